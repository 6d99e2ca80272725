"""What a certificate's results come from: the evaluation of each certified run, and what it was computed with."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from monitor import __version__
from monitor.records import Campaign, LinearAxes
from monitor.reporting.pdf.layout_engine import engine_versions
from monitor.store import Database, StoredModel
from monitor.workflow.certificate.files import font_hashes
from monitor.workflow.certificate.orders import Measured
from monitor.workflow.certificate.results import StoredMonteCarlo, stored_monte_carlo
from monitor.workflow.models import label
from monitor.workflow.uncertainty.evaluations import Evaluation, evaluation_of, stored_evaluation

Document = dict[str, Any]


@dataclass(frozen=True)
class Part:
    """A certified run: which state of the machine, its evaluation, the Monte Carlo result stored of it."""

    measured: Measured
    found: Evaluation
    monte_carlo: StoredMonteCarlo | None


def part_of(
    db: Database, campaign: Campaign, model: StoredModel, measured: Measured, linear_axes: LinearAxes | None
) -> Part:
    """The run's stored evaluation where there is one, else a new one, with the Monte Carlo result stored of it."""
    found = stored_evaluation(db, campaign, measured.run, model, linear_axes)
    if found is None:
        found = _evaluated(db, campaign, model, measured.run, linear_axes)
    return Part(measured, found, stored_monte_carlo(db, found))


def _evaluated(
    db: Database, campaign: Campaign, model: StoredModel, run: int, linear_axes: LinearAxes | None
) -> Evaluation:
    """The evaluation of a run that has none in the database."""
    # Solver and compiler take a second to load, for which a stored result need not wait.
    from monitor.workflow.uncertainty.documents import statement
    from monitor.workflow.uncertainty.evaluation import evaluate

    done = evaluate(
        db, campaign.name, run, model=f"{model.name}@{model.version}", method="guf", linear_axes=linear_axes
    )
    return evaluation_of(statement(done), campaign, model)


def inputs_of(parts: Sequence[Part], linear_axes: LinearAxes | None, fonts: Sequence[Path]) -> Document:
    """What the results were computed from: kept with the certificate and inside its PDF."""
    first = parts[0]
    inputs = {
        "campaign": first.found.campaign.name,
        **_own(first),
        "files": [{"name": file.name, "sha256": file.sha256} for file in first.found.campaign.files],
        "model": label(first.found.model),
        "model_effects": list(first.found.model.effects),
        "software": f"machine-health-monitor {__version__}",
        "page_made_by": engine_versions(),
        "fonts": font_hashes(fonts),
        "states": [one.measured.state for one in parts],
    }
    if len(parts) > 1:
        inputs["as_left"] = _own(parts[1])
    if linear_axes is not None:
        inputs["linear_axes_mm"] = dataclasses.asdict(linear_axes)
    return inputs


def _own(part: Part) -> Document:
    """What belongs to one run alone."""
    monte_carlo = part.monte_carlo
    return {
        "run": part.measured.run,
        # The GUM framework draws no random numbers; the Monte Carlo that it was compared with does.
        "seed": None if monte_carlo is None else monte_carlo.seed,
        # Numbers in v_analyses; None for an evaluation that was made for the certificate.
        "stored_result": part.found.number,
        "stored_monte_carlo": None if monte_carlo is None else monte_carlo.number,
    }
