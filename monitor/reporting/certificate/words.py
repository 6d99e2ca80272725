"""Items of a certificate's record as texts of its language, the same on paper and in the digital certificate."""

from __future__ import annotations

from datetime import date

from monitor.reporting.certificate.record import ConformityStatement, NotApplicable, Replaced, Verdict
from monitor.reporting.texts import Texts


def answer(value: str | date | NotApplicable | ConformityStatement | None, texts: Texts) -> str:
    """What the laboratory answered to an item, as one text."""
    if isinstance(value, ConformityStatement):
        rule = f"{value.rule[:1].upper()}{value.rule[1:]}"
        # Records of before ``together`` speak of verdicts where there is one, too.
        is_one = value.together and len(value.verdicts) == 1
        return texts(f"conformity.stated{'_one' if is_one else ''}", rule=rule, risk=value.risk)
    if isinstance(value, NotApplicable):
        return texts("record.not_applicable", statement=value.statement)
    return texts.day(value) if isinstance(value, date) else value or ""


def amendment(replaced: Replaced | None, texts: Texts) -> str:
    """The sentence that names the certificate that this one replaces (7.8.8.3); empty where there is none."""
    if replaced is None or replaced.issued_on is None:
        return ""
    day = texts.day(replaced.issued_on)
    return texts("record.replaces", number=replaced.number, day=day, reason=replaced.reason)


def verdict_words(verdict: Verdict, texts: Texts) -> str:
    """The word for a verdict in the language."""
    return texts(f"conformity.{verdict.name.lower()}")
