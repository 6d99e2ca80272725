"""What a calibration certificate states: a record with every item that ISO/IEC 17025:2017 asks for.

Each item of 7.8.2.1 a to p and 7.8.4.1 a to f is a field; none has a default. A field that is None, or has an
empty part, is missing: ``completeness`` names it with its clause and refuses the record.
What does not apply is said by the laboratory in words, with ``NotApplicable``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from enum import StrEnum

from monitor.documents import OMITTED
from monitor.records import AuditAnchor
from monitor.reporting.certificate.grounds import AcceptedGround
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.signature.signer import Signer
from monitor.reporting.texts import ENGLISH

_EITHER = " or that it does not apply"


@dataclass(frozen=True)
class NotApplicable:
    """An item that the laboratory declares not to apply, in the words that are printed."""

    statement: str


@dataclass(frozen=True)
class Party:
    """A laboratory or a customer; the address line by line."""

    name: str | None
    address: tuple[str, ...]
    contact: str | None


@dataclass(frozen=True)
class Item:
    """The machine that was calibrated."""

    description: str | None
    identification: str | None
    condition: str | None


@dataclass(frozen=True)
class MethodUsed:
    """How it was calibrated: the method, the document that describes it, the model, the software."""

    name: str | None
    document: str | None
    model: str | None
    software: str | None


@dataclass(frozen=True)
class MeasuredCondition:
    """The number behind a condition: its ``column`` among those recorded (``ambient_degC``), value and display unit.

    ``expanded`` is its uncertainty (k = 2) where the laboratory states one.
    """

    column: str
    value: float
    unit: str
    expanded: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Condition:
    """A condition as printed: ``ambient temperature``, ``22.1 °C``.

    ``measured`` is the number where it has one; ``state`` the only state of the machine that it belongs to, None for
    all. Records of earlier versions have neither.
    """

    name: str
    value: str | None
    measured: MeasuredCondition | None = field(default=None, metadata=OMITTED)
    state: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Reference:
    """A standard that carries the traceability: what it is, and its certificate or a word why it has none."""

    name: str
    certificate: str | NotApplicable | None


@dataclass(frozen=True)
class Standard:
    """A reference standard: what it is, its own certificate with issuer and day, and until when that is valid."""

    name: str | None
    identification: str | None
    certificate: str | None
    issuer: str | None
    issued_on: date | None
    valid_until: date | NotApplicable | None


@dataclass(frozen=True)
class Accreditation:
    """The body that accredited the laboratory, and the number under which."""

    body: str | None
    number: str | None


@dataclass(frozen=True)
class Person:
    """Who authorises the certificate."""

    name: str | None
    function: str | None


class Verdict(StrEnum):
    """What a decision rule says of one parameter; the value is how records store it."""

    PASS = "pass"
    FAIL = "fail"
    CONDITIONAL_PASS = "conditional pass"
    CONDITIONAL_FAIL = "conditional fail"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class ConformityVerdict:
    """What is stated of one parameter: its tolerance (limit of the absolute value) and probability of conformity.

    ``guard_band`` w of the rule in the parameter's unit; None in a record of an earlier version. ``consumers_risk`` and
    ``producers_risk`` are the global risks of the rule (JCGM 106:2012, 9.5) where the spread of the process is stated.
    """

    name: str
    unit: str
    tolerance: float
    verdict: Verdict
    probability: float
    guard_band: float | None = field(default=None, metadata=OMITTED)
    consumers_risk: float | None = field(default=None, metadata=OMITTED)
    producers_risk: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ConformityStatement:
    """A statement of conformity: decision rule and risk in words, the verdicts, the joint probability of conformity.

    ``process`` says in words by which spread of the true values the global risks were found, None where by none.
    ``state``: to which results it applies; ``basis``: from where the tolerances are, and by which distribution the
    probabilities were found (ISO/IEC 17025:2017, 7.8.6.2). ``joint_probability`` is None where no parameter is judged,
    1 in such records of before. ``together`` says that all of it stands on one page where it can, and that its words
    begin with the joint probability: a line that a bold number does not fit into ends at its first hyphen. Records of
    before do not say so.
    """

    rule: str
    risk: str
    verdicts: tuple[ConformityVerdict, ...]
    joint_probability: float | None = field(default=None, kw_only=True, metadata=OMITTED)
    state: str
    basis: str
    process: str | None = field(default=None, metadata=OMITTED)
    together: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Replaced:
    """The certificate that this one replaces, why, and the SHA-256 of its document (7.8.8.1 and 7.8.8.3)."""

    number: str | None
    issued_on: date | None
    reason: str | None
    sha256: str | None


#: Field of the record: the clause of ISO/IEC 17025:2017 that asks for it, and the item in words.
ITEMS: Mapping[str, tuple[str, str]] = {
    "title": ("7.8.2.1 a", "title"),
    "laboratory": ("7.8.2.1 b", "laboratory"),
    "place": ("7.8.2.1 c", "place where the calibration was performed"),
    "number": ("7.8.2.1 d", "unique number of the certificate"),
    "customer": ("7.8.2.1 e", "customer"),
    "method": ("7.8.2.1 f", "method"),
    "item": ("7.8.2.1 g", "item calibrated"),
    "received_on": ("7.8.2.1 h", "date of receipt of the item" + _EITHER),
    "performed_on": ("7.8.2.1 i", "dates of the calibration"),
    "issued_on": ("7.8.2.1 j", "date of issue"),
    "sampling": ("7.8.2.1 k", "sampling plan" + _EITHER),
    "relates_only": ("7.8.2.1 l", "statement that the results relate only to the item calibrated"),
    "results": ("7.8.2.1 m and 7.8.4.1 a", "results with uncertainties"),
    "deviations": ("7.8.2.1 n", "additions to, deviations or exclusions from the method" + _EITHER),
    "authorised_by": ("7.8.2.1 o", "persons who authorise the certificate"),
    "external_results": ("7.8.2.1 p", "which results come from external providers" + _EITHER),
    "reproduction": ("7.8.2.1 note", "statement that the certificate is not to be reproduced except in full"),
    "conditions": ("7.8.4.1 b", "conditions of the calibration"),
    "traceability": ("7.8.4.1 c", "statement of metrological traceability"),
    "references": ("7.8.4.1 c", "standards that carry the traceability"),
    "adjustment": ("7.8.4.1 d", "results before and after adjustment or repair" + _EITHER),
    "conformity": ("7.8.4.1 e", "statement of conformity" + _EITHER),
    "opinions": ("7.8.4.1 f", "opinions and interpretations" + _EITHER),
}


@dataclass(frozen=True, kw_only=True)
class CertificateRecord:
    """One certificate. Nothing in it is computed here, nothing is filled in.

    What the laboratory says in words is in its own ``language`` (ISO 639-1), and so is what is printed around it.
    A ``ConformityVerdict`` keeps its kind, which gets its word where it is printed.

    ``performed_on`` are the first and last day of the calibration. ``ITEMS`` names the clause
    that asks for each field. ``accreditation`` is printed where a laboratory has one;
    ``country`` (ISO 3166-1, two letters) is what a digital certificate asks for besides.
    ``replaces`` is the certificate that this one amends. ``volumetric`` maps follow from the ``results``; they are
    printed where one was asked for. ``accepted`` are the grounds against it that the laboratory answers for; None where
    there were none. ``accredited`` and ``mark`` (a picture as a data address) are printed where the laboratory states
    them, ``standards`` with the traceability. ``anchor`` is the last entry of the audit when the certificate was made,
    ``draft`` is true of a draft, which says so on every page. ``signer`` who signs the file; ``dcc_version`` the
    release of the digital certificate (3.2.1 without); all None in records of earlier versions.
    """

    title: str | None
    laboratory: Party | None
    place: str | None
    number: str | None
    customer: Party | None
    method: MethodUsed | None
    item: Item | None
    received_on: date | NotApplicable | None
    performed_on: tuple[date, date] | None
    issued_on: date | None
    sampling: str | NotApplicable | None
    relates_only: str | None
    results: tuple[ResultSet, ...] | None
    deviations: str | NotApplicable | None
    authorised_by: tuple[Person, ...] | None
    external_results: str | NotApplicable | None
    reproduction: str | None
    conditions: tuple[Condition, ...] | None
    traceability: str | None
    references: tuple[Reference, ...] | None
    adjustment: str | NotApplicable | None
    conformity: str | NotApplicable | ConformityStatement | None
    opinions: str | NotApplicable | None
    accreditation: str | None = None
    country: str | None = None
    replaces: Replaced | None = None
    volumetric: tuple[VolumetricResult, ...] = ()
    language: str = ENGLISH
    accepted: tuple[AcceptedGround, ...] | None = field(default=None, metadata=OMITTED)
    accredited: Accreditation | None = field(default=None, metadata=OMITTED)
    mark: str | None = field(default=None, metadata=OMITTED)
    standards: tuple[Standard, ...] | None = field(default=None, metadata=OMITTED)
    anchor: AuditAnchor | None = field(default=None, metadata=OMITTED)
    signer: Signer | None = field(default=None, metadata=OMITTED)
    dcc_version: str | None = field(default=None, metadata=OMITTED)
    draft: bool | None = field(default=None, metadata=OMITTED)
