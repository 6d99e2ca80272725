"""The contract of the product: every question that can be asked, as a function of a typed request with a typed answer.

The faces (the command line, Python, HTTP and pages) ask nothing else. A question is named by
the place of its function and loaded when it is asked, so that to list the contract loads neither solver nor engine; its
types are the annotations of the function.
"""

from __future__ import annotations

import importlib
import typing
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Question:
    """A question by its ``name``; ``function`` is ``module:name`` below ``monitor.workflow``."""

    name: str
    function: str

    def load(self) -> Callable[..., Any]:
        """Return the function: of a database, a request, or both."""
        module, _, name = self.function.partition(":")
        function: Callable[..., Any] = getattr(importlib.import_module(f"monitor.workflow.{module}"), name)
        return function

    @property
    def request(self) -> Any:
        """The type of the request; None where there is nothing to ask for."""
        return typing.get_type_hints(self.load()).get("request")

    @property
    def answer(self) -> Any:
        """The type of the answer."""
        return typing.get_type_hints(self.load())["return"]

    @property
    def needs_database(self) -> bool:
        """Whether the function takes an open database first."""
        return "db" in typing.get_type_hints(self.load())


#: Every question by its name. A new one is one line here and its function in a folder or file beside this one.
QUESTIONS = {
    name: Question(name, function)
    for name, function in {
        "add effect": "model.change:add_effect",
        "affected by effect": "model.change:affected",
        "amend certificate": "certificate.issue:amend",
        "archive files": "retention:archive",
        "audit": "keeping:audit",
        "backup": "keeping:backup",
        "campaigns": "intake.campaigns:campaigns",
        "certificate template": "certificate.template:write_template",
        "certificates": "certificate.states:list_certificates",
        "compact": "retention:compact_database",
        "compare": "explain.compare:compare",
        "digital certificate": "certificate.digital:write_digital",
        "digital certificate page": "certificate.digital:write_digital_page",
        "effects": "effects:effects",
        "effects of campaign": "effects:campaign_effects",
        "event": "events:event",
        "events": "events:events",
        "explain": "explain.explain:explain",
        "export": "keeping:export",
        "fleet": "fleet.fleet:fleet",
        "identify": "identify.identify:identify",
        "identify all": "identify.every:identify_all",
        "identify stepwise": "identify.stepwise:identify_stepwise",
        "import": "intake.importing:import_folders",
        "contributions": "instruments.instruments:instruments",
        "issue certificate": "certificate.issue:issue",
        "issued certificate": "certificate.states:write_issued",
        "machines": "query:machines",
        "map": "volumetric.volumetric:volumetric_map",
        "model": "model.show:show_model",
        "model history": "explain.versions:history",
        "models": "model.show:list_all_models",
        "map over the stroke": "volumetric.over_stroke:over_stroke",
        "monte carlo cloud": "uncertainty.cloud:cloud",
        "periods": "history.periods:periods",
        "plan": "plan.plan:plan",
        "poses": "kinematics:poses",
        "predict": "predict.predict:predict",
        "publish": "publishing:publish",
        "readings": "query:readings",
        "remake certificate": "certificate.remaking:remake",
        "remove effect": "model.change:remove_effect",
        "report": "health.report:report",
        "residuals": "explain.residual_vectors:residual_vectors",
        "residuals by driver": "explain.residuals_by_driver:residuals_by_driver",
        "restore": "keeping:restore_backup",
        "runs": "intake.campaigns:runs",
        "select": "selections.select:select",
        "selections": "selections.select:selections",
        "selections side by side": "selections.side_by_side:side_by_side",
        "show certificate": "certificate.states:show_certificate",
        "simulate": "simulation:simulate",
        "simulate a machine": "simulation:simulate_machine",
        "simulate like a folder": "likeness:simulate_like",
        "simulate like a campaign": "likeness:simulate_like_stored",
        "sql": "query:sql",
        "standards": "standards.standards:standards",
        "statistics": "run_statistics.statistics:stats",
        "trend": "trend.trends:trend",
        "uncertainty": "uncertainty.evaluation:uncertainty",
        "use model": "model.use:use_model",
        "values": "history.values:values_of_machine",
        "verify": "keeping:verify",
        "verify certificate": "certificate.verification:verify_file",
        "watch": "watching.watch:watch",
        "withdraw campaign": "intake.withdrawals:withdraw",
        "withdraw certificate": "certificate.issue:withdraw",
        "withdraw event": "events:withdraw",
    }.items()
}
