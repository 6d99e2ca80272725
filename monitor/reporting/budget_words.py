"""Sentences on what stands behind a stated uncertainty, in each language."""

from __future__ import annotations

from collections.abc import Mapping

from monitor.reporting.budget import (
    DayToDay,
    HoldsFor,
    LengthKind,
    LengthReference,
    StatedSource,
    Unchecked,
    larger_than_u,
)
from monitor.reporting.numbers import decimal_of, round_result, round_to_place, round_uncertainty
from monitor.reporting.texts import Texts
from monitor.sources import HALF_WIDTHS, Law, Quantity

#: More parameters are counted, not named.
_NAMED = 3
#: K from the reference temperature: less is printed as 0, and an expansion coefficient does nothing.
_LEAST_KELVIN = 0.005


def days_sentences(
    holds_for: HoldsFor,
    days: DayToDay | None,
    expanded: Mapping[str, float],
    units: Mapping[str, str],
    texts: Texts,
) -> tuple[str, ...]:
    """For which time the uncertainty holds, what the days differ by, and what cannot be known."""
    sentences = [texts(f"budget.holds_for_{holds_for.value}")]
    if days is None:
        return tuple(sentences)
    if days.not_known is not None:
        sentences.append(texts(f"budget.{days.not_known.replace(' ', '_')}", runs=days.runs, days=days.days))
    beyond = larger_than_u(days, expanded) if holds_for is not HoldsFor.CAMPAIGN else ()
    beyond = tuple(sorted(beyond, key=lambda name: -days.spread[name] / expanded[name]))
    if beyond:
        named = []
        for name in beyond[:_NAMED]:
            spread = _at_place_of(days.spread[name], expanded[name], texts)
            limit = _two_digits(expanded[name], texts)
            named.append(f"{name} ({spread} {units[name]}, U = {limit} {units[name]})")
        names = ", ".join([*named, *beyond[_NAMED:]])
        sentences.append(texts("budget.days_differ", names=names, days=days.days))
    return tuple(sentences)


def negative_sentence(days: DayToDay, texts: Texts) -> str:
    """Which estimates of u_day were negative; empty where none was."""
    return texts("budget.negative", names=", ".join(days.not_from_zero)) if days.not_from_zero else ""


def unchecked_sentence(unchecked: Unchecked, texts: Texts) -> str:
    """Which readings nothing checks, and what a wrong one of them moves."""
    rows, names = (
        ", ".join([*shown[:_NAMED], *["..."] * (len(shown) > _NAMED)])
        for shown in (tuple(map(str, unchecked.sequence)), unchecked.parameters)
    )
    return texts("budget.unchecked", rows=rows, names=names)


def length_sentence(length: LengthReference, texts: Texts) -> str:
    """To what gains refer, whether that is 20 °C, and what of the bar's temperature is no part of u."""
    values = {
        "temperature": None if length.temperature is None else _plain(length.temperature, 0.01, texts),
        "reference": None if length.reference is None else _plain(length.reference, 0.01, texts),
        "expansion": None if length.expansion is None else _plain(1e6 * length.expansion, 0.01, texts),
    }
    key = length.kind.value if length.temperature is not None else f"{length.kind.value}_unknown"
    if length.columns:
        key = f"{key}_by"
    sentence = texts(
        f"length.{key}", gains=", ".join(length.gains), columns=", ".join(length.columns or ()), **values
    )
    return " ".join(part for part in (sentence, _not_in_u(length, texts)) if part)


def _not_in_u(length: LengthReference, texts: Texts) -> str:
    """What no source states of a bar, and what a kelvin and a millionth of its expansion come to; empty for nothing."""
    lacking = set(length.not_in_u or ())
    if length.kind is not LengthKind.CORRECTED or length.temperature is None:
        return texts("length.not_in_u_uncorrected") if str(Quantity.STANDARD_TEMPERATURE) in lacking else ""
    kelvin = abs(length.temperature - (length.reference or 0.0))
    if kelvin < _LEAST_KELVIN:
        lacking.discard(str(Quantity.STANDARD_EXPANSION))
    if not lacking:
        return ""
    key = "not_in_u_bar" if len(lacking) > 1 else f"not_in_u_{lacking.pop()}"
    per_kelvin = _plain(1e6 * (length.expansion or 0.0), 0.01, texts)
    return texts(f"length.{key}", per_kelvin=per_kelvin, per_millionth=_plain(kelvin, 0.01, texts))


def source_words(source: StatedSource, texts: Texts) -> str:
    """A source's size, law and sharing: ``± 1 K, rectangular, shared by all runs``."""
    sign = "± " if source.distribution in [law.value for law in HALF_WIDTHS] else "u = "
    size = f"{source.size:.4g}".replace(".", texts.decimal_sign)
    law = texts(f"budget.law_{Law(source.distribution).name.lower()}")
    shared = texts(f"budget.shared_{source.shared_by.replace(' ', '_')}")
    quantity = texts(f"budget.quantity_{source.quantity}")
    if source.acts_on is not None:
        quantity = f"{quantity} {source.acts_on}"
    return f"{quantity}, {sign}{size} {source.unit}, {law}, {shared}"


def _two_digits(value: float, texts: Texts) -> str:
    return texts.number(round_uncertainty(value)) if value > 0.0 else "0"


def _at_place_of(value: float, expanded: float, texts: Texts) -> str:
    return texts.number(round_result(value, expanded).estimate)


def _plain(value: float, step: float, texts: Texts) -> str:
    return texts.number(round_to_place(value, decimal_of(step)).normalize())
