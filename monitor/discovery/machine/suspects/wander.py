"""A tracker that wanders: what reflectors beside the machine say of a drift that is about to be named.

A drift of the whole machine and one of what looks at it differ on resting targets alone. A tracker seldom drifts along
the curves of the catalogue; it walks. So, before the machine is named, its drift has to stand out beside a tracker that
moves in every run along any curve of some nodes, in all three directions: only what resting targets do not take part in
is left to the machine then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.effects import ArtefactEffect, ChainEffect, Context
from monitor.effects.artefact.station import BaseMoved
from monitor.effects.description import Description
from monitor.effects.driver import HeatDriver
from monitor.effects.drivers import Always
from monitor.records import Array
from monitor.units import MICROMETRE, Unit

# Nodes of the tracker's curve in every run: each is held by some visits of the resting targets.
FEWEST_NODES, MOST_NODES, VISITS_A_NODE = 3, 10, 2


@dataclass(frozen=True)
class TrackerWander:
    """A shift of the tracker's frame along a curve of ``nodes`` over every run; never an answer itself."""

    nodes: int
    text: str = "tracker:wander"
    unit: Unit = MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        """A suffix for each coefficient: run by run, node by node, along X, Y and Z."""
        runs = np.unique(context.run)
        return tuple(f".{run}.{node}.{axis}" for run in runs for node in range(self.nodes) for axis in "xyz")

    def shifts(self, context: Context) -> Array:
        """The shifts (n, 3, 3 R K) of all rows."""
        grid = np.linspace(0.0, 1.0, self.nodes)
        curves = np.clip(1.0 - np.abs(context.run_time[:, None] - grid) / grid[1], 0.0, None)
        inside = context.run[:, None] == np.unique(context.run)
        shifts = np.einsum("nr,nk,ab->narkb", inside, curves, np.eye(3))
        return np.asarray(shifts.reshape(len(context), 3, -1))

    def described(self, driven: str) -> Description:
        """A curve that nobody is told of."""
        return Description("the frame of the tracker wanders", "", "", "")


def is_drift_of_machine(candidate: ChainCandidate) -> bool:
    """Whether an effect is a drift with time or heat, or a move, of anything but the tracker."""
    effect = candidate.effect
    if isinstance(effect, ArtefactEffect):
        return isinstance(effect.change, BaseMoved)
    return isinstance(effect.driver, HeatDriver)


def tracker_wander(scene: ChainScene) -> tuple[ChainCandidate, ...]:
    """What a tracker that walks could do; empty where no target rests."""
    problem = scene.fit.problem
    resting = np.isin(problem.context.target, list(problem.resting))
    if not resting.any():
        return ()
    runs = len(problem.runs)
    visits = int(resting.sum()) // (len(problem.resting) * runs)
    return wander(scene, int(np.clip(visits // VISITS_A_NODE, FEWEST_NODES, MOST_NODES)))


def wander(scene: ChainScene, nodes: int) -> tuple[ChainCandidate, ...]:
    """What a tracker that walks along a curve of so many nodes could do."""
    curve = ArtefactEffect(TrackerWander(nodes), Always(), "")
    return scene_of(scene.fit, [Variant(curve.text, curve)]).candidates


def with_base_instead(scene: ChainScene, result: ChainScan, rate: float) -> ChainScan:
    """The result of a scan with what ``base_instead`` has in place of its effects."""
    instead = base_instead(scene, result.candidates, rate)
    return ScanResult(findings_of(scene, instead)) if instead else result


def base_instead(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> list[ChainCandidate]:
    """Effects with a base of the machine that moves in place of a tracker that does, where resting targets say so; none
    where they do not.

    A shift of the tracker has three coefficients and is found in one step; each direction in which a base moves is an
    effect of its own and stands behind it until all are tried together. That something moves is certain already: only
    which of the two is asked, and nothing is paid for the catalogue again. The base has to be seen at ``rate`` beside a
    tracker that moves along any curve.
    """
    tool = scene.fit.problem.context.chain.tool
    if not scene.fit.problem.resting or not tool:
        return []
    first = tool[0].name
    of_base = [candidate for candidate in scene.candidates if _moves_base(candidate, first)]
    named = [each for each in selected if _is_tracker(each) or _moves_base(each, first)]
    if not of_base or not any(map(_is_tracker, named)):
        return []
    others = [each for each in selected if not (_is_tracker(each) or _moves_base(each, first))]
    base, worth = _best_base(scene, of_base, others)
    present = sum(
        weigh_beside(scene, [candidate], [*others, *named[:index]])[0].score
        for index, candidate in enumerate(named)
    )
    if worth <= present + WORTH_EXCHANGING or not _is_seen_beside_wander(scene, base, others, rate):
        return []
    return [*others, *base]


def _best_base(
    scene: ChainScene, of_base: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> tuple[list[ChainCandidate], float]:
    """Drifts of the base, each of another direction and at its best time constant, as long as one is worth its price,
    and their score together."""
    base: list[ChainCandidate] = []
    worth = 0.0
    while True:
        errors = {candidate.family.partition("@")[0] for candidate in base}
        rest = [each for each in of_base if each.family.partition("@")[0] not in errors]
        weighed = weigh_beside(scene, rest, [*others, *base]) if rest else []
        if not weighed or weighed[0].score <= 0.0:
            return base, worth
        beside = [*others, *base]
        drift = refine(scene, [*beside, weighed[0].candidate], len(beside)).candidate
        worth += weigh_beside(scene, [drift], beside)[0].score
        base.append(drift)


def _is_seen_beside_wander(
    scene: ChainScene, base: Sequence[ChainCandidate], others: Sequence[ChainCandidate], rate: float
) -> bool:
    """Whether drifts of the base, together, are more than chance beside a tracker that walks."""
    if not base:
        return False
    beside = scene.remainders.beside([*others, *tracker_wander(scene)])
    columns = orthonormal(without(beside.basis, np.concatenate([each.columns for each in base], axis=1)))
    explained, size = float(np.sum((columns.T @ beside.residual) ** 2)), columns.shape[1]
    dof = beside.degrees_of_freedom - size
    rest = float(beside.residual @ beside.residual) - explained
    if size == 0 or dof < 1 or rest <= 0.0:
        return False
    return float(scipy.special.fdtrc(size, dof, explained / size / (rest / dof))) <= rate


def _is_tracker(candidate: ChainCandidate) -> bool:
    return isinstance(candidate.effect, ArtefactEffect) and candidate.family.startswith("tracker:")


def _moves_base(candidate: ChainCandidate, first: str) -> bool:
    """Whether an effect is a drift of where the first axis stands."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and effect.term.symbol.endswith(f"0{first}")
        and is_drift_of_machine(candidate)
    )
