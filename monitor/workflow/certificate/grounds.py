"""The grounds against a certificate: read from the stored evaluations of its runs, and accepted by the laboratory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from monitor.exceptions import InputError, RefusedResultError
from monitor.records import Campaign
from monitor.reporting.certificate.completeness import MissingItem
from monitor.reporting.certificate.grounds import AcceptedGround, Ground, GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import StoredModel
from monitor.workflow.uncertainty.stored import StatedUncertainty

#: Grounds of one run that speak against the others too, whose covariance is pooled with it.
OF_ANY_RUN = (GroundKind.UNITS, GroundKind.GROSS_READINGS)


class RefusedGroundsError(RefusedResultError):
    """A certificate against which ``grounds`` speak that nobody accepts; ``missing`` is what else it lacks."""

    def __init__(self, grounds: Sequence[Ground], missing: Sequence[MissingItem] = ()) -> None:
        self.grounds, self.missing = tuple(grounds), tuple(missing)
        texts = texts_of()
        kinds = dict.fromkeys(ground.kind for ground in grounds)
        options = " ".join(f"--accept {kind}=REASON" for kind in kinds)
        lines = [
            "the certificate is refused:",
            *(f"  {ground.kind}: {ground_sentence(ground, texts)}" for ground in grounds),
            "Correct what is wrong; or, where the laboratory can answer for it, say why, which is printed on the "
            f"certificate: {options}",
        ]
        if missing:
            lines += ["and besides it lacks:", *(f"  {gap}" for gap in missing)]
        super().__init__("\n".join(lines))


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
        from monitor.workflow.identify.fitting import machine_problem
        from monitor.workflow.uncertainty.grounds import grounds_of

        robust = robust_fit(machine_problem(campaign, model))
        by_run = [grounds_of(campaign, robust, run) for run in stored]
    simulated = (
        [Ground(GroundKind.SIMULATED, min(stored), campaign.machine.id)] if campaign.machine.virtual else []
    )
    # Gross readings and units of any run speak against each: once each, before what is the runs' own.
    grounds = dict.fromkeys([*simulated, *(ground for of_run in by_run for ground in of_run or ())])
    return tuple(sorted(grounds, key=lambda ground: ground.kind not in OF_ANY_RUN))


def accepted_grounds(
    grounds: Sequence[Ground], reasons: Mapping[GroundKind, str]
) -> tuple[AcceptedGround, ...]:
    """The grounds with the reasons for which they are accepted.

    Raises RefusedGroundsError naming every ground that is not, InputError for one that is accepted and not there.
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
    if refused:
        raise RefusedGroundsError(refused)
    return tuple(AcceptedGround(kind, tuple(of_kind), reasons[kind]) for kind, of_kind in by_kind.items())
