"""The rounds of a search on a chain: effects and suspects in turn, each under the others, and under the noise of
neighbours that the effects leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache, partial
from typing import TypeAlias

import numpy as np

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit, fit, fit_those_possible
from monitor.discovery.machine.found_again import Found, found_in_other_noise, still_found
from monitor.discovery.machine.joints.robot_search import (
    MOST_EFFECTS as MOST_BESIDE_CURVES,
    search_beside_curves,
)
from monitor.discovery.machine.missing import told_apart
from monitor.discovery.machine.noise.correlation import Correlation, caution, is_next
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, MachineEffect, scene_of
from monitor.discovery.machine.search import first_found, search_chain
from monitor.discovery.machine.shapes.free_parts import price_of_parts
from monitor.discovery.machine.shapes.refine import Refined
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.suspects.suspects import (
    MOST_BAD_POINTS,
    SuspectNames,
    Suspects,
    find_suspects,
    with_effects,
    with_scatter_of,
    with_slip_of,
)
from monitor.discovery.machine.suspects.unknown_sides import unknown_sides
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.rounds import Turns, in_rounds
from monitor.discovery.search.scan import MOST_EFFECTS
from monitor.discovery.search.sign_flips import FEWEST
from monitor.effects import ArtefactEffect, ChainEffect
from monitor.effects.driver import HeatDriver
from monitor.exceptions import NotConvergedError
from monitor.methods.chain.problem import ChainProblem

# Suspects and effects are found in turn; a campaign that has not settled after so many rounds is reported as it is.
MOST_ROUNDS = 4
# How joints come to rest follows from pose to pose by no more than this: effects are counted by poses anyway, and none
# takes that up. Taken out as noise it made the search of 250 such poses three times as long, for the same findings.
OF_ONE_POSE = 0.5


class Limit(StrEnum):
    """What a search has an end of, whatever the data."""

    EFFECTS = "effects"
    BAD_POINTS = "bad_points"
    ROUNDS = "rounds"


@dataclass(frozen=True)
class ChainRound:
    """The findings of a round: ``under`` is the fit with them and the ``suspects``; ``unable`` are those that could not
    be fitted, ``unfitted`` the families of earlier rounds that could not; ``sides`` is what plays do where nobody knows
    on which side they are; ``whole`` says that all was searched, nothing taken from a round under noise that hardly
    differs."""

    scene: ChainScene
    result: ChainScan
    refined: Sequence[Refined]
    suspects: Suspects
    under: Fit
    unable: tuple[str, ...] = ()
    unfitted: tuple[str, ...] = ()
    limits: tuple[Limit, ...] = ()
    sides: tuple[MachineEffect, ...] = ()
    whole: bool = True

    @property
    def effects(self) -> list[MachineEffect]:
        """The effects that were found."""
        return [finding.candidate.effect for finding in self.refined]

    @property
    def correlation(self) -> Correlation | None:
        """The noise of neighbours under which it was searched."""
        noise = self.scene.fit.whitening
        return None if noise is None else noise.correlation

    @property
    def families(self) -> frozenset[str]:
        """What was found, whatever the searched values."""
        return frozenset(finding.candidate.family for finding in self.refined)


@dataclass(frozen=True)
class ChainSearch:
    """What is searched: the ``variants`` that a problem lacks, at a false discovery rate, with the ``drivers`` that the
    recorded columns allow, and the ``gross`` readings that are left out whatever is found."""

    problem: ChainProblem
    variants: Sequence[ChainVariant]
    drivers: Sequence[str]
    rate: float
    gross: Suspects

    def under(self, first: Fit, beside_curves: Suspects | None = None) -> ChainRound:
        """Search until nothing changes, from a fit that leaves the ``gross`` readings out; beside the curves of joints
        one that leaves out the suspects so far."""
        before = _Found()
        latest, settled = self._settled(first, beside_curves, None, before)
        # Of few runs effects may take up noise that walks, or noise an effect, and either stands under its own noise.
        few = beside_curves is None and len(self.problem.runs) <= FEWEST
        by_poses = poses_of_rows(first) is not None
        doubtful = any(not by_poses or _may_be_a_walk(effect) for effect in latest.effects)
        correlation = correlation_under(first, shared=True) if few and doubtful else None
        if correlation is not None:
            other, other_settled = self._settled(first, beside_curves, correlation, before)
            # An error of so many in a hundred goes for this decision too: the odds of effects have to be as good, on
            # whichever side they are.
            margin = 2.0 * float(np.log((1.0 - self.rate) / self.rate))
            if other.families > latest.families:
                margin = -margin
            disagree = other.families != latest.families
            if disagree and self.cost(first, other) < self.cost(first, latest) + margin:
                latest, settled = other, other_settled
        reached = {
            Limit.EFFECTS: len(latest.refined)
            >= (MOST_EFFECTS if beside_curves is None else MOST_BESIDE_CURVES),
            Limit.BAD_POINTS: len(latest.suspects.bad) >= MOST_BAD_POINTS,
            Limit.ROUNDS: not settled,
        }
        return replace(latest, limits=tuple(limit for limit, is_reached in reached.items() if is_reached))

    def _settled(
        self, first: Fit, beside_curves: Suspects | None, correlation: Correlation | None, before: _Found
    ) -> tuple[ChainRound, bool]:
        """What stands in the end, and whether it settled: from noise of so correlated neighbours on, to which belongs
        what runs share as long as no effect explains it, or from white noise and what runs do not share."""
        rounds = _Rounds(self, first, beside_curves, correlation, before)
        latest, settled = in_rounds(rounds, MOST_ROUNDS)
        if not settled:
            latest = replace(latest, suspects=rounds.suspects, unfitted=(*rounds.unfitted,))
        return latest, settled

    def cost(self, first: Fit, latest: ChainRound) -> float:
        """Minus twice the logarithm of the likelihood of what was found in what the unknowns of ``first`` leave, with
        Schwarz's price of what it has free beyond that, and that of each choice among all families, values and parts.

        A reading that is left out is one with an offset of its own.
        """
        under = latest.under
        correlation = None if under.whitening is None else under.whitening.correlation
        design = first.noise_design_under(correlation, whole=True)
        rest = without(orthonormal(under.nuisance.shared), under.white.reshape(-1, 1))
        free = first.degrees_of_freedom - under.degrees_of_freedom + 2 * (correlation is not None)
        families = len({variant.family for variant in self.variants})
        candidates = [finding.candidate for finding in latest.refined]
        tries = [families * each.variant.tries * each.variant.odds for each in candidates]
        price = free * np.log(design.contrasts) + 2.0 * np.sum(np.log(tries))
        # Readings of a target that scatters are counted by less: in its own unit each is as likely.
        weighted = under.has_weight
        units = 2.0 * np.sum(np.log(under.problem.sigma[weighted] / first.problem.sigma[weighted]))
        deviance = design.deviance(float(np.sum(rest**2)), correlation)
        return deviance + float(price + units) + sum(map(price_of_parts, candidates))


NoiseTurns: TypeAlias = Turns[Correlation | None, ChainRound]


@dataclass
class _Found:
    """What searches of one problem, from white noise and from that of neighbours, need to find out but once: the
    ``rounds`` under the same conditions, and the ``suspects`` beside the same effects in the same noise."""

    rounds: dict[tuple[object, ...], ChainRound] = field(default_factory=dict)
    suspects: dict[tuple[object, ...], Suspects] = field(default_factory=dict)
    sides: tuple[MachineEffect, ...] = ()


class _Rounds:
    """The rounds of a search on a chain, and the conditions of the present one: suspects, the correlation of neighbours
    and the families that cannot be fitted."""

    def __init__(
        self,
        search: ChainSearch,
        first: Fit,
        beside_curves: Suspects | None,
        correlation: Correlation | None,
        before: _Found,
    ) -> None:
        self.search = search
        self.before = before
        self.first = first
        self.beside_curves = beside_curves is not None
        self.most_effects = MOST_BESIDE_CURVES if self.beside_curves else MOST_EFFECTS
        self.initial = search.gross if beside_curves is None else beside_curves
        # A ball that shakes hides effects and makes others; runs that do not share it show it before any is known.
        self.suspects = self.initial if self.beside_curves else self._with_scatter()
        if self.suspects.same_as(self.initial) and not self.beside_curves:
            self.suspects = with_slip_of(first, search.problem, self.initial, search.variants)
        self.correlation = correlation
        self.shared = correlation is not None
        self.unfitted: dict[str, None] = {}
        self.sides: tuple[MachineEffect, ...] = before.sides
        self._noises: NoiseTurns = Turns()
        self._earlier: Turns[SuspectNames, ChainRound] = Turns()

    def _with_scatter(self) -> Suspects:
        return with_scatter_of(self.first, self.search.problem, self.initial)

    def round(self) -> ChainRound:
        """The effects under the present suspects and correlation, and the fit with those that can be fitted."""
        conditions = self._conditions
        if conditions not in self.before.rounds:
            searched = self._round(self._near())
            if self._with_new_sides(searched.scene, [finding.candidate for finding in searched.refined]):
                searched = self._round(searched if searched.whole and self._is_able(searched) else None)
            # What effects beside each other leave was of this search: a scene without it is a fifth as large.
            searched = replace(searched, scene=replace(searched.scene))
            self.before.rounds |= dict.fromkeys((conditions, self._conditions), searched)
        self.sides = self.before.rounds[conditions].sides
        return replace(self.before.rounds[conditions], suspects=self.suspects)

    @property
    def _conditions(self) -> tuple[object, ...]:
        """What a search depends on."""
        return self.suspects.conditions, self.correlation, self.sides, *self.unfitted

    def _with_new_sides(self, scene: ChainScene, selected: Sequence[ChainCandidate]) -> bool:
        """Take for unknowns of the runs what plays of selected effects do where nobody knows on which side they are, of
        errors of which it is none yet; return whether there is any."""
        if self.beside_curves:
            return False
        errors = {side.term for side in self.sides if isinstance(side, ChainEffect)}
        sides = unknown_sides(scene, selected, self.search.rate)
        new = tuple(side for side in sides if side.term not in errors)
        if not new:
            return False
        try:
            self._current((*self.sides, *new))
        except NotConvergedError:
            # What a plan hardly tells from the other unknowns of the runs may have no solution.
            return False
        self.sides = self.before.sides = (*self.sides, *new)
        return True

    def _current(self, sides: Sequence[MachineEffect]) -> Fit:
        """The fit under the present suspects with what plays do where their side is not known."""
        problem, suspects = self.search.problem, self.suspects
        if not sides and suspects.same_as(self.initial):
            return self.first
        single = [*suspects.effects(problem), *sides]
        return fit(with_effects(suspects.weighed(problem), single), suspects.left_out(problem), self.first)

    def _near(self) -> ChainRound | None:
        """What a whole search found under the same conditions but for noise that hardly differs; None where there was
        none."""
        for earlier in self._earlier_rounds():
            same = earlier.suspects.conditions == self.suspects.conditions
            if same and earlier.whole and is_next(earlier.correlation, self.correlation):
                return earlier
        return None

    def _earlier_rounds(self) -> list[ChainRound]:
        """The rounds under the same conditions but for the noise and single readings that are left out, of which all
        that was found could be fitted; those that left out the same readings last."""
        _, *others = self.suspects.conditions
        alike = [
            earlier
            for earlier in self.before.rounds.values()
            if [*earlier.suspects.conditions[1:], earlier.sides, earlier.unfitted]
            == [*others, self.sides, (*self.unfitted,)]
            and self._is_able(earlier)
        ]
        return sorted(alike, key=lambda earlier: earlier.suspects.conditions == self.suspects.conditions)

    def _is_able(self, earlier: ChainRound) -> bool:
        """Whether all that was found in a round could be fitted."""
        return not earlier.unable and not self.beside_curves

    def _round(self, near: ChainRound | None) -> ChainRound:
        """Search effects under the present conditions; what was found under ``near`` ones is what is found, where a
        scan that begins with it neither adds to it nor takes from it."""
        suspects, out = self.suspects, self.suspects.left_out(self.search.problem)
        again = None if near is None else self._again(self._noisy(), near)
        (scene, result), whole = self._scan() if again is None else (again, False)
        result, refined = told_apart(scene, result)
        effects = [finding.candidate.effect for finding in refined]
        under, without = fit_those_possible(scene.fit.problem, effects, out, scene.fit)
        unable = tuple(finding.candidate.family for finding in refined if finding.candidate.effect in without)
        return ChainRound(
            scene,
            result,
            refined,
            suspects,
            under,
            unable,
            (*self.unfitted,),
            sides=self.sides,
            whole=whole,
        )

    def judged(self, current: ChainRound) -> ChainRound | None:
        """Judge what cannot be fitted, the noise of neighbours and, once these have settled, the suspects."""
        if current.unable:
            self.unfitted |= dict.fromkeys(current.unable)
            return None
        # What all runs share and what the effects explain is no noise of neighbours.
        following = correlation_under(current.under, self.shared)
        circle = self._noises.circle(self.correlation, current, following)
        if not circle:
            self.correlation = following
            return None
        self.correlation, standing = most_cautious(circle)
        more = self._suspects_anew(standing, current.scene.fit)
        if self.beside_curves:
            # The curves are pursued anew first: bad poses hide lines.
            return replace(standing, suspects=more)
        # Suspects that had their turn come again in a circle: what was found under the last ones stands.
        if self._earlier.circle(self.suspects.names, standing, more.names):
            # The same ones: how far off they are is what they are beside the effects that stand.
            return replace(standing, suspects=more) if more.same_as(standing.suspects) else standing
        self.suspects = more
        self._noises = Turns()
        return None

    def _noisy(self) -> Fit:
        """The fit under the present conditions."""
        return self._current(self.sides).with_correlation(self.correlation)

    def _scan(self) -> tuple[Found, bool]:
        """Search effects, beside the curves of joints or those of the whole catalogue; return what was found, and
        whether all was searched, nothing taken from an earlier round."""
        drivers, rate = self.search.drivers, self.search.rate
        if self.beside_curves:
            return Found(*search_beside_curves(self._noisy(), self._able, rate)), True
        scene = scene_of(self._noisy(), self._able)
        first = cache(partial(first_found, scene, drivers, rate))
        if earlier := self._earlier_rounds():
            latest = Found(earlier[-1].scene, earlier[-1].result)
            again = found_in_other_noise(scene, first, latest, drivers, rate)
            if again is not None:
                return again, False
        # Sides that the first scan shows are not to be asked for after a whole search.
        if self._with_new_sides(scene, first().candidates):
            return search_chain(scene_of(self._noisy(), self._able), drivers, rate), True
        return search_chain(scene, drivers, rate, first()), True

    def _again(self, under: Fit, near: ChainRound) -> Found | None:
        """The findings of a near round under a fit with a scene of all that was searched there; None where they are not
        what a scan that begins with them finds."""
        scene = scene_of(under, [each.variant for each in near.scene.candidates])
        result = still_found(scene, Found(near.scene, near.result), self.search.drivers, self.search.rate)
        return None if result is None else Found(scene, result)

    @property
    def _able(self) -> list[ChainVariant]:
        """The variants of which nothing speaks against a fit."""
        return [variant for variant in self.search.variants if variant.family not in self.unfitted]

    def _suspects_anew(self, standing: ChainRound, start: Fit) -> Suspects:
        """Judge the readings under the effects of a round, again from the ``gross`` ones where others were left out:
        what looked bad without the effects may be good."""
        problem, gross, begin = (
            with_effects(self.search.problem, standing.sides),
            self.search.gross,
            standing.under,
        )
        left_out = self.suspects.conditions if self.beside_curves else ()
        noise = None if start.whitening is None else start.whitening.correlation
        beside = tuple(standing.effects), standing.sides, noise, *self.unfitted, *left_out
        if beside in self.before.suspects:
            return self.before.suspects[beside]
        if not self.beside_curves and not self.suspects.same_as(gross):
            begin, _ = fit_those_possible(problem, standing.effects, gross.left_out(problem), start)
        same_scene = standing.scene if begin is standing.scene.fit else None
        suspects = find_suspects(begin, problem, standing.effects, gross, self._able, same_scene)
        return self.before.suspects.setdefault(beside, suspects)


def _may_be_a_walk(effect: MachineEffect) -> bool:
    """Whether an effect follows the time, or is of the tracker: where effects are counted by poses, no other can take
    up noise that walks from one to the next."""
    return isinstance(effect, ArtefactEffect) or isinstance(effect.driver, HeatDriver)


def most_cautious(
    circle: Sequence[tuple[Correlation | None, ChainRound]],
) -> tuple[Correlation | None, ChainRound]:
    """The turn of the most cautious correlation: effects that are found under one may leave another, and so on in a
    circle."""
    return max(circle, key=lambda turn: caution(turn[0]))


def correlation_under(under: Fit, shared: bool = False) -> Correlation | None:
    """The correlation of neighbours under a model, of what runs do not share or of all of it; None where readings share
    their poses and hardly more than these."""
    design = under.whole_noise_design if shared else under.noise_design
    correlation = design.correlation(under.solution.last.residual)
    if correlation is not None and correlation.rho <= OF_ONE_POSE and poses_of_rows(under) is not None:
        return None
    return correlation
