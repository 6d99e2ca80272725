"""What a machine's page lacks, computed without the database, so that any process can do it.

The model is fitted once to the runs that were known by the week's end: identification (where the campaign has no
later runs), uncertainty, explanation and map all rest on that fit, uncertainty and map on one evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from monitor.discovery import Fit, fit
from monitor.documents import to_document
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.records import Campaign
from monitor.store import StoredIdentification, StoredModel
from monitor.workflow.explain.explain import explanation_of
from monitor.workflow.explain.machine_answer import explain_answer
from monitor.workflow.explain.versions import error_steps
from monitor.workflow.identify.machine import identified
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.error_map import map_of
from monitor.workflow.volumetric.stating import map_answer

Document = dict[str, Any]
Result = TypeVar("Result")
METHOD = "guf"


@dataclass(frozen=True)
class Work:
    """What is to be computed for one machine under ``model``.

    ``identify`` are the campaigns with runs that are not identified yet. ``known`` are the runs of the last campaign
    up to the week's end, ``whole`` where it has no later ones; of its ``run`` the uncertainty and the map are wanted,
    of all of them the explanation, and the errors of ``versions`` of the model.
    """

    model: StoredModel
    identify: tuple[Campaign, ...]
    known: Campaign
    whole: bool
    run: int
    uncertainty: bool
    explanation: bool
    map: bool
    versions: tuple[StoredModel, ...]


@dataclass(frozen=True)
class Done:
    """What was computed; None for what was not wanted or could not be, the latter with a remark that says why."""

    identified: tuple[StoredIdentification, ...] = ()
    uncertainty: UncertaintyAnswer | None = None
    explanation: Document | None = None
    map: VolumetricAnswer | None = None
    history: tuple[Document, ...] | None = None
    remarks: tuple[str, ...] = ()


def kept(step: Callable[[], Result], failure: str, remarks: list[str]) -> Result | None:
    """The result of a step, or a remark that says why there is none: one machine does not stop the fleet's report."""
    try:
        return step()
    except MonitorError as error:
        remarks.append(f"{failure}: {error}")
        return None


def computed(work: Work | None) -> Done:
    """Everything that is lacking for a machine; nothing for one that was not measured (None).

    One thread of linear algebra, in whatever process: with several it may round otherwise.
    """
    if work is None:
        return Done()
    with threadpool_limits(1, "blas"):
        return _computed(work, _Fitted(work))


class _Fitted:
    """The model fitted to the known runs, and the evaluation of the run: each made when it is first asked for."""

    def __init__(self, work: Work) -> None:
        self._work = work

    @cached_property
    def fit(self) -> Fit:
        known = self._work.known
        return fit(campaign_method(known).problem_of(known, as_model(self._work.model)))

    @cached_property
    def uncertainty(self) -> UncertaintyAnswer:
        work = self._work
        request = UncertaintyRequest(work.known.name, work.run, method=METHOD)
        return answer_of(evaluate_fit(work.known, work.model, self.fit, request))

    @property
    def evaluated(self) -> StatedUncertainty:
        return StatedUncertainty(self._work.known, self._work.model, self.uncertainty)


def _computed(work: Work, fitted: _Fitted) -> Done:
    remarks: list[str] = []
    runs = []
    for campaign in work.identify:
        same = work.whole and campaign.name == work.known.name
        solve = (lambda problem: fitted.fit.solution) if same else solve_problem
        found = kept(
            lambda one=campaign, solve=solve: identified(one, work.model, solve)[1],  # type: ignore[misc]
            f"campaign {campaign.name} could not be identified",
            remarks,
        )
        if found is not None:
            runs.append(found)
    uncertainty = explanation = mapped = history = None
    if work.uncertainty:
        uncertainty = kept(
            lambda: fitted.uncertainty,
            "the uncertainty of the last run could not be evaluated",
            remarks,
        )
    if work.explanation:
        explanation = kept(
            lambda: to_document(explain_answer(explanation_of(work.known, work.model, fitted.fit))),
            "model and measurement could not be compared",
            remarks,
        )
    # Without an uncertainty there is no map, and its remark says why.
    if work.map and (uncertainty is not None or not work.uncertainty):
        mapped = kept(
            lambda: map_answer(map_of(fitted.evaluated, fitted.fit)),
            "the volumetric error could not be mapped",
            remarks,
        )
    if work.versions:
        history = kept(
            lambda: tuple(to_document(step) for step in error_steps(work.known, work.versions)),
            "the versions of the model could not be compared",
            remarks,
        )
    return Done(tuple(runs), uncertainty, explanation, mapped, history, tuple(remarks))
