"""The volumetric error as a certificate prints it: a table of its lengths, and in words what they mean and where."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

from markupsafe import Markup

from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.reporting.certificate.tables import Number, aligned
from monitor.reporting.certificate.volumetric_result import Length, Place, VolumetricResult
from monitor.reporting.numbers import (
    round_result,
    round_to_place,
    round_uncertainty,
    written_factor,
    written_probability,
)
from monitor.reporting.refused import why_refused
from monitor.reporting.texts import Texts
from monitor.units import MICROMETRE

#: The file inside the PDF that holds every point of the grid.
POINTS_FILE = "volumetric-error-{place}.csv"


@dataclass(frozen=True)
class PrintedMap:
    """A volumetric error as printed: rows of (quantity, where, (value, u, U), unit)."""

    state: str
    expanded: Markup
    rows: tuple[tuple[str, str, tuple[Number, ...], str], ...]
    explained: str
    left_out: str


def printed_map(volumetric: VolumetricResult, texts: Texts) -> PrintedMap:
    """The map in the words of a language."""
    sign = texts.decimal_sign
    k = written_factor(volumetric.k, sign)
    explained = [_region(volumetric, texts, k)]
    explained += [_between(effect, texts) for effect in volumetric.between_points or ()]
    explained += [_place_of(step, texts) for step in volumetric.step_places or ()]
    return PrintedMap(
        state=volumetric.state,
        expanded=texts.markup("page.map_expanded", k=k),
        rows=_rows(volumetric, texts),
        explained=" ".join(explained),
        left_out=" ".join(
            texts("page.map_left_out", parameters=", ".join(names), why=why)
            for why, names in _by_reason(volumetric, texts).items()
        ),
    )


def _by_reason(volumetric: VolumetricResult, texts: Texts) -> dict[str, list[str]]:
    """The parameters that the map leaves out, by the reason in words."""
    by_reason: dict[str, list[str]] = {}
    for name, refused in volumetric.refused:
        by_reason.setdefault(why_refused(refused, texts), []).append(name)
    return by_reason


def _region(volumetric: VolumetricResult, texts: Texts, k: str) -> str:
    """What the numbers mean, and of which region they are."""
    sign = texts.decimal_sign
    return texts(
        "page.map_explained"
        if volumetric.poses > 1 or volumetric.turns is None
        else "page.map_explained_one_pose",
        points=volumetric.points,
        each=volumetric.each,
        poses=volumetric.poses,
        pose=texts("page.map_one_pose" if volumetric.turns else "page.map_no_rotary"),
        ranges="; ".join(
            texts("page.map_range", axis=axis, first=_tenths(first, texts), last=_tenths(last, texts))
            for axis, first, last in volumetric.ranges
        ),
        origin=texts("page.map_from_strokes" if volumetric.from_strokes else "page.map_from_visited"),
        datum=texts("page.map_datum", place=place_words(volumetric.datum, texts))
        if volumetric.datum
        else texts("page.map_no_datum"),
        k=k,
        p=written_probability(volumetric.p, sign),
    )


def _between(effect: BetweenPoints, texts: Texts) -> str:
    """What an error does between the points of the map."""
    return texts(
        "page.map_between_points",
        effect=effect.effect,
        axis=effect.axis,
        spacing=_tenths(effect.spacing_mm, texts),
        size=_tenths(effect.size, texts),
        unit=effect.unit,
        pitch=_tenths(effect.pitch_mm, texts),
    )


def _place_of(step: StepPlace, texts: Texts) -> str:
    """Where a step may lie, and what follows."""
    over = "_over" if step.width_mm else ""
    between = "_zero_between" if step.zero_between else ""
    first, last = step.middle
    return texts(
        f"page.map_step{over}{between}",
        parameter=step.parameter,
        size=_tenths(step.size, texts),
        unit=step.unit,
        width=texts.number(Decimal(f"{step.width_mm or 0.0:g}")),
        first=_tenths(first, texts),
        last=_tenths(last, texts),
        low=_tenths(step.low_mm, texts),
        high=_tenths(step.high_mm, texts),
        error=_tenths(step.most, texts),
        axis=step.axis,
    )


def place_words(position: Place, texts: Texts) -> str:
    """A place of the machine: ``X −178.9 mm, B −90.0°``."""
    return ", ".join(
        f"{axis}\N{NO-BREAK SPACE}{_tenths(reading, texts)}{'' if unit == '°' else chr(0xA0)}{unit}"
        for axis, reading, unit in position
    )


def _tenths(value: float, texts: Texts) -> str:
    return texts.number(round_to_place(value, Decimal("0.1")))


def _rows(volumetric: VolumetricResult, texts: Texts) -> tuple[tuple[str, str, tuple[Number, ...], str], ...]:
    lengths: list[tuple[str, Length]] = [
        ("page.map_largest", volumetric.largest),
        ("page.map_rms", volumetric.rms),
        ("page.map_mean", volumetric.mean),
    ]
    columns: tuple[list[str], list[str], list[str]] = ([], [], [])
    for _, length in lengths:
        rounded = round_result(length.value_um, length.expanded_um)
        columns[0].append(texts.number(rounded.estimate))
        columns[1].append(texts.number(round_uncertainty(length.u_um)))
        columns[2].append(texts.number(rounded.uncertainty))
    numbers = zip(*(aligned(column, texts.decimal_sign) for column in columns), strict=True)
    return tuple(
        (
            texts(key),
            place_words(length.at, texts) if length.at else texts("page.map_all"),
            row,
            MICROMETRE.name,
        )
        for (key, length), row in zip(lengths, numbers, strict=True)
    )
