"""The grounds against a certificate: read from the stored evaluations of its runs, and accepted by the laboratory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from monitor.exceptions import InputError
from monitor.records import Campaign
from monitor.reporting.certificate.completeness import RefusedGroundsError
from monitor.reporting.certificate.grounds import AcceptedGround, Ground, GroundKind
from monitor.store import StoredModel
from monitor.workflow.uncertainty.file_grounds import nominal_grounds
from monitor.workflow.uncertainty.stored import StatedUncertainty

#: Grounds of one run that speak against the others too, whose covariance is pooled with it.
OF_ANY_RUN = (
    GroundKind.NOMINAL_READINGS,
    GroundKind.LATE_ROWS,
    GroundKind.UNITS,
    GroundKind.GROSS_READINGS,
)


def grounds_against(
    campaign: Campaign, model: StoredModel, stored: Mapping[int, StatedUncertainty | None]
) -> tuple[Ground, ...]:
    """Return every ground against a certificate of runs, which are given with their stored evaluations.

    They are determined where no evaluation has them. Raises DataError where the campaign cannot be fitted then.
    """
    by_run = [None if stated is None else stated.answer.grounds for stated in stored.values()]
    if None in by_run:
        # Loaded here: what is stored waits for no solver.
        from monitor.discovery import robust_fit
        from monitor.workflow.identify.fitting import explained_refusals, machine_problem
        from monitor.workflow.uncertainty.file_grounds import late_grounds
        from monitor.workflow.uncertainty.grounds import grounds_of

        with explained_refusals(campaign, model):
            robust = robust_fit(machine_problem(campaign, model))
        late = late_grounds(campaign, model, robust.fit)
        by_run = [(*late, *grounds_of(campaign, robust, run)) for run in stored]
    simulated = (
        [Ground(GroundKind.SIMULATED, min(stored), campaign.machine.id)] if campaign.machine.virtual else []
    )
    # Gross readings and units of any run speak against each: once each, before what is the runs' own.
    of_file = nominal_grounds(campaign)
    grounds = dict.fromkeys([*simulated, *of_file, *(ground for of_run in by_run for ground in of_run or ())])
    return tuple(sorted(grounds, key=lambda ground: ground.kind not in OF_ANY_RUN))


def judged_grounds(
    grounds: Sequence[Ground], reasons: Mapping[GroundKind, str]
) -> tuple[tuple[AcceptedGround, ...], tuple[Ground, ...]]:
    """The grounds that are accepted, with the reasons, and those that nobody accepts.

    Raises InputError for one that is accepted and not there.
    """
    by_kind: dict[GroundKind, list[Ground]] = {}
    for ground in grounds:
        by_kind.setdefault(ground.kind, []).append(ground)
    absent = [kind.value for kind in reasons if kind not in by_kind]
    if absent:
        raise InputError(
            f"--accept {absent[0]}: there is nothing to accept, no such ground speaks against this certificate"
        )
    refused = [ground for kind, of_kind in by_kind.items() if kind not in reasons for ground in of_kind]
    accepted = [
        AcceptedGround(kind, tuple(of_kind), reasons[kind])
        for kind, of_kind in by_kind.items()
        if kind in reasons
    ]
    return tuple(accepted), tuple(refused)


def accepted_grounds(
    grounds: Sequence[Ground], reasons: Mapping[GroundKind, str]
) -> tuple[AcceptedGround, ...]:
    """The grounds with the reasons for which they are accepted.

    Raises RefusedGroundsError naming every ground that is not, InputError for one that is accepted and not there.
    """
    accepted, refused = judged_grounds(grounds, reasons)
    if refused:
        raise RefusedGroundsError(refused)
    return accepted
