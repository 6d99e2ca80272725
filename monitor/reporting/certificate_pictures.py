"""The figures of a certificate, from the stored result, as addresses that its template can hold."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np

from monitor.reporting.figure_style import MILLIMETRES_PER_INCH, PAGE_WIDTH_MM, svg
from monitor.reporting.figures_parameters import parameter_intervals
from monitor.reporting.figures_residuals import residual_bars
from monitor.reporting.numbers import round_uncertainty, written, written_factor
from monitor.reporting.results import ResidualSummary, ResultSet

#: Up to so many parameters the figures stand side by side on one page with the correlation matrix.
BESIDE = 16


@dataclass(frozen=True)
class Picture:
    """A figure as a data address, its width on paper, its caption, and what it shows for those who cannot see it."""

    source: str
    width_mm: float
    caption: str
    alternative: str


def pictures_of(result: ResultSet) -> tuple[Picture, ...]:
    """The parameters with their intervals, and the residuals by group where they are stored."""
    width = PAGE_WIDTH_MM / 2 if len(result.names) <= BESIDE and result.residuals else PAGE_WIDTH_MM
    intervals = parameter_intervals(
        result.names,
        result.units,
        result.estimate,
        result.expanded,
        tolerances=result.tolerances,
        width_mm=width,
    )
    brackets = ""
    if result.tolerances is not None and bool(np.any(np.isfinite(result.tolerances))):
        brackets = "; brackets: limits of the machine's file"
    pictures = [
        Picture(
            _data_address(svg(intervals)),
            width,
            f"Estimates with their expanded uncertainties U = {written_factor(result.k_q)} u{brackets}.",
            "Dots with horizontal bars, one row a parameter, as in the table of results.",
        )
    ]
    if result.residuals is not None:
        height = (
            float(intervals.get_size_inches()[1]) * MILLIMETRES_PER_INCH if width < PAGE_WIDTH_MM else 60.0
        )
        pictures.append(_residual_picture(result.residuals, width, height))
    return tuple(pictures)


def _residual_picture(residuals: ResidualSummary, width: float, height: float) -> Picture:
    bars = residual_bars(
        {residuals.by: (residuals.labels, residuals.rms_um)},
        level_um=residuals.probe_um,
        level_name="stated standard uncertainty of the probe",
        width_mm=width,
        height_mm=height,
    )
    numbers = ", ".join(
        f"{label}: {written(round_uncertainty(rms)) if rms > 0 else '0'} µm"
        for label, rms in zip(residuals.labels, residuals.rms_um, strict=True)
    )
    return Picture(
        _data_address(svg(bars)),
        width,
        f"What the model leaves of the probed coordinates, root mean square by {residuals.by}.",
        f"Root mean square residual by {residuals.by}: {numbers}.",
    )


def _data_address(image: bytes) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(image).decode("ascii")
