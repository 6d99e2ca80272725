"""The search for missing effects: step by step, with the false discovery rate controlled over every scan.

Each step weighs every candidate against what the effects found so far leave over, takes the most convincing
one if it stands the control, and then asks of each effect found before whether, given the others, another
candidate would do better: a mimic taken early is exchanged. The scan ends when nothing stands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from monitor.discovery.machine.evidence import Evidence, Pool, best_of_families, orthonormal, weigh, without
from monitor.discovery.machine.visible import SMALLEST_SHARE, Candidate, Visible
from monitor.records import Array
from monitor.statistics import control_false_discoveries

# More than this many effects hidden together in one campaign are beyond what a plan can separate.
MOST_EFFECTS = 6
# Effects that are merged and found again in turn would go round for ever; a search that has not settled by then is
# told as it is.
MOST_STEPS = 4 * MOST_EFFECTS
# An exchange must be worth more than the noise of the comparison.
WORTH_EXCHANGING = 1.0

#: Whether a candidate may stand beside others.
Allowed = Callable[[Sequence[Candidate], Candidate], bool]


@dataclass(frozen=True)
class Finding:
    """One effect found: the evidence for it given the others, its q-value, and its rivals.

    ``rivals`` are all candidates with their evidence in its place, most convincing first, itself included.
    """

    evidence: Evidence
    q_value: float
    rivals: tuple[Evidence, ...]

    @property
    def candidate(self) -> Candidate:
        """The effect found."""
        return self.evidence.candidate


@dataclass(frozen=True)
class ScanResult:
    """What a scan found, the most convincing first, and the evidence for all that remains."""

    findings: tuple[Finding, ...]
    remaining: tuple[Evidence, ...]


def _stack(visible: Visible, candidates: Sequence[Candidate]) -> Array:
    return np.concatenate([visible.added, *(candidate.columns for candidate in candidates)], axis=1)


def scan(
    visible: Visible,
    *,
    rate: float = 0.01,
    most: int = MOST_EFFECTS,
    more: Callable[[Candidate], Sequence[Candidate]] = lambda found: (),
    accept: Callable[[Sequence[Candidate], Candidate], bool] = lambda others, found: True,
    best_value: Callable[[Sequence[Candidate], int], Candidate] = lambda chosen, place: chosen[place],
    allowed: Allowed | None = None,
    better: Callable[[Sequence[Candidate], Candidate], bool] = lambda chosen, rival: True,
) -> ScanResult:
    """Find the missing effects among the candidates of which the data see anything.

    ``rate`` is the false discovery rate over each scan; ``most`` how many effects at most; ``more`` gives
    further candidates to compare with one that was found (its drivers); ``accept`` has the last word on a
    finding (held-out error); ``best_value`` gives the chosen one at a place with its time constant or pitch at
    the best value, so that what the grid misses is not taken for another effect; ``allowed`` rules candidates out
    beside others (a period that the data cannot separate from one found before); ``better`` has the last word on a
    rival that would take the place of one of the chosen.
    """
    pool = _pool(visible)
    chosen: list[Candidate] = []
    for _ in range(MOST_STEPS):
        found = best_of_families(_weighed(visible, pool, chosen, allowed))
        if not found or len(chosen) >= most:
            break
        taken = {one.family for one in chosen}
        q = control_false_discoveries([one.p_value for one in found], rate=rate).q_value
        standing = [
            one
            for one, value in zip(found, q, strict=True)
            if value <= rate and one.candidate.family not in taken
        ]
        best = next((one for one in standing if accept(chosen, one.candidate)), None)
        if best is None:
            break
        chosen.append(best.candidate)
        chosen[-1] = best_value(chosen, len(chosen) - 1)
        pool = pool.with_more([one for one in more(best.candidate) if one.share > SMALLEST_SHARE])
        chosen = _exchange(visible, pool, chosen, best_value, allowed, better)
        chosen = _merge(visible, pool, chosen, allowed, better)
    return ScanResult(findings_of(visible, chosen, pool, allowed), tuple(found))


def _pool(visible: Visible) -> Pool:
    return Pool(tuple(one for one in visible.candidates if one.share > SMALLEST_SHARE))


def findings_of(
    visible: Visible, chosen: list[Candidate], pool: Pool | None = None, allowed: Allowed | None = None
) -> tuple[Finding, ...]:
    """The chosen effects with their evidence given the others and their rivals of ``pool`` (of all candidates where
    there is none), most convincing first."""
    families = len({one.family for one in visible.candidates if one.share > SMALLEST_SHARE})
    pool = _pool(visible) if pool is None else pool
    findings = [_finding(visible, pool, chosen, place, families, allowed) for place in range(len(chosen))]
    return tuple(sorted(findings, key=lambda one: -one.evidence.score))


def _weighed(
    visible: Visible, pool: Pool, chosen: Sequence[Candidate], allowed: Allowed | None
) -> list[Evidence]:
    """Evidence for the candidates of a pool that are allowed beside the chosen ones, given these."""
    found = weigh(pool, visible.residual, _stack(visible, chosen), visible.degrees_of_freedom)
    return found if allowed is None else [one for one in found if allowed(chosen, one.candidate)]


def _exchange(
    visible: Visible,
    pool: Pool,
    chosen: list[Candidate],
    best_value: Callable[[Sequence[Candidate], int], Candidate],
    allowed: Allowed | None,
    better: Callable[[Sequence[Candidate], Candidate], bool],
) -> list[Candidate]:
    """Exchange effects for better ones, given the others, until nothing improves."""
    chosen = list(chosen)
    for _ in range(MOST_EFFECTS):
        changed = False
        for place in range(len(chosen)):
            own, others = _in_its_place(visible, pool, chosen, place, allowed)
            worth = others and others[0].score > own.score + WORTH_EXCHANGING
            if worth and better(chosen, others[0].candidate):
                chosen[place] = others[0].candidate
                chosen[place] = best_value(chosen, place)
                changed = True
        if not changed:
            break
    return chosen


def _merge(
    visible: Visible,
    pool: Pool,
    chosen: list[Candidate],
    allowed: Allowed | None,
    better: Callable[[Sequence[Candidate], Candidate], bool],
) -> list[Candidate]:
    """One effect instead of two where it explains as much at its price: growth of a whole artefact may first be
    taken for that of two axes."""
    for first, second in combinations(range(len(chosen)), 2):
        others = [one for place, one in enumerate(chosen) if place not in (first, second)]
        families = {one.family for one in chosen}
        stack, dof = _stack(visible, others), visible.degrees_of_freedom
        found = [
            one for one in _weighed(visible, pool, others, allowed) if one.candidate.family not in families
        ]
        more = _stack(visible, [*others, chosen[first]])
        pair = weigh([chosen[first]], visible.residual, stack, dof)[0].score
        pair += weigh([chosen[second]], visible.residual, more, dof)[0].score
        if found and found[0].score > pair and better(chosen, found[0].candidate):
            return _merge(visible, pool, [*others, found[0].candidate], allowed, better)
    return chosen


def _in_its_place(
    visible: Visible, pool: Pool, chosen: Sequence[Candidate], place: int, allowed: Allowed | None
) -> tuple[Evidence, list[Evidence]]:
    """Evidence for the chosen effect at a place, given the other chosen ones, and for all that are not chosen."""
    without_it = [one for other, one in enumerate(chosen) if other != place]
    families = {one.family for one in chosen}
    found = best_of_families(_weighed(visible, pool, without_it, allowed))
    stack = _stack(visible, without_it)
    own = weigh([chosen[place]], visible.residual, stack, visible.degrees_of_freedom)[0]
    return own, [one for one in found if one.candidate.family not in families]


def _finding(
    visible: Visible,
    pool: Pool,
    chosen: list[Candidate],
    place: int,
    families: int,
    allowed: Allowed | None,
) -> Finding:
    own, others = _in_its_place(visible, pool, chosen, place, allowed)
    # The smallest of m p-values times m bounds its q-value from above, whatever their dependence.
    rivals = sorted([own, *others], key=lambda one: -one.score)
    return Finding(own, min(1.0, own.p_value * families), tuple(rivals))


@dataclass(frozen=True)
class Amplitudes:
    """Coefficients (k,) of the chosen effects together, and their covariance (k, k), in internal units."""

    estimate: Array
    covariance: Array


def amplitudes(visible: Visible, chosen: Sequence[Candidate], extra: Array | None = None) -> Amplitudes:
    """The coefficients of the chosen effects, fitted together with those the model has already.

    ``extra`` (M, e) are columns whose coefficients are not wanted but widen the covariance (how the residual
    changes with a time constant that was searched).
    """
    wanted = np.concatenate([candidate.columns for candidate in chosen], axis=1)
    nuisance = visible.added if extra is None else np.concatenate([visible.added, extra], axis=1)
    basis = orthonormal(nuisance)
    left, residual = without(basis, wanted), without(basis, visible.residual[:, None])[:, 0]
    scale = np.linalg.norm(left, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv((left / scale).T @ (left / scale), rcond=1e-10, hermitian=True)
    estimate = -inverse @ ((left / scale).T @ residual)
    stays = residual + (left / scale) @ estimate
    dof = visible.degrees_of_freedom - basis.shape[1] - int(np.linalg.matrix_rank(inverse, hermitian=True))
    variance = float(stays @ stays) / max(dof, 1)
    return Amplitudes(estimate / scale, variance * inverse / np.outer(scale, scale))
