"""Registers shapes, drivers and changes of the artefact: one file of a folder here, or one class of a plug-in.

A built-in one is listed in ``REGISTERED`` of its file. A plug-in's is a class with a ``pattern``, registered under an
entry point; it is called with the texts of the pattern's groups.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import Any, ClassVar, Self

from monitor.exceptions import EffectError


class BuiltIn:
    """What is written as a text that matches ``pattern``."""

    pattern: ClassVar[str]

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        """Build the object from the groups of its pattern that matched."""
        return cls(**groups)


#: What a class of a plug-in needs, whether shape or driver.
NEEDED = ("pattern", "labels", "columns", "unit")


@cache
def plug_ins(group: str) -> tuple[Any, ...]:
    """Return what is registered under an entry point group (``monitor.shapes`` or ``monitor.drivers``).

    Raises EffectError, which names the plug-in, for one that cannot be loaded or lacks what it needs.
    """
    return tuple(_loaded(point) for point in sorted(entry_points(group=group), key=lambda point: point.name))


def _loaded(point: Any) -> Any:
    try:
        kind = point.load()
    except Exception as error:
        raise EffectError(f"the plug-in {point.name} ({point.value}) cannot be loaded: {error}") from error
    missing = [name for name in NEEDED if not hasattr(kind, name)]
    if missing:
        raise EffectError(
            f"the plug-in {point.name} ({point.value}) lacks {', '.join(missing)}; docs/effects.md has an example"
        )
    try:
        re.compile(kind.pattern)
    except (re.error, TypeError) as error:
        raise EffectError(
            f"the pattern of the plug-in {point.name} ({point.value}) is no regular expression: {error}"
        ) from error
    return kind


def plug_in_patterns(group: str) -> str:
    """Return the patterns of the plug-ins of a group as the end of a sentence, empty where there are none."""
    patterns = ", ".join(kind.pattern for kind in plug_ins(group))
    return f"; from plug-ins {patterns}" if patterns else ""


@cache
def built_in(package: str) -> tuple[type[BuiltIn], ...]:
    """Return what the files of a package list in ``REGISTERED``."""
    folder = importlib.import_module(package)
    names = sorted(module.name for module in pkgutil.iter_modules(folder.__path__))
    modules = (importlib.import_module(f"{package}.{name}") for name in names)
    return tuple(kind for module in modules for kind in module.REGISTERED)


def parse(text: str, package: str, others: tuple[Any, ...] = ()) -> Any:
    """Return the object that a text names, of a package or of ``others`` from plug-ins; None where nothing matches."""
    for kind in (*built_in(package), *others):
        match = re.fullmatch(kind.pattern, text)
        if match:
            groups = {name: value for name, value in match.groupdict().items() if value is not None}
            return kind.of(groups) if issubclass(kind, BuiltIn) else kind(**groups)
    return None
