"""The results that a certificate prints, from the evaluation of a run and its stored Monte Carlo result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.machine import Chain
from monitor.methods.model import chain_of
from monitor.records import Array, ValidationVerdict
from monitor.reporting.budget import Budget, HoldsFor, budget_lines
from monitor.reporting.certificate.machine_frame_result import MachineFrameResult
from monitor.reporting.certificate.results import (
    CoverageFactors,
    JointEstimate,
    ResidualSummary,
    ResultSet,
    ResultStatements,
    result_set,
)
from monitor.reporting.covariance_source import covariance_sentence
from monitor.reporting.frames import referred
from monitor.reporting.messages import joint_region_lacks, region_for_others
from monitor.reporting.numbers import decimal_of, round_to_place, round_uncertainty, written_factor
from monitor.reporting.symbols import describe
from monitor.reporting.texts import Texts
from monitor.store import Database, check_analysis, stored_analyses
from monitor.units import MICROMETRE, Unit
from monitor.workflow.certificate.taken_as_stated import known_scale_sentence, tool_point_sentence
from monitor.workflow.uncertainty.answer import MonteCarloAnswer, UncertaintyAnswer
from monitor.workflow.uncertainty.machine_frame import frames_of, in_machine_frame
from monitor.workflow.uncertainty.stored import KIND, StatedUncertainty, restored

#: What two evaluations of the same readings may differ by, relative to u: the last digits of double precision.
_SAME = 1e-6


@dataclass(frozen=True)
class StoredMonteCarlo:
    """The latest stored Monte Carlo result ``mcm`` of a run, in its ``answer``; ``number`` in v_analyses."""

    number: int
    answer: UncertaintyAnswer
    mcm: MonteCarloAnswer

    @property
    def trials(self) -> int:
        """How many trials there were."""
        return self.mcm.trials

    @property
    def seed(self) -> int:
        """The seed of the trials."""
        return self.mcm.seed

    @property
    def estimate(self) -> Array:
        """Estimates (m,) in display units."""
        return np.array([self.mcm.estimate[name] for name in self.answer.parameters])

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) in products of the display units."""
        u = np.array([self.mcm.u[name] for name in self.answer.parameters])
        return np.asarray(self.mcm.correlation * np.outer(u, u))


def stored_monte_carlo(db: Database, evaluated: StatedUncertainty) -> StoredMonteCarlo | None:
    """The latest stored Monte Carlo result that belongs to what is certified, None where there is none.

    It belongs where its framework result is the same: not one from a selection of runs, without the budget's line for
    lack of fit, or for another probability. Raises StoreError where it was altered since it was stored.
    """
    for analysis in stored_analyses(
        db, KIND, campaign=evaluated.campaign.name, run=evaluated.run, model=evaluated.model.name,
        model_version=evaluated.model.version,
    ):  # fmt: skip
        if "mcm" not in analysis.document:
            continue
        answer = restored(analysis.document)
        if answer.mcm is not None and _belongs(answer, evaluated):
            check_analysis(db, analysis.number)
            return StoredMonteCarlo(analysis.number, answer, answer.mcm)
    return None


def _belongs(answer: UncertaintyAnswer, evaluated: StatedUncertainty) -> bool:
    if answer.parameters != evaluated.names or answer.p != evaluated.answer.p:
        return False
    u = np.array([answer.guf.u[name] for name in evaluated.names])
    estimate = np.array([answer.guf.estimate[name] for name in evaluated.names])
    allowed = _SAME * evaluated.u
    return bool(
        np.all(abs(u - evaluated.u) <= allowed) and np.all(abs(estimate - evaluated.estimate) <= allowed)
    )


def results_of(
    evaluated: StatedUncertainty,
    texts: Texts,
    monte_carlo: StoredMonteCarlo | None = None,
    method: str = "guf",
    *,
    state: str | None = None,
) -> ResultSet:
    """The results that a certificate prints, by the GUM framework or by Monte Carlo; as found where no state is given.

    The readings' covariance is known from few runs: both methods are printed with the factors that hold for so few,
    which a Monte Carlo of a known covariance cannot give. Raises InputError, NotFoundError where the method cannot be
    certified, DataError where there are too few runs for any joint region.
    """
    if not bounds_a_region(evaluated):
        raise no_region(evaluated)
    answer = evaluated.answer
    estimate, covariance = evaluated.estimate, evaluated.covariance
    factors = CoverageFactors(
        answer.p,
        evaluated.k_p,
        evaluated.k_q,
        answer.guf.rank,
        evaluated.dof,
        answer.guf.coverage_sampling,
    )
    if method == "mcm":
        monte_carlo = _certifiable(evaluated, monte_carlo)
        estimate, covariance = monte_carlo.estimate, monte_carlo.covariance
        if not np.isfinite(evaluated.dof):
            factors = replace(factors, k_p=monte_carlo.mcm.k_p, k_q=monte_carlo.mcm.k_q, sampling=None)
    limits = evaluated.campaign.machine.tolerances
    chain = chain_of(evaluated.campaign.machine)
    frames = frames_of(evaluated.names, chain)
    return result_set(
        # In display units already.
        JointEstimate(evaluated.names, [Unit(unit, 1.0) for unit in evaluated.units], estimate, covariance),
        factors,
        ResultStatements(
            state=state or texts("record.as_found"),
            evaluation=_evaluation(evaluated, texts, monte_carlo, method),
            refused=answer.refused,
            residuals=_residuals(evaluated),
            trials=None if monte_carlo is None or method == "guf" else monte_carlo.trials,
            validation=None if monte_carlo is None else _verdict(monte_carlo, texts),
            descriptions={
                name: referred(describe(name, texts), frames.get(name), texts) for name in evaluated.names
            },
            machine_frame=_in_machine_frame(evaluated, chain, estimate, covariance),
            tolerances={name: limits[name] for name in limits if name in evaluated.names} or None,
            budget=_budget(answer),
        ),
        texts,
    )


def bounds_a_region(evaluated: StatedUncertainty) -> bool:
    """Whether there are runs enough for a region that can be certified."""
    # Few days bound no ellipsoid, but the intervals over the campaign, which are stated without it.
    over_campaign = evaluated.answer.holds_for is HoldsFor.CAMPAIGN and np.isfinite(evaluated.k_q)
    return bool(np.isfinite(evaluated.k_p)) or bool(over_campaign)


def no_region(evaluated: StatedUncertainty, others: Sequence[HoldsFor] = ()) -> DataError:
    """The refusal of a result without a region, naming ``others``: the times for which there is one."""
    return DataError(
        f"the runs behind the covariance of the readings are too few for a joint region of "
        f"{len(evaluated.names)} parameters: they need more degrees of freedom than there are parameters"
        f"{_lacking(evaluated)}; a certificate needs more repeated runs{region_for_others(others)}"
    )


def _residuals(evaluated: StatedUncertainty) -> ResidualSummary:
    """What the model leaves of the run, by target; of several instruments there is no one uncertainty beside it."""
    by_target, campaign = evaluated.answer.residuals.by_target_um, evaluated.campaign
    of_setups = bool(campaign.artefact.setups)
    return ResidualSummary(
        "setup" if of_setups else "target",
        tuple(by_target),
        tuple(by_target.values()),
        None if of_setups else MICROMETRE.to_display(campaign.probe.standard_uncertainty),
    )


def _in_machine_frame(
    evaluated: StatedUncertainty, chain: Chain, estimate: Array, covariance: Array
) -> MachineFrameResult:
    answer = evaluated.answer
    unknown = [name for refused in answer.refused for name in refused.parameters]
    frame = in_machine_frame(evaluated.names, estimate, covariance, chain, unknown)
    return MachineFrameResult(
        names=frame.parameters,
        units=tuple(frame.units[name] for name in frame.parameters),
        estimate=np.array([frame.estimate[name] for name in frame.parameters]),
        covariance=frame.covariance,
        sums=frame.sums,
        k=_single_factor(evaluated),
        p=answer.p,
    )


def _single_factor(evaluated: StatedUncertainty) -> float:
    """The coverage factor of one number by itself; that of the answer where it has one."""
    frame = evaluated.answer.machine_frame
    if frame is not None and frame.k is not None:
        return frame.k
    # An answer of before there was one. Loaded here: what states a stored result waits for no library of formulas.
    from monitor.uncertainty.coverage_regions.coverage import single_factor

    return single_factor(evaluated.answer.p, evaluated.fewest_dof)


def _lacking(evaluated: StatedUncertainty) -> str:
    """What the runs have, and how many more of the same days would do; empty where that is not known."""
    estimated = [
        freedom
        for freedom in (evaluated.answer.guf.budget_degrees_of_freedom or {}).values()
        if freedom is not None
    ]
    return joint_region_lacks(len(evaluated.names) + 1, min(estimated)) if estimated else ""


def _budget(answer: UncertaintyAnswer) -> Budget | None:
    """What stands behind the uncertainty; None for an answer that does not say it."""
    if answer.holds_for is None:
        return None
    guf = answer.guf
    u = {name: guf.u[name] for name in answer.parameters}
    return Budget(
        answer.holds_for,
        budget_lines(guf.budget, u, guf.budget_degrees_of_freedom or {}),
        answer.day_to_day,
        answer.sources or (),
        answer.length,
        answer.unchecked,
    )


def _certifiable(evaluated: StatedUncertainty, monte_carlo: StoredMonteCarlo | None) -> StoredMonteCarlo:
    if monte_carlo is None:
        run, campaign = evaluated.run, evaluated.campaign.name
        raise NotFoundError(
            f"there is no stored Monte Carlo result of run {run} of campaign {campaign}; first: "
            f"monitor uncertainty {campaign} --run {run} --method both"
        )
    if evaluated.counts_lack_of_fit:
        raise InputError(
            "the model does not explain all of the measurement, and the Monte Carlo result holds no part for that: "
            "certify the framework's result (--method guf), or complete the model"
        )
    return monte_carlo


def _evaluation(
    evaluated: StatedUncertainty, texts: Texts, monte_carlo: StoredMonteCarlo | None, method: str
) -> str:
    """How the results were evaluated, sentence by sentence, the last without its full stop."""
    readings = covariance_sentence(evaluated.covariance_source, texts)
    if method == "mcm" and monte_carlo is not None:
        parts = [
            texts(
                "evaluation.monte_carlo", trials=monte_carlo.trials, seed=monte_carlo.seed, readings=readings
            )
        ]
    else:
        parts = [texts("evaluation.framework", readings=readings)]
    sampling = evaluated.answer.guf.coverage_sampling
    if np.isfinite(evaluated.dof) and sampling is not None:
        # Seed and trials, so that either factor can be computed again from the budget.
        parts[0] += ", " + texts(
            "evaluation.factors",
            single=texts.number(round_to_place(evaluated.fewest_dof, decimal_of(0.1))),
            trials=sampling.trials,
            seed=sampling.seed,
            u_q=texts.number(round_uncertainty(max(sampling.k_q_standard_error, 0.0001), 1)),
            u_p=texts.number(round_uncertainty(max(sampling.k_p_standard_error, 0.0001), 1)),
        )
        if method == "mcm" and monte_carlo is not None:
            k_q = written_factor(monte_carlo.mcm.k_q, texts.decimal_sign)
            k_p = written_factor(monte_carlo.mcm.k_p, texts.decimal_sign)
            parts[0] += "; " + texts("evaluation.known_covariance", k_q=k_q, k_p=k_p)
    if monte_carlo is not None and monte_carlo.answer.validation is not None:
        checked = texts(
            "evaluation.checked",
            trials=monte_carlo.trials,
            seed=monte_carlo.seed,
            verdict=_verdict(monte_carlo, texts),
        )
        parts.append(checked[:1].upper() + checked[1:])
    as_stated = (
        tool_point_sentence(evaluated.campaign, evaluated.names, texts),
        known_scale_sentence(evaluated.campaign, texts),
    )
    return ". ".join([*parts, *(each for each in as_stated if each), _how_it_fits(evaluated, texts)])


def _verdict(monte_carlo: StoredMonteCarlo, texts: Texts) -> str | None:
    validation = monte_carlo.answer.validation
    if validation is None:
        return None
    if validation.verdict is ValidationVerdict.UNDECIDED:
        return texts("evaluation.undecided")
    confirmed = ", ".join(
        texts("evaluation.estimates") if kind == "estimate" else kind for kind in validation.confirmed
    )
    if validation.verdict is ValidationVerdict.VALIDATED:
        return texts("evaluation.validated", quantities=confirmed)
    # An earlier version compared a bound of k_q, which no result stated, with what the correlations ask for.
    bound = validation.failed == ("k_q",) and monte_carlo.answer.guf.coverage_sampling is None
    return texts(
        "evaluation.bound_not_validated" if bound else "evaluation.not_validated",
        quantities=", ".join(validation.failed),
        confirmed=confirmed,
    )


def _how_it_fits(evaluated: StatedUncertainty, texts: Texts) -> str:
    """Whether the model explains the measurement, in a sentence that ends without its full stop."""
    residuals = evaluated.answer.residuals
    rms, expected = (
        texts.number(round_to_place(value, decimal_of(0.01)))
        for value in (residuals.rms_um, residuals.expected_rms_um)
    )
    of_setups = bool(evaluated.campaign.artefact.setups)
    fits = texts("evaluation.fit_setups" if of_setups else "evaluation.fit", rms=rms, expected=expected)
    if evaluated.counts_lack_of_fit:
        fits += "; " + texts("evaluation.fit_counted")
    elif residuals.something_is_missing:
        fits += "; " + texts("evaluation.fit_not_counted")
    return fits
