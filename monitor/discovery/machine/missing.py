"""The effects that a chain lacks as results: size, evidence, error before and after, and their rivals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.evidence.poses import p_value_by_poses, poses_of_rows, widening
from monitor.discovery.machine.joints.curve_findings import is_curve
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, MachineEffect, scene_of
from monitor.discovery.machine.separation.late import SizeIfLate, sizes_if_late
from monitor.discovery.machine.separation.rivals import RivalSearch
from monitor.discovery.machine.separation.separate import Separation, separating_poses
from monitor.discovery.machine.shapes.curves import Curve, follows
from monitor.discovery.machine.shapes.held_place import HeldPlace, held_place
from monitor.discovery.machine.shapes.refine import Refined, refine, refine_all
from monitor.discovery.machine.shapes.step_places import Between, steps_between
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.variants import each_run, part_of_bend
from monitor.discovery.machine.sizes import (
    all_but_cancels,
    peak_of,
    peaks_of_errors,
    seen_as_turn,
    size_of,
    spread_or_length,
)
from monitor.discovery.machine.surroundings import Surroundings
from monitor.discovery.search.amplitudes import amplitudes, length_of
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.missing import Missing, Rival
from monitor.discovery.search.rivals import least_likelihood
from monitor.discovery.search.scan import Finding, except_for, reduced
from monitor.effects import ChainEffect
from monitor.effects.description import Description
from monitor.effects.drivers import Always, EachRun
from monitor.effects.shapes.free import Free
from monitor.effects.words import describe, describe_bend, describe_free
from monitor.records import Array
from monitor.units import Unit

# An effect of less than twice its standard uncertainty is no answer.
SMALLEST_RATIO = 2.0


@dataclass(frozen=True)
class ChainMissing(Missing):
    """A missing effect of a chain; lengths in mm.

    Held-out errors are of runs left out (with one run of many poses: of blocks of poses; with one of few: None), those
    of days None with fewer than three days, those of poses are of poses left out of every run. ``separation`` holds the
    poses that would separate the rivals; ``varies`` says that the effect has another size in every run. Where the
    catalogue does not have its shape, ``nearest`` is the entry that comes closest, and ``curve`` the shape.
    ``travelled_periods`` of a harmonic are those through which the axis turned, where they are so few over a part of a
    turn that it is a smooth bend (else None);
    ``unit`` is that of ``amplitude`` where it is not that of the coefficients: the weights of many links are one angle,
    the largest of the run. ``within_its_shape`` are effects that stand out beside it, but not beside its error in any
    shape. ``within_runs`` says that the runs' own parameters take it up where its driver stays the same through a run:
    only what changes within runs shows it. ``largest`` is the coefficient of a table, the largest, that ``amplitude``
    is the absolute value of. ``error_peak`` is what the error does at most with all its effects together, in the first
    of several. ``steps`` says between which readings each step of an error lies, ``held`` where a plate that grows is
    held, by axis. ``if_late`` are its sizes if it follows its temperature late, where these data do not rule that out.
    ``turns`` says that rows of angles alone show it: its peaks are on a lever of one metre.
    """

    held_out_days_before: float | None
    held_out_days_after: float | None
    held_out_poses_before: float | None
    held_out_poses_after: float | None
    separation: Separation
    varies: bool
    nearest: str | None = None
    curve: Curve | None = None
    travelled_periods: float | None = None
    within_its_shape: tuple[str, ...] = ()
    unit: Unit | None = None
    within_runs: bool = False
    largest: str | None = None
    error_peak: float | None = None
    steps: tuple[Between, ...] = ()
    held: tuple[HeldPlace, ...] = ()
    turns: bool = False
    if_late: tuple[SizeIfLate, ...] = ()


@dataclass(frozen=True)
class _Selection:
    """The findings of a scan together, at their best values: the most convincing first.

    ``poses`` (M,) is the pose of every row, None where poses have no several rows. Errors are ``shown`` in readings of
    equal weight, whatever neighbours share.
    """

    scene: ChainScene
    candidates: Sequence[ChainCandidate]
    shown: ChainScene
    poses: npt.NDArray[np.int64] | None
    surroundings: Surroundings
    computed: dict[int, _Errors] = field(default_factory=dict)

    def errors(self, first: Sequence[ChainCandidate]) -> _Errors:
        """The errors with the first so many candidates in the model."""
        if len(first) not in self.computed:
            self.computed[len(first)] = _errors(self.shown, first, self.surroundings)
        return self.computed[len(first)]


@dataclass(frozen=True)
class _Errors:
    """Root mean square in mm: of the fit, and of runs, days and poses left out, None where there are too few."""

    rms: float
    runs: float | None
    days: float | None
    poses: float | None


def _errors(shown: ChainScene, first: Sequence[ChainCandidate], surroundings: Surroundings) -> _Errors:
    runs = _held_out(shown, first, surroundings.runs)
    single = len(surroundings.runs) == 1
    return _Errors(
        rms=_rms(shown, first),
        runs=runs,
        days=runs if single else _held_out(shown, first, surroundings.days),
        poses=runs if single and runs is not None else _held_out_poses(shown, first),
    )


def missing_effects(
    scene: ChainScene, result: ChainScan, refined: Sequence[Refined], surroundings: Surroundings
) -> tuple[ChainMissing, ...]:
    """The findings of a scan as results, the most convincing first; ``refined`` are the same at their best time
    constants and pitches."""
    candidates = [finding.candidate for finding in refined]
    if not candidates:
        return ()
    slopes = np.concatenate([finding.slope for finding in refined], axis=1)
    estimate = amplitudes(scene, candidates).estimate
    # The searched values widen the covariance of the sizes; their estimates stay those at the best value.
    covariance = amplitudes(scene, candidates, slopes).covariance
    poses = poses_of_rows(scene.fit)
    if poses is not None:
        factors = widening(scene, candidates, poses)
        covariance = factors[:, None] * covariance * factors
    shown = scene
    if scene.fit.whitening is not None:
        shown = scene_of(scene.fit.with_correlation(None), [candidate.variant for candidate in candidates])
    selection = _Selection(scene, candidates, shown, poses, surroundings)
    sizes = [(estimate[part], covariance[part, part]) for part in _parts(candidates)]
    peaks = peaks_of_errors(scene, candidates, sizes)
    return tuple(
        replace(
            _missing(selection, index, finding, refined[index], sizes[index]), error_peak=peaks.get(index)
        )
        for index, finding in enumerate(result.findings)
    )


def _parts(candidates: Sequence[ChainCandidate]) -> Iterator[slice]:
    """The part of each candidate in the coefficients of all."""
    start = 0
    for candidate in candidates:
        size = candidate.columns.shape[1]
        yield slice(start, start + size)
        start += size


def standing_out(scene: ChainScene, result: ChainScan) -> ChainScan:
    """The findings whose size, fitted together with others, exceeds its standard uncertainty by a factor of two.

    Two effects that can hardly be separated may each stand the scan and be fitted with sizes that cancel, within their
    uncertainty or hundreds of times as large as what they take away; the weaker one is taken out, and the other's size
    is determined again. Nothing cancels a finding that is alone: a cosine and a sine of which the plan sees one badly
    are certain together where the length of both is not.
    """
    return reduced(result, lambda findings: _too_small(scene, findings))


def _too_small(scene: ChainScene, findings: Sequence[Finding[ChainCandidate]]) -> int | None:
    """Index of the least convincing finding that is no larger than its uncertainty allows; None where all are."""
    candidates = [finding.candidate for finding in findings]
    sizes = amplitudes(scene, candidates)
    weak = []
    for index, part in enumerate(_parts(candidates)):
        # Of what differs from run to run the sizes, not their spread: two runs say little of that of all runs.
        size, u = length_of(sizes.estimate[part], sizes.covariance[part, part])
        is_small = len(findings) > 1 and u > 0 and abs(size) / u < SMALLEST_RATIO
        removed = weigh_beside(scene, [candidates[index]], except_for(candidates, index))[0].explained
        if is_small or all_but_cancels(scene, candidates[index], sizes.estimate[part], removed):
            weak.append(index)
    return max(weak, key=lambda index: -findings[index].evidence.score, default=None)


def told_apart(scene: ChainScene, result: ChainScan) -> tuple[ChainScan, list[Refined]]:
    """The findings at their best values, without those that are one with another that follows a driver of its own.

    A searched time constant widens what the sizes may be: a warm-up and an even drift of one error may each be taken
    for the other's opposite. Of such a pair one stays, which alone explains more, and the other is its rival.
    """
    while True:
        refined = refine_all(scene, result.candidates)
        index = _one_with_another(scene, refined)
        if index is None:
            return result, refined
        rest = refine_all(scene, except_for(result.candidates, index))
        findings = [finding for number, finding in enumerate(result.findings) if number != index]
        candidates = [each.candidate for each in rest]
        # What was weighed beside the other is weighed without it.
        result = replace(
            result,
            findings=tuple(
                replace(finding, evidence=weigh_beside(scene, [candidate], except_for(candidates, number))[0])
                for number, (finding, candidate) in enumerate(zip(findings, candidates, strict=True))
            ),
        )


def _one_with_another(scene: ChainScene, refined: Sequence[Refined]) -> int | None:
    """Index of a finding that is below twice its standard uncertainty beside another of the same error, and without
    which that explains no less than it would without that; None where there is none."""
    candidates = [each.candidate for each in refined]
    if len(candidates) < 2:
        return None
    slopes = np.concatenate([each.slope for each in refined], axis=1)
    sizes = amplitudes(scene, candidates, slopes)
    weak = [
        index
        for index, part in enumerate(_parts(candidates))
        if _is_small(candidates[index].effect, sizes.estimate[part], sizes.covariance[part, part])
    ]
    for first, second in combinations(weak, 2):
        names = [candidates[index].family.partition("@") for index in (first, second)]
        if names[0][0] == names[1][0] and all(driver for _, _, driver in names):
            alone = [
                _likelihood_without(scene, candidates, *pair) for pair in ((second, first), (first, second))
            ]
            return second if alone[0] >= alone[1] else first
    return None


def _is_small(effect: MachineEffect, coefficients: Array, covariance: Array) -> bool:
    """Whether a size is below twice its standard uncertainty."""
    size, u = spread_or_length(effect, coefficients, covariance)
    return u > 0 and abs(size) / u < SMALLEST_RATIO


def _likelihood_without(
    scene: ChainScene, candidates: Sequence[ChainCandidate], without: int, remaining: int
) -> float:
    """What the data say of one candidate at its best value without another."""
    rest = except_for(candidates, without)
    index = remaining - (without < remaining)
    best = refine(scene, rest, index).candidate
    return weigh_beside(scene, [best], except_for(rest, index))[0].likelihood


def name_of(candidate: ChainCandidate) -> str:
    """The effect as written; searched pitches, orders and nodes are part of it, a searched time constant is not."""
    searched = candidate.family.endswith(
        (":cyclic", ":sawtooth", ":step", ":windup", ":harmonic", ":table", ":free", ":curve")
    )
    return candidate.effect.text if searched else candidate.family


def _missing(
    selection: _Selection,
    index: int,
    finding: Finding[ChainCandidate],
    refined: Refined,
    sizes: tuple[Array, Array],
) -> ChainMissing:
    """One finding as a result; ``sizes`` are its coefficients and their covariance."""
    scene, surroundings = selection.scene, selection.surroundings
    coefficients, covariance = sizes
    candidate, effect = refined.candidate, refined.candidate.effect
    size = size_of(candidate, coefficients, covariance)
    p_value, q_value = _p_and_q(selection, finding, candidate)
    shown = selection.shown
    visible = selection.candidates if shown is scene else shown.candidates
    before, after = selection.errors(visible[:index]), selection.errors(visible[: index + 1])
    rivals: list[tuple[ChainCandidate, bool]] = []
    if not is_curve(candidate):
        search = RivalSearch(scene, selection.candidates, surroundings.drivers)
        # What was searched under another name may come to the same.
        rivals = [
            pair
            for pair in search.rivals(index, least_likelihood(finding.evidence), coefficients)
            if name_of(pair[0]) != name_of(candidate)
        ]
    travelled_periods = part_of_bend(effect, scene.fit.problem.context)
    return ChainMissing(
        rank=index + 1,
        effect=name_of(candidate),
        description=_described(scene, effect, travelled_periods, coefficients, covariance),
        parameters=effect.parameters(scene.fit.problem.context),
        units=(effect.unit,) * len(coefficients),
        coefficients=coefficients,
        covariance=covariance,
        amplitude=size.amplitude,
        u=size.u,
        peak=peak_of(scene, candidate, size.raw, coefficients),
        turns=seen_as_turn(scene, size.raw @ coefficients),
        searched=refined.searched,
        p_value=p_value,
        q_value=q_value,
        rms_before=before.rms,
        rms_after=after.rms,
        held_out_before=before.runs,
        held_out_after=after.runs,
        held_out_days_before=before.days,
        held_out_days_after=after.days,
        rivals=tuple(Rival(name_of(rival), same) for rival, same in rivals),
        held_out_poses_before=before.poses,
        held_out_poses_after=after.poses,
        separation=separating_poses(
            scene.fit, effect, coefficients, [rival.effect for rival, _ in rivals], surroundings.strokes
        ),
        varies=isinstance(effect.driver, EachRun),
        within_runs=_shows_within_runs_alone(scene, effect),
        travelled_periods=travelled_periods,
        unit=size.unit,
        nearest=candidate.variant.nearest,
        curve=size.curve,
        largest=size.largest,
        steps=steps_between(scene, candidate, except_for(selection.candidates, index)),
        held=held_place(scene, candidate, except_for(selection.candidates, index)),
        if_late=sizes_if_late(scene, selection.candidates, index, least_likelihood(finding.evidence)),
    )


def _described(
    scene: ChainScene,
    effect: MachineEffect,
    travelled_periods: float | None,
    coefficients: Array,
    covariance: Array,
) -> Description:
    """An effect in words, as these data show it."""
    if travelled_periods is not None:
        return describe_bend(effect)
    if (
        isinstance(effect, ChainEffect)
        and isinstance(effect.shape, Free)
        and not isinstance(effect.driver, EachRun)
    ):
        return describe_free(effect, follows(scene.fit.problem.context, effect, coefficients, covariance))
    return describe(effect)


def _shows_within_runs_alone(scene: ChainScene, effect: MachineEffect) -> bool:
    """Whether nothing would be seen of an effect whose driver had one value in every run."""
    if not isinstance(effect, ChainEffect) or isinstance(effect.driver, Always | EachRun):
        return False
    steady = each_run(replace(effect, driver=Always(), driver_text=""))
    return steady is not None and not scene_of(scene.fit, [steady]).candidates[0].visible


def _p_and_q(
    selection: _Selection, finding: Finding[ChainCandidate], candidate: ChainCandidate
) -> tuple[float, float]:
    """p-value and q-value of a finding, every pose counted as one observation where that is less certain."""
    p_value, q_value = finding.evidence.p_value, finding.q_value
    if selection.poses is None:
        return p_value, q_value
    others = [other for other in selection.candidates if other is not candidate]
    by_poses = p_value_by_poses(candidate, selection.scene, others, selection.poses)
    q_value = max(q_value, min(1.0, by_poses * q_value / p_value)) if p_value > 0.0 else by_poses
    return max(p_value, by_poses), q_value


def _rms(scene: ChainScene, candidates: Sequence[ChainCandidate]) -> float:
    """Root mean square in mm of all coordinates with candidates in the model."""
    return scene.fit.rms_of(scene.remainders.beside(candidates).residual)


def _held_out(
    scene: ChainScene, candidates: Sequence[ChainCandidate], fold: npt.NDArray[np.int64]
) -> float | None:
    """Held-out error in mm with candidates in the model; None where one has another size in every run."""
    if any(isinstance(candidate.effect.driver, EachRun) for candidate in candidates):
        return None
    return scene.held_out_error_of(scene.columns(candidates), fold)


def _held_out_poses(scene: ChainScene, candidates: Sequence[ChainCandidate]) -> float | None:
    """Error in mm of poses left out of every run; None where one has another size in every run."""
    if any(isinstance(candidate.effect.driver, EachRun) for candidate in candidates):
        return None
    return scene.held_out_error_by_poses(scene.columns(candidates))
