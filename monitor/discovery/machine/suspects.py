"""What belongs to single runs: bad points, balls that moved in a run, effects with another size in every run.

Each of them can be taken for another: an effect that varies makes probings deviate from the other runs', a bad
point makes sizes scatter. So whatever explains most is taken first, and the rest is judged with it taken out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.anomalies import BadPoint, BallMove, bad_points, ball_moves
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.variants import each_run
from monitor.discovery.machine.varying import most_varying
from monitor.discovery.machine.visible import Variant, Visible
from monitor.effects import ArtefactEffect, ChainEffect, parse_effect
from monitor.methods.chain.problem import ChainProblem

MOST_BAD_POINTS = 40
# More effects that vary, each with a coefficient a run, than this are beyond what a plan can separate.
MOST_VARYING = 2


def with_effects(problem: ChainProblem, effects: Sequence[ChainEffect | ArtefactEffect]) -> ChainProblem:
    """The problem with further effects in common."""
    return replace(problem, added=(*problem.added, *effects))


@dataclass(frozen=True)
class Suspects:
    """Bad points by row, moves by ball and run, and effects (without driver) that vary from run to run."""

    bad: dict[int, BadPoint] = field(default_factory=dict)
    moves: dict[tuple[str, int], BallMove] = field(default_factory=dict)
    varying: tuple[ChainEffect | ArtefactEffect, ...] = ()

    @property
    def any(self) -> bool:
        """Whether there is any."""
        return bool(self.bad or self.moves or self.varying)

    def same_as(self, other: Suspects) -> bool:
        """Whether both name the same ones."""
        return (
            set(self.bad) == set(other.bad)
            and set(self.moves) == set(other.moves)
            and self.varying == other.varying
        )

    def left_out(self, problem: ChainProblem) -> npt.NDArray[np.bool_]:
        """Marks (n,) the bad points."""
        out = np.zeros(len(problem.context), dtype=bool)
        out[list(self.bad)] = True
        return out

    def move_effects(self, problem: ChainProblem) -> list[ChainEffect | ArtefactEffect]:
        """The moves as effects."""
        return [
            parse_effect(
                f"ball:{move.target}:moved(run {move.run}, sequence {move.sequence})", problem.context.chain
            )
            for move in self.moves.values()
        ]

    def effects(self, problem: ChainProblem) -> list[ChainEffect | ArtefactEffect]:
        """Moves and varying effects, each with coefficients of its runs."""
        varying = [variant.effect for effect in self.varying if (variant := each_run(effect)) is not None]
        return [*self.move_effects(problem), *varying]


def find_suspects(
    under: Fit,
    problem: ChainProblem,
    chosen: Sequence[ChainEffect | ArtefactEffect],
    known: Suspects,
    variants: Sequence[Variant],
    visible: Visible | None = None,
) -> Suspects:
    """The suspects under a model with the ``chosen`` effects, the most certain first; ``known`` ones are kept.

    ``under`` is the fit with the chosen and the known ones, ``variants`` the effects that may vary,
    ``visible`` what ``under`` shows of them all where that is known.
    """
    bad, moves, varying = dict(known.bad), dict(known.moves), known.varying
    now = under
    while len(bad) < MOST_BAD_POINTS:
        new: list[BadPoint | BallMove] = [*bad_points(now), *ball_moves(now)]
        new.sort(key=lambda one: -one.chi_square)
        wild = most_varying(now, variants, visible) if len(varying) < MOST_VARYING else None
        if wild is not None and (not new or wild.gain > new[0].chi_square):
            varying = (*varying, wild.effect)
        elif not new:
            break
        # What one of them does to its run and, through the mean, to its ball in the other runs is seen only once
        # it is taken out.
        else:
            runs: set[int] = set()
            targets: set[str] = set()
            for one in new:
                if one.run in runs or one.target in targets:
                    continue
                runs.add(one.run)
                targets.add(one.target)
                if isinstance(one, BallMove):
                    moves[(one.target, one.run)] = one
                else:
                    bad[one.row] = one
        found = Suspects(bad, moves, varying)
        now = fit(with_effects(problem, [*found.effects(problem), *chosen]), found.left_out(problem), now)
        visible = None
    return Suspects(bad, moves, varying)
