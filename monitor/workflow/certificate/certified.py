"""The certified runs: the evaluation of each, stored or new, and what they were computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from monitor import __version__
from monitor.exceptions import DataError
from monitor.records import Campaign
from monitor.reporting.budget import HoldsFor
from monitor.reporting.pdf.beside import engine_versions
from monitor.store import Database, StoredModel
from monitor.workflow.certificate.files import HashedFile, font_hashes
from monitor.workflow.certificate.inputs import CertificateInputs, RunInputs
from monitor.workflow.certificate.orders import Measured
from monitor.workflow.certificate.results import (
    StoredMonteCarlo,
    bounds_a_region,
    no_region,
    stored_monte_carlo,
)
from monitor.workflow.models import label
from monitor.workflow.uncertainty.request import Asked, UncertaintyRequest
from monitor.workflow.uncertainty.stored import StatedUncertainty


@dataclass(frozen=True)
class CertifiedRun:
    """A certified run: which state of the machine, its evaluation, the Monte Carlo result stored of it."""

    measured: Measured
    evaluated: StatedUncertainty
    monte_carlo: StoredMonteCarlo | None

    @property
    def inputs(self) -> RunInputs:
        """What belongs to this run alone."""
        return RunInputs(
            run=self.measured.run,
            seed=None if self.monte_carlo is None else self.monte_carlo.seed,
            stored_result=self.evaluated.number,
            stored_monte_carlo=None if self.monte_carlo is None else self.monte_carlo.number,
        )


def certified_run(
    db: Database,
    campaign: Campaign,
    model: StoredModel,
    measured: Measured,
    asked: Asked,
    stored: StatedUncertainty | None,
) -> CertifiedRun:
    """Return a run with its ``stored`` evaluation, else a new one, and the Monte Carlo result stored of it."""
    evaluated = stored or _evaluated(db, campaign, model, measured.run, asked)
    return CertifiedRun(measured, evaluated, stored_monte_carlo(db, evaluated))


def _evaluated(
    db: Database, campaign: Campaign, model: StoredModel, run: int, asked: Asked
) -> StatedUncertainty:
    """The evaluation of a run that has none in the database."""
    # Solver and compiler take a second to load, for which a stored result need not wait.
    from monitor.workflow.uncertainty.evaluation import evaluate
    from monitor.workflow.uncertainty.stating import statement

    version = f"{model.name}@{model.version}"
    request = UncertaintyRequest(
        campaign.name, run, model=version, method="guf", linear_axes=asked.linear_axes, sources=asked.sources,
        holds_for=asked.holds_for,
    )  # fmt: skip
    return StatedUncertainty(campaign, model, statement(evaluate(db, request)))


def refuse_without_region(
    db: Database, campaign: Campaign, model: StoredModel, runs: Sequence[CertifiedRun], asked: Asked
) -> None:
    """Raise DataError where a run bounds no region that can be certified, naming the times for which all runs do."""
    for run in runs:
        if not bounds_a_region(run.evaluated):
            raise no_region(run.evaluated, _times_with_a_region(db, campaign, model, runs, asked))


def _times_with_a_region(
    db: Database, campaign: Campaign, model: StoredModel, runs: Sequence[CertifiedRun], asked: Asked
) -> tuple[HoldsFor, ...]:
    return tuple(
        time
        for time in HoldsFor
        if time is not asked.holds_for
        and all(_bounds(db, campaign, model, run, replace(asked, holds_for=time)) for run in runs)
    )


def _bounds(db: Database, campaign: Campaign, model: StoredModel, run: CertifiedRun, asked: Asked) -> bool:
    try:
        return bounds_a_region(_evaluated(db, campaign, model, run.measured.run, asked))
    except DataError:
        # The runs are too few for that time altogether.
        return False


def inputs_of(runs: Sequence[CertifiedRun], asked: Asked, fonts: Sequence[Path]) -> CertificateInputs:
    """What the results were computed from."""
    evaluated = runs[0].evaluated
    return CertificateInputs(
        campaign=evaluated.campaign.name,
        run=runs[0].inputs,
        files=tuple(HashedFile(file.name, file.sha256) for file in evaluated.campaign.files),
        model=label(evaluated.model),
        model_effects=tuple(evaluated.model.effects),
        software=f"machine-health-monitor {__version__}",
        page_made_by=engine_versions(),
        fonts=font_hashes(fonts),
        states=tuple(run.measured.state for run in runs),
        as_left=runs[1].inputs if len(runs) > 1 else None,
        linear_axes_mm=asked.linear_axes,
        sources=asked.sources,
    )
