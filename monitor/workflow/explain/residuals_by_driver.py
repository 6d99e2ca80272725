"""The residual along X, Y and Z against anything that it may depend on: positions, temperatures, time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.discovery import Fit
from monitor.documents import OMITTED
from monitor.exceptions import DataError, did_you_mean
from monitor.methods.curve.fit import CurveFit
from monitor.records import Array
from monitor.reporting.health.comparison import ResidualAgainst
from monitor.store import Database
from monitor.workflow.explain.residuals import drivers_followed, drivers_of, in_machine_frame
from monitor.workflow.explain.residuals_against import Against, grouped
from monitor.workflow.explain.tried import tried
from monitor.workflow.identify.fitting import fitted
from monitor.workflow.models import label


@dataclass(frozen=True)
class ResidualsByDriverRequest:
    """A model (None: the one that is followed) against a campaign; a ``driver`` of the campaign (None: that which the
    residual follows most); ``effect`` is tried beside the model, nothing is stored."""

    campaign: str
    model: str | None = None
    driver: str | None = None
    effect: str | None = None


@dataclass(frozen=True)
class ResidualsByDriverAnswer:
    """The residual ``along`` each of X, Y and Z against a ``driver``, which is one of ``drivers``.

    ``after`` of a group is with the ``effect`` in the model.
    """

    campaign: str
    model: str
    drivers: tuple[str, ...]
    driver: str
    along: Mapping[str, ResidualAgainst]
    effect: str | None = field(default=None, metadata=OMITTED)


def residuals_by_driver(db: Database, request: ResidualsByDriverRequest) -> ResidualsByDriverAnswer:
    """Fit a model to a campaign and state what it leaves against a driver.

    Raises NotFoundError, EffectError, DataError for a curve, for readings that are no displacement, and for a driver
    that the campaign does not have or that did not change.
    """
    model = fitted(db, request.campaign, request.model)
    fit = model.fit
    if isinstance(fit, CurveFit) or len(fit.problem.components) > 3:
        raise DataError(
            f"{request.campaign}: a reading is no displacement of a machine; compare shows its residuals"
        )
    columns = drivers_of(fit)
    if not columns:
        raise DataError(f"{request.campaign}: nothing that a residual may depend on changed")
    driver = request.driver or drivers_followed(fit)[0][0]
    if driver not in columns:
        hint = did_you_mean(driver, columns)
        raise DataError(f"{request.campaign} has no driver '{driver}'; {hint}it has {', '.join(columns)}")
    weighed = ~fit.left_out
    before = _along_axes(fit)[weighed]
    effect, after = None, None
    if request.effect is not None:
        effect, with_effect = tried(db, model, request.effect)
        after = _along_axes(with_effect)[weighed]
    return ResidualsByDriverAnswer(
        campaign=request.campaign,
        model=label(model.model),
        drivers=tuple(columns),
        driver=driver,
        along={
            name: grouped(
                Against(
                    driver, name, columns[driver], before[:, axis], None if after is None else after[:, axis]
                )
            )
            for axis, name in enumerate("XYZ")
        },
        effect=effect,
    )


def _along_axes(fit: Fit) -> Array:
    return in_machine_frame(fit, fit.problem.as_vectors(fit.vectors))[1]
