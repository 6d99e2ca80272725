"""Prints the values of the effects that were added to the model of a certificate: its results hold beside them."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from markupsafe import Markup, escape

from monitor.reporting.certificate.model_effect import Lies, ModelEffect
from monitor.reporting.certificate.tables import Number, aligned
from monitor.reporting.numbers import round_result, round_to_place, round_uncertainty
from monitor.reporting.symbols import describe
from monitor.reporting.texts import Texts


@dataclass(frozen=True)
class PrintedEffects:
    """The rows (symbol, words, (value, u), unit) of the effects, what they are, and those without a value."""

    rows: tuple[tuple[str, str, tuple[Number, Number], str], ...]
    explained: Markup
    unknown: Markup


def printed_effects(effects: tuple[ModelEffect, ...] | None, texts: Texts) -> PrintedEffects | None:
    """What the page says of the effects; None where the model has none, or the result is of an earlier version."""
    if not effects:
        return None
    lines: list[tuple[str, str, float, float, str]] = []
    for effect in effects:
        if effect.value is None or effect.u is None:
            continue
        # One that is among the results is there with its value.
        if not effect.joint:
            lines.append((effect.name, describe(effect.name, texts), effect.value, effect.u, effect.unit))
        if effect.reversal_value is not None and effect.u_reversal is not None:
            meaning = texts("page.effect_reversal")
            lines.append((effect.name, meaning, effect.reversal_value, effect.u_reversal, effect.unit))
    unknown = [effect.name for effect in effects if effect.value is None]
    values = aligned(
        [texts.number(round_result(value, u).estimate) for _, _, value, u, _ in lines], texts.decimal_sign
    )
    uncertainties = aligned([texts.number(round_uncertainty(u)) for *_, u, _ in lines], texts.decimal_sign)
    return PrintedEffects(
        tuple(
            (name, meaning, (value, u), unit)
            for (name, meaning, _, _, unit), value, u in zip(lines, values, uncertainties, strict=True)
        ),
        _explained(effects, texts),
        texts.markup("page.effects_unknown", effects=", ".join(unknown)) if unknown else Markup(""),
    )


def _explained(effects: tuple[ModelEffect, ...], texts: Texts) -> Markup:
    """What the values are: those among the results, then those by themselves and why these are no results."""
    joint, joint_of_run = _by_extent([effect for effect in effects if effect.joint])
    alone, alone_of_run = _by_extent(
        [effect for effect in effects if effect.value is not None and not effect.joint]
    )
    sentences = []
    if joint:
        names = ", ".join(effect.name for effect in joint)
        sentences.append(
            texts.markup("page.effects_joint", effects=names, runs=joint[0].runs, days=joint[0].days)
        )
    if joint_of_run:
        sentences.append(texts.markup("page.effects_joint_of_run", effects=", ".join(joint_of_run)))
    if alone:
        sentences.append(texts.markup("page.effects_explained", runs=alone[0].runs, days=alone[0].days))
    if alone_of_run:
        sentences.append(texts.markup("page.effects_of_run", effects=", ".join(alone_of_run)))
    outside = {effect.outside for effect in effects if effect.outside is not None}
    sentences += [texts.markup(f"page.outside_{reason.value}") for reason in sorted(outside)]
    sentences += [
        escape(place_in_words(effect.name, effect.lies, texts))
        for effect in effects
        if effect.lies is not None
    ]
    return Markup(" ").join(sentences)


def _by_extent(effects: list[ModelEffect]) -> tuple[list[ModelEffect], list[str]]:
    """The effects of all runs, and the names of those of one run."""
    of_all = [effect for effect in effects if not effect.of_one_run]
    return of_all, [effect.name for effect in effects if effect.of_one_run]


def place_in_words(name: str, lies: Lies, texts: Texts) -> str:
    """Where a step lies, which its name says as one number."""
    return texts(
        "page.effect_lies" if lies.width_mm is None else "page.effect_lies_over",
        effect=name,
        axis=lies.axis,
        low=texts.number(round_to_place(lies.low_mm, Decimal("0.1"))),
        high=texts.number(round_to_place(lies.high_mm, Decimal("0.1"))),
    )
