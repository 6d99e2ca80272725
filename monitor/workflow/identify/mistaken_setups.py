"""A sign, a unit or exchanged columns of one setup or instrument, which contradicts the others by them; columns
that stand some rows too late; and passes whose readings stand in the opposite order."""

from __future__ import annotations

import numpy as np
import scipy

from monitor.methods import campaign_method
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.method import Instruments
from monitor.records import Campaign
from monitor.store import StoredModel
from monitor.units import MICROMETRE
from monitor.workflow.identify.answer import LikelyMistake
from monitor.workflow.models import as_model

#: Sums of squares that chance makes more often than this, larger or smaller, ask for no search.
USUAL = 0.01


def mistaken_setups(
    campaign: Campaign, model: StoredModel, problem: ChainProblem, solution: Solution
) -> tuple[LikelyMistake, ...]:
    """The mistakes of a setup or an instrument that explain why it contradicts the others, or that of columns shifted,
    or passes turned, against the readings; ``solution`` is that of the campaign as recorded. Empty where the residuals
    are as stated."""
    if not isinstance(campaign_method(campaign).instruments, Instruments):
        return ()
    # Loaded here: only readings that contradict what is stated need the search.
    from monitor.discovery import Fit, find_late_rows, find_setup_mistakes, find_turned_passes

    fit = Fit(problem, solution, np.zeros(len(problem.context), dtype=bool))
    free = max(fit.degrees_of_freedom, 1)
    if USUAL / 2.0 < float(scipy.special.chdtrc(free, fit.sum_of_squares)) < 1.0 - USUAL / 2.0:
        return ()
    stored = as_model(model)

    def maker(changed: Campaign) -> ChainProblem:
        return campaign_method(changed).problem_of(changed, stored)

    mistakes = find_late_rows(campaign, maker, fit) or find_setup_mistakes(campaign, maker, fit)
    if not any(mistake.enough for mistake in mistakes):
        mistakes = find_turned_passes(campaign, maker, fit) or mistakes
    um = MICROMETRE.to_display
    return tuple(
        LikelyMistake(each.what, um(each.rms_as_recorded), um(each.rms_undone), each.enough)
        for each in mistakes
    )
