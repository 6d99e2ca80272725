"""Is a certificate's record complete, and do its dates agree? Asked before anything is printed or written.

An item is missing where it is None, empty, or says nothing: blanks, dashes, ``n/a``, ``TBD``. What does not apply is
said with a reason (``NotApplicable``).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from monitor.exceptions import InputError, RefusedResultError
from monitor.reporting.certificate.grounds import Ground, ground_sentence
from monitor.reporting.certificate.laboratory_keys import key_of
from monitor.reporting.certificate.record import ITEMS, CertificateRecord, Standard
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.texts import texts_of

#: What only a certificate that replaces another has to say.
AMENDMENT = ("7.8.8.1 and 7.8.8.3", "reference to the certificate that it replaces, with the reason")
#: What a laboratory need not state, but where it does, whole.
_STATED = {
    "accredited": ("8.1 and ILAC P8", "accreditation"),
    "standards": ("7.8.4.1 c", "reference standards"),
}
#: Written where nothing is known: a reader learns no more from it than from a blank. Not "na", which is a name too.
_PLACEHOLDERS = frozenset({"n/a", "n.a.", "n. a.", "k.a.", "k. a.", "tbd", "tba", "t.b.d."})
#: Units that have neither a letter nor a digit: of a relative humidity, of an angle.
_UNITS_OF_SIGNS = frozenset({"%", "‰", "°", "′", "″"})


@dataclass(frozen=True)
class MissingItem:
    """An item that the certificate lacks: the clause, what it is, and what of it is missing (may be empty).

    ``key`` is where the laboratory's file, or the campaign's, answers it; empty where what was computed does.
    """

    clause: str
    item: str
    part: str = ""
    key: str = ""

    def __str__(self) -> str:
        part = f", {self.part}" if self.part else ""
        key = f": write {self.key}" if self.key else ""
        return f"{self.item}{part}{key} (ISO/IEC 17025:2017, {self.clause})"


class IncompleteCertificateError(InputError):
    """A certificate that lacks items; ``missing`` lists them all."""

    def __init__(self, missing: tuple[MissingItem, ...]) -> None:
        self.missing = missing
        count = len(missing)
        lines = [f"the certificate is refused: {count} item{'s are' if count != 1 else ' is'} missing"]
        lines += [f"  {gap}" for gap in missing]
        if any(gap.key for gap in missing):
            lines.append(
                "the keys are those of the laboratory's file where no other is named; "
                "`monitor certificate template` writes one with all of them"
            )
        super().__init__("\n".join(lines))


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


def missing_items(record: CertificateRecord) -> tuple[MissingItem, ...]:
    """Every item that is None, empty or says nothing, and every such part of an item, in the order of the record."""
    missing: list[MissingItem] = []
    texts = texts_of(record.language)
    for name, (clause, element) in ITEMS.items():
        missing += [
            MissingItem(clause, element, part, key_of(name, part, texts))
            for part in _gaps(getattr(record, name))
        ]
    for field, clause_and_item in _STATED.items():
        missing += [
            MissingItem(*clause_and_item, part, key_of(field, part, texts))
            for part in _gaps(getattr(record, field))
            if getattr(record, field) is not None
        ]
    if record.replaces is not None:
        missing += [MissingItem(*AMENDMENT, part) for part in _gaps(record.replaces)]
    return tuple(missing)


def date_faults(record: CertificateRecord) -> tuple[str, ...]:
    """What cannot be true of a record's dates: an item that came after its calibration, an issue before it."""
    faults = []
    if record.performed_on is not None:
        first, last = record.performed_on
        if last < first:
            faults.append(f"the calibration ended on {last}, before it began on {first}")
        if isinstance(record.received_on, date) and record.received_on > first:
            faults.append(f"the item was received on {record.received_on}, after the calibration of {first}")
        if record.issued_on is not None and record.issued_on < last:
            faults.append(f"it was issued on {record.issued_on}, before the calibration of {last}")
        faults += [
            fault for standard in record.standards or () for fault in _standard_faults(standard, first, last)
        ]
    issued, old = record.issued_on, record.replaces
    if issued is not None and old is not None and old.issued_on is not None and issued < old.issued_on:
        faults.append(
            f"it replaces certificate {old.number} of {old.issued_on}, and was issued on {issued}, before it"
        )
    return tuple(faults)


def _standard_faults(standard: Standard, first: date, last: date) -> list[str]:
    """What cannot be true of a standard's dates for a calibration from ``first`` to ``last``."""
    faults = []
    if standard.issued_on is not None and standard.issued_on > first:
        faults.append(
            f"the certificate of {standard.name} was issued on {standard.issued_on}, after the calibration of {first}"
        )
    if isinstance(standard.valid_until, date) and standard.valid_until < last:
        faults.append(
            f"the certificate of {standard.name} was valid until {standard.valid_until}, which is before the "
            f"calibration of {last}"
        )
    return faults


def check_complete(record: CertificateRecord) -> None:
    """Raise IncompleteCertificateError, with the whole list, where an item is missing; InputError for dates that
    contradict one another."""
    missing = missing_items(record)
    if missing:
        raise IncompleteCertificateError(missing)
    faults = date_faults(record)
    if faults:
        raise InputError(
            "\n  ".join(["the certificate is refused, its dates contradict one another:", *faults])
        )


def _gaps(value: object) -> list[str]:
    """Which parts of a value are missing; ``""`` is the value itself."""
    if value is None:
        return [""]
    if isinstance(value, str):
        return gaps_of_text(value)
    if isinstance(value, tuple):
        if not value:
            return [""]
        return [_within(_label(element), gap) or "one entry" for element in value for gap in _gaps(element)]
    if isinstance(value, ResultSet):
        return list(value.gaps())
    if dataclasses.is_dataclass(value):
        return [
            _within(part.name, gap)
            for part in dataclasses.fields(value)
            # What may be left out of a record is not missing where it is.
            if not (part.metadata.get("omitted") and getattr(value, part.name) is None)
            for gap in _gaps(getattr(value, part.name))
        ]
    return []


def gaps_of_text(text: str) -> list[str]:
    """Return why a text of the laboratory states nothing: blank, or a placeholder; empty where it states something."""
    if not text.strip():
        return [""]
    said = text.strip().casefold()
    if said in _PLACEHOLDERS or not (said in _UNITS_OF_SIGNS or any(sign.isalnum() for sign in said)):
        return [f"{text.strip()!r} says nothing"]
    return []


def _within(name: str, gap: str) -> str:
    """A gap of something that has a name, told with that name."""
    if gap.endswith("says nothing"):
        return f"{name}: {gap}" if name else gap
    return " of ".join(filter(None, (gap, name)))


def _label(element: object) -> str:
    name = getattr(element, "name", None)
    return name if isinstance(name, str) else ""
