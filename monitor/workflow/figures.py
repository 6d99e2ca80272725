"""Figures of comparison, explanation and statistics, drawn from their results into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery import Explanation, Fit
from monitor.discovery.anomalies import plan_places
from monitor.effects import ChainEffect
from monitor.exceptions import DataError, InputError
from monitor.machine import evaluate
from monitor.records import Array
from monitor.reporting.figure_style import save
from monitor.reporting.figures_models import error_falling, ranked_effects
from monitor.reporting.figures_parameters import parameters_by_run
from monitor.reporting.figures_residuals import (
    predicted_against_measured,
    residual_against_driver,
    residual_bars,
    residual_vectors,
)
from monitor.reporting.numbers import round_result
from monitor.store import StoredIdentification
from monitor.units import MICROMETRE

Document = dict[str, Any]
ENDINGS = (".svg", ".png")
# Of the drivers of the residual so many are drawn: those that explain most, the others in the document.
MOST_DRIVERS = 4


def _saved(figure: Any, folder: Path, name: str) -> list[str]:
    return [str(save(figure, folder / f"{name}{ending}")) for ending in ENDINGS]


def make_folder(folder: Path) -> Path:
    """The folder for figures, made where it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made: {error.strerror or error}") from error
    return folder


def _in_machine_frame(found: Fit) -> tuple[Array, Array]:
    """Where the tip stood, mm, and the residual, µm, both (n, 3) along the machine's axes."""
    errors, target, tip = found.problem.state(found.solution.local, found.solution.common)
    context = found.problem.context
    seen = evaluate(context.chain, context.positions, errors, target, tip)
    turned = np.einsum("nij,nj->ni", seen.work_rotation, seen.residual)
    linear = [place for place, joint in enumerate(context.chain.joints) if not joint.turns]
    places = np.zeros((len(context), 3))
    for place in linear:
        sign = 1.0 if place >= len(context.chain.work) else -1.0
        places += sign * context.positions[:, [place]] * np.array(context.chain.joints[place].direction)
    vectors: Array = MICROMETRE.to_display(1.0) * turned
    return places, vectors


def comparison_figures(document: Document, found: Fit, folder: Path) -> list[str]:
    """Where the model fails: by target, axis and run, over the workspace, against what it may depend on."""
    make_folder(folder)
    names = ("target", "axis", "run")
    groups = {}
    for name in names:
        # A ball touched once a run is followed exactly: it has no residual to show.
        parts = {
            label: part for label, part in document["by"].get(name, {}).items() if part["rms_um"] > 0.005
        }
        if parts:
            groups[name] = (list(parts), [part["rms_um"] for part in parts.values()])
    level = document["expected_rms_um"]
    verdict = document["verdict"]
    title = (
        f"{document['campaign']}: RMS {document['rms_um']:.2f} µm where {level:.2f} µm is expected: {verdict}"
    )
    files = _saved(
        residual_bars(groups, level_um=level, level_name="expected", title=title), folder, "where-it-fails"
    )
    places, vectors = _in_machine_frame(found)
    places, vectors = _mean_over_runs(found, places, vectors)
    files += _saved(
        residual_vectors(
            places, vectors, title="What the model leaves, mean over the runs, over the workspace"
        ),
        folder,
        "residual-vectors",
    )
    for name, driver, axis, values in _drivers(found):
        files += _saved(
            residual_against_driver(
                driver, values, title=f"Residual along {axis} against {name}", driver_name=name,
                residual_name=f"residual along {axis} / µm",
            ),
            folder,
            f"residual-against-{name.split(' ')[0].lower()}",
        )  # fmt: skip
    return files


def _mean_over_runs(found: Fit, places: Array, vectors: Array) -> tuple[Array, Array]:
    numbers = plan_places(found)
    keep = ~found.left_out
    count = np.bincount(numbers[keep]).astype(float)
    count[count == 0] = np.nan

    def mean(rows: Array) -> Array:
        sums = [
            np.bincount(numbers[keep], weights=rows[keep, axis], minlength=len(count)) for axis in range(3)
        ]
        means: Array = np.stack(sums, axis=1) / count[:, None]
        return means

    first, second = mean(places), mean(vectors)
    good = np.isfinite(first).all(axis=1)
    return first[good], second[good]


def _drivers(found: Fit) -> list[tuple[str, Array, str, Array]]:
    """The drivers that the residual follows most, with the axis in which it does: name, values, axis, residual."""
    context = found.problem.context
    _, vectors = _in_machine_frame(found)
    keep = ~found.left_out
    scored = []
    columns: dict[str, Array] = {
        f"{joint.name} / {'°' if joint.turns else 'mm'}": joint.sign * context.positions[:, place]
        * (180.0 / np.pi if joint.turns else 1.0)
        for place, joint in enumerate(context.chain.joints)
    }  # fmt: skip
    columns |= {name: values for name, values in context.columns.items() if name.endswith("_degC")}
    columns["time_in_run / min"] = context.time / 60.0
    columns["time_of_day / h"] = context.day_time / 3600.0
    for name, values in columns.items():
        if not np.isfinite(values[keep]).all() or np.ptp(values[keep]) == 0.0:
            continue
        cuts = np.unique(np.quantile(values[keep], np.linspace(0, 1, 9)[1:-1]))
        bins = np.searchsorted(cuts, values[keep], side="right")
        for axis in range(3):
            rows = vectors[keep, axis]
            count = np.bincount(bins)
            means = np.bincount(bins, weights=rows) / np.maximum(count, 1)
            scored.append((float(np.sum(count * means**2)), name, axis))
    best: dict[str, tuple[float, int]] = {}
    for score, name, axis in sorted(scored, reverse=True):
        best.setdefault(name, (score, axis))
    chosen = sorted(best, key=lambda name: -best[name][0])[:MOST_DRIVERS]
    return [
        (name, columns[name][keep], "XYZ"[best[name][1]], vectors[keep, best[name][1]]) for name in chosen
    ]


def explanation_figures(document: Document, found: Explanation, folder: Path) -> list[str]:
    """What is missing: effects by evidence, the best against the measurement, the error falling."""
    make_folder(folder)
    missing = document["missing"]
    if not missing:
        return []
    names: list[str] = []
    peaks: list[float] = []
    groups: list[int] = []
    notes: list[str] = []
    for one in missing:
        for place, effect in enumerate([one["effect"], *one["indistinguishable_from"][:5]]):
            names.append(effect)
            peaks.append(one["peak_um"])
            groups.append(one["rank"])
            # The words are in the document; beside a bar there is room for the size alone.
            notes.append(_size(one["amplitude"], one["u"], one["unit"]) if place == 0 else "not ruled out")
    files = _saved(
        ranked_effects(
            names, peaks, groups, title=document["answer"], value_name="peak displacement / µm", notes=notes
        ),
        folder,
        "missing-effects",
    )
    files += _saved(_falling(document), folder, "error-falling")
    pair = _predicted(found, missing[0]["effect"])
    if pair is not None:
        files += _saved(
            predicted_against_measured(
                pair[0], pair[1], title=f"{missing[0]['effect']} predicts what the model leaves"
            ),
            folder,
            "predicted-against-measured",
        )
    return files


def _size(amplitude: float, u: float, unit: str) -> str:
    try:
        shown = round_result(amplitude, u)
    except DataError:
        return f"{amplitude:.3g} {unit}"
    return f"{shown.estimate} ± {shown.uncertainty} {unit}"


def _falling(document: Document) -> Any:
    missing = document["missing"]
    steps = ["as it is", *(f"+ {one['effect']}" for one in missing)]
    rms = [missing[0]["rms_before_um"], *(one["rms_after_um"] for one in missing)]
    held = [missing[0]["heldout_before_um"], *(one["heldout_after_um"] for one in missing)]
    floor = document["stated_uncertainty_um"]
    return error_falling(
        steps,
        rms,
        [np.nan if value is None else value for value in held],
        noise_um=floor,
        noise_name="probe's stated uncertainty",
        title=f"The error falls from {rms[0]:.2f} to {rms[-1]:.2f} µm",
    )


def _predicted(found: Explanation, effect: str) -> tuple[Array, Array] | None:
    """What an effect does at every probing and what the model without it leaves there, µm, along the main axis."""
    problem = found.final.problem
    place = 0
    for one in problem.added:
        basis = one.basis(problem.context)
        if one.text == effect and isinstance(one, ChainEffect):
            own = found.final.moved_by(basis) @ found.final.solution.common[place : place + basis.size]
            axis = int(np.argmax(np.sum(own**2, axis=0)))
            um = MICROMETRE.to_display(1.0)
            # The effect explains the residual with the opposite sign: what is measured without it is its negative.
            return -own[:, axis] * um, (found.final.vectors[:, axis] - own[:, axis]) * um
        place += basis.size
    return None


def history_figure(steps: list[Document], folder: Path) -> list[str]:
    """The error falling, version by version."""
    make_folder(folder)
    floor = steps[-1]["stated_uncertainty_um"]
    figure = error_falling(
        [one["model"] if one["added"] is None else f"+ {one['added']}" for one in steps],
        [one["rms_um"] for one in steps],
        [np.nan if one["heldout_rms_um"] is None else one["heldout_rms_um"] for one in steps],
        noise_um=floor,
        noise_name="probe's stated uncertainty",
        title=f"{steps[-1]['model']} on {steps[-1]['campaign']}: "
        f"the error falls from {steps[0]['rms_um']:.2f} to {steps[-1]['rms_um']:.2f} µm",
    )
    return _saved(figure, folder, "error-falling")


def statistics_figure(
    document: Document, found: StoredIdentification, days: dict[int, int], folder: Path
) -> list[str]:
    """Every parameter over the runs, days as bands: a step between days is seen at once."""
    make_folder(folder)
    names = document["parameter_order"]
    places = [found.parameters.index(name) for name in names]
    factors = np.array([found.units[place].factor for place in places])
    estimate = np.array([run.estimate[places] for run in found.runs]) / factors
    u = np.sqrt(np.array([np.diag(run.covariance)[places] for run in found.runs])) / factors
    moved = [name for name in names if (document["parameters"][name]["anova_q"] or 1.0) < 0.001]
    said = f"differ between days: {', '.join(moved)}" if moved else "no parameter differs between days"
    figure = parameters_by_run(
        [run.run for run in found.runs],
        [days[run.run] for run in found.runs],
        names,
        [found.units[place].name for place in places],
        estimate,
        2.0 * u,
        title=f"{document['campaign']}: {said}",
        interval="± 2 standard uncertainties of the run",
        highlight=moved,
    )
    return _saved(figure, folder, "parameters-by-run")
