"""What an evaluation of one run's uncertainty leaves: the fit, the framework's result, the Monte Carlo result."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.discovery import Fit
from monitor.records import Campaign
from monitor.refusal import Refusal
from monitor.reporting.budget import DayToDay, HoldsFor, LengthReference, StatedSource, Unchecked
from monitor.reporting.certificate.model_effect import Outside
from monitor.reporting.covariance_source import CovarianceSource
from monitor.store import StoredModel
from monitor.uncertainty import FrameworkResult, MonteCarloResult, Validation
from monitor.units import Unit
from monitor.workflow.uncertainty.request import Asked


@dataclass(frozen=True)
class Behind:
    """What stands behind a stated uncertainty: for which time it holds, how days differ, the sources, the length,
    and which readings nothing checks."""

    holds_for: HoldsFor
    day_to_day: DayToDay
    sources: tuple[StatedSource, ...]
    length: LengthReference | None
    unchecked: Unchecked | None


@dataclass(frozen=True)
class RunUncertainty:
    """The evaluated uncertainty of one run; ``units`` are the display units of ``framework.names``.

    ``causes`` are the effects that lack of fit may come from, with their probabilities. ``effects`` are those of the
    names that were added to the model, ``effects_outside`` says why none of them is an output.
    """

    campaign: Campaign
    model: StoredModel
    fit: Fit
    run: int
    asked: Asked
    framework: FrameworkResult
    units: tuple[Unit, ...]
    refused: tuple[Refusal, ...]
    covariance_source: CovarianceSource
    monte_carlo: MonteCarloResult | None
    validation: Validation | None
    causes: tuple[tuple[str, float], ...]
    behind: Behind
    effects: tuple[str, ...] = ()
    effects_outside: Outside | None = None
