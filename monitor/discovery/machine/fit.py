"""A model fitted to a campaign, with what comparison and scan read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.noise.correlation import Correlation, NoiseDesign
from monitor.discovery.machine.noise.plan_cells import plan_cells
from monitor.discovery.machine.noise.rows import Rows, along_axes, from_pose_to_pose, neighbours_of
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.effects import Basis, Effect
from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import Solution, eliminate, project_out
from monitor.methods.chain.memory import TIMES_OF_FIT, within_memory
from monitor.methods.chain.poses import shared_poses
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.records import Array

#: What of a fit the correlation of its noise changes.
OF_NOISE = frozenset({"whitening", "nuisance", "nuisance_by_rows", "white", "in_likely_noise"})
#: So many correlations hold nearly all of the weight; where hundreds share it their p-values are alike.
MOST_CORRELATIONS = 24
#: Below this part of the largest weight a correlation says nothing: the smallest p-value that is asked for is 1e-5.
SMALLEST_WEIGHT = 1e-3


@dataclass(frozen=True)
class Nuisance:
    """The unknowns that belong to single runs, and the coefficients that several runs share.

    ``basis`` (R, N, p) is orthonormal and spans what every run's own unknowns can do; ``shared`` (M, c) are the
    whitened columns of the coefficients that several runs share, M rows of all runs, with that taken out.
    """

    basis: Array
    shared: Array
    shared_rank: int


# By identity: what depends on a fit alone is computed once for it.
@dataclass(frozen=True, eq=False)
class Fit:
    """A problem and its least-squares point; ``left_out`` (n,) marks probings without weight.

    Where neighbours of a run resemble each other, ``whitening`` makes the whitened numbers of the search independent;
    the least-squares point itself stays that of equal weights.
    """

    problem: ChainProblem
    solution: Solution
    left_out: npt.NDArray[np.bool_]
    whitening: Whitening | None = None

    @cached_property
    def vectors(self) -> Array:
        """Residuals (n, d) in mm of all rows, those left out included."""
        return self.problem.vectors(self.solution.local, self.solution.common)

    @cached_property
    def by_error(self) -> Array:
        """Derivatives (n, 3, J, 2, 6) by every error of the chain of the vector that the rows report (a part of)."""
        pose = self.problem.evaluated(self.solution.local, self.solution.common, jacobian=True)
        assert pose.by_error is not None
        return pose.by_error

    @cached_property
    def observed_by_error(self) -> Array:
        """The same derivatives (n, d, J, 2, 6) of the numbers of the rows."""
        return self.problem.observe(self.by_error)

    def moved_by(self, basis: Basis) -> Array:
        """Change (n, d, k) of the residuals for each coefficient of an effect."""
        return self.problem.observe(basis.displacement(self.by_error))

    @property
    def readings(self) -> int:
        """The count of numbers that have weight, calibrated quantities aside."""
        return int(self.has_weight.sum())

    @cached_property
    def has_weight(self) -> npt.NDArray[np.bool_]:
        """The numbers (n, d) that have weight: those of rows left out and those that were not read have none."""
        return np.isfinite(self.problem.sigma) & ~self.left_out[:, None]

    @cached_property
    def sources(self) -> npt.NDArray[np.int64]:
        """The place (R, m) of every whitened number in the rows' numbers (n d,), -1 where there is none.

        Calibrated quantities follow the probings of a run and do not depend on the effects.
        """
        numbers = np.arange(float(self.problem.sigma.size)).reshape(self.problem.sigma.shape) + 1.0
        return self.problem.padded(numbers).astype(np.int64) - 1

    @cached_property
    def nuisance(self) -> Nuisance:
        """The unknowns of single runs.

        A coefficient that acts in one run only (a ball that moved in it, an effect with another size in every run) is
        an unknown of that run: no other run predicts it.
        """
        local, common = self.solution.last.local, self.solution.last.common
        if self.whitening is not None:
            local, common = (
                np.moveaxis(self.whitening(np.moveaxis(rows, 2, 0)), 0, 2) for rows in (local, common)
            )
        acts = np.any(common != 0.0, axis=1)
        single = acts.sum(axis=0) == 1
        most = int(acts[:, single].sum(axis=1).max(initial=0))
        more = np.zeros((*local.shape[:2], most))
        for run in range(len(local)):
            columns = common[run][:, single & acts[run]]
            more[run, :, : columns.shape[1]] = columns
        basis = eliminate(np.concatenate([local, more], axis=2)).basis
        shared = project_out(basis, common[:, :, ~single]).reshape(
            len(local) * local.shape[1], int(np.sum(~single))
        )
        scale = np.linalg.norm(shared, axis=0)
        rank = int(np.linalg.matrix_rank(shared / np.where(scale == 0, 1.0, scale))) if shared.size else 0
        return Nuisance(basis, shared, rank)

    @cached_property
    def nuisance_by_rows(self) -> Array:
        """The basis of the unknowns of single runs (n, d, p), by which to multiply numbers of rows."""
        return self.by_rows(self.nuisance.basis)

    def by_rows(self, numbers: Array) -> Array:
        """What to multiply numbers of rows (n, d) by, (n, d, k), for the products of their whitened ones (R, N, k)."""
        if self.whitening is not None:
            numbers = np.moveaxis(self.whitening.transposed(np.moveaxis(numbers, 2, 0)), 0, 2)
        return self.problem.by_rows(numbers)

    @cached_property
    def white(self) -> Array:
        """The whitened residual (R, N) with what every run's own unknowns can do taken out, independent numbers."""
        residual = self.solution.last.residual
        if self.whitening is None:
            return residual
        return project_out(self.nuisance.basis, self.whitening(residual)[..., None])[..., 0]

    def rms_of(self, white: Array) -> float:
        """Root mean square in mm of all coordinates with weight, as ``rms``, from what is left (R N,) of ``white``."""
        numbers = white.reshape(self.solution.last.residual.shape)
        if self.whitening is not None:
            numbers = self.whitening.undone(numbers)
        sigma = self.problem.padded(np.where(self.has_weight, self.problem.sigma, 0.0)[:, :, None])[..., 0]
        return float(np.sqrt(np.sum((numbers[:, : sigma.shape[1]] * sigma) ** 2) / self.readings))

    @property
    def rows(self) -> Rows:
        """How the whitened numbers follow each other, in the frame in which they do."""
        return self._layouts[self.frame]

    @cached_property
    def _layouts(self) -> tuple[Rows, ...]:
        """How the whitened numbers may follow each other: reading by reading, or where several are read at a pose from
        pose to pose, of which one part of the noise is common to all of them; directions along the axes too."""
        rows = neighbours_of(self.problem, self.by_error)
        pose = shared_poses(self.problem, self.solution)
        rows = rows if pose is None else from_pose_to_pose(rows, pose)
        return rows, *along_axes(self.problem, self.by_error, rows)

    @cached_property
    def frame(self) -> int:
        """The number of the layout in which neighbours are alike, the likeliest under the residual: asked of every
        residual anew, for an effect that was missing looks alike in a frame of its own."""
        if len(self._layouts) == 1:
            return 0
        designs = [self._noise_design(frame, self._is_noise_shared) for frame in range(len(self._layouts))]
        residual = self.solution.last.residual
        return int(np.argmin([design.least_criterion(residual) for design in designs]))

    def correlation(self) -> Correlation | None:
        """The correlation of neighbours that the residuals show; None where they show none.

        Of several runs only what they do not share counts: an effect that the model lacks makes neighbours alike too.
        """
        return self._correlation

    @cached_property
    def _correlation(self) -> Correlation | None:
        return self.noise_design.correlation(self.solution.last.residual)

    @cached_property
    def noise_design(self) -> NoiseDesign:
        """What the estimate of that correlation needs besides the residuals; runs of which each has poses of its own
        share nothing that would not be noise."""
        return self._noise_design(self.frame, self._is_noise_shared)

    @property
    def _is_noise_shared(self) -> bool:
        """Whether most poses stand in one run alone."""
        cells = plan_cells(self.problem)
        repeated = np.bincount(cells)[cells] > 1
        return 2 * int(repeated.sum()) < len(cells)

    @cached_property
    def whole_noise_design(self) -> NoiseDesign:
        """The same where what all runs share is noise too, as of one run."""
        return self.noise_design if self.noise_design.shared else self._noise_design(self.frame, True)

    def noise_design_under(self, correlation: Correlation | None, *, whole: bool) -> NoiseDesign:
        """One of the two in the frame of a correlation."""
        design = self.whole_noise_design if whole else self.noise_design
        if correlation is None or correlation.frame == self.frame:
            return design
        return self._noise_design(correlation.frame, design.shared)

    def _noise_design(self, frame: int, shared: bool) -> NoiseDesign:
        rows = self._layouts[frame]
        cells = self.problem.padded(plan_cells(self.problem)[:, None, None].astype(np.float64) + 1.0).reshape(
            rows.weighted.shape
        )
        last = self.solution.last
        several = len(last.residual) > 1
        unknowns = last.local if several else np.concatenate([last.local, last.common], axis=2)
        return NoiseDesign(rows, cells.astype(np.int64) - 1, eliminate(unknowns).basis, shared, frame)

    def with_correlation(self, correlation: Correlation | None) -> Fit:
        """The fit with the noise of neighbours correlated as said."""
        whitening = None if correlation is None else Whitening(self._layouts[correlation.frame], correlation)
        other = replace(self, whitening=whitening)
        # What the noise does not change is computed once for all correlations.
        vars(other).update({name: value for name, value in vars(self).items() if name not in OF_NOISE})
        return other

    @cached_property
    def in_likely_noise(self) -> list[tuple[float, Fit]]:
        """The weight of every correlation that the residuals allow, and the fit with it."""
        stated = None if self.whitening is None else self.whitening.correlation
        likelihoods = self.noise_design_under(stated, whole=False).likelihoods(self.solution.last.residual)
        best = sorted(likelihoods, key=lambda each: -each[1])[:MOST_CORRELATIONS]
        likely = [each for each in best if each[1] >= SMALLEST_WEIGHT * best[0][1]]
        total = sum(weight for _, weight in likely)
        return [(weight / total, self.with_correlation(correlation)) for correlation, weight in likely]

    @cached_property
    def degrees_of_freedom(self) -> int:
        """Readings and calibrated quantities less what the model determines from them."""
        readings = self.readings + len(self.problem.runs) * len(self.problem.extra_names)
        return readings - int(self.solution.rank.sum()) - int(self.solution.common_free.sum())

    @property
    def sum_of_squares(self) -> float:
        """Of the whitened residuals; its expectation is the degrees of freedom where the model is right."""
        return float(np.sum(self.solution.last.residual**2))

    @property
    def rms(self) -> float:
        """Root mean square in mm of the residuals that have weight."""
        return float(np.sqrt(np.mean(self.vectors[self.has_weight] ** 2)))

    @property
    def sigma(self) -> float:
        """Root mean square in mm of the stated standard uncertainty of a coordinate."""
        return float(np.sqrt(np.mean(self.problem.sigma[self.has_weight] ** 2)))

    @property
    def scale(self) -> float:
        """Residual standard deviation as a multiple of the stated standard uncertainty.

        Raises TooFewReadingsError where the model takes as many numbers as there are.
        """
        if self.degrees_of_freedom < 1:
            refuse_exact_fits(self.problem, self.solution)
        return float(np.sqrt(self.sum_of_squares / self.degrees_of_freedom))


def fit(
    problem: ChainProblem, left_out: npt.NDArray[np.bool_] | None = None, start: Fit | None = None
) -> Fit:
    """The least-squares point of a problem; probings that are left out get no weight.

    ``start`` is an earlier fit of the same runs with the same base, from which the search begins and whose correlation
    of neighbours is kept. Raises DataError where the readings do not suffice, or all of them at once need more memory
    than there is.
    """
    out = np.zeros(len(problem.context), dtype=bool) if left_out is None else left_out
    weighted = replace(problem, sigma=np.where(out[:, None], np.inf, problem.sigma)) if out.any() else problem
    if start is None:
        return Fit(weighted, _solved(weighted), out)
    common = weighted.common_start.copy()
    names = start.problem.added_names
    if names == weighted.added_names[: len(names)]:
        common[: len(names)] = start.solution.common
    fitted = Fit(weighted, _solved(weighted, start.solution.local, common), out)
    return fitted if start.whitening is None else fitted.with_correlation(start.whitening.correlation)


def _solved(problem: ChainProblem, local: Array | None = None, common: Array | None = None) -> Solution:
    """The solution of a problem with the linearisation of all rows, also where they are so many that it needs none."""
    with within_memory(problem, TIMES_OF_FIT):
        solution = solve_problem(problem, local, common)
        if not problem.is_in_parts:
            return solution
        return replace(solution, last=problem.linearise(solution.local, solution.common))


def fit_those_possible(
    problem: ChainProblem, effects: Sequence[Effect], out: npt.NDArray[np.bool_], start: Fit
) -> tuple[Fit, tuple[Effect, ...]]:
    """Fit a problem with further effects in common; return the fit and the effects that could not be fitted.

    Effects whose coefficients only products of small errors determine may keep the steps from settling. Then they are
    added one after the other, and each that cannot be fitted beside those before is left out.
    Raises DataError where nothing of it can be fitted.
    """
    try:
        return fit(replace(problem, added=(*problem.added, *effects)), out, start), ()
    except (DataError, np.linalg.LinAlgError):
        current = fit(problem, out, start)
    able: list[Effect] = []
    for effect in effects:
        try:
            current = fit(replace(problem, added=(*problem.added, *able, effect)), out, current)
        except (DataError, np.linalg.LinAlgError):
            continue
        able.append(effect)
    return current, tuple(effect for effect in effects if effect not in able)
