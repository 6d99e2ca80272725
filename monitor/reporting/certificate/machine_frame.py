"""Prints the location errors of a certificate in the frame of the machine."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from monitor.reporting.certificate.machine_frame_result import MachineFrameResult
from monitor.reporting.certificate.tables import Number, aligned
from monitor.reporting.frames import sum_words
from monitor.reporting.numbers import round_result, round_uncertainty, written_factor, written_probability
from monitor.reporting.texts import Texts


@dataclass(frozen=True)
class PrintedMachineFrame:
    """The rows (symbol, sum, numbers, unit) of what differs in the machine frame, and the sentences below the
    results."""

    rows: tuple[tuple[str, str, tuple[Number, Number, Number], str], ...]
    expanded: str
    explained: Markup


def printed_machine_frame(result: MachineFrameResult | None, texts: Texts) -> PrintedMachineFrame | None:
    """What the page says of the machine frame; None for a result that has no location error or is older."""
    if result is None or not result.names:
        return None
    columns: tuple[list[str], list[str], list[str]] = ([], [], [])
    for index in result.moved:
        u = float(result.u[index])
        rounded = round_result(float(result.estimate[index]), result.k * u)
        columns[0].append(texts.number(rounded.estimate))
        columns[1].append(texts.number(round_uncertainty(u)))
        columns[2].append(texts.number(rounded.uncertainty))
    numbers = zip(*(aligned(column, texts.decimal_sign) for column in columns), strict=True)
    rows = tuple(
        (
            result.names[index],
            sum_words(result.sums[result.names[index]], texts.decimal_sign),
            cells,
            result.units[index],
        )
        for index, cells in zip(result.moved, numbers, strict=True)
    )
    k = written_factor(result.k, texts.decimal_sign)
    key = "page.machine_frame_explained" if rows else "page.machine_frame_same"
    explained = texts.markup(key, k=k, p=written_probability(result.p, texts.decimal_sign))
    return PrintedMachineFrame(rows, texts("page.map_expanded", k=k), explained)
