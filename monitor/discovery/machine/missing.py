"""What is told of a missing effect: size, evidence, error before and after, and what it may be taken for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.evidence import Evidence, best_of_families, orthonormal, weigh, without
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.held_out import held_out_error
from monitor.discovery.machine.poses import p_value_by_poses, poses_of_rows, widening
from monitor.discovery.machine.refine import Refined, refine
from monitor.discovery.machine.scan import Finding, ScanResult, amplitudes
from monitor.discovery.machine.separate import Separation, separating_poses
from monitor.discovery.machine.variants import with_drivers
from monitor.discovery.machine.visible import Candidate, Visible, see
from monitor.discovery.search.missing import COINCIDES, UNDECIDED, Missing, Rival
from monitor.effects import ChainEffect
from monitor.effects.drivers import EachRun
from monitor.effects.shapes import Cyclic, Harmonic
from monitor.effects.words import describe
from monitor.records import Array

# A time constant between two of the grid may lose so much there; rivals are compared at their best value.
GRID_LOSS = 12.0
# An effect of less than twice its standard uncertainty is no answer.
SMALLEST_RATIO = 2.0
# Orders of a gear closer than this are the same: less than a turn of the joint tells no more.
ONE_ORDER = 2.0


@dataclass(frozen=True)
class ChainMissing(Missing):
    """A missing effect of a chain; lengths in mm.

    Held-out errors are of runs left out (with one run of many poses: of blocks of poses; with one of few: None), those
    of days None with fewer than three days. ``separation`` holds the poses that would separate the rivals; ``varies``
    says that the effect has another size in every run.
    """

    held_out_days_before: float | None
    held_out_days_after: float | None
    separation: Separation
    varies: bool


@dataclass(frozen=True)
class Surroundings:
    """What the campaign says besides its probings.

    ``runs`` and ``days`` (R,) are the fold of every run for held-out errors: itself, and its day; ``drivers`` are
    those that the recorded columns allow; ``strokes`` the ranges of axes in mm or rad that the machine file gives.
    """

    runs: npt.NDArray[np.int64]
    days: npt.NDArray[np.int64]
    drivers: tuple[str, ...]
    strokes: Mapping[str, tuple[float, float]]


def tell(
    fit: Fit, visible: Visible, result: ScanResult, refined: Sequence[Refined], known: Surroundings
) -> tuple[ChainMissing, ...]:
    """Everything that is told of the findings of a scan, the most convincing first; ``refined`` are the same at
    their best time constants and pitches."""
    findings = result.findings
    chosen = [one.candidate for one in refined]
    if not chosen:
        return ()
    slopes = np.concatenate([one.slope for one in refined], axis=1)
    values = amplitudes(visible, chosen)
    # The searched values widen the covariance of the sizes; their estimates stay those at the best value.
    wide = amplitudes(visible, chosen, slopes).covariance
    poses = poses_of_rows(fit)
    if poses is not None:
        wider = widening(visible, chosen, poses)
        wide = wider[:, None] * wide * wider
    told = []
    start = 0
    for place, finding in enumerate(findings):
        size = chosen[place].columns.shape[1]
        own = slice(start, start + size)
        start += size
        told.append(
            _missing(
                fit, visible, finding, refined[place], chosen, place, values.estimate[own], wide[own, own],
                known, poses,
            )
        )  # fmt: skip
    return tuple(told)


def stands_out(visible: Visible, result: ScanResult) -> ScanResult:
    """The findings whose size, fitted together with the others, exceeds its standard uncertainty by a factor of two.

    Two effects that can hardly be told apart may each stand the scan and be fitted with sizes that cancel; the
    weaker one is taken out, and the other's size is known again.
    """
    findings = list(result.findings)
    while findings:
        chosen = [finding.candidate for finding in findings]
        values = amplitudes(visible, chosen)
        ends = np.cumsum([one.columns.shape[1] for one in chosen])
        ratios = []
        for one, end in zip(chosen, ends, strict=True):
            own = slice(end - one.columns.shape[1], end)
            size, u = _amplitude(one, values.estimate[own], values.covariance[own, own])
            ratios.append(abs(size) / u if u > 0 else np.inf)
        weak = [place for place, ratio in enumerate(ratios) if ratio < SMALLEST_RATIO]
        if not weak:
            break
        del findings[max(weak, key=lambda place: -findings[place].evidence.score)]
    return replace(result, findings=tuple(findings))


def _amplitude(candidate: Candidate, coefficients: Array, covariance: Array) -> tuple[float, float]:
    if len(coefficients) == 1:
        return float(coefficients[0]), float(np.sqrt(covariance[0, 0]))
    if isinstance(candidate.variant.effect.driver, EachRun):
        # The spread of the sizes less what noise adds to it, and the uncertainty of a variance from R sizes.
        noise = float(np.mean(np.diag(covariance)))
        total = float(np.var(coefficients, ddof=1))
        spread = float(np.sqrt(max(total - noise, 0.0)))
        u_of_variance = total * float(np.sqrt(2.0 / (len(coefficients) - 1)))
        return spread, u_of_variance / (2.0 * max(spread, float(np.sqrt(noise))))
    length = float(np.linalg.norm(coefficients))
    if length == 0.0:
        return 0.0, float(np.sqrt(np.trace(covariance)))
    direction = coefficients / length
    return length, float(np.sqrt(direction @ covariance @ direction))


def _name(candidate: Candidate) -> str:
    """The effect as written; searched pitches, orders and nodes are part of it, a searched time constant is not."""
    searched = candidate.family.endswith((":cyclic", ":harmonic", ":table"))
    return candidate.variant.effect.text if searched else candidate.family


def _same_cycle(one: Candidate, other: Candidate) -> bool:
    """Whether a candidate is the search for the pitch, or has all but the order, that the other has."""
    found, mine = other.variant.effect, one.variant.effect
    if isinstance(found, ChainEffect) and isinstance(mine, ChainEffect) and found.term == mine.term:
        orders = [part.shape.order for part in (found, mine) if isinstance(part.shape, Harmonic)]
        if len(orders) == 2 and max(orders) > 3 and abs(orders[0] - orders[1]) < ONE_ORDER:
            return True
    return (
        one.family.endswith(":cyclic")
        and isinstance(found, ChainEffect)
        and isinstance(found.shape, Cyclic)
        and one.family == f"{found.term.symbol}:cyclic"
    )


def _missing(
    fit: Fit,
    visible: Visible,
    finding: Finding,
    refined: Refined,
    chosen: Sequence[Candidate],
    place: int,
    coefficients: Array,
    covariance: Array,
    known: Surroundings,
    poses: npt.NDArray[np.int64] | None,
) -> ChainMissing:
    candidate = refined.candidate
    p_value, q_value = finding.evidence.p_value, finding.q_value
    if poses is not None:
        by_poses = p_value_by_poses(
            candidate, visible, [one for one in chosen if one is not candidate], poses
        )
        q_value = max(q_value, min(1.0, by_poses * q_value / p_value)) if p_value > 0.0 else by_poses
        p_value = max(p_value, by_poses)
    effect = candidate.variant.effect
    amplitude, u = _amplitude(candidate, coefficients, covariance)
    before, after = chosen[:place], chosen[: place + 1]
    rivals = _rivals(fit, visible, finding, candidate, chosen, place, coefficients, known.drivers)
    return ChainMissing(
        rank=place + 1,
        effect=_name(candidate),
        words=describe(effect),
        parameters=effect.parameters(fit.problem.context),
        units=(effect.unit,) * len(coefficients),
        coefficients=coefficients,
        covariance=covariance,
        amplitude=amplitude,
        u=u,
        peak=float(np.linalg.norm(candidate.raw @ coefficients, axis=1).max()),
        searched=refined.searched,
        p_value=p_value,
        q_value=q_value,
        rms_before=_rms(fit, visible, before),
        rms_after=_rms(fit, visible, after),
        held_out_before=_held_out(fit, visible, before, known.runs),
        held_out_after=_held_out(fit, visible, after, known.runs),
        held_out_days_before=_held_out(fit, visible, before, known.days),
        held_out_days_after=_held_out(fit, visible, after, known.days),
        rivals=tuple(Rival(_name(one.candidate), coincides) for one, coincides in rivals),
        separation=separating_poses(
            fit,
            effect,
            coefficients,
            [one.candidate.variant.effect for one, _ in rivals],
            dict(known.strokes),
        ),
        varies=isinstance(effect.driver, EachRun),
    )


def _rivals(
    fit: Fit,
    visible: Visible,
    finding: Finding,
    candidate: Candidate,
    chosen: Sequence[Candidate],
    place: int,
    coefficients: Array,
    drivers: Sequence[str],
) -> list[tuple[Evidence, bool]]:
    """Effects that the data do not rule out, those that coincide with the found one first."""
    others = np.concatenate(
        [visible.added, *(one.columns for other, one in enumerate(chosen) if other != place)], axis=1
    )
    taken = {one.family for one in chosen}
    pool = [
        one
        for one in visible.candidates
        if one.family not in taken and np.any(one.columns) and not _same_cycle(one, candidate)
    ]
    pool += [
        one
        for one in see(fit, with_drivers(candidate.variant.effect, drivers)).candidates
        if one.family not in taken
        and one.family not in {other.family for other in pool}
        and np.any(one.columns)
    ]
    found = best_of_families(weigh(pool, visible.residual, others, visible.degrees_of_freedom))
    basis = orthonormal(others)
    vector = without(basis, candidate.columns) @ coefficients
    # What explains less than its own price is no rival, however weak the finding.
    least = max(finding.evidence.likelihood - UNDECIDED, 0.0)
    told = []
    for one in found:
        if one.likelihood < least - GRID_LOSS:
            continue
        if one.candidate.variant.tries > 1:
            trial = [*chosen[:place], one.candidate, *chosen[place + 1 :]]
            best = refine(fit, visible, trial, place).candidate
            (one,) = weigh([best], visible.residual, others, visible.degrees_of_freedom)
        if one.likelihood < least:
            continue
        own = orthonormal(without(basis, one.candidate.columns))
        share = float(np.sum((own.T @ vector) ** 2) / max(float(vector @ vector), 1e-300))
        told.append((one, share > COINCIDES))
    return sorted(told, key=lambda pair: not pair[1])


def _rms(fit: Fit, visible: Visible, chosen: Sequence[Candidate]) -> float:
    basis = orthonormal(np.concatenate([visible.added, *(one.columns for one in chosen)], axis=1))
    left = without(basis, visible.residual[:, None])
    return fit.sigma * float(np.sqrt(np.sum(left**2) / fit.readings))


def _held_out(
    fit: Fit, visible: Visible, chosen: Sequence[Candidate], fold: npt.NDArray[np.int64]
) -> float | None:
    if any(isinstance(one.variant.effect.driver, EachRun) for one in chosen):
        return None
    columns = np.concatenate([visible.added, *(one.columns for one in chosen)], axis=1)
    return held_out_error(fit, visible, columns, fold)
