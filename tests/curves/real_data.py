"""docs/real-data.md: what the search finds in the measured series of NIST, with pictures.

    python tests/curves/real_data.py            writes docs/real-data.md and docs/images/real-*.png
    python tests/curves/real_data.py --check    says whether the page holds the numbers that come out now

Every series goes the way of a user: a folder is written, imported, explained, each effect found is added to the
model, and the history is taken from the database.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
from nist import Series, series, write

from monitor.discovery.curve.explain import explain_curve
from monitor.documents import to_document
from monitor.reporting.figures.style import png
from monitor.statistics.means import anova
from monitor.store import Database, load_curve
from monitor.workflow.explain.curve_answer import curve_explanation
from monitor.workflow.explain.curve_figures import residual_figure
from monitor.workflow.explain.request import HistoryRequest
from monitor.workflow.explain.versions import history
from monitor.workflow.identify.fitting import curve_problem
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import version_with
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.models import label, resolve

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "real-data.md"
IMAGES = DOCS / "images"
DRAWN = ("pontius", "loadcell", "dziuba1", "mlco2mon", "enso", "lew")
DPI = 90


@dataclass(frozen=True)
class Told:
    """What came out for one series: the documents of explain and of the model's history."""

    one: Series
    explained: dict[str, Any]
    history: list[dict[str, Any]]
    figure: Any


def tell(names: tuple[str, ...] | None = None) -> dict[str, Told]:
    """Every series through import, explain, model add and model history."""
    found: dict[str, Told] = {}
    with tempfile.TemporaryDirectory() as made, Database(Path(made) / "nist.duckdb") as db:
        for name, one in series().items():
            if names is not None and name not in names:
                continue
            import_folders(db, ImportRequest([write(one, Path(made) / name)]))
            model = "curve"
            explanation = explain_curve(curve_problem(load_curve(db, name), resolve(db, model)))
            answer = curve_explanation(explanation, model)
            for step, missing in enumerate(answer.missing, start=1):
                request = AddEffectRequest(missing.effect, model, f"{name}-{step}", campaign=name)
                model = label(version_with(db, request))
            versions = [to_document(version) for version in history(db, HistoryRequest(model, name)).steps]
            figure = residual_figure(explanation.first, explanation) if name in DRAWN else None
            found[name] = Told(one, to_document(answer), versions, figure)
    return found


def number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _searched(one: dict[str, Any]) -> str:
    if "searched" not in one:
        return ""
    found = one["searched"]
    u = "" if found["u"] is None else f" ± {found['u']:.2g}"
    frequency = f", {found['frequency']:.4f} cycles a row" if found["unit"] == "row" else ""
    return (
        f"{found['what']} {found['value']:.6g}{u} {found['unit'] if found['unit'] != '1' else ''}".rstrip()
        + frequency
    )


def section(told: Told) -> list[str]:
    """The part of the page about one series."""
    explained, history = told.explained, told.history
    unit = "" if explained["unit"] == "1" else f" {explained['unit']}"
    base = history[0]
    fit = "" if base["lack_of_fit_f"] is None else f", lack of fit F = {base['lack_of_fit_f']:.2f}"
    lines = [
        f"## {told.one.name}: {told.one.title}",
        "",
        f"{explained['rows']} rows, base model `{explained['base']}`, residual standard deviation "
        f"{number(base['residual_deviation'])}{unit}{fit}.",
        "",
    ]
    if explained["missing"]:
        lines += [
            "| step | effect | found | residual s | held-out | lack of fit F | BIC |",
            "| --- | --- | --- | --- | --- | --- | --- |",
            f"| 0 | base | | {number(base['residual_deviation'])} | {number(base['heldout_rms'])} | "
            f"{number(base['lack_of_fit_f'])} | {base['bic']:.1f} |",
        ]
        for place, (one, step) in enumerate(zip(explained["missing"], history[1:], strict=True), start=1):
            likely = "" if one["certain"] else " (likely)"
            sizes = (step["residual_deviation"], step["heldout_rms"], step["lack_of_fit_f"])
            lines.append(
                f"| {place} | `{one['effect']}`{likely} | {_searched(one)} | {' | '.join(map(number, sizes))} | "
                f"{step['bic']:.1f} |"
            )
        lines += ["", "All rows are in these fits, outliers too.", ""] if explained["suspect_data"] else [""]
    lines += [f"> {line}" for line in textwrap.wrap(explained["answer"], 118)] + [""]
    if told.figure is not None:
        lines += [f"![{told.one.name}](images/real-{told.one.name}.png)", ""]
    return lines


HEAD = """# Tried on real measurements

Public measurement series of NIST, read from the published files in `tests/references` and put through `import`,
`explain`, `model add` and `model history` like any campaign ([method curve](campaign-format.md#curves)). Nobody here
made these data. The page is written by `tests/curves/real_data.py` (`make real-data`); a test holds it against what
comes out now. How often the search is wrong on simulated curves: [trials-curve.md](trials-curve.md).

In every table step 0 is the base model; each further step adds one effect that the search found, the most convincing
first. Held-out errors are those of rows that took no part in the fit. *Likely* stands at an effect that noise whose
neighbouring rows resemble each other might bring forth by itself in more than one such series of a hundred.
"""

NOTES = (
    "**lew**: the sine printed in the handbook is not the least-squares optimum (frequency 0.302596, residual standard "
    "deviation 155.85); the optimum is 0.301807 with 134.066, and that is what one period comes to with all rows "
    "(step 1). Row 158 is probably a misprint (300 for -300): it is named, the file is left as it is. During the first "
    "twenty rows the beam moved out of step with the rest: the picture shows it. The further periods lie around the "
    "first one: its amplitude changes along the series. Beyond three residual standard deviations of one period with "
    "all rows lie exactly rows 2, 3, 6, 8, 11 and 158; Rosner's test, in which outliers do not hide each other, adds "
    "9 and 14 there (3.0 and 2.8), and under all periods other rows of the same stretch at the beginning. They are the "
    "beam's start, not single wrong readings, and the answer says so.",
    "**dziuba1**: neighbouring readings of the resistor resemble each other, so the evidence for the yearly cycle is "
    "far smaller than independent rows would make it, and a curvature of the drift, which slow noise explains as well, "
    "is not told.",
    "**mlco2mon**: a curvature of the rise is known to be there; against the slow noise these rows do not show it.",
    "**enso**: the periods agree with the certified values of the StRD, 44.311 and 26.888 months. They are told as "
    "likely: the rows are independent once both are in the model, but slow noise alone (correlation 0.85 in 40 % of "
    "the variance, what the annual cycle leaves) brought two cycles as good as these in 22 of 300 simulated series of "
    "the same length. At 1 % they cannot be had from 168 months; if the rows are independent, their p-values are "
    "6e-8 and 3e-6.",
    "**loadcell**: the file is sorted by load, so the order of its rows says nothing of time and is not an input.",
)


def mpc62_note(told: Told) -> str:
    """What these rows say of a day effect, and why there is no probe bias to find."""
    columns = told.one.columns
    test = anova([float(value) for value in columns["resistivity"]], columns["day"])
    return (
        f"**mpc62** was measured with one probe, #2362, so it can hold no bias between probes; that shows in the gauge "
        f"study of the same case with five probes (mpc61), and the day effect in mpc633. Here the "
        f"{len(set(columns['day']))} days do not differ: F = {test.statistic[0]:.2f}, p = {test.p_value[0]:.2f}; "
        f"and the means of six readings scatter by "
        f"{number(told.explained['residual_deviation'])}, where the scatter of the six says "
        f"{number(told.explained['stated_uncertainty'])} (p = {told.explained['excess_over_statement_p']:.2f}): no day "
        "effect of a size that 25 means can show."
    )


def page(found: dict[str, Told]) -> str:
    """The page."""
    lines = [HEAD]
    for told in found.values():
        lines += section(told)
    lines += ["## What to know of these series", ""]
    for note in (*NOTES, mpc62_note(found["mpc62"])):
        lines += textwrap.wrap(f"- {note}", 118, subsequent_indent="  ")
    return "\n".join(lines) + "\n"


def draw(found: dict[str, Told], folder: Path) -> None:
    """Draw the pictures of the page."""
    for name, told in found.items():
        if told.figure is not None:
            (folder / f"real-{name}.png").write_bytes(png(told.figure, DPI))


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    found = tell()
    text = page(found)
    if options.check:
        same = PAGE.read_text(encoding="utf-8") == text
        print("docs/real-data.md is up to date" if same else "docs/real-data.md is not what comes out now")
        return 0 if same else 1
    PAGE.write_text(text, encoding="utf-8")
    draw(found, IMAGES)
    print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
