"""The residual of every probing as a vector at its place in the machine, with and without a further effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from monitor.discovery import Fit
from monitor.documents import OMITTED
from monitor.exceptions import DataError
from monitor.methods.curve.fit import CurveFit
from monitor.records import Array, Campaign
from monitor.store import Database
from monitor.workflow.explain.residuals import in_machine_frame
from monitor.workflow.identify.fitting import fit_of, fitted
from monitor.workflow.model.subjects import subjects_of
from monitor.workflow.models import label

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ResidualsRequest:
    """A model (None: the one that is followed) against a campaign; ``effect`` is tried beside it, nothing is stored."""

    campaign: str
    model: str | None = None
    effect: str | None = None


@dataclass(frozen=True)
class ResidualsAnswer:
    """The n probings of a campaign: run, target and sequence; place in mm and residual in µm, along the machine's axes.

    ``left_out`` probings took no part in the fit. ``with_effect_um`` are the residuals once the effect is in the model.
    """

    campaign: str
    model: str
    axes: tuple[str, ...]
    topology: str
    run: tuple[int, ...]
    sequence: tuple[int, ...]
    target: tuple[str, ...]
    place_mm: tuple[Vector, ...]
    residual_um: tuple[Vector, ...]
    left_out: tuple[bool, ...]
    effect: str | None = field(default=None, metadata=OMITTED)
    with_effect_um: tuple[Vector, ...] | None = field(default=None, metadata=OMITTED)


def residual_vectors(db: Database, request: ResidualsRequest) -> ResidualsAnswer:
    """Fit a model to a campaign and list what it leaves. Raises NotFoundError, EffectError, DataError for a curve."""
    fit = fitted(db, request.campaign, request.model)
    if isinstance(fit.fit, CurveFit) or not isinstance(fit.campaign, Campaign):
        raise DataError(
            f"{request.campaign} is a curve: it has no places in a machine; compare shows its residuals"
        )
    problem = fit.fit.problem
    if len(problem.components) > 3:
        raise DataError(
            f"{request.campaign}: a reading of {fit.campaign.method} has {', '.join(problem.components)}, "
            "which is no displacement at a place; compare shows its residuals"
        )
    places, residuals = _measured(fit.fit)
    context = problem.context
    answer = ResidualsAnswer(
        campaign=request.campaign,
        model=label(fit.model),
        axes=tuple(joint.name for joint in context.chain.joints),
        topology=fit.campaign.machine.topology,
        run=tuple(np.asarray(context.run).tolist()),
        sequence=tuple(np.asarray(context.sequence).tolist()),
        target=tuple(str(name) for name in context.target),
        place_mm=_vectors(places),
        residual_um=_vectors(residuals),
        left_out=tuple(np.asarray(fit.fit.left_out).tolist()),
    )
    if request.effect is None:
        return answer
    effect = subjects_of(db, fit.model).canonical(request.effect, request.campaign)
    tried = replace(fit.model, effects=(*fit.model.effects, effect))
    with_effect = fit_of(fit.campaign, tried)
    assert isinstance(with_effect, Fit)
    return replace(answer, effect=effect, with_effect_um=_vectors(_measured(with_effect)[1]))


def _measured(fit: Fit) -> tuple[Array, Array]:
    """Places (n, 3) mm and residuals (n, 3) µm; where a reading is one number along a normal, its vector along it."""
    return in_machine_frame(fit, fit.problem.as_vectors(fit.vectors))


def _vectors(rows: Array) -> tuple[Vector, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in np.round(rows, 6))
