"""Angles on the screen in the unit that the configuration names: `angle_unit` of monitor.toml.

An answer states its numbers in µrad, µm and µm/m. For people it is turned into another answer of the same type, whose
angles are in arc seconds or in µm/m, before its tables and sentences are written. What is stored, JSON, CSV, figures,
reports and certificates are as they were: a number that leaves the screen has one unit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from monitor.cli.configuration import configuration
from monitor.units import MICRORADIAN

Answer = TypeVar("Answer")

#: The units of angle in rad.
_RADIANS = {MICRORADIAN.name: MICRORADIAN.factor, "arcsec": math.pi / 648_000.0, "µm/m": 1e-6}
#: The fields that are in the unit that stands beside them or in the answer around them. Others are probabilities,
#: counts, factors, times, or carry their unit in their name.
IN_UNIT = frozenset(
    {
        *("value", "u", "estimate", "expanded", "expanded_cautious", "u_independent_rows"),
        *("size", "error", "limit", "tolerance", "tolerances", "differences", "values"),
        *("amplitude", "coefficient", "interval", "per_hour"),
        *("mean", "u_all", "u_pooled", "u_by_day", "mean_by_day", "sd", "sd_all", "sd_pooled", "centre"),
        *("between", "between_interval", "within", "within_interval", "u_run_on_a_day_of_its_own"),
        *(
            "within_run",
            "between_runs",
            "u_day",
            "u_day_interval",
            "spread",
            "between_days",
            "within_days",
            "u_within_days",
        ),
        *("latest", "latest_u", "u_line", "u_slope_per_year", "slope_per_year", "u_slope", "slope_interval"),
        *("robust_slope_per_year", "robust_interval", "bias", "lower", "upper", "stable_within"),
        *("stepwise", "u_stepwise", "at_once", "u_at_once", "difference_by_method", "u_difference_by_noise"),
        *("earlier", "later", "parts", "known_beforehand", "expected_of_drift", "drift_in_30_days"),
        "by_temperature",
        *("mean_forward", "mean_backward", "s_forward", "s_backward", "reversal"),
        *("first", "u_first", "second", "u_second", "difference"),
        *("rms", "rms_before", "rms_after", "largest", "repeatability", "expected_rms", "peak"),
        *("residual_deviation", "stated_uncertainty", "heldout_before", "heldout_after", "heldout_rms"),
    }
)


@dataclass(frozen=True)
class _Around:
    """The unit that the numbers are in, and those of the parameters by name."""

    unit: str | None = None
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)


def on_screen(answer: Answer) -> Answer:
    """Return the answer with its angles in the unit of the configuration."""
    angle = configuration().angle_unit
    return answer if angle is None else in_angle(answer, angle)


def in_angle(answer: Answer, angle: str) -> Answer:
    """Return the answer with its angles in another unit, one of `configuration.ANGLE_UNITS`."""
    converted: Answer = _converted(answer, angle, _Around())
    return converted


def _converted(part: Any, angle: str, around: _Around) -> Any:
    """Return a part of an answer, whatever it is, with its angles in another unit."""
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        return _record(part, angle, around)
    if isinstance(part, Mapping):
        return {key: _converted(value, angle, around) for key, value in part.items()}
    if isinstance(part, (list, tuple)):
        elements = [_converted(value, angle, around) for value in part]
        return type(part)(*elements) if hasattr(part, "_fields") else type(part)(elements)
    return part


def _record(record: Any, angle: str, around: _Around) -> Any:
    unit, units = getattr(record, "unit", None), getattr(record, "units", None)
    around = _Around(unit or around.unit, units or around.units)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if field.name == "unit":
            fields[field.name] = _unit(value, angle)
        elif field.name == "units":
            fields[field.name] = {name: _unit(each, angle) for name, each in value.items()}
        elif field.name in IN_UNIT:
            fields[field.name] = _numbers(value, angle, around.unit, around)
        else:
            fields[field.name] = _converted(value, angle, around)
    return dataclasses.replace(record, **fields)


def _numbers(value: Any, angle: str, unit: str | None, around: _Around) -> Any:
    """Return numbers in the unit of the screen: one, a sequence, or those of parameters or days by name."""
    if isinstance(value, Mapping):
        return {
            key: _numbers(each, angle, around.units.get(key, unit), around) for key, each in value.items()
        }
    if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
        return type(value)(_numbers(each, angle, unit, around) for each in value)
    if isinstance(value, float):
        return value * _factor(unit, angle)
    return _converted(value, angle, around)


def _unit(unit: str | None, angle: str) -> str | None:
    """Return the unit of the screen: ``µrad/h`` is ``arcsec/h``."""
    if unit is None or not _is_angle(unit):
        return unit
    return angle + unit.removeprefix(MICRORADIAN.name)


def _factor(unit: str | None, angle: str) -> float:
    return _RADIANS[MICRORADIAN.name] / _RADIANS[angle] if unit is not None and _is_angle(unit) else 1.0


def _is_angle(unit: str) -> bool:
    """Whether the numerator is the microradian."""
    return unit.split("/")[0].split(" ")[0] == MICRORADIAN.name
