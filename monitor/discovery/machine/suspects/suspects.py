"""Suspects of single runs: bad points, balls that moved in a run, targets whose readings scatter, effects with another
size in every run.

Each of them can be mistaken for another: an effect that varies makes probings deviate from the other runs', a bad
point makes sizes scatter, a ball that shakes makes bad points. So whatever explains most is taken first, and the rest
is judged with it taken out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.scene import ChainScene, ChainVariant, MachineEffect
from monitor.discovery.machine.shapes.variants import each_run
from monitor.discovery.machine.suspects.anomalies import (
    BadPoint,
    BallMove,
    bad_points,
    ball_moves,
    deviations_of,
)
from monitor.discovery.machine.suspects.bad_poses import bad_poses
from monitor.discovery.machine.suspects.piece_moves import piece_move
from monitor.discovery.machine.suspects.scatter import Scatter, scattering, settled
from monitor.discovery.machine.suspects.varying import Varying, most_varying
from monitor.effects import parse_effect
from monitor.exceptions import DataError
from monitor.methods.chain.problem import ChainProblem

MOST_BAD_POINTS = 40
# More effects that vary, each with a coefficient a run, than this are beyond what a plan can separate.
MOST_VARYING = 2

SuspectNames: TypeAlias = tuple[
    frozenset[int], frozenset[tuple[str, int]], frozenset[str], tuple[MachineEffect, ...]
]


def with_effects(problem: ChainProblem, effects: Sequence[MachineEffect]) -> ChainProblem:
    """The problem with further effects in common."""
    return replace(problem, added=(*problem.added, *effects))


@dataclass(frozen=True)
class Suspects:
    """Bad points by row, moves by ball and run, what scatters by target, and effects (without driver) that vary from
    run to run."""

    bad: dict[int, BadPoint] = field(default_factory=dict)
    moves: dict[tuple[str, int], BallMove] = field(default_factory=dict)
    scatter: dict[str, Scatter] = field(default_factory=dict)
    varying: tuple[MachineEffect, ...] = ()

    @property
    def any(self) -> bool:
        """Whether there is any."""
        return bool(self.bad or self.moves or self.scatter or self.varying)

    def with_single(self, suspects: Sequence[BadPoint | BallMove]) -> Suspects:
        """The suspects with the most certain further ones of every run and target.

        What one of them does to its run and, through the mean, to its ball in the other runs is seen only once
        it is taken out.
        """
        bad, moves = dict(self.bad), dict(self.moves)
        runs: set[int] = set()
        targets: set[str] = set()
        for suspect in suspects:
            if suspect.run in runs or suspect.target in targets:
                continue
            runs.add(suspect.run)
            targets.add(suspect.target)
            if isinstance(suspect, BallMove):
                moves[(suspect.target, suspect.run)] = suspect
            else:
                bad[suspect.row] = suspect
        return replace(self, bad=bad, moves=moves)

    def same_as(self, other: Suspects) -> bool:
        """Whether both name the same ones."""
        return self.names == other.names

    @property
    def names(self) -> SuspectNames:
        """What they are, without how far off."""
        return frozenset(self.bad), frozenset(self.moves), frozenset(self.scatter), self.varying

    @property
    def conditions(self) -> tuple[object, ...]:
        """All that a fit under them depends on."""
        out = frozenset(row for point in self.bad.values() for row in point.all_rows)
        moves = tuple(move.text for move in self.moves.values())
        weights = tuple((scatter.target, scatter.times) for scatter in self.scatter.values())
        return out, moves, weights, self.varying

    def with_scatter(self, scatter: Scatter) -> Suspects:
        """The suspects with a target that scatters."""
        return replace(self, scatter={**self.scatter, scatter.target: scatter})

    def weighed(self, problem: ChainProblem) -> ChainProblem:
        """The problem with the readings of targets that scatter counting by so much less."""
        sigma = problem.sigma
        for scatter in self.scatter.values():
            of_target = problem.context.target == scatter.target
            sigma = np.where(of_target[:, None], scatter.times * sigma, sigma)
        return problem if not self.scatter else replace(problem, sigma=sigma)

    def left_out(self, problem: ChainProblem) -> npt.NDArray[np.bool_]:
        """Marks (n,) the bad points."""
        out = np.zeros(len(problem.context), dtype=bool)
        out[[row for point in self.bad.values() for row in point.all_rows]] = True
        return out

    def move_effects(self, problem: ChainProblem) -> list[MachineEffect]:
        """The moves as effects."""
        return [parse_effect(move.text, problem.context.chain) for move in self.moves.values()]

    def effects(self, problem: ChainProblem) -> list[MachineEffect]:
        """Moves and varying effects, each with coefficients of its runs."""
        varying = [variant.effect for effect in self.varying if (variant := each_run(effect)) is not None]
        return [*self.move_effects(problem), *varying]


class _LooksForVarying:
    """Looks for what varies from run to run, and for slips of the piece.

    Each is weighed among all variants, seconds where there are hundreds of touches: at first, where it leads, and once
    nothing single is left, not after each of some forty bad points.
    """

    def __init__(self, variants: Sequence[ChainVariant], scene: ChainScene | None) -> None:
        self._variants = variants
        self._scene = scene
        self._under: Fit | None = None
        self._latest: Varying | None = None
        self._may_slip = True

    def slip(self, under: Fit) -> BallMove | None:
        """The slip of the piece under a fit, if any. Where there was none it is not asked for again."""
        if not self._may_slip:
            return None
        scene = self._scene if self._scene is not None and self._scene.fit is under else None
        slip = piece_move(under, self._variants, scene)
        self._may_slip = slip is not None
        return slip

    def leading(self, under: Fit, least: float) -> Varying | None:
        """The effect that varies most under a fit, where it gains more than the ``least``; None where it does not."""
        if self._under is None or (self._under is not under and (least == 0.0 or self._gains(least))):
            self._latest = most_varying(under, self._variants, self._scene)
            self._under, self._scene = under, None
        return self._latest if self._gains(least) else None

    def _gains(self, least: float) -> bool:
        return self._latest is not None and self._latest.gain > least


def find_suspects(
    under: Fit,
    problem: ChainProblem,
    selected: Sequence[MachineEffect],
    earlier: Suspects,
    variants: Sequence[ChainVariant],
    scene: ChainScene | None = None,
) -> Suspects:
    """The suspects under a model with the ``selected`` effects, the most certain first; ``earlier`` ones remain.

    ``under`` is the fit with the selected effects and the earlier suspects, ``variants`` the effects that may vary,
    ``scene`` that of ``under`` with all of them where it is known.
    """
    if poses_of_rows(under) is not None and len(under.problem.runs) == 1:
        return replace(earlier, bad={**earlier.bad, **{point.row: point for point in bad_poses(under)}})
    suspects = earlier
    current = under
    look = _LooksForVarying(variants, scene)
    while len(suspects.bad) < MOST_BAD_POINTS:
        further = _with_most_certain(suspects, current, look)
        if further is None:
            break
        try:
            current, suspects = _fitted(problem, selected, further, suspects, current)
        except (DataError, np.linalg.LinAlgError):
            # What cannot be fitted is no suspect; those before it remain.
            return suspects
    return suspects


def with_scatter_of(under: Fit, problem: ChainProblem, suspects: Suspects) -> Suspects:
    """The suspects with the target that scatters most under a fit of a problem, if any; each of its touches would be a
    bad point."""
    scatter = scattering(under)
    if scatter is None:
        return suspects
    try:
        return _fitted(problem, (), suspects.with_scatter(scatter), suspects, under)[1]
    except (DataError, np.linalg.LinAlgError):
        return suspects


def with_slip_of(
    under: Fit, problem: ChainProblem, suspects: Suspects, variants: Sequence[ChainVariant]
) -> Suspects:
    """The suspects with the slip of the piece that a fit of a problem shows, if any: errors of the machine come near
    it, so it is looked for before any is known."""
    slip = piece_move(under, variants)
    return suspects if slip is None else suspects.with_single([slip])


def _with_most_certain(suspects: Suspects, current: Fit, look: _LooksForVarying) -> Suspects | None:
    """The suspects with what explains most of what a fit leaves; None where nothing does."""
    slip, deviations = look.slip(current), deviations_of(current)
    single: list[BadPoint | BallMove] = [
        *bad_points(current, deviations=deviations),
        *ball_moves(current, deviations=deviations),
        *([slip] if slip else []),
    ]
    single.sort(key=lambda suspect: -suspect.chi_square)
    least = single[0].chi_square if single else 0.0
    scatter = scattering(current, suspects.scatter)
    scatters = scatter is not None and scatter.gain > least
    if len(suspects.varying) < MOST_VARYING:
        varying = look.leading(current, scatter.gain if scatter is not None and scatters else least)
        if varying is not None:
            return replace(suspects, varying=(*suspects.varying, varying.effect))
    if scatter is not None and scatters:
        return suspects.with_scatter(scatter)
    return suspects.with_single(single) if single else None


def _fitted(
    problem: ChainProblem,
    selected: Sequence[MachineEffect],
    suspects: Suspects,
    before: Suspects,
    start: Fit,
) -> tuple[Fit, Suspects]:
    """The fit with suspects and effects, and the suspects: how much a target scatters shows once it counts by less."""

    def under(suspects: Suspects, start: Fit) -> Fit:
        whole = with_effects(suspects.weighed(problem), [*suspects.effects(problem), *selected])
        return fit(whole, suspects.left_out(problem), start)

    current = under(suspects, start)
    for target in suspects.scatter.keys() - before.scatter.keys():
        suspects = suspects.with_scatter(settled(current, suspects.scatter[target]))
        current = under(suspects, current)
    return current, suspects
