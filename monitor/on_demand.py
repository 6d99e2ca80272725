"""Names of a package whose modules are loaded when the first of their names is asked for.

A verb that reads needs few of the modules of a room; loading the others takes longer than its answer. The package lists
its names twice, for the type checker as imports and here by module; ``tests/test_on_demand.py`` compares both.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def on_demand(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__getattr__`` and ``__dir__`` of a package; ``modules`` has the names, parted by blanks, of each module.

    No name may be that of a module beside it: Python gives the package the module under that name.
    """
    module_of = {name: module for module, names in modules.items() for name in names.split()}

    def load(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(importlib.import_module(f"{package}.{module_of[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *module_of})

    return load, names
