"""What a machine's page lacks, computed without the database, so that any process can do it.

The model is fitted once to the runs that were measured by the week's end: identification (where the campaign has no
later runs), uncertainty, explanation and map all rest on that fit, uncertainty and map on one evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

from threadpoolctl import threadpool_limits

from monitor.discovery import Fit, RobustFit, fit
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.records import Campaign
from monitor.reporting.health.sentences import Step, StepFailed
from monitor.store import StoredIdentification, StoredModel
from monitor.workflow.explain.explain import explained, explanation_of, first_fit
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.version_answer import HistoryAnswer
from monitor.workflow.explain.versions import error_steps
from monitor.workflow.identify.machine import identified
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.file_grounds import late_grounds, nominal_grounds
from monitor.workflow.uncertainty.grounds import grounds_of
from monitor.workflow.uncertainty.lack_in_budget import lack_in_budget
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.error_map import map_of
from monitor.workflow.volumetric.stating import map_answer

Result = TypeVar("Result")
METHOD = "guf"


@dataclass(frozen=True)
class Task:
    """What is to be computed for one machine under ``model``.

    ``identify`` are the campaigns with runs that are not identified yet. ``past`` are the runs of the last campaign
    up to the week's end, ``whole`` where it has no later ones; of its ``run`` the uncertainty and the map are asked,
    of all of them the explanation, and the errors of ``versions`` of the model.
    """

    model: StoredModel
    identify: tuple[Campaign, ...]
    past: Campaign
    whole: bool
    run: int
    uncertainty: bool
    explanation: bool
    map: bool
    versions: tuple[StoredModel, ...]


@dataclass(frozen=True)
class TaskResult:
    """What was computed; None for what was not asked or could not be, the latter with a remark that says why."""

    identified: tuple[StoredIdentification, ...] = ()
    uncertainty: UncertaintyAnswer | None = None
    explanation: MachineExplanation | None = None
    map: VolumetricAnswer | None = None
    versions: HistoryAnswer | None = None
    remarks: tuple[StepFailed, ...] = ()


def attempted(
    step: Callable[[], Result], part: Step, remarks: list[StepFailed], campaign: str = ""
) -> Result | None:
    """The result of a step, or a remark that says why there is none: one machine does not stop the fleet's report."""
    try:
        return step()
    except MonitorError as error:
        remarks.append(StepFailed(part, str(error), campaign))
        return None


def computed(task: Task | None) -> TaskResult:
    """Everything that is lacking for a machine; nothing for one that was not measured (None).

    One thread of linear algebra, in whatever process: with several it may round otherwise.
    """
    if task is None:
        return TaskResult()
    with threadpool_limits(1, "blas"):
        return _computed(task, _Fitted(task))


class _Fitted:
    """The model fitted to the past runs, and the evaluation of the run: each made when it is first asked for."""

    def __init__(self, task: Task) -> None:
        self._task = task

    @cached_property
    def robust(self) -> RobustFit:
        return first_fit(self._task.past, self._task.model)

    @cached_property
    def fit(self) -> Fit:
        """The fit of all readings: what is identified and stated leaves none out."""
        if not self.robust.gross:
            return self.robust.fit
        past = self._task.past
        return fit(campaign_method(past).problem_of(past, as_model(self._task.model)))

    @cached_property
    def uncertainty(self) -> UncertaintyAnswer:
        task = self._task
        request = UncertaintyRequest(task.past.name, task.run, method=METHOD)
        answer = answer_of(evaluate_fit(task.past, task.model, self.fit, request))
        # What was measured later may speak against a certificate, too.
        if not task.whole:
            return answer
        of_file = (*nominal_grounds(task.past), *late_grounds(task.past, task.model, self.robust.fit))
        grounds = (*of_file, *grounds_of(task.past, self.robust, task.run), *lack_in_budget(answer))
        return replace(answer, grounds=grounds)

    @property
    def evaluated(self) -> StatedUncertainty:
        return StatedUncertainty(self._task.past, self._task.model, self.uncertainty)


def _computed(task: Task, fitted: _Fitted) -> TaskResult:
    remarks: list[StepFailed] = []
    runs = []
    for campaign in task.identify:
        same = task.whole and campaign.name == task.past.name
        solve = (lambda problem: fitted.fit.solution) if same else solve_problem
        identification = attempted(
            lambda campaign=campaign, solve=solve: identified(campaign, task.model, solve)[1],  # type: ignore[misc]
            Step.IDENTIFICATION,
            remarks,
            campaign.name,
        )
        if identification is not None:
            runs.append(identification)
    uncertainty = explanation = mapped = versions = None
    if task.uncertainty:
        uncertainty = attempted(lambda: fitted.uncertainty, Step.UNCERTAINTY, remarks)
    if task.explanation:
        explanation = attempted(
            lambda: explained(explanation_of(task.past, task.model, fitted.robust), task.past, task.model),
            Step.COMPARISON,
            remarks,
        )
    # Without an uncertainty there is no map, and its remark says why.
    if task.map and (uncertainty is not None or not task.uncertainty):
        mapped = attempted(
            lambda: map_answer(map_of(fitted.evaluated, fitted.fit)),
            Step.MAP,
            remarks,
        )
    if task.versions:
        versions = attempted(
            lambda: HistoryAnswer(error_steps(task.past, task.versions)),
            Step.VERSIONS,
            remarks,
        )
    return TaskResult(tuple(runs), uncertainty, explanation, mapped, versions, tuple(remarks))
