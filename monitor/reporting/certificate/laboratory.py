"""What a laboratory states on its certificates: the TOML file that it writes once and keeps.

Nothing is filled in: a key that is absent stays None, and the certificate that needs it is refused by name.
``examples/laboratory.toml`` shows every key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Any

from monitor.exceptions import InputError
from monitor.reporting.certificate.dcc_elements import DccVersion
from monitor.reporting.certificate.laboratory_keys import SECTIONS
from monitor.reporting.certificate.mark import read_mark
from monitor.reporting.certificate.record import Accreditation, NotApplicable, Party, Person, Standard
from monitor.reporting.certificate.samples import sample_faults
from monitor.reporting.resources import report_text
from monitor.reporting.texts import languages
from monitor.toml_text import toml_file

#: The keys that may be answered by ``{ not_applicable = "..." }``.
MAY_NOT_APPLY = frozenset(
    {
        "item.received_on",
        "traceability.probe",
        "traceability.scale_bar",
        "traceability.instruments",
        "standards.valid_until",
        "statements.sampling",
        "statements.deviations",
        "statements.external_results",
        "statements.adjustment",
        "statements.conformity",
        "statements.opinions",
    }
)

Statement = str | NotApplicable


@dataclass(frozen=True)
class LaboratoryFile:
    """The answers of a laboratory, None where it gave none.

    ``item_*`` replace what the campaign says of the machine; ``probe``, ``scale_bar`` and ``instruments`` are the
    certificates of those standards where the campaign names none. ``mark`` is the laboratory's picture as a data
    address; ``temperature`` what was measured of machine and standard, by its key.
    """

    laboratory: Party | None
    customer: Party | None
    accreditation: str | None
    item_description: str | None
    item_identification: str | None
    item_condition: str | None
    place: str | None
    received_on: date | NotApplicable | None
    method_document: str | None
    traceability: str | None
    probe: Statement | None
    scale_bar: Statement | None
    title: str | None
    sampling: Statement | None
    relates_only: str | None
    deviations: Statement | None
    external_results: Statement | None
    reproduction: str | None
    adjustment: Statement | None
    conformity: Statement | None
    opinions: Statement | None
    authorised_by: tuple[Person, ...] | None
    country: str | None = None
    dcc_version: str | None = None
    language: str | None = None
    accredited: Accreditation | None = None
    mark: str | None = None
    standards: tuple[Standard, ...] | None = None
    temperature: Mapping[str, float | str] | None = None
    instruments: Statement | None = None


def read_laboratory(path: str | Path) -> LaboratoryFile:
    """The answers in a TOML file. Raises InputError, with all faults, where it cannot be read as such."""
    file = Path(path)
    try:
        tables = toml_file(file)
    except InputError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            raise InputError(f"{error}; `monitor certificate template` writes a file to fill in") from error
        raise
    faults: list[str] = []
    answers = _answers(tables, faults)
    mark = read_mark(file, answers.get("laboratory.mark"), faults)
    _check_temperature(answers, faults)
    faults += sample_faults(answers)
    if faults:
        raise InputError("\n  ".join([f"{file} was refused:", *faults]))
    people = answers.get("authorised_by")
    return LaboratoryFile(
        laboratory=_party("laboratory", answers),
        customer=_party("customer", answers),
        accreditation=answers.get("laboratory.accreditation"),
        country=answers.get("laboratory.country"),
        dcc_version=answers.get("laboratory.dcc_version"),
        language=answers.get("laboratory.language"),
        item_description=answers.get("item.description"),
        item_identification=answers.get("item.identification"),
        item_condition=answers.get("item.condition"),
        place=answers.get("item.place"),
        received_on=answers.get("item.received_on"),
        method_document=answers.get("method.document"),
        traceability=answers.get("traceability.statement"),
        probe=answers.get("traceability.probe"),
        scale_bar=answers.get("traceability.scale_bar"),
        authorised_by=people,
        accredited=(
            Accreditation(answers.get("accreditation.body"), answers.get("accreditation.number"))
            if "accreditation" in tables
            else None
        ),
        mark=mark,
        standards=answers.get("standards"),
        instruments=answers.get("traceability.instruments"),
        temperature={
            key: answers[name] for key in SECTIONS["temperature"] if (name := f"temperature.{key}") in answers
        }
        or None,
        **{key: answers.get(f"statements.{key}") for key in SECTIONS["statements"]},
    )


def template(language: str) -> str:
    """A laboratory's file with every key and no answer yet, its comments in a language that certificates have.

    Raises InputError for another.
    """
    if language not in languages():
        raise InputError(f"there is no template in {language!r}; there are {', '.join(languages())}")
    return report_text(f"laboratory.{language}.toml")


def _answers(tables: Mapping[str, Any], faults: list[str]) -> dict[str, Any]:
    """Every answer under ``section.key``; what is wrong goes to ``faults``."""
    answers: dict[str, Any] = {}
    for section, content in tables.items():
        if section not in SECTIONS:
            faults.append(f"there is no section [{section}]; there are {', '.join(SECTIONS)}")
        elif section in _LISTS:
            if not isinstance(content, list) or not all(isinstance(entry, dict) for entry in content):
                faults.append(f"{section} is a list of {_LISTS[section][0]}: begin each with [[{section}]]")
                continue
            entries = [_section(section, entry, faults) for entry in content]
            answers[section] = tuple(
                _LISTS[section][1](*(entry.get(f"{section}.{key}") for key in SECTIONS[section]))
                for entry in entries
            )
        elif isinstance(content, dict):
            answers |= _section(section, content, faults)
        else:
            faults.append(f"{section} is a section: write [{section}] and its keys below")
    return answers


def _section(section: str, content: Mapping[str, Any], faults: list[str]) -> dict[str, Any]:
    answers = {}
    for key, value in content.items():
        name = f"{section}.{key}"
        if key not in SECTIONS[section]:
            faults.append(f"[{section}] has no key {key}; it has {', '.join(SECTIONS[section])}")
            continue
        answer = _answer(name, value, faults)
        if answer is not None:
            answers[name] = answer
    return answers


def _answer(name: str, value: Any, faults: list[str]) -> Any:
    """The answer to the item ``name``; None, with a fault, where it is none."""
    if (
        isinstance(value, dict)
        and set(value) == {"not_applicable"}
        and isinstance(value["not_applicable"], str)
    ):
        if name in MAY_NOT_APPLY:
            return NotApplicable(value["not_applicable"])
        faults.append(f"{name} always applies; not_applicable is no answer to it")
        return None
    answer, fault = _RULES.get(name, _text)(value)
    if fault:
        faults.append(f"{name} {fault}")
    return answer


#: An answer, and what is wrong with it behind the name of its item; empty where nothing is.
_Checked = tuple[Any, str]


def _text(value: Any) -> _Checked:
    return (value, "") if isinstance(value, str) else (None, f"is a text in quotes, but is {value!r}")


def _text_or_left_out(value: Any) -> _Checked:
    if isinstance(value, str) and not value.strip():
        return None, "is blank; leave the line out where there is none"
    return _text(value)


def _temperature(value: Any) -> _Checked:
    if isinstance(value, int | float) and not isinstance(value, bool) and -50.0 <= value <= 100.0:
        return float(value), ""
    return None, f"is a temperature in °C between -50 and 100, without quotes, but is {value!r}"


def _uncertainty(value: Any) -> _Checked:
    if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value <= 50.0:
        return float(value), ""
    return None, f"is an expanded uncertainty (k = 2) in °C above 0, without quotes, but is {value!r}"


def _address(value: Any) -> _Checked:
    if isinstance(value, list) and all(isinstance(line, str) for line in value):
        return tuple(value), ""
    return None, f'is a list of lines, for example ["1 Example Road", "Town"], but is {value!r}'


def _day(value: Any) -> _Checked:
    if isinstance(value, date) and not isinstance(value, datetime):
        return value, ""
    return None, f"is a date without quotes, for example 2026-03-02, but is {_shown(value)}"


def _language(value: Any) -> _Checked:
    return (
        (value, "")
        if value in languages()
        else (None, f"is one of {', '.join(languages())}, but is {value!r}")
    )


def _release(value: Any) -> _Checked:
    return (
        (value, "")
        if value in list(DccVersion)
        else (
            None,
            f"is the release of the digital certificate, one of {', '.join(DccVersion)}, but is {value!r}",
        )
    )


#: Items that are answered by something else than any text.
_RULES: Mapping[str, Callable[[Any], _Checked]] = {
    "laboratory.address": _address,
    "customer.address": _address,
    "item.received_on": _day,
    "laboratory.language": _language,
    "laboratory.dcc_version": _release,
    "laboratory.accreditation": _text_or_left_out,
    "laboratory.country": _text_or_left_out,
    "standards.issued_on": _day,
    "standards.valid_until": _day,
    "temperature.machine_degC": _temperature,
    "temperature.machine_U_degC": _uncertainty,
    "temperature.standard_degC": _temperature,
    "temperature.standard_U_degC": _uncertainty,
}


#: Sections that are lists: what an entry is called, and what it becomes.
_LISTS: Mapping[str, tuple[str, Callable[..., Any]]] = {
    "authorised_by": ("persons", Person),
    "standards": ("standards", Standard),
}


def _check_temperature(answers: Mapping[str, Any], faults: list[str]) -> None:
    """Note what is missing of the temperatures, where any is stated: one without its uncertainty says too little."""
    if not any(name.startswith("temperature.") for name in answers):
        return
    faults += [
        f"[temperature] has {key} missing: a temperature is stated with its expanded uncertainty, both of machine and "
        'standard, and with the reference (for example "results refer to 20 °C")'
        for key in SECTIONS["temperature"]
        if f"temperature.{key}" not in answers
    ]


def _shown(value: object) -> str:
    return value.isoformat() if isinstance(value, datetime) else repr(value)


def _party(section: str, answers: Mapping[str, Any]) -> Party | None:
    keys = [f"{section}.{key}" for key in ("name", "address", "contact")]
    if not any(key in answers for key in keys):
        return None
    name, address, contact = keys
    return Party(answers.get(name), answers.get(address, ()), answers.get(contact))
