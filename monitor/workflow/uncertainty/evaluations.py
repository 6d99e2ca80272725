"""One run's evaluated uncertainty as its document states it: a stored result and a new one give the same numbers.

Certificates and maps are made from these. Nothing is evaluated here, so that what only states a result waits for
neither solver nor compiler.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor import __version__
from monitor.records import Array, Campaign, LinearAxes
from monitor.store import Database, StoredModel, check_analysis, stored_analyses

Document = dict[str, Any]
#: The line of the budget for what lack of fit of the model adds.
LACK_OF_FIT = "lack of fit of the model"
#: Coverage probability of what is certified, and of results where no other is wished for.
COVERAGE = 0.95


@dataclass(frozen=True)
class Evaluation:
    """Results of the GUM framework for ``run``, m parameters in their display ``units``.

    ``estimate`` (m,), ``u`` (m,), ``correlation`` (m, m). ``dof`` are the degrees of freedom of the covariance as a
    whole, ``fewest_dof`` those of the variance with the fewest; infinite where they do not apply, as k_p and k_q are
    where so few allow no joint region. ``refused`` are groups of parameters without a number, and why. The RMS of the
    residual over the campaign, what is expected of it, and whether ``something_is_missing`` are those of `monitor
    compare`; ``residuals`` are the RMS in µm by target that the run touched more than once. ``number`` is that of the
    stored result, None where it was evaluated now.
    """

    campaign: Campaign
    model: StoredModel
    run: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    u: Array
    correlation: Array
    p: float
    k_p: float
    k_q: float
    rank: int
    dof: float
    fewest_dof: float
    sources: tuple[str, ...]
    input_covariance: str
    refused: tuple[tuple[tuple[str, ...], str], ...]
    rms_um: float
    expected_rms_um: float
    something_is_missing: bool
    residuals: Mapping[str, float]
    number: int | None

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) in products of the display units."""
        return np.asarray(self.correlation * np.outer(self.u, self.u))


def evaluation_of(
    document: Mapping[str, Any], campaign: Campaign, model: StoredModel, number: int | None = None
) -> Evaluation:
    """The evaluation that a document of `monitor uncertainty` states; ``number`` as it is stored under."""
    guf, names = document["guf"], document["parameters"]
    compared = document["residuals"]
    return Evaluation(
        campaign=campaign,
        model=model,
        run=int(document["run"]),
        names=tuple(names),
        units=tuple(document["units"][name] for name in names),
        estimate=np.array([guf["estimate"][name] for name in names], dtype=np.float64),
        u=np.array([guf["u"][name] for name in names], dtype=np.float64),
        correlation=np.asarray(guf["correlation"], dtype=np.float64),
        p=float(document["p"]),
        k_p=_number(guf["k_p_with_degrees_of_freedom"]),
        k_q=_number(guf["k_q_with_degrees_of_freedom"]),
        rank=int(guf["rank"]),
        dof=_number(guf["degrees_of_freedom"]),
        fewest_dof=_number(guf["fewest_degrees_of_freedom"]),
        sources=tuple(guf["budget"]),
        input_covariance=str(document["input_covariance"]),
        refused=tuple((tuple(one["parameters"]), str(one["why"])) for one in document["refused"]),
        rms_um=float(compared["rms_um"]),
        expected_rms_um=float(compared["expected_rms_um"]),
        something_is_missing=bool(compared["something_is_missing"]),
        residuals=dict(compared["by_target_um"]),
        number=number,
    )


def _number(value: float | None) -> float:
    return math.inf if value is None else float(value)


def wished(
    p: float = COVERAGE,
    select: str | None = None,
    model_uncertainty: bool = True,
    linear_axes: LinearAxes | None = None,
) -> Document:
    """What an evaluation was asked for, as its document says it: only such an evaluation answers such a question."""
    return {
        "p": p,
        "select": select,
        "model_uncertainty": model_uncertainty,
        "linear_axes": None if linear_axes is None else _plain(dataclasses.asdict(linear_axes)),
    }


def _plain(value: Any) -> Any:
    """As JSON gives it back."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, tuple | list) else value


def stored_evaluation(
    db: Database, campaign: Campaign, run: int, model: StoredModel, linear_axes: LinearAxes | None = None
) -> Evaluation | None:
    """The latest stored evaluation of a run by this model that was asked for nothing else; None where there is none.

    Only what this version of the software evaluated is taken: another may have evaluated otherwise. Raises StoreError
    where it was altered since it was stored.
    """
    asked = wished(linear_axes=linear_axes)
    for one in stored_analyses(
        db, "uncertainty", campaign=campaign.name, run=run, model=model.name, model_version=model.version
    ):
        if one.document.get("asked") == asked and one.software_version == __version__:
            check_analysis(db, one.number)
            return evaluation_of(one.document, campaign, model, one.number)
    return None
