"""The methods that are known, found by looking through this package, and the door to all of them.

A built-in method is a folder with a ``method.py`` that has a ``METHOD``; a plug-in gives one through an entry point of
the group ``monitor.methods`` (and its campaign format or rules through ``monitor.readers``).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from types import MappingProxyType
from typing import overload

from monitor.exceptions import DataError, InputError
from monitor.methods.method import ChainMethod, CurveMethod, Unable
from monitor.methods.rehearsal import Able
from monitor.records import Campaign, CurveCampaign

GROUP = "monitor.methods"


@cache
def methods() -> Mapping[str, ChainMethod | CurveMethod]:
    """Every method by its name; a plug-in may not take the name of another."""
    registered: dict[str, ChainMethod | CurveMethod] = {}
    for method in (*_built_in(), *_plugged_in()):
        if method.name in registered:
            raise InputError(f"two methods are named {method.name}; remove one of the plug-ins")
        registered[method.name] = method
    return MappingProxyType(registered)


def method_named(name: str) -> ChainMethod | CurveMethod:
    """The method of that name; DataError lists those that are known."""
    built_in = _built_in_named(name)
    if built_in is not None:
        return built_in
    if name not in methods():
        raise DataError(f"method '{name}' cannot be identified yet; these can: {', '.join(methods())}")
    return methods()[name]


@overload
def campaign_method(campaign: Campaign) -> ChainMethod: ...
@overload
def campaign_method(campaign: CurveCampaign) -> CurveMethod: ...
def campaign_method(campaign: Campaign | CurveCampaign) -> ChainMethod | CurveMethod:
    """The method that a campaign was measured by. Raises DataError where it is not known or measures something else."""
    method = method_named(campaign.method)
    kind = CurveMethod if isinstance(campaign, CurveCampaign) else ChainMethod
    if not isinstance(method, kind):
        raise DataError(f"campaign {campaign.name} cannot have been measured by the method {method.name}")
    return method


def require(ability: Able | Unable, campaign: Campaign | CurveCampaign, verb: str) -> None:
    """Raise DataError, with the reason, where the method of a campaign has no answer to a verb."""
    if isinstance(ability, Unable):
        raise DataError(
            f"{verb} has no answer for campaign {campaign.name}, which was measured by {campaign.method}: {ability.why}"
        )


def _built_in_named(name: str) -> ChainMethod | CurveMethod | None:
    """The built-in method in the folder of its name, without loading the others; None where there is none."""
    folder = name.replace("-", "_")
    module = f"monitor.methods.{folder}"
    spec = find_spec(module) if folder.isidentifier() else None
    if spec is None or not spec.submodule_search_locations or find_spec(f"{module}.method") is None:
        return None
    method = _checked(importlib.import_module(f"{module}.method").METHOD, module)
    return method if method.name == name else None


def _built_in() -> Iterator[ChainMethod | CurveMethod]:
    package = importlib.import_module("monitor.methods")
    for folder in sorted(pkgutil.iter_modules(package.__path__), key=lambda module: module.name):
        name = f"{package.__name__}.{folder.name}"
        if folder.ispkg and find_spec(f"{name}.method") is not None:
            yield _checked(importlib.import_module(f"{name}.method").METHOD, name)


def _plugged_in() -> Iterator[ChainMethod | CurveMethod]:
    for point in entry_points(group=GROUP):
        try:
            method = point.load()
        except Exception as error:
            raise InputError(f"the plug-in {point.name} ({point.value}) cannot be loaded: {error}") from error
        yield _checked(method, f"the plug-in {point.name} ({point.value})")


def _checked(method: object, source: str) -> ChainMethod | CurveMethod:
    if not isinstance(method, ChainMethod | CurveMethod):
        raise InputError(f"{source} must give a ChainMethod or a CurveMethod")
    return method
