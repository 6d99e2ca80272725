"""A station that moved once within a run: from a reading on, all that a tracker sees stands elsewhere, or all that the
machine carries.

Every moment is tried, with a shift and a turn. A move has to say more at its price, all moments paid for, than such
a motion of the tracker or of the machine by and by through that run, evenly or settling, and than a tracker that walks
along a curve of some nodes; drifts of the catalogue compete with it in the scan.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.suspects.wander import wander
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import Evidence, weigh_beside
from monitor.effects import ArtefactEffect
from monitor.effects.artefact.station import BaseMoved, Moved, TrackerMoved
from monitor.effects.artefact.tracker import TRACKER_COLUMNS
from monitor.effects.driver import Driver
from monitor.effects.drivers import Always, RunTime
from monitor.effects.drivers.settling import Settling

# Readings before and after: six coefficients follow fewer.
READINGS_EACH_SIDE = 8
# So many moments of a run are tried, then as many of those between the best one and its neighbours.
MOMENTS = 40
# A tripod is knocked more easily than a machine; resting targets outweigh that at once.
ODDS_OF_BASE = 3.0
# Nodes of a curve along which a tracker may walk through every run. A walk has most of its power in its slowest parts:
# at the price of many nodes it explained nothing, and was told as a move.
NODES = (3, 4, 6, 10)
# Time constants of what settles in a run, in parts of it.
SETTLING = (0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6)


def station_moves(
    scene: ChainScene,
    selected: Sequence[ChainCandidate],
    rate: float,
    first_moments: dict[type[Moved], tuple[ChainCandidate, ...]] | None = None,
) -> list[ChainVariant]:
    """The move of the tracker and that of the machine that explain most beside selected effects; none where none stands
    out at a ``rate``. ``first_moments`` are the moments of one run that were tried first under this fit, kept here."""
    context = scene.fit.problem.context
    if any(name not in context.columns for name in TRACKER_COLUMNS):
        return []
    steady = [candidate for candidate in selected if not may_be_a_move(candidate)]
    first_moments = {} if first_moments is None else first_moments
    likeliest = (_likeliest(scene, steady, kind, first_moments) for kind in (TrackerMoved, BaseMoved))
    moves = [best for best in likeliest if best is not None]
    if not moves:
        return []
    walks = [walk for nodes in NODES for walk in wander(scene, nodes)]
    rivals = [*weigh_beside(scene, walks, steady), *_by_and_by(scene, steady, moves)]
    least = max((rival.score for rival in rivals), default=0.0)
    return [move.candidate.variant for move in moves if move.p_value <= rate and move.score > max(least, 0.0)]


def _by_and_by(
    scene: ChainScene, steady: Sequence[ChainCandidate], moves: Sequence[Evidence[ChainCandidate]]
) -> list[Evidence[ChainCandidate]]:
    """The motions of moves through all of their run, evenly or settling, most likely first."""
    context = scene.fit.problem.context
    variants = []
    for move in moves:
        change = _change_of(move.candidate)
        of_run = context.run == change.run
        lasted = float(np.ptp(context.time[of_run]))
        drivers: list[Driver] = [
            RunTime(),
            *(Settling(time_constant_s=part * lasted) for part in SETTLING if lasted > 0.0),
        ]
        whole = replace(change, sequence=int(context.sequence[of_run].min()))
        for number, driver in enumerate(drivers):
            drift = ArtefactEffect(whole, driver, f"drift {number}")
            variants.append(Variant(drift.text, drift, len(drivers), move.candidate.variant.odds))
    return weigh_beside(scene, scene_of(scene.fit, variants).candidates, steady)


def may_be_a_move(candidate: ChainCandidate) -> bool:
    """Whether an effect is one of the frame of the tracker or of the machine's base that follows a driver: what a
    single move is taken for."""
    head, _, driver = candidate.family.partition("@")
    first = candidate.fit.problem.context.chain.joints[0].name
    return bool(driver) and (head.startswith("tracker:") or head.endswith(f"0{first}"))


def _change_of(candidate: ChainCandidate) -> Moved:
    """What moved, and when."""
    effect = candidate.effect
    assert isinstance(effect, ArtefactEffect)
    assert isinstance(effect.change, Moved)
    return effect.change


def _likeliest(
    scene: ChainScene,
    steady: Sequence[ChainCandidate],
    kind: type[Moved],
    first_moments: dict[type[Moved], tuple[ChainCandidate, ...]],
) -> Evidence[ChainCandidate] | None:
    """The likeliest move of a kind of all runs."""
    context = scene.fit.problem.context
    moments = {
        int(run): np.unique(context.sequence[context.run == run])[READINGS_EACH_SIDE:-READINGS_EACH_SIDE]
        for run in scene.fit.problem.runs
    }
    tries = sum(map(len, moments.values()))

    def moves(run: int, sequences: Iterable[int]) -> tuple[ChainCandidate, ...]:
        effects = [ArtefactEffect(kind(run, int(sequence)), Always(), "") for sequence in sequences]
        odds = ODDS_OF_BASE if kind is BaseMoved else 1.0
        return scene_of(
            scene.fit, [Variant(effect.text, effect, tries, odds) for effect in effects]
        ).candidates

    def best_of(candidates: Sequence[ChainCandidate]) -> Evidence[ChainCandidate] | None:
        weighed = weigh_beside(scene, candidates, steady)
        return weighed[0] if weighed else None

    of_runs = []
    for run, sequences in moments.items():
        step = max(len(sequences) // MOMENTS, 1)
        coarse = first_moments.get(kind) or moves(run, sequences[::step])
        if len(moments) == 1:
            first_moments[kind] = coarse
        best = best_of(coarse)
        while best is not None and step > 1:
            at = int(np.searchsorted(sequences, _change_of(best.candidate).sequence))
            around = sequences[max(at - step, 0) : at + step + 1]
            step = max(len(around) // MOMENTS, 1)
            best = best_of(moves(run, around[::step])) or best
        if best is not None:
            of_runs.append(best)
    return max(of_runs, key=lambda each: each.score, default=None)
