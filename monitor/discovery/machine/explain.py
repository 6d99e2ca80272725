"""The physical effects that are missing: the whole way from a fitted model to an answer.

Fit, scan, add the findings to the model, look for bad points and balls that moved under that model, leave them out and
begin again until nothing changes. Then the steps between runs, what varies without a recorded column, what cannot be
separated, and the effects to which the plan is blind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from monitor.discovery.machine.compare import ChainComparison, compare
from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit, fit, fit_those_possible
from monitor.discovery.machine.joints.curve_findings import with_curves
from monitor.discovery.machine.joints.joint_curves import joint_curves
from monitor.discovery.machine.missing import ChainMissing, missing_effects
from monitor.discovery.machine.mistakes.cures import Mistake
from monitor.discovery.machine.nearest import Nearest, nearest_effect, outdone_by
from monitor.discovery.machine.rounds import ChainRound, ChainSearch, Limit, correlation_under
from monitor.discovery.machine.scene import ChainScene, ChainVariant, MachineEffect, scene_of
from monitor.discovery.machine.separation.aliases import taken_for_machine
from monitor.discovery.machine.shapes.shapes_of_model import not_followed
from monitor.discovery.machine.shapes.variants import (
    cycles_of_unknown_pitch,
    resolvable,
    reversals_of_unknown_width,
    that_lag,
    that_moves_first,
    variants_of,
    without_aliases,
    without_part_periods,
)
from monitor.discovery.machine.step_within_run import searched_beside_step
from monitor.discovery.machine.surroundings import Surroundings, surroundings_of
from monitor.discovery.machine.suspects.anomalies import BadPoint, BallMove
from monitor.discovery.machine.suspects.off_alike import off_alike
from monitor.discovery.machine.suspects.off_in_places import TargetOff, off_in_all_places
from monitor.discovery.machine.suspects.recurring import are_unchecked, recurring
from monitor.discovery.machine.suspects.runs_apart import RunApart, runs_apart
from monitor.discovery.machine.suspects.scatter import Scatter
from monitor.discovery.machine.suspects.small_moves import (
    follows_moves,
    may_turn_nothing,
    without_small_moves,
)
from monitor.discovery.machine.suspects.stepped_within import SteppedWithin
from monitor.discovery.machine.suspects.steps import Step, find_steps
from monitor.discovery.machine.suspects.suspects import Suspects, with_effects
from monitor.discovery.machine.suspects.varying import varying_effects
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import ChainEffect
from monitor.effects.catalogue import catalogue
from monitor.effects.shapes import Const
from monitor.methods.chain.identification import TakenUp
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign, Verdict

# Lines of joint curves that bad poses hid show once these are out; what they show again hides no more.
MOST_CURVES = 4


@dataclass(frozen=True)
class Explanation:
    """The answer. ``comparison`` is the model as given, ``missing`` what it lacks, most convincing first.

    ``suspect`` points were left out, ``moves`` and ``steps`` are changes reported as such; ``blind`` effects leave
    nothing that this plan can see. Of ``missing`` those marked ``varies`` have another size in every run, and no
    recorded column follows it. ``unfitted`` stood out but could not be fitted, and were skipped. Where the file itself
    looks wrong, ``mistakes`` says how, and nothing else is reported.
    ``limits`` says at which ends of the search more may be there. ``taken_for_machine`` are errors of instruments that
    leave nothing to see because base parameters do the same. Readings of targets that ``scatter`` counted by so much
    less. Runs ``apart`` leave more than the others. ``together`` is the verdict of the tests of all residuals together,
    under the model as given. ``not_followed`` are errors that the model has in a free shape which does not follow them.
    ``recurring`` readings were left out like suspect ones, but most runs left them alike: the model lacks something
    there. The suspect ones are ``unchecked`` where so many lie where no other run read that it may lack as much.
    ``nearest`` is the effect that comes nearest where none is named. ``beside`` is the verdict on what is left with all
    of ``missing`` in the model. ``stepped`` is a step of an error within a run, in the model beside ``missing``.
    ``small_moves_turn_nothing``: the plays of all this turn over from 0.1 mm on between stated places, not from 0.01 mm
    on as elsewhere.
    """

    comparison: ChainComparison
    missing: tuple[ChainMissing, ...]
    suspect: tuple[BadPoint, ...]
    moves: tuple[BallMove, ...]
    steps: tuple[Step, ...]
    blind: tuple[str, ...]
    refused: tuple[tuple[str, str], ...]
    final: Fit
    mistakes: tuple[Mistake, ...] = ()
    unfitted: tuple[str, ...] = ()
    limits: tuple[Limit, ...] = ()
    taken_for_machine: tuple[TakenUp, ...] = ()
    scatter: tuple[Scatter, ...] = ()
    apart: tuple[RunApart, ...] = ()
    together: Verdict | None = None
    not_followed: tuple[str, ...] = ()
    recurring: tuple[BadPoint, ...] = ()
    unchecked: bool = False
    off_targets: tuple[TargetOff, ...] = ()
    nearest: Nearest | None = None
    stepped: SteppedWithin | None = None
    beside: Verdict = Verdict.EXPLAINED
    small_moves_turn_nothing: bool = False

    @property
    def more_is_left(self) -> bool:
        """Whether more is left with what is missing in the model, and a step, than noise leaves."""
        return bool(self.missing or self.stepped) and self.beside is Verdict.SOMETHING_IS_MISSING


def variants_of_campaign(
    campaign: Campaign, problem: ChainProblem, drivers: Sequence[str]
) -> list[ChainVariant]:
    """Every effect of the catalogue that the model lacks, with what is searched of it."""
    axes = campaign.machine.axes.items()
    pitches = {name: axis.scale_pitch for name, axis in axes if axis.scale_pitch is not None}
    texts = [effect.text for effect in (*problem.base, *problem.added)]
    chain = problem.context.chain
    effects = catalogue(chain, texts, drivers, pitches, problem.method_effects(drivers))
    shown = filter(problem.can_show, effects)
    variants = [variant for effect in shown for variant in variants_of(effect)]
    variants = that_moves_first(without_aliases(variants, problem.context, pitches), problem.context)
    variants += that_lag([variant.effect for variant in variants], problem.context)
    if problem.needs_whole_periods:
        variants = without_part_periods(variants, problem.context)
    unknown = [*resolvable(cycles_of_unknown_pitch(problem.context), problem.context)]
    return [*variants, *unknown, *reversals_of_unknown_width(problem.context)]


def explain(
    campaign: Campaign,
    problem: ChainProblem,
    model: str,
    *,
    rate: float = 0.01,
    rng: np.random.Generator,
    first: Fit | None = None,
    gross: Sequence[BadPoint] = (),
) -> Explanation:
    """Explain what a model lacks. ``rate`` is the false discovery rate of each scan; ``rng`` serves the step search;
    ``first`` is the fit of ``problem`` where it is known, with the ``gross`` readings left out.

    Raises DataError where the model cannot be fitted.
    """
    foreseen = problem.for_search()
    # The fit of the problem as it is serves only where nothing else is foreseen.
    certain = Suspects({point.row: point for point in gross})
    if first is None or foreseen is not problem:
        first = fit(foreseen, certain.left_out(foreseen) if gross else None)
    surroundings = surroundings_of(campaign, foreseen)
    variants = variants_of_campaign(campaign, foreseen, surroundings.drivers)
    search = ChainSearch(foreseen, variants, surroundings.drivers, rate, certain)
    as_given = compare(first, campaign.name, model)
    first, search, curves, latest, off_targets, alike = _by_moves_that_turn(as_given, first, search)
    small_moves_turn_nothing = search.problem is not foreseen
    without_step, stepped = latest, None
    if not curves:
        first, search, latest, stepped = searched_beside_step(first, search, latest)
    suspects = latest.suspects
    missing = _missing(first, search, curves, latest, surroundings)
    missing += _varying(first, search, latest, surroundings, len(missing))
    unfollowed = not_followed(latest.scene, [finding.candidate for finding in latest.refined], rate)
    single, again = _single_and_recurring(latest, alike, off_targets)
    unchecked = as_given.verdict is Verdict.SOMETHING_IS_MISSING and are_unchecked(latest.under, single)
    # A bad point or a ball that moved is reported as that: what counts is the verdict without them.
    verdict_beside = compare(latest.under, campaign.name, model).verdict
    is_found = bool(missing or unfollowed or again or unchecked or stepped)
    verdict = Verdict.SOMETHING_IS_MISSING if is_found else verdict_beside
    return Explanation(
        comparison=replace(as_given, verdict=verdict),
        together=as_given.verdict,
        missing=missing,
        suspect=tuple(single),
        moves=tuple(suspects.moves.values()),
        steps=tuple(_steps(campaign, latest, rng)),
        blind=_blind(latest.scene, missing),
        refused=latest.scene.refused,
        final=latest.under,
        unfitted=latest.unfitted,
        limits=latest.limits,
        taken_for_machine=taken_for_machine(latest.scene),
        scatter=tuple(suspects.scatter.values()),
        apart=_apart(latest, variants, varies=bool(suspects.varying)),
        not_followed=unfollowed,
        recurring=again,
        unchecked=unchecked,
        nearest=_nearest(without_step, search, verdict, (*missing, *unfollowed), stepped),
        stepped=stepped,
        beside=verdict_beside,
        small_moves_turn_nothing=small_moves_turn_nothing,
        off_targets=tuple(each.measured_under(latest.under) for each in off_targets),
    )


def _nearest(
    latest: ChainRound,
    search: ChainSearch,
    verdict: Verdict,
    named: Sequence[object],
    stepped: SteppedWithin | None,
) -> Nearest | None:
    """The effect that comes nearest where something is missing and nothing is ``named``; that which a step within a run
    took the place of comes first."""
    if named or verdict is not Verdict.SOMETHING_IS_MISSING:
        return None
    if stepped is not None and latest.refined:
        return outdone_by(stepped, latest.scene, [finding.candidate for finding in latest.refined])
    return nearest_effect(latest.scene, search.drivers, search.rate)


class _Searched(NamedTuple):
    """A search, the fit that it began with, the curves of joints and the round in which it ended, without targets that
    are off in all places of their piece and readings that are off ``alike`` in all runs."""

    first: Fit
    search: ChainSearch
    curves: tuple[ChainVariant, ...]
    latest: ChainRound
    off_targets: tuple[TargetOff, ...]
    alike: tuple[BadPoint, ...]


def _by_moves_that_turn(as_given: ChainComparison, first: Fit, search: ChainSearch) -> _Searched:
    """Search with the moves that turn plays over: those of 0.01 mm on between stated places or, where that leaves less
    likely readings, of 0.1 mm on."""
    searched = _searched(as_given, first, search)
    larger = without_small_moves(search.problem)
    if larger is None:
        return searched
    begin = fit(larger, search.gross.left_out(larger) if search.gross.any else None)
    in_model = any(follows_moves(effect, larger.context) for effect in larger.added)
    better_begun = in_model and begin.rms < first.rms
    is_asked = better_begun or _leaves_something(as_given, searched.latest)
    if not is_asked and not _may_turn_nothing(search, searched.latest, begin):
        return searched
    other = _searched(as_given, begin, replace(search, problem=larger))
    if [each.target for each in other.off_targets] != [each.target for each in searched.off_targets]:
        return searched
    cost = searched.search.cost(first, searched.latest) - other.search.cost(first, other.latest)
    return other if cost > UNDECIDED else searched


def _may_turn_nothing(search: ChainSearch, latest: ChainRound, begin: Fit) -> bool:
    """Whether plays that were found may do as well with the moves of a fit to ``begin`` with; not asked cheaply where
    readings or targets were judged, or sides are unknown."""
    selected = [finding.candidate for finding in latest.refined]
    if not any(follows_moves(each.effect, begin.problem.context) for each in selected):
        return False
    if latest.sides or not latest.suspects.same_as(search.gross):
        return True
    noise = latest.scene.fit.whitening
    under = begin.with_correlation(None if noise is None else noise.correlation)
    return may_turn_nothing(latest.scene, selected, under)


def _leaves_something(as_given: ChainComparison, latest: ChainRound) -> bool:
    """Whether more is left than noise leaves, found effects in the model."""
    verdict = compare(latest.under, as_given.campaign, as_given.model).verdict
    return verdict is Verdict.SOMETHING_IS_MISSING


def _searched(as_given: ChainComparison, first: Fit, search: ChainSearch) -> _Searched:
    """Search without the targets that are off in all places, which effects would be asked for: with what stands out
    before any effect is known, and once more with what does beside them."""
    off_targets = off_in_all_places(first) if as_given.verdict is Verdict.SOMETHING_IS_MISSING else ()
    if off_targets:
        first, search = _without([each.point for each in off_targets], first, search)
    curves, latest = _search_with_curves(first, search)
    if later := _off_beside(latest, off_targets):
        off_targets += later
        first, search = _without([each.point for each in later], first, search)
        curves, latest = _search_with_curves(first, search)
    alike = _off_alike(as_given, latest, off_targets)
    if not latest.under.left_out[[point.row for point in alike]].all():
        first, search = _without(alike, first, search)
        curves, latest = _search_with_curves(first, search)
    return _Searched(first, search, curves, latest, off_targets, alike)


def _off_alike(
    as_given: ChainComparison, latest: ChainRound, off_targets: Sequence[TargetOff]
) -> tuple[BadPoint, ...]:
    """What all runs have off alike, where something is missing or readings were left out, as gross ones are before;
    nothing of targets that are off in all places."""
    doubtful = as_given.verdict is Verdict.SOMETHING_IS_MISSING or latest.suspects.bad
    of_targets = {row for each in off_targets for row in each.point.rows}
    return (
        tuple(point for point in off_alike(latest.under) if point.row not in of_targets) if doubtful else ()
    )


def _off_beside(latest: ChainRound, named: Sequence[TargetOff]) -> tuple[TargetOff, ...]:
    """What is off in all places beside the effects of a round, or beside readings that it left out, and is not named
    yet."""
    if not (latest.refined or latest.suspects.any):
        return ()
    targets = {each.target for each in named}
    return tuple(each for each in off_in_all_places(latest.under) if each.target not in targets)


def _single_and_recurring(
    latest: ChainRound, alike: Sequence[BadPoint], off_targets: Sequence[TargetOff]
) -> tuple[list[BadPoint], tuple[BadPoint, ...]]:
    """The suspect points that stand for themselves, and those that most runs share, what is off ``alike`` in all of
    them included; none of targets that are off in all places."""
    of_targets = {row for each in off_targets for row in each.point.rows}
    points = sorted(latest.suspects.bad.values(), key=lambda point: point.row)
    points = [point for point in points if point.row not in of_targets]
    in_all = {point.row for point in alike}
    recur = recurring(latest.under, points) | in_all
    again = [point for point in points if point.row in recur - in_all]
    return [point for point in points if point.row not in recur], (*again, *alike)


def _without(points: Sequence[BadPoint], first: Fit, search: ChainSearch) -> tuple[Fit, ChainSearch]:
    """A fit and a search without points on which all runs agree: no search leaves them out by itself, and effects would
    be asked what they do."""
    gross = Suspects(search.gross.bad | {point.row: point for point in points})
    return fit(search.problem, gross.left_out(search.problem), first), replace(search, gross=gross)


def _varying(
    first: Fit, search: ChainSearch, latest: ChainRound, surroundings: Surroundings, before: int
) -> tuple[ChainMissing, ...]:
    """What varies from run to run, ranked after so many effects ``before`` it."""
    suspects, problem = latest.suspects, search.problem
    if not suspects.varying:
        return ()
    effects = [*suspects.move_effects(problem), *latest.sides, *latest.effects]
    steady, _ = fit_those_possible(suspects.weighed(problem), effects, latest.under.left_out, first)
    steady = steady.with_correlation(correlation_under(latest.under))
    varying = varying_effects(steady, suspects.varying, search.variants, search.rate, surroundings)
    return tuple(replace(effect, rank=effect.rank + before) for effect in varying)


def _missing(
    first: Fit,
    search: ChainSearch,
    curves: Sequence[ChainVariant],
    latest: ChainRound,
    surroundings: Surroundings,
) -> tuple[ChainMissing, ...]:
    """What is reported as missing: the effects of a search, the curves of joints before them."""
    if curves:
        suspects, problem = latest.suspects, search.problem
        base = first if suspects.same_as(search.gross) else fit(problem, suspects.left_out(problem), first)
        return missing_effects(*with_curves(base, curves, latest.scene, latest.refined), surroundings)
    missing = missing_effects(latest.scene, latest.result, latest.refined, surroundings)
    if missing:
        rules = ChainAcceptance(latest.scene, search.drivers, search.rate)
        within = rules.within_shapes([finding.candidate for finding in latest.refined])
        missing = tuple(
            replace(effect, within_its_shape=names) for effect, names in zip(missing, within, strict=True)
        )
    return missing


def _search_with_curves(first: Fit, search: ChainSearch) -> tuple[tuple[ChainVariant, ...], ChainRound]:
    """The curves of joints with several lines, and the search under them; once more without the bad poses that it
    named, as long as these hide lines."""
    problem, variants, rate = search.problem, search.variants, search.rate
    curves = joint_curves(first, variants, rate)
    if not curves:
        return (), search.under(first)
    suspects = search.gross
    for _ in range(MOST_CURVES):
        under_curves = with_effects(problem, [curve.effect for curve in curves])
        begin = fit(under_curves, suspects.left_out(problem), first)
        latest = replace(search, problem=under_curves).under(begin, beside_curves=suspects)
        if latest.suspects.same_as(suspects):
            break
        suspects = latest.suspects
        clean = fit(problem, suspects.left_out(problem), first)
        curves = joint_curves(clean, variants, rate) or curves
    return curves, latest


def _apart(latest: ChainRound, variants: Sequence[ChainVariant], *, varies: bool) -> tuple[RunApart, ...]:
    """The runs that leave more than the others under what was found; none where an effect varies from run to run, or
    readings share their poses."""
    if varies or poses_of_rows(latest.under) is not None:
        return ()
    drifts = [variant for variant in variants if variant.family.endswith("@run_time")]
    return runs_apart(scene_of(latest.under, drifts))


def _steps(campaign: Campaign, latest: ChainRound, rng: np.random.Generator) -> list[Step]:
    """Steps between the runs, where these are in the order of time."""
    runs = sorted(campaign.runs, key=lambda run: run.run)
    started = np.array([run.started_at.timestamp() for run in runs])
    present = np.isin([run.run for run in runs], latest.under.problem.runs)
    order = np.argsort(started[present], kind="stable")
    if not np.array_equal(order, np.arange(len(order))):
        return []
    moved = frozenset(move.target for move in latest.suspects.moves.values())
    return find_steps(latest.under, started[present] / 86400.0, rng, moved)


def _blind(scene: ChainScene, missing: Sequence[ChainMissing]) -> tuple[str, ...]:
    """The effects that this plan would not show at the size that a machine in use may hide."""
    named = {
        name for effect in missing for name in (effect.effect, *(rival.effect for rival in effect.rivals))
    }
    # A constant that leaves nothing is taken up by what is free in every run; ``taken_up`` names what does.
    hidden = [
        candidate.family
        for candidate in scene.candidates
        if not candidate.detectable and not _is_constant(candidate.effect)
    ]
    return tuple(dict.fromkeys(family for family in hidden if family not in named))


def _is_constant(effect: MachineEffect) -> bool:
    return isinstance(effect, ChainEffect) and isinstance(effect.shape, Const) and not effect.driver_text
