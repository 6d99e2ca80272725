"""Ties for which `monitor plan --separate` is named: the plan is asked first, so that both say the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

from monitor.discovery import ChainMissing, Fit, fit
from monitor.discovery.machine.separation.distances import DECIDES
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array, Campaign
from monitor.store import StoredModel
from monitor.workflow.explain.explain_answer import MachineExplanation, MachineMissing
from monitor.workflow.explain.ties import Tie, TieBreak, axes_of
from monitor.workflow.identify.fitting import machine_problem
from monitor.workflow.plan.answer import SeparationVerdict
from monitor.workflow.plan.separate import deviations_apart, separation_of

#: The ties that a plan may break: those of poses, and those whose driver acts at other poses too.
ASKED = (TieBreak.PLAN, TieBreak.INDEXATIONS)
#: More than so many times the runs of the campaign are nobody's next measurement.
MOST_TIMES = 20


def with_plans(
    explanation: MachineExplanation, missing: Sequence[ChainMissing], campaign: Campaign, model: StoredModel
) -> MachineExplanation:
    """The explanation of what is ``missing`` with what the plan says of each tie: poses, runs more of the same plan, or
    that no pose helps."""
    if not any(tie.broken_by in ASKED for effect in explanation.missing for tie in effect.ties):
        return explanation
    problem = machine_problem(campaign, model)
    if not isinstance(problem, TouchProblem):
        return explanation
    plan = PlanOfPairs(fit(problem), campaign)
    return replace(
        explanation,
        missing=tuple(
            plan.of_missing(effect, each.coefficients)
            for effect, each in zip(explanation.missing, missing, strict=True)
        ),
    )


@dataclass(frozen=True)
class PlanOfPairs:
    """The present plan, by the model ``fitted`` to its campaign."""

    fitted: Fit
    campaign: Campaign

    def of_missing(self, effect: MachineMissing, coefficients: Array) -> MachineMissing:
        """A missing effect of these ``coefficients`` with what breaks its ties."""
        ties = (each for tie in effect.ties for each in self.of_tie(effect.effect, coefficients, tie))
        return replace(effect, ties=tuple(ties))

    def of_tie(self, effect: str, coefficients: Array, tie: Tie) -> Iterator[Tie]:
        """A tie, of each rival by itself where a plan may break it: plans are of pairs."""
        if tie.broken_by not in ASKED:
            yield tie
            return
        for rival in tie.rivals:
            alone = replace(tie, rivals=(rival,))
            verdict = separation_of(self.fitted, self.campaign, (effect, rival)).verdict
            if verdict is SeparationVerdict.WITH_POSES:
                yield replace(alone, broken_by=TieBreak.PLAN)
            elif tie.broken_by is TieBreak.INDEXATIONS:
                yield alone
            else:
                # The plan is asked of a usual size and direction; what was found has its own.
                apart = deviations_apart(self.fitted, self.campaign, (effect, rival), coefficients)
                yield (
                    self._with_runs(alone, apart, verdict)
                    if apart > 0.0
                    # What no errors of axes make is in no plan of pairs.
                    else replace(alone, broken_by=TieBreak.MORE_POSES, axes=axes_of(effect, rival))
                )

    def _with_runs(self, tie: Tie, apart: float, verdict: SeparationVerdict) -> Tie:
        """A tie that no poses break, of effects so many standard deviations ``apart``, with the runs that do."""
        present = len(self.fitted.problem.runs)
        times = (DECIDES / apart) ** 2
        runs = max(ceil(present * times) - present, 1) if times <= MOST_TIMES else None
        is_told = verdict is SeparationVerdict.ALREADY and runs is not None
        return replace(tie, broken_by=TieBreak.MORE_RUNS if is_told else TieBreak.NO_POSES, runs=runs)
