"""Signs, exchanged columns and units of axes with which the tool point stays at its work point, as vectors read it.

An R-test keeps its sphere within its stroke, so a machine without errors puts the tool point at one point of the work
side in all rows of a setup, to some tenths of a millimetre. With another sign of an axis it wanders by tens of
millimetres, which a fit may follow all the same: where nothing brings the unit of length, gains and work points are
free, and the machine comes out mirrored. So the positions are asked, and no fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from monitor.machine import Joint, evaluate, orientation
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import Plain
from monitor.methods.instruments.readings.vector import VectorReading
from monitor.records import Array, Setup
from monitor.units import DEGREE, UNIT_WORDS, mistaken_for_mm

# mm. A work point is stated to some millimetres. Positions in inches, with another sign or of another column put it a
# hundred away, and the fit follows them: the errors come out as of a machine of another size.
STATED_WITHIN = 5.0
# mm. Errors of a machine, and tool points that are known to tenths of a millimetre, let the tool point wander by less.
WANDERS = 1.0
# A mistake is named that takes away all but this part of how far the tool point wanders, and leaves no more than so
# many times what the best one does.
LEFT_BY_MISTAKE, AS_WELL = 0.1, 3.0
# So many rows of a setup in a run show how far the tool point wanders.
MOST_ROWS = 60


@dataclass(frozen=True)
class _Trial:
    """A mistake in words, of how many axes it is, and the columns of positions (J,) that stand for each joint with it
    undone, times ``factors`` (J,)."""

    what: str
    size: int
    columns: npt.NDArray[np.int64]
    factors: Array

    @property
    def shrinks(self) -> bool:
        """Whether the axes move less with it undone."""
        return bool(np.any(np.abs(self.factors) < 1.0))


@dataclass(frozen=True)
class _Cure:
    """A trial, how far the tool point wanders with it undone and how far from the stated work points it is on average,
    in mm, the largest of all setups and runs each; NaN where none states a work point."""

    trial: _Trial
    wanders: float
    off: float


@dataclass(frozen=True)
class _Stay:
    """Rows of one vector's setup in the run of a ``number``, in which the tool point should stay at the work point."""

    part: Part
    number: int

    def positions(self, trial: _Trial) -> Array:
        """The positions (m, J) of the axes with a mistake undone."""
        return self.part.rows.positions[:, trial.columns] * trial.factors

    def vectors(self, trial: _Trial) -> Array:
        """Where a machine without errors puts the tool point from the stated work point, less what was read, (m, 3)
        mm."""
        part = replace(self.part, rows=replace(self.part.rows, positions=self.positions(trial)))
        return nominal(part) - read_in_work(part)

    def travel(self, trial: _Trial) -> float:
        """The RMS distance, mm, of the places of the linear axes from their mean with a mistake undone."""
        linear = [not joint.turns for joint in self.part.rows.chain.joints]
        return _wanders(self.positions(trial)[:, linear])


def mistaken_axes(parts: Iterable[Part], numbers: npt.NDArray[np.int64], *, everywhere: bool) -> str | None:
    """The signs, exchanged columns or units of axes with which the tool point stays where it wanders as recorded, in
    words; with ``everywhere`` such of the whole file alone. ``numbers`` (R,) of the runs. None where it stays, or none
    is enough."""
    vectors = (part for part in parts if isinstance(part.reading, VectorReading))
    stays = [stay for part in vectors for stay in _stays(part, numbers)]
    if not stays:
        return None
    as_recorded = _trial("", stays[0].part.rows.chain.joints)
    wanders = [_wanders(stay.vectors(as_recorded)) for stay in stays]
    wandering = [stay for stay, size in zip(stays, wanders, strict=True) if size > WANDERS]
    cures = _cures(wandering, LEFT_BY_MISTAKE * max(wanders))
    if not cures:
        return None
    staying = [stay for stay, size in zip(stays, wanders, strict=True) if size <= WANDERS]
    is_everywhere = _stay_as_well(staying, cures)
    if everywhere and not is_everywhere:
        return None
    whole = "" if is_everywhere else f" in {_named(wandering)}"
    what = " or ".join(cure.trial.what for cure in cures)
    return (
        f"setup {wandering[0].part.id}: the tool point wanders by {max(wanders):.3g} mm about the work point, at "
        f"which it should stay, and by {max(cure.wanders for cure in cures):.2g} mm if {what}{whole}"
    )


def _cures(wandering: Sequence[_Stay], most: float) -> list[_Cure]:
    """The mistakes that undone leave the tool point within ``most`` in all rows in which it wanders, as good as the
    best."""
    trials = _trials(wandering[0].part.rows.chain.joints, wandering) if wandering else ()
    return _best([cure for trial in trials if (cure := _tried(wandering, trial, most))])


def _stay_as_well(staying: Iterable[_Stay], cures: Sequence[_Cure]) -> bool:
    """Whether the tool point stays with each of the mistakes undone where it stays as recorded."""
    return all(_wanders(stay.vectors(cure.trial)) <= WANDERS for stay in staying for cure in cures)


def _stays(part: Part, numbers: npt.NDArray[np.int64]) -> Iterator[_Stay]:
    """The rows of a vector's setup that were read, run by run, and of very many some, spread over the run."""
    rows = part.rows
    has_all = np.isfinite(rows.measured).all(axis=1)
    for run in np.unique(rows.run):
        at = np.flatnonzero(has_all & (rows.run == run))
        at = at[:: int(np.ceil(len(at) / MOST_ROWS)) or 1]
        if len(at) > 1:
            yield _Stay(replace(part, rows=rows.taken(at, rows.run[at]), at=part.at[at]), int(numbers[run]))


def _tried(stays: Sequence[_Stay], trial: _Trial, most: float) -> _Cure | None:
    """A trial as a cure; None where the tool point wanders by more than ``most`` with it undone. Of axes that hardly
    move with it undone it has to stay within a part of what they do: one that never moved stays, whatever is wrong."""
    if trial.shrinks:
        most = min(most, LEFT_BY_MISTAKE * max(stay.travel(trial) for stay in stays))
    wanders, off = 0.0, float("nan")
    for stay in stays:
        vectors = stay.vectors(trial)
        wanders = max(wanders, _wanders(vectors))
        if wanders > most:
            return None
        if any(_setup_of(stay.part).work_point):
            off = float(np.fmax(off, np.linalg.norm(vectors.mean(axis=0))))
    return _Cure(trial, wanders, off)


def _best(cures: Sequence[_Cure]) -> list[_Cure]:
    """Those that leave the tool point where it is, and the stated work points at their places; of these those of the
    fewest axes."""
    least = min((cure.wanders for cure in cures), default=0.0)
    cures = [cure for cure in cures if cure.wanders <= max(AS_WELL * least, LEFT_BY_MISTAKE * WANDERS)]
    nearest = min((cure.off for cure in cures), default=0.0)
    if np.isfinite(nearest):
        cures = [cure for cure in cures if cure.off <= max(STATED_WITHIN, AS_WELL * nearest)]
    fewest = min((cure.trial.size for cure in cures), default=0)
    return [cure for cure in cures if cure.trial.size == fewest]


def _wanders(vectors: Array) -> float:
    """The RMS distance of points (m, d) from their mean."""
    return float(np.sqrt(np.mean(np.sum((vectors - vectors.mean(axis=0)) ** 2, axis=1))))


def _trials(joints: Sequence[Joint], stays: Sequence[_Stay]) -> Iterator[_Trial]:
    """Every mistake that is tried of the axes that moved."""
    positions = np.vstack([stay.part.rows.positions for stay in stays])
    moved = [index for index in range(len(joints)) if np.ptp(positions[:, index]) > 0.0]
    yield from _signs(joints, moved)
    yield from _exchanges(joints, moved)
    yield from _units(joints, moved)


def _signs(joints: Sequence[Joint], moved: Sequence[int]) -> Iterator[_Trial]:
    for count in range(1, len(moved) + 1):
        for subset in combinations(moved, count):
            names = _joined([joints[index].name for index in subset])
            what = f"the sign{'s' * (count > 1)} of {names} were the other way round"
            yield _trial(what, joints, factors=dict.fromkeys(subset, -1.0), size=count)


def _exchanges(joints: Sequence[Joint], moved: Sequence[int]) -> Iterator[_Trial]:
    for first, second in combinations(range(len(joints)), 2):
        if joints[first].turns == joints[second].turns and (first in moved or second in moved):
            sign = float(joints[first].sign * joints[second].sign)
            columns = sorted((_column(joints[first]), _column(joints[second])))
            yield _trial(
                f"the columns {_joined(columns)} were exchanged",
                joints,
                factors={first: sign, second: sign},
                exchanged={first: second, second: first},
            )


def _units(joints: Sequence[Joint], moved: Sequence[int]) -> Iterator[_Trial]:
    linear = [index for index in moved if not joints[index].turns]
    columns = _joined(sorted(_column(joints[index]) for index in linear)) if linear else ""
    verb = "were" if len(linear) > 1 else "was"
    for unit in mistaken_for_mm() if linear else ():
        factors = dict.fromkeys(linear, unit.factor)
        yield _trial(f"{columns} {verb} {UNIT_WORDS[unit]}", joints, factors=factors)
    turning = [index for index in moved if joints[index].turns]
    together = [turning] if len(turning) > 1 else []
    for group in (*together, *([index] for index in turning)):
        columns = _joined(sorted(_column(joints[index]) for index in group))
        factors = dict.fromkeys(group, 1.0 / DEGREE.factor)
        yield _trial(f"{columns} {'were' if len(group) > 1 else 'was'} in radians", joints, factors=factors)


def _trial(
    what: str,
    joints: Sequence[Joint],
    factors: dict[int, float] | None = None,
    exchanged: dict[int, int] | None = None,
    size: int = 1,
) -> _Trial:
    columns = np.array([(exchanged or {}).get(index, index) for index in range(len(joints))])
    return _Trial(
        what, size, columns, np.array([(factors or {}).get(index, 1.0) for index in range(len(joints))])
    )


def _column(joint: Joint) -> str:
    return f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"


def _joined(names: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _named(stays: Sequence[_Stay]) -> str:
    """Setups and their runs, in words."""
    runs_of: dict[str, list[str]] = {}
    for stay in stays:
        runs_of.setdefault(stay.part.id, []).append(str(stay.number))
    return " and ".join(
        f"setup {name} of run{'s' * (len(runs) > 1)} {_joined(runs)}" for name, runs in runs_of.items()
    )


def _setup_of(part: Part) -> Setup:
    assert isinstance(part.reading, Plain)
    return part.reading.setup


def nominal(part: Part, scale: Array | float = 1.0) -> Array:
    """The vectors r (n, 3) mm of a machine without errors, for positions times ``scale``."""
    rows, setup = part.rows, _setup_of(part)
    count, joints = len(rows), len(rows.chain.joints)
    work, tool = np.tile(setup.work_point, (count, 1)), np.tile(setup.tool_point, (count, 1))
    none = np.zeros((count, joints, 2, 6))
    return evaluate(rows.chain, rows.positions * scale, none, work, tool).residual


def read_in_work(part: Part) -> Array:
    """The vectors (n, 3) mm that a setup read, in the frame of the last work axis."""
    rows = part.rows
    if _setup_of(part).frame == "work":
        return rows.measured
    return np.asarray(np.einsum("nij,nj->ni", tool_in_work(part), rows.measured))


def tool_in_work(part: Part) -> Array:
    """Rotations (n, 3, 3) from the frame of the last tool axis to that of the last work axis, without errors."""
    rows = part.rows
    sides = orientation(rows.chain, rows.positions, np.zeros((len(rows), len(rows.chain.joints), 2, 6)))
    return np.asarray(np.swapaxes(sides.work, 1, 2) @ sides.tool)
