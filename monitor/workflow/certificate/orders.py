"""What has to hold before a certificate is computed: its number, its day, its runs, the one that it replaces."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from monitor.documents import from_document
from monitor.exceptions import InputError, NotFoundError
from monitor.records import Campaign, Run
from monitor.reporting import record_messages
from monitor.reporting.certificate.laboratory import LaboratoryFile
from monitor.reporting.certificate.record import NotApplicable, Replaced
from monitor.said import check_number_of_certificate, reason as said_reason
from monitor.store import Database, StoredCertificate, certificate_numbers, load_certificate
from monitor.workflow.certificate.inputs import MadeWith

#: The two states of a machine that a certificate may describe (ISO/IEC 17025:2017, 7.8.4.1 d).
AS_FOUND, AS_LEFT = "as found", "as left"


@dataclass(frozen=True)
class Measured:
    """A run that is certified, and the state of the machine that it found: AS_FOUND or AS_LEFT."""

    run: int
    state: str

    @property
    def text(self) -> str:
        """The key of its state among the texts."""
        return f"record.{self.state.replace(' ', '_')}"


def next_number(db: Database, year: int) -> str:
    """The next free number of a year: ``2026-0001``."""
    numbers = certificate_numbers(db)
    last = max((int(n[5:]) for n in numbers if n.startswith(f"{year}-") and n[5:].isdigit()), default=0)
    return f"{year}-{last + 1:04d}"


def check_number(db: Database, number: str) -> None:
    """Before anything is computed: a number is a line of text, and is used once. Raises InputError."""
    check_number_of_certificate(number)
    try:
        old = load_certificate(db, number)
    except NotFoundError:
        return
    if old.state != "draft":
        raise InputError(
            f"the number {number} is taken, by the {old.state} certificate of campaign {old.campaign}; leave --number "
            "out for the next free one"
        )


def measured_runs(campaign: Campaign, run: int | None, as_left: int | None) -> tuple[Measured, ...]:
    """The runs that are certified: ``run`` as found, ``as_left`` behind an adjustment; the only one where none is
    named. Raises InputError where it is open which, or the machine cannot have been left as ``as_left`` says."""
    by_number = {run.run: run for run in campaign.runs}
    if run is None and as_left is None:
        if len(by_number) > 1:
            raise InputError(
                f"campaign {campaign.name} has {len(by_number)} runs ({min(by_number)} to {max(by_number)}): --run N "
                "says which one the certificate is of"
            )
        run = next(iter(by_number))
    measured = [Measured(run, AS_FOUND)] if run is not None else []
    measured += [Measured(as_left, AS_LEFT)] if as_left is not None else []
    for state in measured:
        if state.run not in by_number:
            numbers = ", ".join(map(str, by_number))
            raise NotFoundError(f"campaign {campaign.name} has no run {state.run}; it has {numbers}")
    if run is not None and as_left is not None and by_number[as_left].started_at <= by_number[run].started_at:
        raise InputError(
            f"run {as_left} was begun on {_when(by_number[as_left])}, run {run} on {_when(by_number[run])}: results as "
            "left are measured after those as found"
        )
    return tuple(measured)


def _when(run: Run) -> str:
    return f"{run.started_at:%Y-%m-%d %H:%M}"


def check_day(campaign: Campaign, measured: tuple[Measured, ...], day: date, today: date) -> None:
    """A certificate bears the day on which it is issued: not before its measurement, not to come. Raises InputError."""
    for run in campaign.runs:
        measured_on = run.started_at.date()
        if day < measured_on and any(state.run == run.run for state in measured):
            raise InputError(
                f"run {run.run} was measured on {measured_on}; no certificate was issued of it on {day}"
            )
    if day > today:
        raise InputError(
            f"--date {day} is still to come (today is {today}): a certificate is issued on its day; --draft shows it "
            "before"
        )


def check_adjustment(stated: LaboratoryFile, measured: tuple[Measured, ...]) -> None:
    """Results as left say that something was done; what, only the laboratory knows. Raises InputError."""
    if any(run.state == AS_LEFT for run in measured) and isinstance(stated.adjustment, NotApplicable):
        raise InputError(
            "results as left are stated, but adjustment under [statements] of the laboratory's file says that it does "
            "not apply: say in words what was adjusted or repaired between (ISO/IEC 17025:2017, 7.8.4.1 d)"
        )


def replaced_by(db: Database, number: str, reason: str, draft: bool, campaign: Campaign) -> Replaced:
    """The certificate to be replaced. Raises InputError where it cannot be replaced by one of ``campaign``."""
    old = load_certificate(db, number)
    if old.state != "issued":
        raise InputError(f"certificate {number} is {old.state}; only an issued one can be replaced")
    if draft:
        raise InputError("a draft replaces nothing; leave --replaces out until it is issued")
    reason = said_reason(reason, record_messages.why_replaced(number))
    if old.machine != campaign.machine.id:
        raise InputError(
            f"campaign {campaign.name} is of machine {campaign.machine.id}, certificate {number} of {old.machine}: "
            "it cannot replace it"
        )
    issued_on = date.fromisoformat(str(old.record["issued_on"]))
    return Replaced(number, issued_on, reason, old.pdf_sha256)


def runs_of(old: StoredCertificate) -> tuple[int | None, int | None]:
    """The runs that a stored certificate describes as found and as left, from its record and its list of runs."""
    states = from_document(MadeWith, old.record.get("inputs") or {}).states or (AS_FOUND,)
    by_state = dict(zip(states, old.runs, strict=False))
    return by_state.get(AS_FOUND), by_state.get(AS_LEFT)
