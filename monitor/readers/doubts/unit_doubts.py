"""Lengths in a unit that is not mm: in all runs, held against declared or nominal places, or in single runs against the
others. Typed, so that a certificate can be refused on it; ``doubts`` makes the sentences of an import.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.readers.method_rules import DeclaredPlaces
from monitor.readers.registry import method_rules
from monitor.records import Array, Campaign
from monitor.units import Unit, mistaken_for_mm

#: Declared places are set up by hand: a few millimetres on 100 mm are usual.
DISTANCE_TOLERANCE = 0.05
#: Balls that are clamped one by one, of which a touching cycle asks no more than that it finds them.
SET_UP_BY_HAND_MM = 5.0
#: Rows of a run whose distances are taken: all pairs of a million rows would need 4 TB. Plans have 60 to 10 000.
MOST_ROWS = 2000
#: A rotary axis that is sent to zero reads some thousandths of a degree at most.
ZERO_RAD = 1e-4
#: Pairs beyond the tolerance from which on it is no single ball that was moved.
TELLING_SHARE = 0.2
#: Spans of one plan repeat to some hundredths of a millimetre on millimetres and more, a run broken off covers less.
SPAN_TOLERANCE = 0.005
#: Positions of one plan repeat to a smaller part of its span; of a run that was broken off nearly all are in it.
SAME_PLACE, MOST_AMONG = 1e-3, 0.9


@dataclass(frozen=True)
class OffPlaces:
    """Distances between targets that are not the declared ones: ``ratio`` of the two (median of ``count``), ``share``
    of them beyond the tolerance. In ``unit`` the columns of ``axes`` fit; None where no unit does."""

    noun: str
    ratio: float
    count: int
    share: float
    axes: str
    unit: Unit | None


@dataclass(frozen=True)
class RunInUnit:
    """A ``run`` whose ``columns`` span ``ratio`` times what they do in the others, as in ``unit``."""

    run: int
    columns: tuple[str, ...]
    ratio: float
    unit: Unit


def off_places(campaign: Campaign) -> OffPlaces | None:
    """Distances between balls, modules or points at one pose against the declared or nominal ones, in the first run: no
    rotary axis has a part in them. None where they agree, or nothing is declared."""
    declared = declared_places(campaign)
    if declared is None or not all(axis in campaign.probings.readings for axis in "XYZ"):
        return None
    steps, declared_steps = pairs(campaign, declared)
    nominal = np.linalg.norm(declared_steps, axis=1)
    if not len(nominal):
        return None
    slack = SET_UP_BY_HAND_MM if declared.by_normals else 0.0
    share = _share_off(steps, nominal, np.ones(3), slack)
    if share <= TELLING_SHARE:
        return None
    ratio = float(np.median(np.linalg.norm(steps, axis=1) / nominal))
    for unit in mistaken_for_mm():
        for axes in ("XYZ", "XY", "X", "Y", "Z"):
            scale = np.where([axis in axes for axis in "XYZ"], unit.factor, 1.0)
            if _share_off(steps, nominal, scale, slack) <= TELLING_SHARE / 2:
                return OffPlaces(declared.noun, ratio, len(nominal), share, axes, unit)
    return OffPlaces(declared.noun, ratio, len(nominal), share, "", None)


def declared_places(campaign: Campaign) -> DeclaredPlaces | None:
    """Return the places of the artefact; of a workpiece without, the nominal ones in the rows; None where there are
    none."""
    rules = method_rules().get(campaign.method)
    declared = None if rules is None else rules.declared(campaign.artefact)
    probings = campaign.probings
    is_on_tool = rules is not None and rules.targets_are_seen
    if declared is not None or is_on_tool or not {"nominal_x_mm", "nominal_y_mm"} <= set(probings.channels):
        return declared
    zero = np.zeros(len(probings.target))
    columns = [probings.channels.get(f"nominal_{axis}_mm", zero) for axis in "xyz"]
    nominal = np.column_stack(columns)
    return DeclaredPlaces("points", dict(zip(probings.target.tolist(), nominal, strict=True)))


def pairs(campaign: Campaign, declared: DeclaredPlaces, *, at_zero: bool = False) -> tuple[Array, Array]:
    """Return the steps (n, 3) of the readings of X, Y, Z between targets probed at one pose of the first run, and the
    declared ones (n, 3), in mm; ``at_zero``: at the pose with all rotary axes at zero alone. Readings that stand off
    along normals are compared where these are the same."""
    probings, places = campaign.probings, declared.places
    rows = np.flatnonzero(probings.run == probings.run[0])[:MOST_ROWS]
    fixed = [
        values[rows] for axis, values in probings.readings.items() if not campaign.machine.is_linear(axis)
    ]
    fixed += [probings.channels[name][rows] for name in ("placement",) if name in probings.channels]
    alike = list(fixed)
    if declared.by_normals:
        alike += [np.round(probings.channels[f"normal_{axis}"][rows], 3) for axis in "xyz"]
    pose: npt.NDArray[np.int64] = np.zeros(len(rows), dtype=np.int64)
    if alike:
        # Beside 0.0 there is -0.0, which counts as another row.
        _, pose = np.unique(np.column_stack(alike) + 0.0, axis=0, return_inverse=True)
    pose = pose.reshape(-1)
    has_place = np.array([name in places for name in probings.target[rows].tolist()])
    read = np.column_stack([probings.readings[axis][rows] for axis in "XYZ"])
    at = np.array([places.get(name, np.zeros(3)) for name in probings.target[rows].tolist()])
    if at_zero:
        has_place &= np.all([np.abs(values) < ZERO_RAD for values in fixed], axis=0)
    first, second = np.triu_indices(len(rows), 1)
    at_one_pose = has_place[first] & has_place[second] & (pose[first] == pose[second])
    first, second = first[at_one_pose], second[at_one_pose]
    nominal = at[first] - at[second]
    apart = np.any(nominal != 0.0, axis=1)
    return (read[first] - read[second])[apart], nominal[apart]


def _share_off(steps: Array, nominal: Array, scale: Array, slack: float) -> float:
    """Share of the distances that differ from the declared ones by more than the tolerance and the ``slack`` in mm."""
    off = np.abs(np.linalg.norm(steps * scale, axis=1) - nominal)
    return float(np.mean(off > np.maximum(DISTANCE_TOLERANCE * nominal, slack)))


def runs_in_units(campaign: Campaign) -> tuple[RunInUnit, ...]:
    """The runs whose lengths look as if they were in another unit than those of the other runs, by what each column
    spans; of two runs the one that a unit explains. One that was broken off has few rows, where others have theirs."""
    probings, columns = campaign.probings, _columns_of_lengths(campaign)
    runs, rows = np.unique(probings.run, return_counts=True)
    if len(runs) < 2 or not columns:
        return ()
    spans = {
        name: np.array([np.ptp(values[probings.run == run]) for run in runs])
        for name, values in columns.items()
    }
    odd: list[RunInUnit] = []
    for index, run in enumerate(runs.tolist()):
        names = list(columns)
        if rows[index] < np.median(rows) / 2.0:
            names = [name for name in names if not _is_among_others(columns[name], probings.run == run)]
        by_unit: dict[Unit, list[str]] = {}
        ratios: dict[Unit, float] = {}
        for name in names:
            usual = float(np.median(np.delete(spans[name], index)))
            if usual <= 0.0:
                continue
            ratio = float(spans[name][index]) / usual
            (unit,) = mistaken_for_mm(ratio, SPAN_TOLERANCE)[:1] or (None,)
            if unit is not None:
                by_unit.setdefault(unit, []).append(name)
                ratios[unit] = ratio
        odd += [RunInUnit(run, tuple(sorted(names)), ratios[unit], unit) for unit, names in by_unit.items()]
    # More than half of the runs are not the odd ones.
    return tuple(odd) if len({entry.run for entry in odd}) <= len(runs) / 2 else ()


def _columns_of_lengths(campaign: Campaign) -> dict[str, Array]:
    """The readings of linear axes and of a tracker, by the names of their columns."""
    probings = campaign.probings
    columns = {
        f"{axis.lower()}_mm": values
        for axis, values in probings.readings.items()
        if campaign.machine.is_linear(axis)
    }
    return columns | {
        name: values for name, values in probings.channels.items() if name.startswith("tracker_")
    }


def _is_among_others(values: Array, of_run: npt.NDArray[np.bool_]) -> bool:
    """Whether nearly all values of a run are among those of the others: in another unit few are."""
    others = np.unique(values[~of_run])
    before = np.clip(np.searchsorted(others, values[of_run]) - 1, 0, len(others) - 1)
    after = np.minimum(before + 1, len(others) - 1)
    nearest = np.minimum(np.abs(values[of_run] - others[before]), np.abs(values[of_run] - others[after]))
    return bool(np.mean(nearest <= SAME_PLACE * np.ptp(others)) >= MOST_AMONG)
