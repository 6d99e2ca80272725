"""Registers the formats and the rules of the methods, and reads a campaign in any of the formats.

Built-in formats and methods are the files of ``formats`` and ``methods``, files of instruments those of ``exports``; a
plug-in gives a ``Reader``, a ``MethodRules`` or an ``ExportFormat`` through an entry point of the group
``monitor.readers``.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeVar

from monitor.exceptions import CampaignError, Fault, InputError
from monitor.readers.export import ExportFormat
from monitor.readers.method_rules import MethodRules
from monitor.records import Campaign, CurveCampaign

GROUP = "monitor.readers"


@dataclass(frozen=True)
class Reader:
    """One format: ``recognises`` says quickly whether a folder looks like it, ``read`` reads or refuses it."""

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path], Campaign | CurveCampaign]


T = TypeVar("T", Reader, MethodRules, ExportFormat)


def read_campaign(folder: Path) -> Campaign | CurveCampaign:
    """Read the campaign of a folder, in internal units.

    Raises CampaignError, with every fault of the folder, if anything in it is wrong.
    """
    folder = Path(folder)
    try:
        is_folder = folder.is_dir()
    except (ValueError, OSError):  # a NUL in the name, or a name longer than the system allows
        is_folder = False
    if not is_folder:
        message = "there is no such folder; give a folder with campaign.toml, runs.csv and probings.csv"
        if _exists(folder):
            message = (
                "this is a file; give the folder that holds campaign.toml, runs.csv and probings.csv, or say with "
                "--mapping FILE what the columns of an instrument's file are (docs/files-as-they-come.md)"
            )
        raise CampaignError(str(folder), [Fault(str(folder), None, None, message)])
    formats = readers()
    reader = next((reader for reader in formats if reader.recognises(folder)), formats[-1])
    return reader.read(folder)


@cache
def readers() -> tuple[Reader, ...]:
    """Return all formats, plug-ins first, so that one can take a folder that the built-in would refuse."""
    return (*_plugged_in(Reader), *_built_in("formats", "READER", Reader))


@cache
def method_rules() -> dict[str, MethodRules]:
    """Return the rules of every method, by its name."""
    rules = (*_built_in("methods", "RULES", MethodRules), *_plugged_in(MethodRules))
    return {rule.name: rule for rule in rules}


@cache
def export_formats() -> dict[str, ExportFormat]:
    """Return the formats of instruments' own files, by their names."""
    formats = (*_built_in("exports", "EXPORT", ExportFormat), *_plugged_in(ExportFormat))
    return {format.name: format for format in formats}


def _built_in(room: str, attribute: str, kind: type[T]) -> Iterator[T]:
    package = importlib.import_module(f"monitor.readers.{room}")
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda module: module.name):
        entry = getattr(importlib.import_module(f"{package.__name__}.{module.name}"), attribute)
        assert isinstance(entry, kind), f"{module.name}.{attribute} must be a {kind.__name__}"
        yield entry


def _plugged_in(kind: type[T]) -> Iterator[T]:
    for point in entry_points(group=GROUP):
        try:
            entry = point.load()
        except Exception as error:
            raise InputError(f"the plug-in {point.name} ({point.value}) cannot be loaded: {error}") from error
        if not isinstance(entry, Reader | MethodRules | ExportFormat):
            raise InputError(
                f"the plug-in {point.name} ({point.value}) must be a Reader, a MethodRules or an ExportFormat"
            )
        if isinstance(entry, kind):
            yield entry


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (ValueError, OSError):
        return False
