"""The results that a certificate prints, from the evaluation of a run and its stored Monte Carlo result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.records import Array
from monitor.reporting.certificate.results import RefusedParameters, ResidualSummary, ResultSet, result_set
from monitor.reporting.numbers import decimal_of, round_to_place, written_factor
from monitor.reporting.texts import Texts
from monitor.store import Database, check_analysis, stored_analyses
from monitor.units import MICROMETRE, Unit
from monitor.workflow.uncertainty.evaluations import LACK_OF_FIT, Evaluation

METHODS = ("guf", "mcm")
#: What two evaluations of the same readings may differ by, relative to u: the last digits of double precision.
_SAME = 1e-6


@dataclass(frozen=True)
class StoredMonteCarlo:
    """The latest stored Monte Carlo result of a run and what it says of the framework; ``number`` in v_analyses.

    ``estimate`` (m,) and ``covariance`` (m, m) are in display units.
    """

    number: int
    trials: int
    seed: int
    estimate: Array
    covariance: Array
    k_p: float
    k_q: float
    verdict: str | None
    differing: tuple[str, ...]


def stored_monte_carlo(db: Database, found: Evaluation) -> StoredMonteCarlo | None:
    """The latest stored Monte Carlo result that belongs to what is certified, None where there is none.

    It belongs where its framework result is the same: not one from a selection of runs, without the budget's line for
    lack of fit, or for another probability. Raises StoreError where it was altered since it was stored.
    """
    for one in stored_analyses(
        db, "uncertainty", campaign=found.campaign.name, run=found.run, model=found.model.name,
        model_version=found.model.version,
    ):  # fmt: skip
        if "mcm" in one.document and _belongs(one.document, found):
            check_analysis(db, one.number)
            return _stored(one.number, one.document)
    return None


def _belongs(document: Mapping[str, Any], found: Evaluation) -> bool:
    if tuple(document["parameters"]) != found.names or document["p"] != found.p:
        return False
    guf = document["guf"]
    u = np.array([guf["u"][name] for name in found.names])
    estimate = np.array([guf["estimate"][name] for name in found.names])
    return bool(
        np.all(abs(u - found.u) <= _SAME * found.u)
        and np.all(abs(estimate - found.estimate) <= _SAME * found.u)
    )


def _stored(number: int, document: Mapping[str, Any]) -> StoredMonteCarlo:
    mcm, checked, names = document["mcm"], document.get("validation"), document["parameters"]
    u = np.array([mcm["u"][name] for name in names])
    differing = () if checked is None else tuple(
        name for name, value in checked["differences"].items() if abs(value) > checked["tolerances"][name]
    )  # fmt: skip
    return StoredMonteCarlo(
        number=number,
        trials=int(mcm["trials"]),
        seed=int(mcm["seed"]),
        estimate=np.array([mcm["estimate"][name] for name in names]),
        covariance=np.asarray(mcm["correlation"], dtype=np.float64) * np.outer(u, u),
        k_p=float(mcm["k_p"]),
        k_q=float(mcm["k_q"]),
        verdict=None if checked is None else str(checked["verdict"]),
        differing=differing,
    )


def results_of(
    found: Evaluation,
    texts: Texts,
    monte_carlo: StoredMonteCarlo | None = None,
    method: str = "guf",
    *,
    state: str | None = None,
) -> ResultSet:
    """The results that a certificate prints, by the GUM framework or by Monte Carlo; as found where no state is given.

    The readings' covariance is known from few runs: both methods are printed with the factors that hold for so few
    (Hotelling, Student), which a Monte Carlo of a known covariance cannot give. Raises InputError, NotFoundError where
    the method cannot be certified, DataError where there are too few runs for any joint region.
    """
    if method not in METHODS:
        raise InputError(f"--method {method}: a certificate states guf or mcm")
    if not np.isfinite(found.k_p):
        raise DataError(
            f"{found.dof:.0f} degrees of freedom bound no joint region of {len(found.names)} parameters; "
            "a certificate needs more repeated runs"
        )
    estimate, covariance, k_p, k_q = found.estimate, found.covariance, found.k_p, found.k_q
    if method == "mcm":
        monte_carlo = _certifiable(found, monte_carlo)
        estimate, covariance = monte_carlo.estimate, monte_carlo.covariance
        if not np.isfinite(found.dof):
            k_p, k_q = monte_carlo.k_p, monte_carlo.k_q
    limits = found.campaign.machine.tolerances
    return result_set(
        found.names,
        # In display units already.
        [Unit(unit, 1.0) for unit in found.units],
        estimate,
        covariance,
        state=state or texts("record.as_found"),
        p=found.p,
        k_p=k_p,
        k_q=k_q,
        rank=found.rank,
        evaluation=_evaluation(found, texts, monte_carlo, method),
        refused=[RefusedParameters(parameters, why) for parameters, why in found.refused],
        residuals=ResidualSummary(
            "target",
            tuple(found.residuals),
            tuple(found.residuals.values()),
            MICROMETRE.to_display(found.campaign.probe.standard_uncertainty),
        ),
        trials=None if monte_carlo is None or method == "guf" else monte_carlo.trials,
        validation=None if monte_carlo is None else _verdict(monte_carlo, texts),
        tolerances={name: limits[name] for name in limits if name in found.names} or None,
        dof=found.dof,
        texts=texts,
    )


def _certifiable(found: Evaluation, monte_carlo: StoredMonteCarlo | None) -> StoredMonteCarlo:
    if monte_carlo is None:
        raise NotFoundError(
            f"there is no stored Monte Carlo result of run {found.run} of campaign {found.campaign.name}; first: "
            f"monitor uncertainty {found.campaign.name} --run {found.run} --method both"
        )
    if LACK_OF_FIT in found.sources:
        raise InputError(
            "the model does not explain all of the measurement, and the Monte Carlo result holds no part for that: "
            "certify the framework's result (--method guf), or complete the model"
        )
    return monte_carlo


def _evaluation(found: Evaluation, texts: Texts, monte_carlo: StoredMonteCarlo | None, method: str) -> str:
    """How the results were found, sentence by sentence, the last without its full stop."""
    readings = texts.computed(found.input_covariance)
    if method == "mcm" and monte_carlo is not None:
        parts = [
            texts(
                "evaluation.monte_carlo", trials=monte_carlo.trials, seed=monte_carlo.seed, readings=readings
            )
        ]
    else:
        parts = [texts("evaluation.framework", readings=readings)]
    if np.isfinite(found.dof):
        # Two numbers, so that either factor can be found again: k_q by Student's t of the least known of the outputs,
        # k_p by Hotelling's T² of all of them together.
        single, joint = (
            texts.number(round_to_place(float(one), decimal_of(0.1))) for one in (found.fewest_dof, found.dof)
        )
        parts[0] += ", " + texts("evaluation.degrees_of_freedom", single=single, joint=joint)
        if method == "mcm" and monte_carlo is not None:
            k_q, k_p = (written_factor(one, texts.decimal_sign) for one in (monte_carlo.k_q, monte_carlo.k_p))
            parts[0] += "; " + texts("evaluation.known_covariance", k_q=k_q, k_p=k_p)
    if monte_carlo is not None and monte_carlo.verdict is not None:
        words = texts(
            "evaluation.checked",
            trials=monte_carlo.trials,
            seed=monte_carlo.seed,
            verdict=_verdict(monte_carlo, texts),
        )
        parts.append(words[:1].upper() + words[1:])
    return ". ".join([*parts, _how_it_fits(found, texts)])


def _verdict(monte_carlo: StoredMonteCarlo, texts: Texts) -> str | None:
    if monte_carlo.verdict is None:
        return None
    if monte_carlo.verdict == "validated":
        return texts("evaluation.validated")
    if not monte_carlo.differing:
        return texts("evaluation.undecided")
    return texts("evaluation.not_validated", quantities=", ".join(monte_carlo.differing))


def _how_it_fits(found: Evaluation, texts: Texts) -> str:
    """Whether the model explains the measurement, in a sentence that ends without its full stop."""
    rms, expected = (
        texts.number(round_to_place(one, decimal_of(0.01))) for one in (found.rms_um, found.expected_rms_um)
    )
    fits = texts("evaluation.fit", rms=rms, expected=expected)
    if LACK_OF_FIT in found.sources:
        fits += "; " + texts("evaluation.fit_counted")
    elif found.something_is_missing:
        fits += "; " + texts("evaluation.fit_not_counted")
    return fits
