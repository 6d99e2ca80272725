"""Which physical effect is missing: the whole way from a fitted model to an honest answer.

Fit, scan, take what was found into the fit, look for bad points and balls that moved under that model, leave
them out and begin again until nothing changes. Then the steps between runs, what varies without a recorded
column, what cannot be told apart, and what the plan is blind for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.anomalies import BadPoint, BallMove
from monitor.discovery.machine.compare import ChainComparison, compare
from monitor.discovery.machine.evidence import p_value_against_runs
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.gears import gear_variants
from monitor.discovery.machine.held_out import held_out_error
from monitor.discovery.machine.missing import ChainMissing, Surroundings, stands_out, tell
from monitor.discovery.machine.mistakes import Mistake
from monitor.discovery.machine.poses import p_value_by_poses, poses_of_rows
from monitor.discovery.machine.refine import refine, refine_all
from monitor.discovery.machine.scan import ScanResult, scan
from monitor.discovery.machine.steps import Step, find_steps
from monitor.discovery.machine.suspects import Suspects, find_suspects, with_effects
from monitor.discovery.machine.tables import with_tables
from monitor.discovery.machine.variants import cycles_of_unknown_pitch, resolvable, variants_of, with_drivers
from monitor.discovery.machine.varying import tell_varying
from monitor.discovery.machine.visible import SMALLEST_SHARE, Candidate, Variant, Visible, see
from monitor.discovery.search.comparison import Verdict
from monitor.effects.catalogue import catalogue, drivers_of
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign

# Suspects and effects are found in turn; a campaign that has not settled after so many rounds is told as it is.
MOST_ROUNDS = 6
# More orders of gears than this are noise that no order explains.
MOST_GEARS = 12


@dataclass(frozen=True)
class Explanation:
    """The answer. ``comparison`` is the model as given, ``missing`` what it lacks, most convincing first.

    ``suspect`` points were left out, ``moves`` and ``steps`` are changes told as such; ``blind`` effects leave
    nothing that this plan can see. Of ``missing`` those marked ``varies`` have another size in every run, and no
    recorded column follows it. Where the file itself looks wrong, ``mistakes`` says how, and nothing else is told.
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


def _surroundings(campaign: Campaign, problem: ChainProblem) -> Surroundings:
    days = {run.run: run.day for run in campaign.runs}
    axes = campaign.machine.axes.items()
    return Surroundings(
        runs=np.arange(len(problem.runs)),
        days=np.array([days[int(run)] for run in problem.runs]),
        drivers=drivers_of(problem.context),
        strokes={name: axis.stroke for name, axis in axes if axis.stroke is not None},
    )


def explain(
    campaign: Campaign,
    problem: ChainProblem,
    model: str,
    *,
    rate: float = 0.01,
    rng: np.random.Generator,
    first: Fit | None = None,
) -> Explanation:
    """What a model lacks. ``rate`` is the false discovery rate of each scan; ``rng`` serves the step search;
    ``first`` is the fit of ``problem`` where it is known.

    Raises DataError where the model cannot be fitted.
    """
    given, problem = problem, problem.for_search()
    # What is known of the problem as given serves only where nothing else is foreseen.
    first = fit(problem) if first is None or problem is not given else first
    surroundings = _surroundings(campaign, problem)
    drivers, runs = surroundings.drivers, surroundings.runs
    pitches = {
        name: axis.scale_pitch for name, axis in campaign.machine.axes.items() if axis.scale_pitch is not None
    }
    known = [effect.text for effect in (*problem.base, *problem.added)]
    effects = catalogue(problem.context.chain, known, drivers, pitches, problem.method_effects(drivers))
    variants = [variant for effect in effects for variant in variants_of(effect)]
    variants += resolvable(cycles_of_unknown_pitch(problem.context.chain), problem.context)
    suspects = Suspects()
    for _ in range(MOST_ROUNDS):
        out, own = suspects.left_out(problem), suspects.effects(problem)
        now = fit(with_effects(problem, own), out, first) if suspects.any else first
        visible, result = _scanned(now, variants, drivers, runs, rate)
        refined = refine_all(now, visible, result)
        chosen = [one.candidate.variant.effect for one in refined]
        under = fit(with_effects(problem, [*own, *chosen]), out, now) if chosen else now
        more = find_suspects(under, problem, chosen, suspects, variants, visible if under is now else None)
        if more.same_as(suspects):
            break
        suspects = more
    missing = tell(now, visible, result, refined, surroundings)
    if suspects.varying:
        steady = fit(with_effects(problem, [*suspects.move_effects(problem), *chosen]), out, first)
        told = tell_varying(steady, suspects.varying, variants, rate, surroundings)
        missing += tuple(replace(one, rank=one.rank + len(missing)) for one in told)
    started = np.array([run.started_at.timestamp() for run in sorted(campaign.runs, key=lambda run: run.run)])
    present = np.isin(sorted(run.run for run in campaign.runs), problem.runs)
    order = np.argsort(started[present], kind="stable")
    steps = (
        find_steps(
            under, started[present] / 86400.0, rng, frozenset(move.target for move in suspects.moves.values())
        )
        if np.array_equal(order, np.arange(len(order)))
        else []
    )
    comparison = compare(first, campaign.name, model)
    # A bad point or a ball that moved is told as that: what counts is the verdict without them.
    verdict = Verdict.SOMETHING_IS_MISSING if missing else compare(under, campaign.name, model).verdict
    named = {name for one in missing for name in (one.effect, *(rival.effect for rival in one.rivals))}
    return Explanation(
        comparison=replace(comparison, verdict=verdict),
        missing=missing,
        suspect=tuple(sorted(suspects.bad.values(), key=lambda point: point.row)),
        moves=tuple(suspects.moves.values()),
        steps=tuple(steps),
        blind=tuple(
            dict.fromkeys(
                one.family for one in visible.candidates if not one.detectable and one.family not in named
            )
        ),
        refused=visible.refused,
        final=under,
    )


def _scanned(
    now: Fit, variants: Sequence[Variant], drivers: Sequence[str], runs: npt.NDArray[np.int64], rate: float
) -> tuple[Visible, ScanResult]:
    """The scan of a fit; where gears stand out of what it leaves, once more with them; at last with tables instead
    of several shapes."""
    gears: list[Variant] = []
    visible = see(now, variants)
    poses = poses_of_rows(now)

    def scanned(visible: Visible) -> ScanResult:
        return scan(
            visible,
            rate=rate,
            more=partial(_driven, now, drivers),
            accept=partial(_stands, now, visible, runs, rate, poses),
            best_value=partial(_at_best, now, visible),
        )

    while True:
        result = scanned(visible)
        known = {one.effect.text for one in gears}
        result = stands_out(visible, result)
        found = gear_variants(now, visible, [one.candidate for one in result.findings], rate)
        new = [one for one in found if one.effect.text not in known]
        if not new or len(gears) > MOST_GEARS:
            visible, result = with_tables(now, visible, result, scanned)
            return visible, stands_out(visible, result)
        gears += new
        visible = replace(visible, candidates=(*visible.candidates, *see(now, new).candidates))


def _driven(now: Fit, drivers: Sequence[str], found: Candidate) -> Sequence[Candidate]:
    """What was found with each driver, or without its own: candidates to compare it with."""
    return see(now, with_drivers(found.variant.effect, drivers)).candidates


def _at_best(now: Fit, visible: Visible, chosen: Sequence[Candidate], place: int) -> Candidate:
    return refine(now, visible, chosen, place).candidate


def _stands(
    now: Fit,
    visible: Visible,
    runs: npt.NDArray[np.int64],
    rate: float,
    pose: npt.NDArray[np.int64] | None,
    others: Sequence[Candidate],
    found: Candidate,
) -> bool:
    """Whether an effect stands out with every pose as one observation and from how its size scatters from run to run,
    and lowers the error on runs that took no part in its fit (blocks of poses where there is one run; true where it
    has few)."""
    families = len({one.family for one in visible.candidates if one.share > SMALLEST_SHARE})
    if pose is not None and p_value_by_poses(found, visible, others, pose) * families > rate:
        return False
    if p_value_against_runs(found, visible, others) * families > rate:
        return False
    before = np.concatenate([visible.added, *(one.columns for one in others)], axis=1)
    after = np.concatenate([before, found.columns], axis=1)
    one = held_out_error(now, visible, before, runs)
    two = held_out_error(now, visible, after, runs)
    return one is None or two is None or two < one
