"""Stored answers to the question for a run's uncertainty: written, restored, and read by certificates and maps.

Nothing is evaluated here, so that what only states a result waits for neither solver nor compiler.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from monitor import __version__
from monitor.documents import from_document, to_document
from monitor.records import Array, Campaign
from monitor.reporting.covariance_source import CovarianceSource
from monitor.store import Database, StoredModel, check_analysis, save_analysis, stored_analyses
from monitor.workflow.campaign_parts import kind_of, method_of
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.request import Asked
from monitor.workflow.uncertainty.sentences_0_1_0 import covariance_source_of, with_reason

#: The kind of analysis under which answers are stored.
KIND = "uncertainty"
#: The line of the budget for what lack of fit of the model adds.
LACK_OF_FIT = "lack of fit of the model"


@dataclass(frozen=True)
class StatedUncertainty:
    """An answer about one run, with the campaign and the model that it belongs to: what certificates and maps are of.

    Arrays are over its m parameters, in their display units. ``number`` is that of the stored answer, None where it was
    evaluated now.
    """

    campaign: Campaign
    model: StoredModel
    answer: UncertaintyAnswer
    number: int | None = None

    @property
    def run(self) -> int:
        """The run."""
        return self.answer.run

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters (m)."""
        return self.answer.parameters

    @property
    def units(self) -> tuple[str, ...]:
        """Their display units (m)."""
        return tuple(self.answer.units[name] for name in self.names)

    @property
    def estimate(self) -> Array:
        """Estimates (m,)."""
        return self._array(self.answer.guf.estimate)

    @property
    def u(self) -> Array:
        """Standard uncertainties (m,)."""
        return self._array(self.answer.guf.u)

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) in products of the display units."""
        return self.answer.covariance

    @property
    def k_p(self) -> float:
        """Coverage factor of the ellipsoid; infinite where so few degrees of freedom bound none."""
        return _or_infinite(self.answer.guf.k_p_with_degrees_of_freedom)

    @property
    def k_q(self) -> float:
        """Coverage factor of all intervals together; infinite where so few degrees of freedom bound none."""
        return _or_infinite(self.answer.guf.k_q_with_degrees_of_freedom)

    @property
    def dof(self) -> float:
        """Degrees of freedom of the covariance as a whole; infinite where they do not apply."""
        return _or_infinite(self.answer.guf.degrees_of_freedom)

    @property
    def fewest_dof(self) -> float:
        """Degrees of freedom of the variance with the fewest; infinite where they do not apply."""
        return _or_infinite(self.answer.guf.fewest_degrees_of_freedom)

    @property
    def dof_by_parameter(self) -> Array:
        """Degrees of freedom (m,) of every variance; those of the covariance as a whole where none are stored."""
        by_name = self.answer.guf.degrees_of_freedom_by_parameter
        if by_name is None:
            return np.full(len(self.names), self.dof)
        return np.array([_or_infinite(by_name[name]) for name in self.names])

    @property
    def counts_lack_of_fit(self) -> bool:
        """Whether the budget has a line for lack of fit of the model."""
        return LACK_OF_FIT in self.answer.guf.budget

    @property
    def covariance_source(self) -> CovarianceSource:
        """Where the covariance of the readings comes from."""
        assert self.answer.input_covariance_source is not None  # restored
        return self.answer.input_covariance_source

    def _array(self, by_name: Mapping[str, float]) -> Array:
        return np.array([by_name[name] for name in self.names], dtype=np.float64)


def _or_infinite(value: float | None) -> float:
    return math.inf if value is None else value


def save_uncertainty(
    db: Database, answer: UncertaintyAnswer, model: StoredModel, method: str, before: datetime | None
) -> None:
    """Store the answer of an evaluation, ``partial`` where runs from ``before`` on took no part."""
    # How long it took is not stored: the same result has the same document.
    stored = answer if answer.mcm is None else replace(answer, mcm=replace(answer.mcm, seconds=None))
    save_analysis(
        db, kind_of(KIND, before), to_document(stored), method=method_of(method, before),
        campaign=answer.campaign, run=answer.run, model=model.name, model_version=model.version,
        seed=None if answer.mcm is None else answer.mcm.seed,
    )  # fmt: skip


def restored(document: Mapping[str, Any]) -> UncertaintyAnswer:
    """The answer that a stored document holds. Raises StoreError where it was written by another version or altered."""
    answer = from_document(UncertaintyAnswer, document)
    return replace(
        answer,
        input_covariance_source=covariance_source(document),
        refused=tuple(map(with_reason, answer.refused)),
    )


def covariance_source(document: Mapping[str, Any]) -> CovarianceSource:
    """Where the covariance of the readings of a stored document comes from. Raises StoreError as ``restored``."""
    stored = document.get("input_covariance_source")
    if stored is None:
        return covariance_source_of(document["input_covariance"])
    return from_document(CovarianceSource, stored)


def stored_uncertainty(
    db: Database, campaign: Campaign, run: int, model: StoredModel, asked: Asked | None = None
) -> StatedUncertainty | None:
    """The latest stored answer about a run by this model to what was ``asked`` (default: nothing but the run); None
    where there is none.

    Only what this version of the software evaluated is taken: another may have evaluated otherwise. Raises StoreError
    where it was altered since it was stored.
    """
    wanted = to_document(asked or Asked())
    for analysis in stored_analyses(
        db, KIND, campaign=campaign.name, run=run, model=model.name, model_version=model.version
    ):
        # An answer that does not say for which time it holds is of before that was evaluated.
        same = analysis.document.get("asked") == wanted and "holds_for" in analysis.document
        if same and analysis.software_version == __version__:
            check_analysis(db, analysis.number)
            answer = restored(analysis.document)
            # Factors of a former kind, from one number of degrees of freedom for all directions, are not stated again.
            if answer.guf.coverage_sampling is not None:
                return StatedUncertainty(campaign, model, answer, analysis.number)
    return None
