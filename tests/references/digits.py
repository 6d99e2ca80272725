"""Measures how many digits of every outside reference the product reaches.

``python tests/references/digits.py`` prints them; the manual's validation report (``docs/site/validation.py``) is made
of these rows, so no digit in it was typed. What the tests demand stands in the tests; here the same comparisons say
what is reached today. The digits are NIST's log relative error, at most 15, which is what a double holds.
"""

from __future__ import annotations

import csv
import json
import math
import re
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from monitor import statistics
from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import problem_of
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.records import CurveCampaign
from monitor.statistics.trend import trend
from monitor.uncertainty import (
    BlockSampler,
    Inputs,
    JointDistribution,
    MonteCarloOptions,
    Normal,
    Rectangular,
    correlated_rectangle_factor,
    ellipsoid_factor,
    gum_framework,
    independent,
    monte_carlo,
    numerical_tolerance,
    overall,
    rectangle_factor,
)
from monitor.uncertainty.conformity import conformity
from monitor.uncertainty.risk import Process

REFERENCES = Path(__file__).resolve().parent
sys.path.insert(0, str(REFERENCES.parents[0]))

from by_path import load  # noqa: E402

STRD = REFERENCES / "nist-strd"


@dataclass(frozen=True)
class Compared:
    """A published value and ours; ``digits`` is what a comparison of several quantities reaches at least."""

    subject: str
    case: str
    quantity: str
    published: str
    ours: str
    digits: float


def digits(ours: float, published: float | str | Fraction) -> float:
    """Return the number of correct significant digits (NIST's LRE), at most 15."""
    exact = Fraction(published)
    error = abs(Fraction(float(ours)) - exact)
    if exact != 0:
        error /= abs(exact)
    return 15.0 if error == 0 else min(15.0, -math.log10(error))


def everything() -> list[Compared]:
    """Return every comparison, by subject."""
    return [
        *_univariate(),
        *_analysis_of_variance(),
        *_linear(),
        *_nonlinear(),
        *_handbook(),
        *_gum(),
        *_supplement_1(),
        *_supplement_2(),
        *_coverage_factors(),
        *_conformity(),
    ]


def _json(path: str) -> Any:
    return json.loads((REFERENCES / path).read_text(encoding="utf-8"))


def _rows(name: str) -> list[list[str]]:
    """Return the rows of a StRD file, where its header says that the data are."""
    lines = (STRD / name).read_text(encoding="latin-1").splitlines()
    stated = [re.search(r"Data\s+\(lines\s+(\d+)\s+to\s+(\d+)", line) for line in lines]
    spans = [(int(match[1]) - 1, int(match[2])) for match in stated if match]
    rules = [number + 1 for number, line in enumerate(lines) if line.startswith("-----")]
    first, last = spans[0] if spans else (rules[-1], len(lines))
    return [line.split() for line in lines[first:last] if line.strip()]


def _compared(subject: str, case: str, quantity: str, published: Any, ours: float) -> Compared:
    return Compared(subject, case, quantity, str(published), f"{ours:.15g}", digits(ours, published))


def _univariate() -> Iterator[Compared]:
    for name, entry in _json("nist-strd/certified_univariate.json").items():
        if not (STRD / f"univariate/{name}.dat").is_file():
            continue
        y = np.array([float(row[0]) for row in _rows(f"univariate/{name}.dat")])
        pooled = statistics.pool(y, np.zeros(len(y), dtype=int))
        for quantity, value in (("mean", pooled.mean[0]), ("sd", pooled.u_all[0])):
            yield _compared("NIST StRD, univariate", name, quantity, entry["certified"][quantity], value)


def _analysis_of_variance() -> Iterator[Compared]:
    for name, entry in _json("nist-strd/certified_anova.json").items():
        if not (STRD / f"anova/{name}.dat").is_file():
            continue
        rows = _rows(f"anova/{name}.dat")
        result = statistics.anova(
            np.array([float(row[1]) for row in rows]), np.array([row[0] for row in rows])
        )
        for quantity, value in (("F", result.statistic[0]), ("residual_sd", result.residual_sd[0])):
            yield _compared(
                "NIST StRD, analysis of variance", name, quantity, entry["certified"][quantity], value
            )


def _linear() -> Iterator[Compared]:
    certified = _json("nist-strd/certified_linear.json")
    subject = "NIST StRD, linear regression"
    norris = np.array(_rows("linear/Norris.dat"), dtype=float)
    line = trend(norris[:, 0], norris[:, 1], independent=True)
    yield _compared(subject, "Norris", "slope", certified["Norris"]["certified"]["estimates"][1], line.slope)
    yield _compared(
        subject, "Norris", "u of the slope", certified["Norris"]["certified"]["sd"][1], line.u_slope
    )
    longley = np.array(_rows("linear/Longley.dat"), dtype=float)
    regressors = {f"x{number}": longley[:, number] for number in range(1, 7)}
    result = statistics.dependence(
        longley[:, 0], longley[:, 6], regressors, drift=False, independent=True
    ).coefficients
    right = certified["Longley"]["certified"]
    for number, (ours, value, u) in enumerate(
        zip(result, right["estimates"][1:], right["sd"][1:], strict=True), 1
    ):
        yield _compared(subject, "Longley", f"coefficient {number}", value, ours.value)
        yield _compared(subject, "Longley", f"u of coefficient {number}", u, ours.u)
    fitted = _curve("pontius", ("load:poly2",))
    right = certified["Pontius"]["certified"]
    for name, ours, value in zip(fitted.names, fitted.estimate, right["estimates"], strict=True):
        yield _compared(subject, "Pontius", name, value, float(ours))
    for name, ours, value in zip(fitted.names, np.sqrt(np.diag(fitted.covariance)), right["sd"], strict=True):
        yield _compared(subject, "Pontius", f"u of {name}", value, float(ours))


def _curve(name: str, added: tuple[str, ...]) -> Any:
    series = load("nist", REFERENCES.parent / "curves" / "nist.py")
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(series.write(series.series()[name], Path(folder, name)))
    assert isinstance(campaign, CurveCampaign)
    return fit(problem_of(campaign, Model("certified", added=added)))


def _nonlinear() -> Iterator[Compared]:
    # The two periods that the search finds, as effects with a searched value.
    fitted = _curve("enso", ("time_month:sin~44.3", "time_month:sin~26.9"))
    right = _json("nist-strd/certified_enso.json")["ENSO"]["certified"]
    subject = "NIST StRD, nonlinear regression"
    estimates = [float(value) for value in right["estimates"]]
    for effect, u, place in (
        (fitted.effects[1], fitted.u_values[1], 3),
        (fitted.effects[2], fitted.u_values[2], 6),
    ):
        yield _compared(subject, "ENSO", f"b{place + 1} (period)", estimates[place], effect.value)
        yield _compared(subject, "ENSO", f"u of b{place + 1}", right["sd"][place], u)
    expected = [*estimates[:3], *estimates[4:6], *estimates[7:9]]
    worst = min(zip(fitted.estimate, expected, strict=True), key=lambda pair: digits(float(pair[0]), pair[1]))
    yield _compared(subject, "ENSO", "worst of the other seven", worst[1], float(worst[0]))
    yield _compared(subject, "ENSO", "residual_sd", right["residual_sd"], float(fitted.deviation))


def _handbook() -> Iterator[Compared]:
    subject = "NIST/SEMATECH e-Handbook"
    with (REFERENCES / "nist-handbook/gear.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gear = np.array([float(row["diameter"]) for row in rows]), np.array([int(row["batch"]) for row in rows])
    right = _json("nist-handbook/gear_bartlett_levene.json")
    yield _compared(
        subject, "1.3.5.7 GEAR", "Bartlett's T", right["bartlett_T"], statistics.bartlett(*gear).statistic[0]
    )
    yield _compared(
        subject,
        "1.3.5.10 GEAR",
        "Levene's W",
        right["levene_median_W"],
        statistics.levene(*gear).statistic[0],
    )
    right = _json("nist-handbook/ewma_6_3_2_4.json")
    chart = statistics.ewma_chart(
        right["x"],
        statistics.known_reference(right["EWMA0"], right["s"]),
        lam=right["lam"],
        limit=right["k"],
    )
    yield _compared(subject, "6.3.2.4 EWMA", "upper limit", right["recomputed"]["UCL"], float(chart.upper[0]))
    right = _json("nist-handbook/cusum_6_3_2_3.json")
    sigma = right["sigma"] / math.sqrt(right["group_size"])
    chart = statistics.cusum_chart(
        right["group_means"],
        statistics.known_reference(right["target"], sigma),
        k=right["k"] / sigma,
        h=right["h"] / sigma,
    )
    yield _compared(
        subject,
        "6.3.2.3 CUSUM",
        "first group out of control",
        right["published_first_signal_group"],
        float(chart.alarms[0] + 1),
    )


def _gum() -> Iterator[Compared]:
    subject = "GUM, JCGM 100:2008, annex H"
    data = np.loadtxt(REFERENCES / "gum/gum_H2_data.csv", delimiter=",", skiprows=1)
    data[:, 1] *= 1e-3
    inputs = overall(data, ("V", "I", "phi"), ("V", "A", "rad"), mean_of=5)
    voltage, current, phase = inputs.estimate
    z, sine, cosine = voltage / current, math.sin(phase), math.cos(phase)
    sensitivity = np.array(
        [
            [cosine / current, -z * cosine / current, -z * sine],
            [sine / current, -z * sine / current, z * cosine],
            [1.0 / current, -z / current, 0.0],
        ]
    )
    result = gum_framework(inputs, sensitivity, np.array([z * cosine, z * sine, z]), "RXZ", ("ohm",) * 3)
    right = _json("gum/gum_H2.json")["recomputed_approach_1"]
    for number, name in enumerate("RXZ"):
        yield _compared(subject, "H.2", name, right["y"][number], float(result.estimate[number]))
        yield _compared(subject, "H.2", f"u({name})", right["u"][number], float(result.u[number]))
    yield _compared(subject, "H.2", "r(X, Z)", right["R_y"][1][2], float(result.correlation[1, 2]))
    h3 = _json("gum/gum_H3.json")
    t, b = np.array(h3["t"]), np.array(h3["b"])
    design = np.column_stack([np.ones_like(t), t - h3["t0"]])
    solver = np.linalg.pinv(design)
    scatter = np.sum((b - design @ (solver @ b)) ** 2) / (len(t) - 2)
    names = tuple(f"b{number}" for number in range(len(t)))
    inputs = Inputs(
        names, ("degC",) * len(t), b, scatter * np.eye(len(t)), ("fit",) * len(t), {"fit": len(t) - 2}
    )
    at_30 = np.vstack([solver, np.array([1.0, 10.0]) @ solver])
    result = gum_framework(inputs, at_30, at_30 @ b, ("y1", "y2", "b30"), ("degC", "1", "degC"))
    for number, name in enumerate(("y1", "y2", "b30")):
        yield _compared(subject, "H.3", name, h3["recomputed"][name], float(result.estimate[number]))
        yield _compared(subject, "H.3", f"u({name})", h3["recomputed"][f"u_{name}"], float(result.u[number]))


def _sampled(
    marginals: list[Any], function: Any, correlation: np.ndarray | None = None, trials: int = 500_000
) -> Any:
    names = tuple(f"X{number + 1}" for number in range(len(marginals)))
    matrix = np.eye(len(names)) if correlation is None else correlation
    joint = JointDistribution(names, ("1",) * len(names), tuple(marginals), matrix)

    def model(block: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return function(block)[:, np.newaxis], np.ones(len(block), dtype=bool)

    sampler = BlockSampler((joint,), 7, 10_000)
    return monte_carlo(model, sampler, ("Y",), ("1",), trials, MonteCarloOptions(keep=trials))


def _supplement_1() -> Iterator[Compared]:
    subject = "GUM Supplement 1, JCGM 101:2008 (Monte Carlo, 500 000 trials)"
    reference = _json("gum/gum_S1_examples.json")
    root = math.sqrt(3.0)
    for clause, marginal in (("s9_2_2", Normal(0.0, 1.0)), ("s9_2_3", Rectangular(-root, root))):
        result = _sampled([marginal] * 4, lambda x: x.sum(axis=1))
        case = clause[1:].replace("_", ".")
        yield _compared(subject, case, "u", 2.0, float(result.u[0]))
        yield _compared(
            subject,
            case,
            "upper end, 95 %",
            reference[clause]["exact_ci95"],
            float(
                result.estimate[0] + result.k_q * result.u[0]
            ),  # of one output, the rectangle is the interval
        )

    def mass(x: np.ndarray) -> np.ndarray:
        standard, deviation, air, weight, density = x.T
        return (standard + deviation) * (1 + (air - 1.2) * (1 / weight - 1 / density)) - 1e5

    result = _sampled(
        [Normal(1e5, 0.050), Normal(1.234, 0.020), Rectangular(1.10, 1.30),
         Rectangular(7000.0, 9000.0), Rectangular(7950.0, 8050.0)],
        mass,
    )  # fmt: skip
    right = reference["s9_3"]["mc_1e7"]
    yield _compared(subject, "9.3 mass", "y / mg", right["y"], float(result.estimate[0]))
    yield _compared(subject, "9.3 mass", "u / mg", right["u"], float(result.u[0]))
    for case in reference["s9_4"]["cases"]:
        correlation = np.array([[1.0, case["r"]], [case["r"], 1.0]])
        result = _sampled(
            [Normal(case["x1"], case["u"]), Normal(case["x2"], case["u"])],
            lambda x: 1e6 * (x[:, 0] ** 2 + x[:, 1] ** 2),
            correlation,
        )
        name = f"9.4 comparison loss, x1 = {case['x1']:g}, r = {case['r']:g}"
        yield _compared(subject, name, "u / 1e-6", case["exact_u_1e6"], float(result.u[0]))
    tolerances = _json("gum/numerical_tolerance.json")
    vectors = tolerances["vectors"] + tolerances["recalled_examples_JCGM101_7_9_2"]
    worst = min(vectors, key=lambda row: digits(numerical_tolerance(row["u"], row["n_dig"]), row["delta"]))
    yield _compared(
        subject,
        "7.9.2",
        f"numerical tolerance, worst of {len(vectors)}",
        worst["delta"],
        numerical_tolerance(worst["u"], worst["n_dig"]),
    )


def _supplement_2() -> Iterator[Compared]:
    subject = "GUM Supplement 2, JCGM 102:2011 (Monte Carlo, 400 000 trials)"
    add = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    reference = _json("gum/gum_S2_9_2_additive.json")
    for key, halves, k_q, k_p in (
        ("case_1_gaussian", None, "k_q_exact_rho_0_5", "k_p"),
        ("rectangular_same_moments", (1.0, 1.0, 1.0), "k_q_exact", "k_p_numeric"),
        ("rectangular_large_common", (1.0, 1.0, 3.0), "k_q_exact", "k_p_numeric"),
    ):
        marginals: list[Any] = [Normal(0.0, 1.0)] * 3
        if halves is not None:
            marginals = [Rectangular(-half * math.sqrt(3), half * math.sqrt(3)) for half in halves]
        joint = independent(("X1", "X2", "X3"), ("1",) * 3, marginals)
        result = monte_carlo(
            lambda block: (block @ add.T, np.ones(len(block), dtype=bool)),
            BlockSampler((joint,), 3, 10_000), ("Y1", "Y2"), ("1", "1"), 400_000, MonteCarloOptions(keep=400_000),
        )  # fmt: skip
        case = f"9.2, {key.replace('_', ' ')}"
        yield _compared(subject, case, "r", reference[key]["r"], float(result.correlation[0, 1]))
        yield _compared(subject, case, "k_p", reference[key][k_p], float(result.k_p))
        yield _compared(subject, case, "k_q", reference[key][k_q], float(result.k_q))

    def polar(block: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        real, imaginary = block.T
        outputs = np.column_stack([np.hypot(real, imaginary), np.arctan2(imaginary, real)])
        return outputs, np.ones(len(block), dtype=bool)

    for entry in _json("gum/gum_S2_9_3_cartesian_polar.json")["cases"]:
        correlation = np.array([[1.0, entry["r_in"]], [entry["r_in"], 1.0]])
        marginals = [Normal(entry["x_re"], entry["u"]), Normal(entry["x_im"], entry["u"])]
        joint = JointDistribution(("re", "im"), ("1", "1"), tuple(marginals), correlation)
        result = monte_carlo(
            polar, BlockSampler((joint,), 4, 10_000), ("magnitude", "phase"), ("1", "rad"), 400_000
        )
        case = f"9.3, x = {entry['x_re']:g}, r = {entry['r_in']:g}"
        yield _compared(subject, case, "u(magnitude)", entry["exact"]["u_mag"], float(result.u[0]))
        yield _compared(subject, case, "u(phase)", entry["exact"]["u_phase"], float(result.u[1]))


def _coverage_factors() -> Iterator[Compared]:
    subject = "Coverage factors, JCGM 102:2011, 6.5"
    reference = _json("gum/coverage_factors.json")
    for p, table in reference["table"].items():
        for key, function in (
            ("k_p", lambda m, p: ellipsoid_factor(m, p)),
            ("k_q_bonferroni", lambda m, p: rectangle_factor(m, p)),
            ("k_q_sidak", lambda m, p: rectangle_factor(m, p, form="independent")),
        ):
            worst = min(
                table,
                key=lambda m, key=key, function=function: digits(function(int(m), float(p)), table[m][key]),
            )
            yield _compared(
                subject,
                f"1 to {len(table)} outputs, p = {p}",
                f"{key}, worst",
                table[worst][key],
                function(int(worst), float(p)),
            )
    for rho, exact in reference["exact_kq_bivariate_gaussian_p095"].items():
        correlation = np.array([[1.0, float(rho)], [float(rho), 1.0]])
        ours = correlated_rectangle_factor(correlation).value
        yield _compared(subject, f"two outputs, r = {rho}, sampled", "k_q", exact, ours)


def _conformity() -> Iterator[Compared]:
    subject = "JCGM 106:2012"
    for p, z in ((0.80, 0.84), (0.90, 1.28), (0.95, 1.64), (0.99, 2.33), (0.999, 3.09)):
        ours = float(conformity([10.0 - z], [[1.0]], [-math.inf], [10.0]).single[0])
        yield _compared(subject, f"table 1, z = {z} (two decimals)", "p", p, ours)
    zener = float(conformity([-5.47], [[0.05**2]], [-math.inf], [-5.40]).single[0])
    yield _compared(subject, "7.4, Zener diode (two decimals)", "p", 0.92, zener)
    # 9.5: resistors within 0.2 ohm; scipy integrates over true and measured values.
    process = Process(1500.0, 0.12)
    risks = process.risks(0.04, (1499.8, 1500.2), (1499.8, 1500.2))
    both = stats.multivariate_normal([1500.0] * 2, [[0.12**2, 0.12**2], [0.12**2, 0.12**2 + 0.04**2]])
    good = float(both.cdf([1500.2, 1500.2], lower_limit=[1499.8, 1499.8]))
    accepted = float(np.diff(stats.norm(1500.0, math.hypot(0.12, 0.04)).cdf([1499.8, 1500.2]))[0])
    yield _compared(
        subject,
        "9.5, resistors, integral of the bivariate normal",
        "R_C",
        accepted - good,
        float(risks.consumer),
    )
    within = float(np.diff(stats.norm(1500.0, 0.12).cdf([1499.8, 1500.2]))[0])
    yield _compared(
        subject,
        "9.5, resistors, integral of the bivariate normal",
        "R_P",
        within - good,
        float(risks.producer),
    )


if __name__ == "__main__":
    for row in everything():
        print(f"{row.subject:40.40}  {row.case:34.34}  {row.quantity:26.26}  {row.digits:5.1f}")
