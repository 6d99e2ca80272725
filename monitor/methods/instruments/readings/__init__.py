"""The kinds of readings, one a file, each with its ``READING``."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from monitor.methods.instruments.reading import Reading


@cache
def readings() -> Mapping[str, type[Reading]]:
    """Every kind of reading by the name that a setup writes."""
    modules = sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name)
    kinds = [importlib.import_module(f"{__name__}.{module.name}").READING for module in modules]
    return MappingProxyType({kind.name: kind for kind in kinds})
