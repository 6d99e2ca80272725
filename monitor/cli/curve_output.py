"""What the verbs print of a curve: its numbers in the unit of the response, four digits, none of it a length in µm."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from typing import Any

from monitor.cli import output
from monitor.store import Database
from monitor.workflow.explain import curves
from monitor.workflow.explain.curve_answer import correlation

Document = dict[str, Any]


def four(value: float | None) -> str:
    """A number with four digits; a dash where there is none."""
    return "-" if value is None else f"{value:.4g}"


def stated(value: float | None, u: float | None) -> str:
    """A value with its standard uncertainty, to two digits of the latter; with a power of ten where needed."""
    if value is None:
        return "-"
    if u is None or not u > 0.0:
        return f"{value:.6g}"
    size = max(abs(value), u)
    if 1e-4 <= size < 1e6:
        return f"{output.rounded(value, u)} ± {output.two_digits(u)}"
    power = int(f"{size:e}".partition("e")[2])
    value, u = value / 10.0**power, u / 10.0**power
    return f"({output.rounded(value, u)} ± {output.two_digits(u)})e{power:+03d}"


def compare(db: Database, options: Namespace) -> int:
    """The verb `compare` for a curve."""
    found, fitted = curves.compare(db, options.campaign, options.model)
    if options.figures is not None:
        from monitor.workflow.explain.curve_figures import curve_figures

        found["figures"] = curve_figures(fitted, None, options.figures)
    if options.json:
        output.document(found)
        return 0
    summary(found)
    for name, parts in found["by"].items():
        rows = [[part, four(one["rms"]), four(one["largest"]), str(one["n"])] for part, one in parts.items()]
        output.table("", [f"by {name}", f"RMS / {found['unit']}", "largest", "rows"], rows)
    _files(found)
    return 0


def summary(found: Document) -> None:
    """The comparison in some sentences."""
    unit, test = found["unit"], found["lack_of_fit"]
    expected = (
        ""
        if found["expected_rms"] is None
        else f", expected {four(found['expected_rms'])} {unit} from the stated uncertainty"
    )
    repeats = (
        "no repeats"
        if found["repeatability"] is None
        else f"repeatability {four(found['repeatability'])} {unit}"
    )
    output.say(
        f"{found['campaign']}, model {found['model']} ({found['base']}): RMS {four(found['rms'])} {unit}{expected}; "
        f"{repeats}"
    )
    if test["f"] is not None:
        output.say(f"lack of fit over repeatability: F = {test['f']:.2f}, {output.stated('p', test['p'])}")
    noise = found["autocorrelation"]
    if noise["noticed"]:
        output.say(
            f"neighbouring rows resemble each other under this model: {correlation(noise)} (a missing "
            "effect or correlated noise; explain tells which)"
        )
    output.say(f"verdict: {found['verdict']}")


def explain(db: Database, options: Namespace) -> int:
    """The verb `explain` for a curve."""
    found, explanation = curves.explain(db, options.campaign, options.model, options.rate)
    if options.figures is not None:
        from monitor.workflow.explain.curve_figures import curve_figures

        found["figures"] = curve_figures(explanation.first, explanation, options.figures)
    if options.json:
        output.document(found)
        return 0
    summary(found)
    output.say()
    for one in found["missing"]:
        _effect(one, found["unit"])
    for point in found["suspect_data"]:
        output.say(
            f"outlier: row {point['sequence']} (line {point['line']}): {point['axis']} {point['value']:g} is off by "
            f"{four(point['size'])} {found['unit']}, {output.stated('p', point['p_value'])}; it was left out"
        )
    output.say(found["answer"])
    if found["missing"]:
        output.say(
            f'to add it: monitor model add "{found["missing"][0]["effect"]}" --to {found["model"]} --as NAME '
            f"--campaign {found['campaign']}"
        )
    _files(found)
    return 0


def _effect(one: Document, unit: str) -> None:
    doubt = (
        ""
        if one["certain"]
        else f" (likely, not certain: noise alone would do in {one['noise_alone_p']:.0%})"
    )
    output.say(f"{one['rank']}. {one['effect']}: {one['meaning']}{doubt}")
    output.say(
        f"   {stated(one['amplitude'], one['u'])} {one['unit']}, at most {four(one['peak'])} {unit} from its mean; "
        f"{output.stated('p', one['p_value'])}, {output.stated('q', one['q_value'])}"
    )
    if "searched" in one:
        found = one["searched"]
        output.say(f"   {found['what']} {stated(found['value'], found['u'])} {found['unit']}")
    output.say(
        f"   RMS {four(one['rms_before'])} -> {four(one['rms_after'])} {unit}; on held-out rows "
        f"{four(one['heldout_before'])} -> {four(one['heldout_after'])} {unit}; "
        f"BIC {one['bic_before']:.1f} -> {one['bic_after']:.1f}"
    )
    output.say(f"   cause: {one['cause']}")
    output.say(f"   remedy: {one['remedy']}")
    if one["indistinguishable_from"]:
        output.say(f"   these rows do not rule out: {', '.join(one['indistinguishable_from'])}")


def coefficients(found: Document) -> None:
    """The coefficients of a curve."""
    run = found["runs"][0]
    rows = [[name, stated(one["value"], one["u"]), one["unit"]] for name, one in run["parameters"].items()]
    rows.append(["residual standard deviation", four(run["residual_deviation"]), found["unit"]])
    output.table(
        f"{found['campaign']}, model {found['model']} ({found['base']}), "
        f"{run['degrees_of_freedom']} degrees of freedom",
        ["coefficient", "value ± u", "unit"],
        rows,
    )
    for one in run["refused"]:
        output.say(f"no number: {one['why']}")
    noise = found["autocorrelation"]
    if noise["noticed"]:
        output.say(
            f"neighbouring rows resemble each other ({correlation(noise)}); u allows for it: "
            f"{noise['effective_rows']:.0f} of {noise['rows']} rows for a mean"
        )


def steps(found: Sequence[Document]) -> None:
    """The error falling, version by version."""
    unit = found[0]["unit"]
    rows = [
        [
            one["model"],
            one["added"] or (f"without {one['removed']}" if one["removed"] else "base"),
            four(one["rms"]),
            four(one["heldout_rms"]),
            four(one["repeatability"]),
            output.probability(one["lack_of_fit_p"]),
            f"{one['bic']:.1f}",
        ]
        for one in found
    ]
    output.table(
        f"on campaign {found[0]['campaign']}",
        [
            "model",
            "added",
            f"RMS / {unit}",
            f"held-out / {unit}",
            f"repeatability / {unit}",
            "lack of fit p",
            "BIC",
        ],
        rows,
        text_columns=2,
    )


def _files(found: Document) -> None:
    for file in found.get("figures", []):
        output.say(file)
