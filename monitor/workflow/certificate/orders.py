"""What has to hold before a certificate is computed: its number, its day, its runs, the one that it replaces."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import Any

from monitor.exceptions import InputError, NotFoundError
from monitor.records import Campaign, Run
from monitor.reporting.certificate.laboratory import LaboratoryFile
from monitor.reporting.certificate.record import NotApplicable, Replaced
from monitor.store import Database, certificate_numbers, load_certificate

#: The two states of a machine that a certificate may describe (ISO/IEC 17025:2017, 7.8.4.1 d).
AS_FOUND, AS_LEFT = "as found", "as left"
#: A number stands in a line on every page, in a file's name and in other certificates.
_LONGEST_NUMBER = 60


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
    taken = certificate_numbers(db)
    last = max((int(n[5:]) for n in taken if n.startswith(f"{year}-") and n[5:].isdigit()), default=0)
    return f"{year}-{last + 1:04d}"


def check_number(db: Database, number: str) -> None:
    """Before anything is computed: a number is a line of text, and is used once. Raises InputError."""
    if not number.strip():
        raise InputError("the number of a certificate is not blank; leave --number out for the next free one")
    if number != number.strip() or not number.isprintable() or len(number) > _LONGEST_NUMBER:
        raise InputError(
            f"the number of a certificate is one line of at most {_LONGEST_NUMBER} visible letters without blanks "
            f"around it, not {number!r}"
        )
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
    known = {one.run: one for one in campaign.runs}
    if run is None and as_left is None:
        if len(known) > 1:
            raise InputError(
                f"campaign {campaign.name} has {len(known)} runs ({min(known)} to {max(known)}): --run N says which "
                "one the certificate is of"
            )
        run = next(iter(known))
    found = [Measured(run, AS_FOUND)] if run is not None else []
    found += [Measured(as_left, AS_LEFT)] if as_left is not None else []
    for one in found:
        if one.run not in known:
            raise NotFoundError(
                f"campaign {campaign.name} has no run {one.run}; it has {', '.join(str(number) for number in known)}"
            )
    if run is not None and as_left is not None and known[as_left].started_at <= known[run].started_at:
        raise InputError(
            f"run {as_left} was begun on {_when(known[as_left])}, run {run} on {_when(known[run])}: results as "
            "left are measured after those as found"
        )
    return tuple(found)


def _when(run: Run) -> str:
    return f"{run.started_at:%Y-%m-%d %H:%M}"


def check_day(campaign: Campaign, measured: tuple[Measured, ...], day: date, today: date) -> None:
    """A certificate bears the day on which it is issued: not before its measurement, not to come. Raises InputError."""
    for one in measured:
        (on,) = (run.started_at.date() for run in campaign.runs if run.run == one.run)
        if day < on:
            raise InputError(f"run {one.run} was measured on {on}; no certificate was issued of it on {day}")
    if day > today:
        raise InputError(
            f"--date {day} is still to come (today is {today}): a certificate is issued on its day; --draft shows it "
            "before"
        )


def check_adjustment(stated: LaboratoryFile, measured: tuple[Measured, ...]) -> None:
    """Results as left say that something was done; what, only the laboratory knows. Raises InputError."""
    if any(one.state == AS_LEFT for one in measured) and isinstance(stated.adjustment, NotApplicable):
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
    if not reason.strip():
        raise InputError(f"say why certificate {number} is replaced: --reason TEXT")
    if old.machine != campaign.machine.id:
        raise InputError(
            f"campaign {campaign.name} is of machine {campaign.machine.id}, certificate {number} of {old.machine}: "
            "it cannot replace it"
        )
    issued_on = date.fromisoformat(str(old.record["issued_on"]))
    return Replaced(number, issued_on, reason.strip(), old.pdf_sha256)


def runs_of(record: Any, runs: tuple[int, ...]) -> tuple[int | None, int | None]:
    """The runs that a stored certificate describes as found and as left, from its record and its list of runs."""
    states = (record.get("inputs") or {}).get("states") or [AS_FOUND]
    by_state = dict(zip(states, runs, strict=False))
    return by_state.get(AS_FOUND), by_state.get(AS_LEFT)
