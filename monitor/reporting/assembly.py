"""A certificate's record put together: from the campaign, the stored results, and the laboratory's file.

Each item has one origin. What none of the three knows stays None and makes the certificate refuse itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

from monitor import __version__
from monitor.exceptions import NotFoundError
from monitor.records import Campaign, Machine, Run
from monitor.reporting.certificate import CertificateRecord, Condition, Item, MethodUsed, Reference
from monitor.reporting.laboratory import LaboratoryFile
from monitor.reporting.numbers import decimal_of, written
from monitor.reporting.results import ResultSet
from monitor.units import COLUMN_UNITS

#: What a condition's name says in words; other names are printed as recorded.
_CONDITION_WORDS = {
    "ambient_degC": "ambient temperature",
    "humidity_percent": "relative humidity",
    "pressure_hPa": "air pressure",
}


def certificate_record(
    laboratory: LaboratoryFile,
    campaign: Campaign,
    run: int,
    results: Sequence[ResultSet],
    *,
    number: str | None,
    issued_on: date | None,
    model: str | None,
    method_name: str | None = None,
) -> CertificateRecord:
    """The record for one run of a campaign. ``model`` is the stored model's name and version.

    ``method_name`` replaces the campaign's word for its method. Nothing is checked here: see
    ``check_complete``. Raises NotFoundError where the campaign has no such run.
    """
    chosen = _run_of(campaign, run)
    day = chosen.started_at.date()
    machine = campaign.machine
    return CertificateRecord(
        title=laboratory.title,
        laboratory=laboratory.laboratory,
        place=laboratory.place or machine.location,
        number=number,
        customer=laboratory.customer,
        method=MethodUsed(
            name=method_name or campaign.method,
            document=laboratory.method_document,
            model=model,
            software=f"machine-health-monitor {__version__}",
        ),
        item=Item(
            description=laboratory.item_description or _description(machine),
            identification=laboratory.item_identification or _identification(machine),
            condition=laboratory.item_condition,
        ),
        received_on=laboratory.received_on,
        performed_on=(day, day),
        issued_on=issued_on,
        sampling=laboratory.sampling,
        relates_only=laboratory.relates_only,
        results=tuple(results),
        deviations=laboratory.deviations,
        authorised_by=laboratory.authorised_by,
        external_results=laboratory.external_results,
        reproduction=laboratory.reproduction,
        conditions=_conditions(campaign, chosen),
        traceability=laboratory.traceability,
        references=_references(laboratory, campaign),
        adjustment=laboratory.adjustment,
        conformity=laboratory.conformity,
        opinions=laboratory.opinions,
        accreditation=laboratory.accreditation,
        country=laboratory.country,
    )


def _run_of(campaign: Campaign, run: int) -> Run:
    for candidate in campaign.runs:
        if candidate.run == run:
            return candidate
    there = ", ".join(str(candidate.run) for candidate in campaign.runs)
    raise NotFoundError(f"campaign {campaign.name} has no run {run}; it has {there}")


def _description(machine: Machine) -> str:
    """Maker and model where the campaign names them, and always the chain that was calibrated."""
    maker = [machine.manufacturer or "", machine.model or ""]
    return ", ".join(filter(None, [" ".join(filter(None, maker)), f"chain {machine.topology}"]))


def _identification(machine: Machine) -> str:
    return f"{machine.id}, serial number {machine.serial_number}" if machine.serial_number else machine.id


def _conditions(campaign: Campaign, run: Run) -> tuple[Condition, ...]:
    recorded = [
        Condition(_CONDITION_WORDS.get(name, _in_words(name)), _with_unit(name, value))
        for name, value in run.conditions.items()
    ]
    offset = run.started_at.strftime("%z")
    start = f"{run.started_at:%Y-%m-%d %H:%M} (UTC{offset[:3]}:{offset[3:5]})" if offset else None
    state = "warming up" if run.warm_up else "run not marked as warm-up"
    touched = int((campaign.probings.run == run.run).sum())
    return (
        Condition(
            "run", f"{run.run} of campaign {campaign.name}, day {run.day}, begun {start}" if start else None
        ),
        Condition("machine", state),
        *recorded,
        Condition("plan", f"{touched} probings of {_targets(campaign, run)}"),
        Condition("artefact", campaign.artefact.id),
    )


def _targets(campaign: Campaign, run: Run) -> str:
    if campaign.artefact.balls:
        return f"{len(campaign.artefact.balls)} balls"
    return f"{len(set(campaign.probings.target[campaign.probings.run == run.run].tolist()))} targets"


def _in_words(name: str) -> str:
    stem, _, suffix = name.rpartition("_")
    return (stem if stem and suffix in COLUMN_UNITS else name).replace("_", " ")


def _with_unit(name: str, value: float) -> str:
    stem, _, suffix = name.rpartition("_")
    unit = COLUMN_UNITS.get(suffix) if stem else None
    number = written(decimal_of(value, name))
    return f"{number}\N{NO-BREAK SPACE}{unit.name}" if unit else number


def _references(laboratory: LaboratoryFile, campaign: Campaign) -> tuple[Reference, ...]:
    probe, bar = campaign.probe, campaign.artefact.scale_bar
    found = [Reference(f"probe {probe.id} ({probe.model})", probe.certificate or laboratory.probe)]
    if bar is not None:
        balls = " and ".join(bar.balls)
        found.insert(
            0, Reference(f"scale bar between balls {balls}", bar.certificate or laboratory.scale_bar)
        )
    return tuple(found)
