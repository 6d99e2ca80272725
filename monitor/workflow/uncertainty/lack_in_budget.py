"""The ground against a certificate whose model the readings refute, where that decides a stated parameter.

Lack of fit has its line in the budget: the squared pulls of the effects that the model may lack. As long as it is the
smaller part, U is what the measurement gives, a little wider. Where it is the largest, the value rests on which effect
is missing, and nobody has decided that.
"""

from __future__ import annotations

import math

from monitor.reporting.certificate.grounds import Ground, GroundKind
from monitor.workflow.history.refuted import REFUTED_P
from monitor.workflow.uncertainty.answer import FrameworkAnswer, UncertaintyAnswer
from monitor.workflow.uncertainty.stored import LACK_OF_FIT

#: Lack of fit over the rest of the budget, as standard uncertainties: from one on it is more than all else together.
#: docs/trials-grounds.md has the rates.
MOST_OF_THE_REST = 1.0


def largest_lack(framework: FrameworkAnswer) -> tuple[str, float] | None:
    """Return the parameter with the largest lack of fit over the rest of its budget, and the two's ratio; None where
    the budget has no such line."""
    shares = framework.budget.get(LACK_OF_FIT)
    if not shares:
        return None
    worst = max(shares, key=lambda name: shares[name])
    share = shares[worst]
    # Of a budget of nothing else the rest is zero.
    return worst, math.sqrt(share / (1.0 - share)) if share < 1.0 else math.inf


def decides(framework: FrameworkAnswer) -> bool:
    """Whether lack of fit is more of the variance of some parameter than all else together."""
    largest = largest_lack(framework)
    return largest is not None and largest[1] > MOST_OF_THE_REST


def lack_in_budget(answer: UncertaintyAnswer) -> tuple[Ground, ...]:
    """Return the ground of the parameter that lack of fit decides most; empty where it decides none, or where the
    readings do not refute the model beyond noise of neighbours."""
    largest = largest_lack(answer.guf)
    if largest is None or largest[1] <= MOST_OF_THE_REST:
        return ()
    p_value = answer.residuals.lack_of_fit_p
    is_refuted = answer.residuals.something_is_missing if p_value is None else p_value < REFUTED_P
    if not is_refuted:
        return ()
    parameter, times = largest
    return (Ground(GroundKind.LACK_OF_FIT, answer.run, parameter, times, MOST_OF_THE_REST),)
