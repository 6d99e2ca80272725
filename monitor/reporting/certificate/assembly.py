"""A certificate's record put together: from the campaign, the stored results, and the laboratory's file.

Each item has one origin. What none of the three knows stays None and makes the certificate refuse itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from monitor import __version__
from monitor.exceptions import NotFoundError
from monitor.records import Campaign, Machine, Run, Setup
from monitor.reporting.certificate.laboratory import LaboratoryFile
from monitor.reporting.certificate.record import (
    CertificateRecord,
    Condition,
    Item,
    MeasuredCondition,
    MethodUsed,
    Reference,
)
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.numbers import decimal_of
from monitor.reporting.texts import ENGLISH, Texts, texts_of
from monitor.units import COLUMN_UNITS, column_unit

#: What a condition's name says in words; other names are printed as recorded.
_CONDITION_WORDS = {"ambient_degC": "ambient", "humidity_percent": "humidity", "pressure_hPa": "pressure"}


@dataclass(frozen=True)
class CertificateIdentity:
    """Number and day of a certificate, the stored model's name and version; ``method_name`` replaces the campaign's
    word for its method."""

    number: str | None
    issued_on: date | None
    model: str | None
    method_name: str | None = None


def certificate_record(
    laboratory: LaboratoryFile,
    campaign: Campaign,
    runs: int | Sequence[int],
    results: Sequence[ResultSet],
    identity: CertificateIdentity,
    volumetric: Sequence[VolumetricResult] = (),
) -> CertificateRecord:
    """The record for one run of a campaign, or for two: as found and as left, in the order of ``results``.

    The words around the numbers are in the laboratory's
    language. Nothing is checked here: see ``check_complete``. Raises NotFoundError where the campaign has no such run.
    """
    certified = [_run_of(campaign, run) for run in ([runs] if isinstance(runs, int) else runs)]
    days = [run.started_at.date() for run in certified]
    machine = campaign.machine
    texts = texts_of(laboratory.language or ENGLISH)
    return CertificateRecord(
        title=laboratory.title,
        laboratory=laboratory.laboratory,
        place=laboratory.place or machine.location,
        number=identity.number,
        customer=laboratory.customer,
        method=MethodUsed(
            name=identity.method_name or campaign.method,
            document=laboratory.method_document,
            model=identity.model,
            software=f"machine-health-monitor {__version__}",
        ),
        item=Item(
            description=laboratory.item_description or _description(machine, texts),
            identification=laboratory.item_identification or _identification(machine, texts),
            condition=laboratory.item_condition,
        ),
        received_on=laboratory.received_on,
        performed_on=(min(days), max(days)),
        issued_on=identity.issued_on,
        sampling=laboratory.sampling,
        relates_only=laboratory.relates_only,
        results=tuple(results),
        deviations=laboratory.deviations,
        authorised_by=laboratory.authorised_by,
        external_results=laboratory.external_results,
        reproduction=laboratory.reproduction,
        conditions=(
            *_conditions_of(campaign, certified, [result.state for result in results], texts),
            *_temperatures(laboratory, texts),
        ),
        traceability=laboratory.traceability,
        references=_references(laboratory, campaign, texts),
        adjustment=laboratory.adjustment,
        conformity=laboratory.conformity,
        opinions=laboratory.opinions,
        accreditation=laboratory.accreditation,
        country=laboratory.country,
        accredited=laboratory.accredited,
        mark=laboratory.mark,
        standards=laboratory.standards,
        volumetric=tuple(volumetric),
        language=texts.language,
    )


def _run_of(campaign: Campaign, run: int) -> Run:
    for candidate in campaign.runs:
        if candidate.run == run:
            return candidate
    numbers = ", ".join(str(candidate.run) for candidate in campaign.runs)
    raise NotFoundError(f"campaign {campaign.name} has no run {run}; it has {numbers}")


def _description(machine: Machine, texts: Texts) -> str:
    """Maker and model where the campaign names them, and always the chain that was calibrated."""
    maker = " ".join(filter(None, [machine.manufacturer, machine.model]))
    return ", ".join(filter(None, [maker, texts("record.chain", topology=machine.topology)]))


def _identification(machine: Machine, texts: Texts) -> str:
    if not machine.serial_number:
        return machine.id
    return texts("record.serial_number", id=machine.id, serial=machine.serial_number)


def _conditions_of(
    campaign: Campaign, runs: Sequence[Run], states: Sequence[str], texts: Texts
) -> tuple[Condition, ...]:
    """The conditions of every run; those that differ between two runs say of which state of the machine they are."""
    each = [_conditions(campaign, run, texts) for run in runs]
    if len(each) == 1:
        return each[0]
    shared = set(each[0]).intersection(*each[1:])
    of_one_state = [
        Condition(f"{condition.name}, {state}", condition.value, condition.measured, state)
        for conditions, state in zip(each, states, strict=True)
        for condition in conditions
        if condition not in shared
    ]
    return (*of_one_state, *(condition for condition in each[0] if condition in shared))


def _conditions(campaign: Campaign, run: Run, texts: Texts) -> tuple[Condition, ...]:
    recorded = [
        Condition(
            texts(f"record.{_CONDITION_WORDS[name]}") if name in _CONDITION_WORDS else _in_words(name),
            _with_unit(name, value, texts),
            _measured(name, value),
        )
        for name, value in run.conditions.items()
    ]
    offset = run.started_at.strftime("%z")
    start = texts(
        "record.run_of",
        run=run.run,
        campaign=campaign.name,
        day=run.day,
        start=f"{texts.day(run.started_at.date())} {run.started_at:%H:%M}",
        offset=f"{offset[:3]}:{offset[3:5]}",
    )
    touched = int((campaign.probings.run == run.run).sum())
    balls, setups = len(campaign.artefact.balls), campaign.artefact.setups
    targets = len(set(campaign.probings.target[campaign.probings.run == run.run].tolist()))
    if setups:
        plan = texts("record.plan_of_setups", readings=touched, count=len(setups))
    elif balls:
        plan = texts("record.plan_of", probings=touched, balls=balls)
    else:
        plan = texts("record.plan_of_targets", probings=touched, targets=targets)
    # Instruments that are set up one after the other are no artefact: they stand among the references.
    artefact = () if setups else (Condition(texts("record.artefact"), campaign.artefact.id),)
    return (
        Condition(texts("record.run"), start if offset else None),
        Condition(
            texts("record.machine"), texts("record.warming_up" if run.warm_up else "record.not_warming_up")
        ),
        *recorded,
        Condition(texts("record.plan"), plan),
        *artefact,
    )


def _temperatures(laboratory: LaboratoryFile, texts: Texts) -> tuple[Condition, ...]:
    """What the laboratory measured of machine and standard, and to which temperature the results refer."""
    stated = laboratory.temperature
    if stated is None:
        return ()
    values = []
    for subject in ("machine", "standard"):
        value = _with_unit(f"{subject}_degC", float(stated[f"{subject}_degC"]), texts)
        expanded = _with_unit(f"{subject}_degC", float(stated[f"{subject}_U_degC"]), texts)
        values.append(
            Condition(
                texts(f"record.{subject}_temperature"),
                texts("record.with_uncertainty", value=value, expanded=expanded),
                _measured(
                    f"{subject}_degC", float(stated[f"{subject}_degC"]), float(stated[f"{subject}_U_degC"])
                ),
            )
        )
    return (*values, Condition(texts("record.reference_temperature"), str(stated["reference"])))


def _measured(name: str, value: float, expanded: float | None = None) -> MeasuredCondition | None:
    """The number of a condition whose column names its unit; None for another."""
    unit = column_unit(name)
    return None if unit is None else MeasuredCondition(name, value, unit.name, expanded)


def _in_words(name: str) -> str:
    stem, _, suffix = name.rpartition("_")
    return (stem if stem and suffix in COLUMN_UNITS else name).replace("_", " ")


def _with_unit(name: str, value: float, texts: Texts) -> str:
    stem, _, suffix = name.rpartition("_")
    unit = COLUMN_UNITS.get(suffix) if stem else None
    number = texts.number(decimal_of(value, name))
    return f"{number}\N{NO-BREAK SPACE}{unit.name}" if unit else number


def _references(laboratory: LaboratoryFile, campaign: Campaign, texts: Texts) -> tuple[Reference, ...]:
    if campaign.artefact.setups:
        return _instrument_references(laboratory, campaign.artefact.setups, texts)
    probe, bar = campaign.probe, campaign.artefact.scale_bar
    name = texts("record.probe", id=probe.id, model=probe.model)
    references = [Reference(name, probe.certificate or laboratory.probe)]
    if bar is not None:
        first, second = bar.balls
        name = texts("record.bar", first=first, second=second)
        references.insert(0, Reference(name, bar.certificate or laboratory.scale_bar))
    return tuple(references)


def _instrument_references(
    laboratory: LaboratoryFile, setups: Sequence[Setup], texts: Texts
) -> tuple[Reference, ...]:
    """Each instrument with its setups: the certificate that the campaign names, else what the laboratory states."""
    by_instrument: dict[tuple[str, str | None], list[str]] = {}
    for setup in setups:
        by_instrument.setdefault((setup.instrument or setup.reading, setup.certificate), []).append(setup.id)
    return tuple(
        Reference(
            texts("record.instrument", name=name, setups=", ".join(ids)),
            certificate or laboratory.instruments,
        )
        for (name, certificate), ids in by_instrument.items()
    )
