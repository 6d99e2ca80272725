"""Titles, names of axes and notes of figures, from the numbers that they state.

Sizes are in the unit that is named with them; RMS of residuals of a machine in µm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from monitor.exceptions import DataError
from monitor.reporting.health.words import in_words
from monitor.reporting.messages import DRIFT_OR_SEASON
from monitor.reporting.numbers import round_result

OVER_WORKSPACE = "What the model leaves, mean over the runs, over the workspace"
EXPECTED = "expected"
NOT_RULED_OUT = "not ruled out"
PEAK = "peak displacement / µm"
AS_IT_IS = "as it is"
INTERVAL_OF_RUN = "± 2 standard uncertainties of the run"
SELECTIONS = "Expanded uncertainty of a calibration, by the runs that its covariance is from"


class Noise(Enum):
    """What the line below which no error falls is."""

    STATED_BY_PROBE = "probe's stated uncertainty"
    STATED_OR_REPEATABILITY = "stated uncertainty or repeatability"
    UNKNOWN = "no repeats"


def where_it_fails(campaign: str, rms_um: float, expected_um: float, verdict: str) -> str:
    """Return the title of the residuals by target, axis and run."""
    return f"{campaign}: RMS {rms_um:.2f} µm where {expected_um:.2f} µm is expected: {verdict}"


def residual_along(axis: str, driver: str) -> str:
    """Return the title of a residual against a driver."""
    return f"Residual along {axis} against {driver}"


def residual_axis(axis: str) -> str:
    """Return the name of the axis of a figure that shows a residual."""
    return f"residual along {axis} / µm"


def effect_name(effect: str, *, shape_unknown: bool) -> str:
    """Return the name of an effect where there is little room: the parts of an unknown shape are left out."""
    return f"{effect.partition(':')[0]}, shape unknown" if shape_unknown else effect


def effect_size(amplitude: float, u: float, unit: str) -> str:
    """Return the size of an effect with its standard uncertainty; without it where there is nothing to round to."""
    try:
        rounded = round_result(amplitude, u)
    except DataError:
        return f"{amplitude:.3g} {unit}"
    return f"{rounded.estimate} ± {rounded.uncertainty} {unit}"


def model_lacks(effect: str) -> str:
    """Return the title of the missing effects."""
    return f"The model lacks {effect}"


def predicts(effect: str) -> str:
    """Return the title of a prediction against the measurement."""
    return f"{effect} predicts what the model leaves"


def residual_follows(effect: str, axis: str) -> str:
    """Return the title of a residual against what drives a missing effect."""
    return f"{effect} is missing: the residual along {axis} follows it"


def unknown_shape_of(error: str, nearest: str | None) -> str:
    """Return the title of the curve of an effect whose shape the catalogue does not have."""
    return f"{error}, shape unknown; nearest in the catalogue: {nearest}"


def reading_of(axis: str) -> str:
    """Return the name of a figure's axis that shows readings of a machine's axis."""
    return f"reading of {axis}"


def error_falls(first_um: float, last_um: float) -> str:
    """Return the title of the error falling by missing effects."""
    return f"The error falls from {first_um:.2f} to {last_um:.2f} µm"


def versions_fall(model: str, campaign: str, first: float, last: float, unit: str | None) -> str:
    """Return the title of the error falling version by version; a curve's columns say their unit (None)."""
    digits, named_unit = (".4g", "") if unit is None else (".2f", f" {unit}")
    return f"{model} on {campaign}: the error falls from {first:{digits}} to {last:{digits}}{named_unit}"


def curve_as_it_is(rms: float) -> str:
    """Return the title of the residual that the model of a curve leaves."""
    return f"model as it is: RMS {rms:.4g}"


def curve_with(effect: str, rms: float) -> str:
    """Return the title of the residual that the model of a curve leaves with an effect more."""
    return f"+ {effect}: RMS {rms:.4g}"


def curve_residual(curve: str, missing: int | None) -> str:
    """Return the title of what the model of a curve leaves, with the number of ``missing`` effects where asked."""
    if missing is None:
        return f"{curve}: what the model leaves"
    if not missing:
        return f"{curve}: nothing is missing that these rows can show"
    return f"{curve}: {missing} missing effect{'s' if missing > 1 else ''} found"


@dataclass(frozen=True)
class PlanSize:
    """How many balls are touched at how many indexations, and how long that takes."""

    balls: int
    poses: int
    seconds: float


def expected_of_plan(campaign: str, present: PlanSize, proposed: PlanSize | None) -> str:
    """Return the title of the uncertainties that a plan leads to, and of the proposed one beside it."""
    size = f"{present.balls} balls at {present.poses} indexations, {present.seconds / 60.0:.0f} min"
    if proposed is not None:
        size += f"; proposed {proposed.balls} at {proposed.poses}, {proposed.seconds / 60.0:.0f} min"
    return f"{campaign}: {size}"


def expected_note(stated_um: float) -> str:
    """Return what the uncertainties of a plan hold for."""
    return f"Expected standard uncertainties of one run with {stated_um:g} µm a coordinate."


def parameters_of_runs(campaign: str, moved: Sequence[str]) -> str:
    """Return the title of the parameters by run: which differ between days."""
    return f"{campaign}: " + (
        f"differ between days: {', '.join(moved)}" if moved else "no parameter differs between days"
    )


def selection_name(name: str, runs: int) -> str:
    """Return the name of a selection of runs."""
    return f"{name} ({runs} runs)"


def selections_note(p: float) -> str:
    """Return what the bars of selections side by side mean."""
    return f"bars: U = k_q u of all parameters together with p = {p:g}"


def parameter_changed(name: str, size: float, u: float, unit: str, day: str) -> str:
    """Return the title of a parameter's history that changed."""
    estimate, uncertainty = in_words(size, u, sign=True)
    return f"{name}: changed by {estimate} {unit} (u = {uncertainty} {unit}) on {day}"


def parameter_drifts(
    name: str, slope: float | None, u: float | None, unit: str, *, moving: bool, season_not_told: bool = False
) -> str:
    """Return the title of a parameter's history without a change: its drift a year."""
    if slope is None or u is None:
        return f"{name}: too little history for a drift"
    estimate, uncertainty = in_words(slope, u, sign=True)
    sentence = f"{name}: {estimate} {unit} a year (u = {uncertainty} {unit} a year)"
    if not moving:
        return f"{sentence}, no drift seen"
    return f"{sentence}; {DRIFT_OR_SEASON}" if season_not_told else sentence


def map_title(campaign: str, run: int, worst: tuple[float, float], rms_um: float) -> str:
    """Return the title of a volumetric map: its ``worst`` error with its expanded uncertainty, µm, and its RMS."""
    return f"{campaign}, run {run}: at worst {worst[0]:.1f} µm ± {worst[1]:.1f} µm, RMS {rms_um:.1f} µm"


def map_note(k: float, p: float, rotary_poses: int | None) -> str:
    """Return what the slices of a volumetric map show; ``rotary_poses`` is None of a machine without rotary axes."""
    shown = (
        "Colour: length of the error; arrows: its part in the slice; numbers: expanded uncertainty "
        f"(k = {k:.2f}, p = {p:g})."
    )
    if rotary_poses is None:
        return shown
    poses = "the one rotary pose" if rotary_poses == 1 else f"all {rotary_poses} rotary poses"
    return f"Rotary axes at zero. {shown} The title is about {poses} of the plan."


def shape_title(campaign: str, run: int, disagree_um: float, expanded_um: float) -> str:
    """Return the title of the shape of a piece: how far its angles disagree, and the shape's expanded uncertainty."""
    return (
        f"{campaign}, run {run}: the angles disagree by up to {disagree_um:.1f} µm; U of the shape at most "
        f"{expanded_um:.1f} µm"
    )
