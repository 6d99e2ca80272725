"""The position and orientation errors that are in no number of a run, and in no uncertainty: what the tool would miss.

A machine has more errors than a campaign tells: the zero of a head that no reading shows, a table's tilt while the
table stood still. Each is taken as 100 µrad or 10 µm. What it would do to the readings is fitted by the numbers that
the run has, by what it leaves open and by the unknowns of the setups; what the tool misses beside these numbers is
outside. All to first order, on a machine without errors.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from monitor.effects import ChainEffect, parse_effect
from monitor.machine import Chain, evaluate
from monitor.machine.terms import COMPONENTS
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.refusal import Reason, ReasonKind, Refusal
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.volumetric import volumetric_error
from monitor.units import MICROMETRE, Unit

#: How large an error is taken, in its display unit.
TURN_URAD, SHIFT_UM = 100.0, 10.0
#: What the tool misses below this, mm, is of no account.
LEAST_MISSED = 1e-4
#: An error leaves more than so many standard deviations in the readings, or they do not show it.
LEAST_SHOWN = 1.0
#: A turn of the workpiece as a whole leaves less than this part of what the tool misses.
WHOLE = 0.01


@dataclass(frozen=True)
class OutsideError:
    """An error in no number: as large as ``size`` in its ``unit`` the tool misses up to ``missed`` mm more than the
    numbers say. ``is_shown``: the readings contradict the numbers then; ``turns_workpiece``: what is missed is a turn
    of the workpiece as a whole, which aligning it takes out."""

    symbol: str
    size: float
    unit: Unit
    missed: float
    is_shown: bool
    turns_workpiece: bool

    @property
    def refusal(self) -> Refusal:
        """Why there is no number of it."""
        kind = ReasonKind.NOT_SHOWN
        if self.turns_workpiece:
            kind = ReasonKind.TURNS_WORKPIECE
        elif self.is_shown:
            kind = ReasonKind.OUTSIDE_MODEL
        missed = MICROMETRE.to_display(self.missed)
        return Refusal(
            (self.symbol,),
            Reason(kind, u=missed, unit=MICROMETRE.name, size=f"{self.size:g} {self.unit.name}"),
        )


def axis_errors(chain: Chain) -> tuple[str, ...]:
    """Position and orientation errors of every axis as ISO 230-1:2012 counts them, zeros included: of a linear axis two
    tilts and its zero, of a rotary axis two shifts, two tilts and its zero; of a spindle no zero."""
    symbols = []
    for joint in chain.joints:
        along, about = joint.main, 3 + joint.main
        lacking = {about, *(each for each in range(3) if each != along)} if not joint.turns else {along}
        if joint.kind == "spindle":
            lacking |= {about}
        symbols += [f"E{COMPONENTS[each]}0{joint.name}" for each in range(6) if each not in lacking]
    return tuple(symbols)


def outside_errors(
    problem: ChainProblem,
    geometric: GeometricErrors,
    positions: Array,
    datum: Array | None,
    besides: Iterable[str] = (),
) -> tuple[OutsideError, ...]:
    """The errors that are in no number of ``geometric``, of which the tool misses more than 0.1 µm at ``positions``
    (n, J), the workpiece set to zero at ``datum`` (J,); ``besides`` are named already."""
    excluded = {*besides, *geometric.names, *problem.base_names}
    symbols = [symbol for symbol in axis_errors(geometric.chain) if symbol not in excluded]
    effects = tuple(parse_effect(symbol, geometric.chain) for symbol in symbols)
    extra = tuple(effect for effect in effects if isinstance(effect, ChainEffect))
    if not extra:
        return ()
    sizes = np.array(
        [effect.unit.to_internal(TURN_URAD if effect.term.is_rotation else SHIFT_UM) for effect in extra]
    )
    shift, shown = _taken_for(problem, geometric, extra)
    count, more = len(geometric.names), len(extra)
    wider = replace(
        geometric,
        effects=(*geometric.effects, *extra),
        names=(*geometric.names, *(effect.text for effect in extra)),
        estimate=np.zeros(count + more),
        covariance=np.zeros((count + more, count + more)),
    )
    moved = volumetric_error(wider, positions, datum).sensitivity
    missed = (moved[..., count:] - moved[..., :count] @ shift) * sizes
    largest = np.linalg.norm(missed, axis=1).max(axis=0)
    turned = _workpiece_turned(geometric, positions, datum)
    return tuple(
        OutsideError(
            symbol=effect.text,
            size=TURN_URAD if effect.term.is_rotation else SHIFT_UM,
            unit=effect.unit,
            missed=float(largest[index]),
            is_shown=bool(shown[index] * sizes[index] > LEAST_SHOWN),
            turns_workpiece=_is_made_of(missed[..., index].ravel(), turned),
        )
        for index, effect in enumerate(extra)
        if largest[index] > LEAST_MISSED
    )


def _taken_for(
    problem: ChainProblem, geometric: GeometricErrors, extra: tuple[ChainEffect, ...]
) -> tuple[Array, Array]:
    """What a unit of each error (m) is taken for: changes (k, m) of the run's numbers, and the length (m,) of what it
    leaves in the readings, in their standard deviations."""
    wider = problem.with_base(extra)
    at = wider.linearise(wider.start, wider.common_start)
    run = int(np.flatnonzero(problem.runs == geometric.run)[0])
    local, common = at.local[run], at.common[run]
    first, last = len(problem.base_names), len(problem.base_names) + len(extra)
    columns = np.hstack([local[:, :first], local[:, last:], common])
    names = (*problem.base_names, *wider.local_names[last:], *problem.added_names)
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    errors = local[:, first:last]
    unknowns = np.linalg.pinv(columns / scale, rcond=RANK_TOLERANCE) @ errors
    unexplained = np.linalg.norm(errors - (columns / scale) @ unknowns, axis=0)
    return (unknowns / scale[:, None])[[names.index(name) for name in geometric.names]], unexplained


def _workpiece_turned(geometric: GeometricErrors, positions: Array, datum: Array | None) -> Array:
    """What turns (3n, 3) of the workpiece about its own axes do at the positions, along the machine's directions."""
    asked = positions if datum is None else np.concatenate([positions, datum[None]])
    none = np.zeros((len(asked), len(geometric.chain.joints), 2, 6))
    pose = evaluate(geometric.chain, asked, none, np.zeros((len(asked), 3)), geometric.tip)
    places = pose.residual[: len(positions)] - (0.0 if datum is None else pose.residual[-1])
    turns = np.swapaxes(np.cross(np.eye(3), places[:, None, :]), 1, 2)
    return np.asarray(pose.work_rotation[: len(positions)] @ turns).reshape(-1, 3)


def _is_made_of(vector: Array, columns: Array) -> bool:
    shares = np.linalg.lstsq(columns, vector, rcond=None)[0]
    return bool(np.linalg.norm(vector - columns @ shares) < WHOLE * np.linalg.norm(vector))
