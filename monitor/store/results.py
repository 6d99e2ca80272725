"""Records of an identification: the parameters of a model, run by run, with covariance and residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.sources import CommonQuantity
from monitor.store import audit
from monitor.units import Unit


@dataclass(frozen=True)
class StoredRun:
    """The k parameters of one run, in internal units (mm, rad, 1).

    ``estimate`` (k,) and ``covariance`` (k, k) are NaN where a parameter was refused; ``refused`` are groups of
    parameters and why. ``residuals`` (n, 3) in mm belong to the touches ``sequence`` (n,). ``rms_mm`` is the
    root mean square of all their components, ``chi_square`` the sum of their normalised squares. ``common_parts`` are
    changes (k,) of the estimate for one standard uncertainty of each calibrated quantity that outlasts the campaign,
    NaN where a parameter was refused.
    """

    run: int
    estimate: Array
    covariance: Array
    refused: tuple[tuple[tuple[str, ...], str], ...]
    rms_mm: float
    iterations: int
    degrees_of_freedom: int
    chi_square: float
    sequence: npt.NDArray[np.int64]
    residuals: Array
    common_parts: Mapping[CommonQuantity, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class LackOfFit:
    """Lack of fit of the runs of an identification over their scatter: the probability of as much where the model is
    right, None where no two runs follow one plan and nothing can be compared."""

    p_value: float | None


@dataclass(frozen=True)
class StoredIdentification:
    """An identification of a campaign by a version of a model: ``parameters`` and display ``units``, k each.

    ``refers_to`` says in words, by name, what the errors of the chain are stated relative to. ``lack_of_fit`` is None
    where it was not looked for: older versions stored none.
    """

    campaign: str
    model: str
    model_version: int
    method: str
    parameters: tuple[str, ...]
    units: tuple[Unit, ...]
    runs: tuple[StoredRun, ...]
    refers_to: Mapping[str, str] = field(default_factory=dict)
    lack_of_fit: LackOfFit | None = None


def identification_content(
    number: int, identification: StoredIdentification, *, signed_zeros: bool = False
) -> str:
    """The hash of all that is stored of an identification; ``signed_zeros`` as in ``audit.bits``."""
    return audit.digest(
        number,
        identification.campaign,
        identification.model,
        identification.model_version,
        identification.method,
        identification.parameters,
        [[unit.name, unit.factor] for unit in identification.units],
        [
            [
                run.run,
                audit.bits(run.estimate, signed_zeros=signed_zeros),
                audit.bits(run.covariance, signed_zeros=signed_zeros),
                run.refused,
                [float(run.rms_mm), int(run.iterations), int(run.degrees_of_freedom), float(run.chi_square)],
                [int(sequence) for sequence in run.sequence],
                audit.bits(run.residuals, signed_zeros=signed_zeros),
            ]
            for run in identification.runs
        ],
        # Nothing is added for those of before frames were stored: their hashes are the old ones.
        *([sorted(identification.refers_to.items())] if identification.refers_to else []),
        *_lack_of_fit_content(identification.lack_of_fit),
        *_common_parts_content(identification.runs, signed_zeros=signed_zeros),
    )


def _lack_of_fit_content(lack_of_fit: LackOfFit | None) -> list[dict[str, str | None]]:
    """Return what is hashed of lack of fit: nothing for identifications of before it was stored."""
    if lack_of_fit is None:
        return []
    p_value = lack_of_fit.p_value
    return [{"lack of fit": None if p_value is None else float(p_value).hex()}]


def _common_parts_content(runs: Sequence[StoredRun], *, signed_zeros: bool) -> list[dict[str, object]]:
    """Return what is hashed of what runs have of calibrated quantities: nothing where they have none."""
    parts = [
        [run.run, *astuple(quantity), audit.bits(part, signed_zeros=signed_zeros)]
        for run in runs
        for quantity, part in sorted(run.common_parts.items())
    ]
    return [{"common parts": parts}] if parts else []


def check_identification(identification: StoredIdentification) -> None:
    """Raise DataError where the arrays of an identification do not fit each other or are not finite."""
    count = len(identification.parameters)
    if len(identification.units) != count:
        raise DataError(f"{count} parameters need {count} units, not {len(identification.units)}")
    if not identification.runs:
        raise DataError("an identification needs at least one run")
    for run in identification.runs:
        name = f"run {run.run} of {identification.campaign}"
        if run.estimate.shape != (count,) or run.covariance.shape != (count, count):
            raise DataError(
                f"{name}: estimate and covariance must be ({count},) and ({count}, {count}), "
                f"not {run.estimate.shape} and {run.covariance.shape}"
            )
        if run.residuals.shape != (len(run.sequence), 3):
            raise DataError(
                f"{name}: residuals must be ({len(run.sequence)}, 3), a row for every touch, "
                f"not {run.residuals.shape}"
            )
        numbers = [run.rms_mm, run.chi_square, *run.residuals.ravel()]
        if not np.all(np.isfinite(numbers)):
            raise DataError(f"{name}: rms, chi-square and residuals must be finite")
        _check_common_parts(run, count, name)
        if np.isinf(run.estimate).any() or np.isinf(run.covariance).any():
            raise DataError(f"{name}: estimates and covariances must be finite, or NaN where refused")
        held = {parameter for group, _ in run.refused for parameter in group}
        for parameter, value in zip(identification.parameters, run.estimate, strict=True):
            if np.isnan(value) and parameter not in held:
                raise DataError(f"{name}: {parameter} has no number and no reason why it was refused")


def _check_common_parts(run: StoredRun, count: int, name: str) -> None:
    """Raise DataError where what a run has of a calibrated quantity does not fit its parameters."""
    if any(part.shape != (count,) or np.isinf(part).any() for part in run.common_parts.values()):
        raise DataError(
            f"{name}: what it has of a calibrated quantity must be {count} finite numbers, NaN where refused"
        )
