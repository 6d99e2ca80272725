"""The figures of a certificate, from the stored result, as addresses that its template can hold."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np

from monitor.reporting.figure_style import MILLIMETRES_PER_INCH, PAGE_WIDTH_MM, svg
from monitor.reporting.figures_parameters import parameter_intervals
from monitor.reporting.figures_residuals import residual_bars
from monitor.reporting.figures_volumetric import volumetric_slices
from monitor.reporting.numbers import round_uncertainty, written_factor
from monitor.reporting.results import ResidualSummary, ResultSet
from monitor.reporting.texts import Texts
from monitor.reporting.volumetric_result import VolumetricResult

#: Up to so many parameters the figures stand side by side on one page with the correlation matrix.
BESIDE = 16


@dataclass(frozen=True)
class Picture:
    """A figure as a data address, its width on paper, its caption, and what it shows for those who cannot see it."""

    source: str
    width_mm: float
    caption: str
    alternative: str


def pictures_of(result: ResultSet, texts: Texts) -> tuple[Picture, ...]:
    """The parameters with their intervals, and the residuals by group where they are stored."""
    width = PAGE_WIDTH_MM / 2 if len(result.names) <= BESIDE and result.residuals else PAGE_WIDTH_MM
    intervals = parameter_intervals(
        result.names,
        result.units,
        result.estimate,
        result.expanded,
        tolerances=result.tolerances,
        width_mm=width,
        decimal_sign=texts.decimal_sign,
    )
    limited = result.tolerances is not None and bool(np.any(np.isfinite(result.tolerances)))
    pictures = [
        Picture(
            _data_address(svg(intervals)),
            width,
            texts(
                "figures.intervals",
                k_q=written_factor(result.k_q, texts.decimal_sign),
                brackets=texts("figures.brackets") if limited else "",
            ),
            texts("figures.intervals_alternative"),
        )
    ]
    if result.residuals is not None:
        height = (
            float(intervals.get_size_inches()[1]) * MILLIMETRES_PER_INCH if width < PAGE_WIDTH_MM else 60.0
        )
        pictures.append(_residual_picture(result.residuals, width, height, texts))
    return tuple(pictures)


def _residual_picture(residuals: ResidualSummary, width: float, height: float, texts: Texts) -> Picture:
    by = texts(f"figures.{residuals.by}")
    bars = residual_bars(
        {by: (residuals.labels, residuals.rms_um)},
        level_um=residuals.probe_um,
        level_name=texts("figures.probe"),
        width_mm=width,
        height_mm=height,
        texts=texts,
    )
    numbers = ", ".join(
        f"{label}: {texts.number(round_uncertainty(rms)) if rms > 0 else '0'} µm"
        for label, rms in zip(residuals.labels, residuals.rms_um, strict=True)
    )
    return Picture(
        _data_address(svg(bars)),
        width,
        texts("figures.residuals", by=by),
        texts("figures.residuals_alternative", by=by, numbers=numbers),
    )


def map_picture(found: VolumetricResult, texts: Texts, file: str) -> Picture:
    """Slices through the workspace, in grey; ``file`` inside the PDF has the numbers."""
    figure = volumetric_slices(
        found.readings_mm, found.vectors_um, found.expanded_um, names=found.axes, title="", texts=texts,
        grey=True,
    )  # fmt: skip
    alternative = texts("figures.map_alternative", file=file)
    return Picture(_data_address(svg(figure)), PAGE_WIDTH_MM, texts("figures.map"), alternative)


def _data_address(image: bytes) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")
