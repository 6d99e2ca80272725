"""What looks like a mistake in a campaign folder, but may be none: told in a sentence, never a reason to refuse.

A unit wrong by a thousand often still fits: the method finds the scale, or the model has room for it. Here the data are
held against what is known without a fit: the declared places of balls and modules, the strokes that calibrations
have, and the angles at which people index. What a fit has to see is told by `identify` and `explain`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from monitor.readers.registry import method_rules
from monitor.records import Array, Campaign
from monitor.units import DEGREE, MICROMETRE

#: No calibration moves its axes by less: the smallest artefacts (a ball plate for a micro-machine) have 10 mm.
SHORTEST_TRAVEL = 5.0
#: A full turn in radians, with room for the last printed digit.
FULL_TURN = 6.3
#: People index at multiples of 5 degrees; radians of three decimals come back to them within 0.03 degrees.
INDEX_DEG, INDEX_TOLERANCE_DEG = 5.0, 0.03
#: Declared places are set up by hand: a few millimetres on 100 mm are usual.
DISTANCE_TOLERANCE = 0.05
#: Rows of a run whose distances are taken: all pairs of a million rows would need 4 TB. Plans have 60 to 10 000.
MOST_ROWS = 2000
#: Pairs beyond the tolerance from which on it is no single ball that was moved.
TELLING_SHARE = 0.2
#: What columns were taken for each other: metres or micrometres for millimetres, inches, a shifted decimal point.
FACTORS = (
    (1e3, "in metres"),
    (1e-3, "in µm"),
    (25.4, "in inches"),
    (10.0, "ten times too small"),
    (0.1, "ten times too large"),
)
#: Standard uncertainties of length standards: a millionth of the length is good, a thousandth is no calibration.
LARGEST_SHARE = 1e-3
#: mm between the calibrated length of a bar and the declared distance of its balls. They are places on one artefact,
#: not set up by hand: declared in whole millimetres they may be 0.4 off (0.32 in hot-cold and cold-cold).
LARGEST_BAR_DIFFERENCE = 0.5
#: Standard uncertainties of probes and trackers in mm: 0.01 µm is finer than any, 1 mm coarser than any.
PROBE_RANGE = (1e-5, 1.0)
#: °C of shops and measuring rooms; spindles and motors are hotter, and not asked. 20 °C in kelvin are 293.
AIR_RANGE = (-40.0, 60.0)
#: Two days begin at least so far apart: two shifts of one date do not.
APART = timedelta(hours=12)
#: What a recorded temperature that says how long the bar was is called.
AIR_NAMES = ("ambient", "air", "bar", "artefact", "artifact", "workpiece")
#: Diameters of calibrated balls in mm.
BALL_RANGE = (0.1, 300.0)


def doubts(campaign: Campaign) -> tuple[str, ...]:
    """Sentences on what to look at, each with the numbers that it rests on; empty for most campaigns."""
    return tuple(
        sentence
        for check in (_short_runs, _travel, _angles, _places, _statements, _temperatures, _days)
        for sentence in check(campaign)
    )


def _short_runs(campaign: Campaign) -> Iterator[str]:
    runs, counts = np.unique(campaign.probings.run, return_counts=True)
    if len(runs) < 2:
        return
    values, times = np.unique(counts, return_counts=True)
    # The commonest number, of two equally common ones the larger: a plan may grow, a file is only cut off.
    usual = int(values[np.lexsort((values, times))[-1]])
    for run, count in zip(runs.tolist(), counts.tolist(), strict=True):
        if count < usual:
            others = int(np.sum(counts == usual))
            yield (
                f"run {run} has {count} probings, {others} other{'s have' if others > 1 else ' has'} {usual}: if it "
                "was broken off, its file may lack rows"
            )


def _spans(columns: dict[str, Array]) -> dict[str, float]:
    return {name: float(np.ptp(values)) for name, values in columns.items() if len(values)}


def _travel(campaign: Campaign) -> Iterator[str]:
    """Columns in metres: nothing moves by more than a few millimetres."""
    machine, probings = campaign.machine, campaign.probings
    groups = (
        {
            f"{axis.lower()}_mm": values
            for axis, values in probings.readings.items()
            if machine.is_linear(axis)
        },
        {name: values for name, values in probings.channels.items() if name.startswith("tracker_")},
    )
    for columns in groups:
        spans = _spans(columns)
        largest = max(spans.values(), default=0.0)
        if 0.0 < largest < SHORTEST_TRAVEL:
            yield (
                f"{_and(spans)} span {largest:.3g} mm at most: is the unit mm? Readings in metres look like this"
            )


def _angles(campaign: Campaign) -> Iterator[str]:
    """Radians in columns of degrees."""
    turning = {
        axis: np.unique(values / DEGREE.factor)
        for axis, values in campaign.probings.readings.items()
        if not campaign.machine.is_linear(axis)
    }
    moving = {axis: values for axis, values in turning.items() if len(values) > 1}
    largest = {axis: float(np.abs(values).max()) for axis, values in moving.items()}
    if len(moving) > 2 and max(largest.values()) <= FULL_TURN:
        columns = _and([f"{axis.lower()}_deg" for axis in moving])
        yield f"{columns} never exceed {max(largest.values()):.3g}: is the unit degree? Radians look like this"
        return
    for axis, values in moving.items():
        used = values[np.abs(values) > 1e-9]
        as_degrees = used / DEGREE.factor
        off_index = np.abs(as_degrees - INDEX_DEG * np.round(as_degrees / INDEX_DEG))
        off_grid = np.abs(used - np.round(used, 2))
        if largest[axis] <= FULL_TURN and np.all(off_index < INDEX_TOLERANCE_DEG) and np.any(off_grid > 1e-4):
            shown = used[int(np.argmax(np.abs(used)))]
            yield (
                f"{axis.lower()}_deg never exceeds {largest[axis]:.4g}, and taken as radians its values are round "
                f"angles ({shown:.6g} rad are {shown / DEGREE.factor:.0f}°): is the unit degree?"
            )


def _places(campaign: Campaign) -> Iterator[str]:
    """Distances between balls, or modules, at one pose against the declared ones: no rotary axis has a part in them."""
    rules = method_rules().get(campaign.method)
    declared = None if rules is None else rules.declared(campaign.artefact)
    if declared is None or not all(axis in campaign.probings.readings for axis in "XYZ"):
        return
    steps, nominal = _pairs(campaign, declared.places)
    if not len(nominal):
        return
    off = _share_off(steps, nominal, np.ones(3))
    if off <= TELLING_SHARE:
        return
    ratio = float(np.median(np.linalg.norm(steps, axis=1) / nominal))
    head = (
        f"the distances between {declared.noun} that were probed are {ratio:.3g} times the declared ones (median of "
        f"{len(nominal)})"
    )
    for factor, unit in FACTORS:
        for axes in ("XYZ", "X", "Y", "Z"):
            scale = np.where([axis in axes for axis in "XYZ"], factor, 1.0)
            if _share_off(steps, nominal, scale) <= TELLING_SHARE / 2:
                columns = _and([f"{axis.lower()}_mm" for axis in axes])
                yield (
                    f"{head}: it looks as if {columns} {'were' if len(axes) > 1 else 'was'} {unit}"
                    + (", or the declared places in another unit than mm" if len(axes) > 1 else "")
                )
                return
    yield (
        f"{head}; {off:.0%} of them differ by more than {DISTANCE_TOLERANCE:.0%}: check the declared places, the "
        "names of the targets and the units"
    )


def _pairs(campaign: Campaign, declared: Mapping[str, Array]) -> tuple[Array, Array]:
    """Steps (n, 3) of X, Y, Z between targets probed at one pose of one run, and their declared distances (n,)."""
    probings = campaign.probings
    rows = np.flatnonzero(probings.run == probings.run[0])[:MOST_ROWS]
    fixed = [
        values[rows] for axis, values in probings.readings.items() if not campaign.machine.is_linear(axis)
    ]
    fixed += [probings.channels[name][rows] for name in ("placement",) if name in probings.channels]
    pose: npt.NDArray[np.int64] = np.zeros(len(rows), dtype=np.int64)
    if fixed:
        _, pose = np.unique(np.column_stack(fixed), axis=0, return_inverse=True)
    pose = pose.reshape(-1)
    has_place = np.array([name in declared for name in probings.target[rows].tolist()])
    read = np.column_stack([probings.readings[axis][rows] for axis in "XYZ"])
    at = np.array([declared.get(name, np.zeros(3)) for name in probings.target[rows].tolist()])
    first, second = np.triu_indices(len(rows), 1)
    at_one_pose = has_place[first] & has_place[second] & (pose[first] == pose[second])
    first, second = first[at_one_pose], second[at_one_pose]
    nominal = np.linalg.norm(at[first] - at[second], axis=1)
    apart = nominal > 0.0
    return (read[first] - read[second])[apart], nominal[apart]


def _share_off(steps: Array, nominal: Array, scale: Array) -> float:
    """Share of the distances that differ from the declared ones by more than the tolerance."""
    return float(np.mean(np.abs(np.linalg.norm(steps * scale, axis=1) / nominal - 1.0) > DISTANCE_TOLERANCE))


def _statements(campaign: Campaign) -> Iterator[str]:
    """Numbers of campaign.toml that no probe, ball or length standard has."""
    u = campaign.probe.standard_uncertainty
    if not PROBE_RANGE[0] <= u <= PROBE_RANGE[1]:
        yield (
            f"the probe's standard uncertainty is {MICROMETRE.to_display(u):g} µm: is standard_uncertainty_um in µm?"
        )
    balls = {ball.id: ball for ball in campaign.artefact.balls}
    for ball in balls.values():
        if not BALL_RANGE[0] <= ball.diameter <= BALL_RANGE[1]:
            yield f"ball {ball.id} has a diameter of {ball.diameter:g} mm: is diameter_mm in mm?"
    bar = campaign.artefact.scale_bar
    if bar is None:
        return
    if bar.standard_uncertainty > LARGEST_SHARE * bar.length:
        yield (
            f"the scale bar's standard uncertainty is {bar.standard_uncertainty:g} mm, more than a thousandth of its "
            f"length of {bar.length:g} mm: are both in mm?"
        )
    difference = bar_difference(campaign)
    if difference is not None and abs(difference) > LARGEST_BAR_DIFFERENCE:
        yield (
            f"the scale bar is {bar.length:g} mm long, but its balls {' and '.join(bar.balls)} are declared "
            f"{bar.length - difference:.7g} mm apart: check length_mm and nominal_mm"
        )


def _temperatures(campaign: Campaign) -> Iterator[str]:
    """Air, bars and workpieces at which nobody measures: kelvin or Fahrenheit."""
    implausible: dict[str, list[tuple[int, float]]] = {}
    for run in campaign.runs:
        for name, value in implausible_temperatures(campaign, run.run).items():
            implausible.setdefault(name, []).append((run.run, value))
    for name, values in implausible.items():
        run_number, value = values[0]
        yield (
            f"{name} is {value:g} in run {run_number} ({len(values)} of {len(campaign.runs)} runs lie outside "
            f"{AIR_RANGE[0]:g} to {AIR_RANGE[1]:g} °C): is the unit °C?"
        )


def _days(campaign: Campaign) -> Iterator[str]:
    """Days that are none: several numbers on one date, which an uncertainty over days would rest on."""
    first: dict[int, datetime] = {}
    for run in sorted(campaign.runs, key=lambda run: run.started_at):
        first.setdefault(run.day, run.started_at)
    began = sorted(first.items(), key=lambda entry: entry[1])
    close = [
        (day, later)
        for (day, at), (later, after) in pairwise(began)
        if at.date() == after.date() and after - at < APART
    ]
    if close:
        day, later = close[0]
        yield (
            f"days {day} and {later} began on {first[day]:%Y-%m-%d} less than {APART.total_seconds() / 3600.0:g} hours "
            f"apart ({len(close)} of {len(began) - 1} such): are the numbers in the column day those of days? What "
            "days differ by is estimated from them"
        )


def implausible_temperatures(campaign: Campaign, run: int) -> dict[str, float]:
    """Temperatures of the air, a bar or a workpiece in a run that no place has, °C by name: the one that is farthest
    off."""
    rows = campaign.probings.run == run
    recorded: dict[str, Array] = {
        name: values[rows] for name, values in campaign.probings.channels.items() if name.endswith("_degC")
    }
    for measured in campaign.runs:
        if measured.run == run:
            recorded |= {name: np.array([value]) for name, value in measured.conditions.items()}
    result = {}
    for name, values in recorded.items():
        finite = values[np.isfinite(values)]
        if (
            not len(finite)
            or not name.endswith("_degC")
            or not any(word in name.lower() for word in AIR_NAMES)
        ):
            continue
        farthest = float(finite[np.abs(finite - sum(AIR_RANGE) / 2.0).argmax()])
        if not AIR_RANGE[0] <= farthest <= AIR_RANGE[1]:
            result[name] = farthest
    return result


def bar_difference(campaign: Campaign) -> float | None:
    """The calibrated length of the scale bar less the declared distance of its balls in mm; None without either."""
    bar = campaign.artefact.scale_bar
    balls = {ball.id: ball for ball in campaign.artefact.balls}
    if bar is None or not all(name in balls for name in bar.balls):
        return None
    first, second = (np.array(balls[name].nominal) for name in bar.balls)
    return bar.length - float(np.linalg.norm(first - second))


def _and(names: Iterator[str] | list[str] | dict[str, float]) -> str:
    listed = list(names)
    return listed[0] if len(listed) == 1 else f"{', '.join(listed[:-1])} and {listed[-1]}"
