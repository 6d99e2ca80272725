"""The results that a certificate prints, from the evaluation of a run."""

from __future__ import annotations

import numpy as np

from monitor.discovery import compare
from monitor.discovery.compare import SOMETHING_IS_MISSING
from monitor.exceptions import DataError
from monitor.reporting.results import RefusedParameters, ResidualSummary, ResultSet, result_set
from monitor.units import MICROMETRE
from monitor.workflow.uncertainty import LACK_OF_FIT, Evaluated


def _evaluation(found: Evaluated) -> str:
    guf = found.framework
    dof = (
        ""
        if np.isinf(guf.dof)
        else f", factors with {guf.dof:.0f} effective degrees of freedom (t and Hotelling)"
    )
    return (
        "GUM uncertainty framework, JCGM 102:2011 clause 6; covariance of the readings from "
        f"{found.input_covariance}{dof}. {_how_it_fits(found)}"
    )


def _how_it_fits(found: Evaluated) -> str:
    """Whether the model explains the measurement, in a sentence that ends without its full stop."""
    compared = compare(found.fit, found.campaign.name, found.model.name)
    fits = (
        f"Over the campaign the model leaves {MICROMETRE.to_display(compared.rms):.2f} µm RMS, where "
        f"{MICROMETRE.to_display(compared.expected_rms):.2f} µm are expected from the probe's statement"
    )
    if LACK_OF_FIT in {line.source for line in found.framework.budget}:
        fits += "; what this lack of fit may do to the parameters is part of u"
    elif compared.verdict == SOMETHING_IS_MISSING:
        fits += "; the model does not explain all of it, and u holds no part for that"
    return fits


def _by_target(found: Evaluated) -> ResidualSummary:
    context = found.fit.problem.context
    vectors = found.fit.vectors
    own = context.run == found.run
    # A target touched once a run (the bar's) is followed exactly by its own coordinates: nothing checks it.
    labels = tuple(
        str(name) for name in found.fit.problem.targets if int(np.sum(own & (context.target == name))) > 1
    )
    rms = tuple(
        MICROMETRE.to_display(float(np.sqrt(np.mean(vectors[own & (context.target == name)] ** 2))))
        for name in labels
    )
    return ResidualSummary(
        "target", labels, rms, MICROMETRE.to_display(found.campaign.probe.standard_uncertainty)
    )


def results_of(found: Evaluated) -> ResultSet:
    """The results that a certificate prints."""
    guf = found.framework
    tolerances = {
        name: limit for name, limit in found.campaign.machine.tolerances.items() if name in guf.names
    }
    if not np.isfinite(guf.k_p):
        raise DataError(
            f"{guf.dof:.0f} degrees of freedom bound no joint region of {len(guf.names)} parameters; "
            "a certificate needs more repeated runs"
        )
    return result_set(
        guf.names,
        found.units,
        guf.estimate,
        guf.covariance,
        state="as found",
        p=guf.p,
        k_p=guf.k_p,
        k_q=guf.k_q,
        rank=guf.rank,
        evaluation=_evaluation(found),
        refused=[RefusedParameters(one.parameters, one.why) for one in found.refused],
        residuals=_by_target(found),
        tolerances=tolerances or None,
    )
