"""The grounds against a certificate that the file gives: nominal numbers in place of readings, and rows that are late.

`explain` names both before it looks for an effect. The first are known by arithmetic; the second are asked of a fit
that leaves more than noise, which takes some tenths of a second, and seconds where that is more than effects leave.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.readers.doubts.nominal_readings import nominal_readings
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import EARLY, LATE, Ground, GroundKind
from monitor.store import StoredModel

if TYPE_CHECKING:
    from monitor.discovery import Fit
    from monitor.methods.chain.problem import ChainProblem


def nominal_grounds(campaign: Campaign) -> tuple[Ground, ...]:
    """The setups whose readings of a run are nominal numbers: the covariance is pooled over all runs."""
    sequence = campaign.probings.sequence
    return tuple(
        Ground(
            GroundKind.NOMINAL_READINGS, each.run,
            _of_rows(int(sequence[each.rows[0]]), int(sequence[each.rows[-1]]), each.setup), len(each.rows),
        )
        for each in nominal_readings(campaign)
    )  # fmt: skip


def late_grounds(campaign: Campaign, model: StoredModel, first: Fit) -> tuple[Ground, ...]:
    """The columns of axes that stand some rows too late or too early; ``first`` is the fit without gross readings.

    As for `explain` nominal readings come first: nothing else is asked of a campaign that has some.
    """
    if nominal_readings(campaign):
        return ()
    # Loaded here: a certificate of a stored result waits for no solver.
    from monitor.discovery import is_gross, late_rows, late_rows_without_fit
    from monitor.methods import campaign_method
    from monitor.workflow.models import as_model

    applied = as_model(model)

    def problem_of(changed: Campaign) -> ChainProblem:
        return campaign_method(changed).problem_of(changed, applied)

    late = late_rows(campaign, problem_of, first)
    if late is None and is_gross(campaign, first):
        late = late_rows_without_fit(campaign, problem_of)
    if late is None:
        return ()
    _, shift = late
    probings = campaign.probings
    subject = _of_rows(
        int(probings.sequence[shift.row]),
        None if shift.end == len(probings) else int(probings.sequence[shift.end - 1]),
        ", ".join(shift.columns(campaign)),
    )
    unit = LATE if shift.late > 0 else EARLY
    return (Ground(GroundKind.LATE_ROWS, int(probings.run[shift.row]), subject, abs(shift.late), None, unit),)


def _of_rows(first: int, last: int | None, what: str) -> str:
    """Rows by the numbers of the first and, where that is no end of the file, the last, and what is wrong there."""
    return f"{first}{'' if last is None else f'–{last}'} ({what})"
