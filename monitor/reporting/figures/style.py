"""One look for all figures: ink on white, two accents that stay apart in grey, our own font, fixed bytes.

A figure function takes arrays and returns a matplotlib ``Figure``; ``svg``, ``png`` and ``save`` turn it into
bytes. The same numbers give the same bytes: the SVG's identifiers have a fixed salt and no date is written.
Nothing goes through pyplot, so that figures can be drawn in threads and are freed at once.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import rc_context, rcdefaults, rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Figure

from monitor.exceptions import InputError
from monitor.reporting.palette import INK, MID

MILLIMETRES_PER_INCH = 25.4
PNG_DPI = 150
_TITLE_SIZE = 10.5
_CAPTION_SIZE = 7.0

_RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 8,
    "axes.labelcolor": INK,
    "axes.edgecolor": MID,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.solid_capstyle": "butt",
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "machine-health-monitor",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}


@contextmanager
def style() -> Iterator[None]:
    """Set the look of all figures; what is drawn and saved inside it is the same on every machine."""
    with rc_context():
        rcdefaults()
        rcParams.update(_RC)
        yield


def new_figure(width_mm: float, height_mm: float, title: str = "") -> Figure:
    """Return an empty figure with the finding as its title, broken into lines; call inside ``style()``."""
    size = (width_mm / MILLIMETRES_PER_INCH, height_mm / MILLIMETRES_PER_INCH)
    figure = Figure(figsize=size, layout="constrained")
    figure.get_layout_engine().set(w_pad=0.04, h_pad=0.05)  # type: ignore[call-arg,union-attr]
    if title:
        # A bold letter of DejaVu Sans is on the average 0.62 of its size wide.
        letters = int(size[0] * 72.0 / (0.62 * _TITLE_SIZE))
        figure.suptitle(
            textwrap.fill(_with_units(title), letters),
            x=0.008,
            ha="left",
            fontsize=_TITLE_SIZE,
            fontweight="bold",
        )
    return figure


def caption(figure: Figure, text: str) -> None:
    """Write what the signs of a figure mean below it, in small letters, broken into lines that fit."""
    # A letter of DejaVu Sans is on the average 0.56 of its size wide.
    letters = int(figure.get_size_inches()[0] * 72.0 / (0.56 * _CAPTION_SIZE))
    figure.supxlabel(
        textwrap.fill(_with_units(text), letters), x=0.008, ha="left", fontsize=_CAPTION_SIZE, color=INK
    )


def legend_above(axes: Axes) -> None:
    """Name what is drawn in a line above the axes, where no bar and no upright line runs through it.

    At the right end: at the left one stands the power of ten of the numbers.
    """
    columns = len(axes.get_legend_handles_labels()[1])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=6.5, ncols=columns, borderaxespad=0.2)


def zero_line(axes: Axes, *, vertical: bool = False) -> None:
    """Draw the line of zero, behind the data."""
    (axes.axvline if vertical else axes.axhline)(0.0, color=MID, linewidth=0.6, zorder=0.5)


def reference_line(axes: Axes, level: float) -> None:
    """Draw a dashed level across, in front of the data; the caption or a label names it."""
    axes.axhline(level, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)


def _with_units(text: str) -> str:
    """Return a text in which a number and its unit stay on one line."""
    return re.sub(r"(\d) (?=[%°µ]|mm\b|m\b|K\b)", "\\1\N{NO-BREAK SPACE}", text)


def svg(figure: Figure) -> bytes:
    """Return the figure as SVG with its letters as outlines: it looks the same everywhere."""
    out = io.BytesIO()
    with style():
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()


def png(figure: Figure, dpi: float = PNG_DPI) -> bytes:
    """Return the figure as PNG without date or software name."""
    out = io.BytesIO()
    with style():
        figure.savefig(out, format="png", dpi=dpi, metadata={"Software": None})
    return out.getvalue()


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure as the path's ending says: ``.svg`` or ``.png``. Raises InputError for another one."""
    file = Path(path)
    writers = {".svg": svg, ".png": png}
    if file.suffix.lower() not in writers:
        raise InputError(f"a figure is saved as .svg or .png, not as '{file.name}'")
    file.write_bytes(writers[file.suffix.lower()](figure))
    return file
