"""The physical effects that are missing: the whole way from a fitted model to an answer.

Fit, scan, add the findings to the model, look for bad points and balls that moved under that model, leave them out and
begin again until nothing changes. Then the steps between runs, what varies without a recorded column, what cannot be
separated, and the effects to which the plan is blind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from monitor.discovery.machine.acceptance import ChainAcceptance
from monitor.discovery.machine.anomalies import BadPoint, BallMove
from monitor.discovery.machine.compare import ChainComparison, compare
from monitor.discovery.machine.correlation import Correlation, caution
from monitor.discovery.machine.cures import Mistake
from monitor.discovery.machine.curve_findings import with_curves
from monitor.discovery.machine.fit import Fit, fit, fit_those_possible
from monitor.discovery.machine.joint_curves import joint_curves
from monitor.discovery.machine.missing import ChainMissing, missing_effects
from monitor.discovery.machine.poses import poses_of_rows
from monitor.discovery.machine.refine import Refined, refine_all
from monitor.discovery.machine.robot_search import MOST_EFFECTS as MOST_BESIDE_CURVES
from monitor.discovery.machine.robot_search import search_beside_curves
from monitor.discovery.machine.scene import ChainScene, ChainVariant, MachineEffect, scene_of
from monitor.discovery.machine.search import search_chain
from monitor.discovery.machine.steps import Step, find_steps
from monitor.discovery.machine.surroundings import Surroundings, surroundings_of
from monitor.discovery.machine.suspects import MOST_BAD_POINTS, Suspects, find_suspects, with_effects
from monitor.discovery.machine.tables import ChainScan
from monitor.discovery.machine.variants import (
    cycles_of_unknown_pitch,
    resolvable,
    that_lag,
    variants_of,
    without_part_periods,
)
from monitor.discovery.machine.varying import varying_effects
from monitor.discovery.search.scan import MOST_EFFECTS
from monitor.effects.catalogue import catalogue
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign, Verdict

# Suspects and effects are found in turn; a campaign that has not settled after so many rounds is reported as it is.
MOST_ROUNDS = 4
# Lines of joint curves that bad poses hid show once these are out; what they show again hides no more.
MOST_CURVES = 4


class Limit(StrEnum):
    """What a search has an end of, whatever the data."""

    EFFECTS = "effects"
    BAD_POINTS = "bad_points"
    ROUNDS = "rounds"


@dataclass(frozen=True)
class Explanation:
    """The answer. ``comparison`` is the model as given, ``missing`` what it lacks, most convincing first.

    ``suspect`` points were left out, ``moves`` and ``steps`` are changes reported as such; ``blind`` effects leave
    nothing that this plan can see. Of ``missing`` those marked ``varies`` have another size in every run, and no
    recorded column follows it. ``unfitted`` stood out but could not be fitted, and were skipped. Where the file itself
    looks wrong, ``mistakes`` says how, and nothing else is reported.
    ``limits`` says at which ends of the search more may be there.
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


@dataclass(frozen=True)
class _Search:
    """The findings of the last round: ``under`` is the fit with them and the ``suspects``."""

    scene: ChainScene
    result: ChainScan
    refined: Sequence[Refined]
    suspects: Suspects
    under: Fit
    unfitted: tuple[str, ...] = ()
    settled: bool = True
    most_effects: int = MOST_EFFECTS

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The ends that the search came to."""
        reached = {
            Limit.EFFECTS: len(self.refined) >= self.most_effects,
            Limit.BAD_POINTS: len(self.suspects.bad) >= MOST_BAD_POINTS,
            Limit.ROUNDS: not self.settled,
        }
        return tuple(limit for limit, is_reached in reached.items() if is_reached)

    @property
    def effects(self) -> list[MachineEffect]:
        """The effects that were found."""
        return [finding.candidate.effect for finding in self.refined]


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
    variants += that_lag([variant.effect for variant in variants], problem.context)
    if problem.needs_whole_periods:
        variants = without_part_periods(variants, problem.context)
    return [*variants, *resolvable(cycles_of_unknown_pitch(chain), problem.context)]


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
    curves, search = _search_with_curves(first, foreseen, variants, surroundings.drivers, rate, certain)
    suspects = search.suspects
    missing = _missing(first, foreseen, curves, search, surroundings, certain, rate)
    if suspects.varying:
        effects = [*suspects.move_effects(foreseen), *search.effects]
        steady, _ = fit_those_possible(foreseen, effects, search.under.left_out, first)
        steady = steady.with_correlation(_correlation(search.under))
        varying = varying_effects(steady, suspects.varying, variants, rate, surroundings)
        missing += tuple(replace(effect, rank=effect.rank + len(missing)) for effect in varying)
    # A bad point or a ball that moved is reported as that: what counts is the verdict without them.
    verdict = Verdict.SOMETHING_IS_MISSING
    if not missing:
        verdict = compare(search.under, campaign.name, model).verdict
    return Explanation(
        comparison=replace(compare(first, campaign.name, model), verdict=verdict),
        missing=missing,
        suspect=tuple(sorted(suspects.bad.values(), key=lambda point: point.row)),
        moves=tuple(suspects.moves.values()),
        steps=tuple(_steps(campaign, search, rng)),
        blind=_blind(search.scene, missing),
        refused=search.scene.refused,
        final=search.under,
        unfitted=search.unfitted,
        limits=search.limits,
    )


def _missing(
    first: Fit,
    problem: ChainProblem,
    curves: Sequence[ChainVariant],
    search: _Search,
    surroundings: Surroundings,
    certain: Suspects,
    rate: float,
) -> tuple[ChainMissing, ...]:
    """What is reported as missing: the effects of a search, the curves of joints before them."""
    if curves:
        suspects = search.suspects
        base = first if suspects.same_as(certain) else fit(problem, suspects.left_out(problem), first)
        return missing_effects(
            *with_curves(base, curves, search.scene, search.result, search.refined), surroundings
        )
    missing = missing_effects(search.scene, search.result, search.refined, surroundings)
    if missing:
        rules = ChainAcceptance(search.scene, surroundings.drivers, rate)
        within = rules.within_shapes([finding.candidate for finding in search.refined])
        missing = tuple(
            replace(effect, within_its_shape=names) for effect, names in zip(missing, within, strict=True)
        )
    return missing


def _search_with_curves(
    first: Fit,
    problem: ChainProblem,
    variants: Sequence[ChainVariant],
    drivers: Sequence[str],
    rate: float,
    gross: Suspects,
) -> tuple[tuple[ChainVariant, ...], _Search]:
    """The curves of joints with several lines, and the search under them; once more without the bad poses that it
    named, as long as these hide lines."""
    curves = joint_curves(first, variants, rate)
    if not curves:
        return (), _search(first, problem, variants, drivers, rate, gross)
    suspects = gross
    for _ in range(MOST_CURVES):
        under_curves = with_effects(problem, [curve.effect for curve in curves])
        begin = fit(under_curves, suspects.left_out(problem), first)
        search = _search(begin, under_curves, variants, drivers, rate, gross, suspects)
        if search.suspects.same_as(suspects):
            break
        suspects = search.suspects
        clean = fit(problem, suspects.left_out(problem), first)
        curves = joint_curves(clean, variants, rate) or curves
    return curves, search


def _search(
    first: Fit,
    problem: ChainProblem,
    variants: Sequence[ChainVariant],
    drivers: Sequence[str],
    rate: float,
    gross: Suspects,
    beside_curves: Suspects | None = None,
) -> _Search:
    """Search effects and suspects in turn, each under the others and the ``gross`` readings that ``first`` leaves out,
    until nothing changes; beside the curves of joints it leaves out the suspects so far."""
    initial = suspects = gross if beside_curves is None else beside_curves
    most = MOST_EFFECTS if beside_curves is None else MOST_BESIDE_CURVES
    noise = _Noise()
    earlier: list[Suspects] = []
    unfitted: list[str] = []
    for _ in range(MOST_ROUNDS):
        out, single = suspects.left_out(problem), suspects.effects(problem)
        current = first if suspects.same_as(initial) else fit(with_effects(problem, single), out, first)
        current = current.with_correlation(noise.correlation)
        able = [variant for variant in variants if variant.family not in unfitted]
        scene, result = _scan(current, able, drivers, rate, beside_curves)
        refined = refine_all(scene, result.candidates)
        under, unable = fit_those_possible(
            current.problem, [finding.candidate.effect for finding in refined], out, current
        )
        if unable:
            unfitted += [
                finding.candidate.family for finding in refined if finding.candidate.effect in unable
            ]
            continue
        # What all runs share and what the effects explain is no noise of neighbours.
        search = noise.settled(
            _correlation(under),
            _Search(
                scene, result, refined, suspects, under, tuple(dict.fromkeys(unfitted)), most_effects=most
            ),
        )
        if search is None:
            continue
        # Readings are judged under the present effects, again from the start: what looked bad without them may be good.
        again = beside_curves is None and not suspects.same_as(gross)
        more = _suspects_anew(search, problem, gross, able, current if again else None)
        if beside_curves is not None:
            # The curves are pursued anew first: bad poses hide lines.
            return replace(search, suspects=more)
        earlier.append(suspects)
        # Suspects that had their turn come again in a circle: what was found under the last ones stands.
        if any(more.same_as(before) for before in earlier):
            return search
        suspects = more
        noise = _Noise(noise.correlation)
    return _Search(scene, result, refined, suspects, under, tuple(dict.fromkeys(unfitted)), settled=False)


def _suspects_anew(
    search: _Search, problem: ChainProblem, gross: Suspects, able: Sequence[ChainVariant], start: Fit | None
) -> Suspects:
    """Judge the readings under the effects of a search, fitted from ``start`` to all but the ``gross`` ones where it is
    given."""
    begin = search.under
    if start is not None:
        begin, _ = fit_those_possible(problem, search.effects, gross.left_out(problem), start)
    same_scene = search.scene if begin is search.scene.fit else None
    return find_suspects(begin, problem, search.effects, gross, able, same_scene)


def _scan(
    under: Fit,
    able: Sequence[ChainVariant],
    drivers: Sequence[str],
    rate: float,
    beside_curves: Suspects | None,
) -> tuple[ChainScene, ChainScan]:
    """Search effects under a fit: beside the curves of joints, or those of the whole catalogue."""
    if beside_curves is not None:
        return search_beside_curves(under, able, rate)
    return search_chain(scene_of(under, able), drivers, rate)


class _Noise:
    """The correlation of neighbours under which effects are searched, from round to round.

    Effects that are found under one correlation may leave another, and so on in a circle: then the most cautious of
    them counts.
    """

    def __init__(self, correlation: Correlation | None = None) -> None:
        self.correlation = correlation
        self._searches: dict[Correlation | None, _Search] = {}

    def settled(self, following: Correlation | None, search: _Search) -> _Search | None:
        """The search that counts, where the one under the present correlation leaves this or one that had its turn;
        None where the ``following`` correlation has its turn."""
        self._searches[self.correlation] = search
        if following != self.correlation and following not in self._searches:
            self.correlation = following
            return None
        turns = list(self._searches)
        self.correlation = max(turns[turns.index(following) :], key=caution)
        return self._searches[self.correlation]


def _correlation(under: Fit) -> Correlation | None:
    """The correlation of neighbours under a model; None where readings share their poses and are counted by these."""
    return under.correlation() if poses_of_rows(under) is None else None


def _steps(campaign: Campaign, search: _Search, rng: np.random.Generator) -> list[Step]:
    """Steps between the runs, where these are in the order of time."""
    runs = sorted(campaign.runs, key=lambda run: run.run)
    started = np.array([run.started_at.timestamp() for run in runs])
    present = np.isin([run.run for run in runs], search.under.problem.runs)
    order = np.argsort(started[present], kind="stable")
    if not np.array_equal(order, np.arange(len(order))):
        return []
    moved = frozenset(move.target for move in search.suspects.moves.values())
    return find_steps(search.under, started[present] / 86400.0, rng, moved)


def _blind(scene: ChainScene, missing: Sequence[ChainMissing]) -> tuple[str, ...]:
    """The effects that this plan would not show at the size that a machine in use may hide."""
    named = {
        name for effect in missing for name in (effect.effect, *(rival.effect for rival in effect.rivals))
    }
    hidden = [candidate.family for candidate in scene.candidates if not candidate.detectable]
    return tuple(dict.fromkeys(family for family in hidden if family not in named))
