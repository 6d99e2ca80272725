"""The figures of a certificate, from the stored result, as SVG that its template can hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from monitor.reporting.certificate.drawings import interval_drawings, residual_drawing
from monitor.reporting.certificate.results import ResidualSummary, ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.numbers import round_uncertainty, written_factor
from monitor.reporting.palette import PAGE_WIDTH_MM
from monitor.reporting.svg.map_slices import map_drawing, slices_of
from monitor.reporting.texts import Texts

#: Up to so many parameters the figures stand side by side on one page with the correlation matrix.
BESIDE = 16
#: Height of the residuals' figure where it has the width of the page.
_RESIDUALS_MM = 56.0


@dataclass(frozen=True)
class Picture:
    """A figure, what it shows for those who cannot see it in its title; its width on paper and its caption."""

    drawing: Markup
    width_mm: float
    caption: str


def beside(result: ResultSet) -> bool:
    """Whether the two figures of a result stand side by side."""
    return len(result.names) <= BESIDE and result.residuals is not None


def pictures_of(result: ResultSet, texts: Texts) -> tuple[Picture, ...]:
    """The parameters with their intervals, and the residuals by group where they are stored."""
    width = PAGE_WIDTH_MM / 2 - 2.0 if beside(result) else PAGE_WIDTH_MM
    limited = result.tolerances is not None and bool(np.any(np.isfinite(result.tolerances)))
    caption = texts(
        "figures.intervals",
        k_q=written_factor(result.k_q, texts.decimal_sign, result.k_q_error),
        brackets=texts("figures.brackets") if limited else "",
    )
    drawings = interval_drawings(result, texts, width)
    pictures = [Picture(Markup(on.svg()), width, caption) for on in drawings]
    if result.residuals is not None:
        height = max(50.0, drawings[0].height_mm) if beside(result) else _RESIDUALS_MM
        pictures.append(_residual_picture(result.residuals, width, height, texts))
    return tuple(pictures)


def _residual_picture(residuals: ResidualSummary, width: float, height: float, texts: Texts) -> Picture:
    by = texts(f"figures.{residuals.by}")
    numbers = ", ".join(
        f"{label}: {texts.number(round_uncertainty(rms)) if rms > 0 else '0'} µm"
        for label, rms in zip(residuals.labels, residuals.rms_um, strict=True)
    )
    title = texts("figures.residuals_alternative", by=by, numbers=numbers)
    caption = texts("figures.residuals_of_setups" if residuals.by == "setup" else "figures.residuals", by=by)
    if residuals.probe_um is not None:
        level = f"{residuals.probe_um:.2g}".replace(".", texts.decimal_sign)
        dashed = texts("figures.dashed", name=texts("figures.probe"), level=level)
        striped = any(rms > 2.0 * residuals.probe_um for rms in residuals.rms_um)
        caption += f" {dashed[:1].upper()}{dashed[1:]}{texts('figures.hatched') if striped else ''}."
    return Picture(Markup(residual_drawing(residuals, texts, width, height, title).svg()), width, caption)


def map_picture(volumetric: VolumetricResult, texts: Texts, file: str) -> Picture:
    """Slices through the workspace, in grey; ``file`` inside the PDF has the numbers."""
    drawing = map_drawing(
        slices_of(volumetric.readings_mm, volumetric.vectors_um, volumetric.expanded_um, volumetric.axes),
        title=texts("figures.map_alternative", file=file),
        scale_words=texts("figures.length"),
        sign=texts.decimal_sign,
    )
    # An older record does not say whether the machine has rotary axes.
    caption = texts("figures.map_no_rotary" if volumetric.turns is False else "figures.map")
    return Picture(Markup(drawing.svg()), PAGE_WIDTH_MM, caption)
