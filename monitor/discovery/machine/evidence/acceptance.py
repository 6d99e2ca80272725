"""Whether a finding of a scan of a chain is believed: with every pose as one observation, against how its size
scatters from run to run, and by the error on runs that took no part in its fit.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.evidence.noise_doubt import NoiseDoubt
from monitor.discovery.machine.evidence.poses import p_value_by_poses, poses_of_rows
from monitor.discovery.machine.evidence.refusal import Refusal
from monitor.discovery.machine.evidence.run_evidence import p_value_against_runs
from monitor.discovery.machine.evidence.wild_readings import without_wild_readings
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import FlexibleErrors, error_of
from monitor.discovery.machine.shapes.free_parts import is_free
from monitor.discovery.machine.shapes.inside_shapes import bending_sight, standing_beside
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.shown_cycles import is_cycle, is_shown
from monitor.discovery.machine.shapes.variants import with_drivers
from monitor.discovery.machine.sizes import all_but_cancels
from monitor.discovery.machine.suspects.wander import is_drift_of_machine, tracker_wander
from monitor.discovery.search.acceptance import Acceptance
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import (
    BEYOND,
    STANDS_OUT,
    Evidence,
    Pool,
    best_of_families_in,
    pool_of,
    weigh_beside,
    weigh_in,
)
from monitor.discovery.search.memory import Memory
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import except_for
from monitor.discovery.search.scene import family_count
from monitor.discovery.search.sign_flips import FEWEST, p_value_by_flips
from monitor.effects.drivers import EachRun

# Readings of one block of a run: some minutes, beyond what neighbours share once their correlation is taken out.
BLOCK = 15
# More than this part of what is seen of an effect is what was stated beforehand.
OF_STATEMENTS = 0.5
# A run that shows more than this part of an effect shows it alone: the others would determine it ten times worse.
OF_ONE_RUN = 0.99
# So many effects within the shape of another are named at most.
MOST_NAMED = 5


def blocks_of_runs(scene: ChainScene) -> npt.NDArray[np.int64]:
    """The block (M,) of every whitened number: some neighbouring readings of one run."""
    problem = scene.fit.problem
    runs, rows = scene.fit.solution.last.residual.shape
    numbers = problem.sigma.shape[1]
    count = max(rows // (BLOCK * numbers), 1)
    return np.asarray(scene.run * count + np.tile(np.arange(rows) * count // rows, runs))


def rows_of_runs(scene: ChainScene) -> npt.NDArray[np.int64]:
    """The reading (M,) of every whitened number, counted over all runs."""
    runs, rows = scene.fit.solution.last.residual.shape
    numbers = scene.fit.problem.sigma.shape[1]
    of_run = np.arange(rows) // numbers
    return np.asarray((np.arange(runs)[:, None] * (of_run[-1] + 1) + of_run).reshape(-1))


class ChainAcceptance(Acceptance[ChainCandidate]):
    """The rules of a search on a chain; ``drivers`` are those that the recorded columns allow, ``shared`` effects that
    the scene takes for granted. Larger errors may have any shape unless ``any_shape`` is false."""

    scene: ChainScene

    def __init__(
        self,
        scene: ChainScene,
        drivers: Sequence[str],
        rate: float,
        shared: Sequence[ChainCandidate] = (),
        *,
        any_shape: bool = True,
    ) -> None:
        super().__init__(scene)
        self.any_shape = any_shape
        self.shared = shared
        self.drivers = drivers
        self.rate = rate
        self._families = family_count(scene)
        self._poses = poses_of_rows(scene.fit)
        # Readings one by one only where neighbours do not resemble each other.
        alone = (rows_of_runs(scene),) if scene.fit.whitening is None else ()
        self._units = (scene.run, blocks_of_runs(scene), *alone)
        self._flexible = FlexibleErrors(scene, drivers)
        self._wander = tracker_wander(scene)
        runs = len(scene.fit.problem.runs)
        # One run's residual holds the effect that is sought, and its correlation errs on the side of silence.
        few = scene.fit.whitening is not None and 1 < runs <= FEWEST
        self._doubt = NoiseDoubt(scene) if few else None
        self._weighed: Memory[float] = Memory()
        self._accepted: Memory[bool] = Memory()
        self._credible: Memory[bool] = Memory()
        self._refined: Memory[ChainCandidate] = Memory()
        self._pool: Pool[ChainCandidate] | None = None
        self._flipped: Memory[bool] = Memory()

    def accepts(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect stands out with every pose as one observation and from how its size scatters from run to
        run, is of a plausible size, and lowers the error on runs left out (blocks of poses where there is one run; true
        where it has few) and that at poses left out of every run."""
        return self._accepted.answer(
            others,
            candidate,
            lambda: self.is_credible(others, candidate) and self.predicts(others, candidate),
        )

    def error_of(self, candidate: ChainCandidate) -> str:
        """The error of which a candidate is a shape."""
        return error_of(candidate)

    def is_credible(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """The rules of ``accepts`` but for the errors on what was left out."""
        return self._credible.answer(others, candidate, lambda: self._is_credible(others, candidate))

    def _is_credible(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        return self._refused_as(others, candidate) is None

    def refusal(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> Refusal | None:
        """The first rule that refuses an effect beside others; None where ``accepts`` does not refuse it."""
        refused = self._refused_as(others, candidate)
        if refused is None and not self.predicts(others, candidate):
            return Refusal.HELD_OUT
        return refused

    def _refused_as(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> Refusal | None:
        """The first rule but for the errors on what was left out that refuses an effect; None where none does."""
        limit = self.rate
        # What takes least time is asked first: most candidates fail one of the rules.
        if self._poses is not None:
            by_poses = p_value_by_poses(candidate, self.scene, others, self._poses)
            if by_poses * self._families > limit:
                return Refusal.POSES
        if p_value_against_runs(candidate, self.scene, others) * self._families > limit:
            return Refusal.RUNS
        named = [
            *self._larger_errors(others, candidate),
            *(shared for shared in self.shared if error_of(shared) != error_of(candidate)),
        ]
        in_any_shape = self._flexible.competitors(named) if self.any_shape else ()
        if not self._survives(others, candidate, in_any_shape):
            return Refusal.OTHER_SHAPES
        if is_drift_of_machine(candidate) and not self._survives(others, candidate, self._wander):
            return Refusal.WANDER
        if not self._is_plausible(others, candidate):
            return Refusal.SIZE
        if self._doubt is not None:
            tries = candidate.variant.tries * candidate.variant.odds * self._families
            if self._doubt.p_value(others, candidate) * tries > limit:
                return Refusal.NOISE
        return None

    def predicts(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect lowers the errors on what was left out; true where what was stated beforehand (the length
        of a bar, a beam) is what it takes the contradiction from: no reading is predicted better by that."""
        if self._is_of_statements(candidate):
            return True
        # What has another size in every run says nothing of a run left out.
        if isinstance(candidate.effect.driver, EachRun) or self._is_of_one_run(others, candidate):
            before, after = (
                self.scene.held_out_error_by_poses(self.scene.columns(some))
                for some in (others, [*others, candidate])
            )
            return before is None or after is None or after < before
        return super().predicts(others, candidate)

    def _is_of_one_run(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether nearly all that the data see of an effect beside others is in one of several runs (a warm-up in the
        first of a day): the other runs do not determine it, and what they say of it predicts nothing."""
        columns = orthonormal(without(self.scene.remainders.beside(others).basis, candidate.columns))
        weights = np.bincount(self.scene.run, weights=np.sum(columns**2, axis=1))
        return len(weights) > 1 and float(weights.max()) > OF_ONE_RUN * float(weights.sum())

    def _is_of_statements(self, candidate: ChainCandidate) -> bool:
        """Whether most of what the data see of an effect are calibrated quantities, not readings."""
        stated = len(self.scene.fit.problem.extra_names)
        if not stated:
            return False
        runs = len(self.scene.fit.problem.runs)
        columns = candidate.columns.reshape(runs, -1, candidate.columns.shape[1])
        whole = float(np.sum(columns**2))
        return float(np.sum(columns[:, -stated:] ** 2)) > OF_STATEMENTS * whole

    def within_shapes(self, selected: Sequence[ChainCandidate]) -> list[tuple[str, ...]]:
        """For each selected effect the families that stand out beside all selected ones, but not beside its error in
        any shape; for one of free shape what bends every line of sight, too, if it stands out in its place alone."""
        pool = pool_of(self.scene)
        families = {candidate.family for candidate in selected}
        within: list[list[str]] = [[] for _ in selected]
        for evidence in best_of_families_in(self.scene.remainders.beside(selected), pool):
            candidate = evidence.candidate
            if evidence.p_value * self._families > self.rate or candidate.family in families:
                continue
            for index, named in enumerate(selected):
                other_error = error_of(named) != error_of(candidate)
                if other_error and not self._survives(
                    selected, candidate, self._flexible.competitors([named])
                ):
                    within[index].append(candidate.family)
                    break
        for index, named in enumerate(selected):
            if is_free(named):
                within[index] += self._bends_within(except_for(selected, index), named, families)
        return [tuple(dict.fromkeys(names))[:MOST_NAMED] for names in within]

    def _bends_within(
        self, others: Sequence[ChainCandidate], named: ChainCandidate, families: Collection[str]
    ) -> list[str]:
        """Flexure and refraction that stand out in place of a free shape, but not beside its error in any shape."""
        competitors = self._flexible.competitors([named])
        bends = [bend for bend in bending_sight(self.scene) if bend.family not in families]
        standing = [bend for bend in bends if standing_beside(self.scene, others, [bend])]
        return [bend.family for bend in standing if not self._survives(others, bend, competitors)]

    def _survives(
        self,
        others: Sequence[ChainCandidate],
        candidate: ChainCandidate,
        competitors: Sequence[ChainCandidate],
    ) -> bool:
        """Whether an effect stands out beside others and flexible ``competitors``."""
        if not competitors:
            return True
        beside = self.scene.remainders.beside([*others, *competitors])
        residual = beside.residual
        columns = orthonormal(without(beside.basis, candidate.columns))
        explained = float(np.sum((columns.T @ residual) ** 2))
        size = columns.shape[1]
        dof = beside.degrees_of_freedom - size
        rest = float(residual @ residual) - explained
        if size == 0 or dof < 1 or rest <= 0.0:
            return False
        p_value = float(scipy.special.fdtrc(size, dof, explained / size / (rest / dof)))
        return p_value * candidate.variant.tries * candidate.variant.odds * self._families <= self.rate

    def _larger_errors(
        self, others: Sequence[ChainCandidate], candidate: ChainCandidate
    ) -> list[ChainCandidate]:
        """The effects of other errors that explain more beside all than a candidate does: of two effects the larger one
        is named first, and its shape may be the cause of the other, not the other way round."""
        explained = self._explained(others, candidate)
        return [
            other
            for index, other in enumerate(others)
            if error_of(other) != error_of(candidate)
            and self._explained([*except_for(others, index), candidate], other) >= explained
        ]

    def _explained(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> float:
        """The sum of squares that a candidate explains beside others."""
        return self._weighed.answer(
            others, candidate, lambda: weigh_beside(self.scene, [candidate], others)[0].explained
        )

    def _is_plausible(self, others: Sequence[ChainCandidate], candidate: ChainCandidate) -> bool:
        """Whether an effect beside others is no larger than a machine could have, and not many times as large as what
        it takes of the residual: such a one is nearly cancelled by others. A cycle is asked at its best pitch, where
        it may pass through zero at all positions."""
        if is_cycle(candidate):
            candidate = self.at_best_value([*others, candidate], len(others))
        size = candidate.columns.shape[1]
        fitted = amplitudes(self.scene, [*others, candidate])
        explained = self._explained(others, candidate)
        if all_but_cancels(self.scene, candidate, fitted.estimate[-size:], explained):
            return False
        removed = self.scene.fit.sigma**2 * explained
        if is_cycle(candidate) and not is_shown(candidate, fitted.estimate[-size:], removed):
            return False
        sizes, spread = fitted.estimate[-size:], np.sqrt(np.diag(fitted.covariance)[-size:])
        sure = np.maximum(np.abs(sizes) - STANDS_OUT * spread, 0.0)
        return float(np.linalg.norm(sure)) <= BEYOND * candidate.largest

    def stands_among(
        self, pool: Pool[ChainCandidate], others: Sequence[ChainCandidate], evidence: Evidence[ChainCandidate]
    ) -> bool:
        """Whether an effect stands out under sign flips of whole runs, of blocks of them or, in one run of independent
        readings, of these, and so again where no wild reading counts for more than its score: noise with heavy tails
        follows no F distribution. True where too few show it."""
        if pool is not self._pool:
            self._pool, self._flipped = pool, Memory()
        return self._flipped.answer(
            others, evidence.candidate, lambda: self._stands_under_flips(pool, others, evidence)
        )

    def _stands_under_flips(
        self, pool: Pool[ChainCandidate], others: Sequence[ChainCandidate], evidence: Evidence[ChainCandidate]
    ) -> bool:
        """Whether an effect stands under flips of what others leave and, where that has heavy tails, in its scores: by
        F, which holds for bounded numbers, or under their flips."""
        p_value = p_value_by_flips(self.scene.remainders.beside(others), pool, evidence, self._units)
        if p_value is None or p_value > self.rate:
            return p_value is None
        scores = without_wild_readings(self.scene, others, evidence.candidate)
        if scores is None:
            return True
        (bounded,) = weigh_in(scores, [evidence.candidate])
        if bounded.p_value * self._families <= self.rate:
            return True
        p_value = p_value_by_flips(scores, pool, bounded, self._units)
        return p_value is not None and p_value <= self.rate

    def alternatives(self, candidate: ChainCandidate) -> Sequence[ChainCandidate]:
        """The effect with each driver, or without its own, at the price of a pitch that was sought; none that the scan
        weighs already: a pitch that was sought would come back as if it had been known."""
        others = with_drivers(candidate.effect, self.drivers)
        if is_cycle(candidate):
            others = [replace(other, tries=other.tries * candidate.variant.tries) for other in others]
        weighed = {each.effect.text for each in self.scene.candidates}
        others = [other for other in others if other.effect.text not in weighed]
        return scene_of(self.scene.fit, others).candidates

    def at_best_value(self, selected: Sequence[ChainCandidate], index: int) -> ChainCandidate:
        """The selected candidate at an index with its time constant, pitch or order at the best value."""
        return self._refined.answer(
            except_for(selected, index),
            selected[index],
            lambda: refine(self.scene, selected, index).candidate,
        )
