"""Figures of comparison and explanation, drawn from their results into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery import Explanation, Fit
from monitor.effects import ChainEffect
from monitor.exceptions import DataError, InputError
from monitor.records import Array
from monitor.reporting.figures.drivers import predicted_against_measured, residual_against_driver
from monitor.reporting.figures.models import error_falling, ranked_effects
from monitor.reporting.figures.residuals import residual_bars, residual_vectors
from monitor.reporting.figures.style import save
from monitor.reporting.numbers import round_result
from monitor.units import MICROMETRE
from monitor.workflow.explain.residuals import drivers_followed, in_machine_frame, mean_over_runs
from monitor.workflow.explain.residuals_against import against_effect
from monitor.workflow.explain.shape import shape_figure

Document = dict[str, Any]
ENDINGS = (".svg", ".png")


def _saved(figure: Any, folder: Path, name: str) -> list[str]:
    return [str(save(figure, folder / f"{name}{ending}")) for ending in ENDINGS]


def make_folder(folder: Path) -> Path:
    """The folder for figures, made where it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made: {error.strerror or error}") from error
    return folder


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
    places, vectors = in_machine_frame(found)
    places, vectors = mean_over_runs(found, places, vectors)
    files += _saved(
        residual_vectors(
            places, vectors, title="What the model leaves, mean over the runs, over the workspace"
        ),
        folder,
        "residual-vectors",
    )
    for name, driver, axis, values in drivers_followed(found):
        files += _saved(
            residual_against_driver(
                driver, values, title=f"Residual along {axis} against {name}", driver_name=name,
                residual_name=f"residual along {axis} / µm",
            ),
            folder,
            f"residual-against-{name.split(' ')[0].lower()}",
        )  # fmt: skip
    return files + shape_figure(document["campaign"], found, folder)


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
    files += _failing(found, missing[0]["effect"], folder)
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


def _failing(found: Explanation, effect: str, folder: Path) -> list[str]:
    """Where the model fails, and what is missing: the residual against what drives the effect, before and after."""
    files = []
    final, before = found.final, found.comparison.vectors
    if before.shape[1] == 3:
        places, vectors = mean_over_runs(final, *in_machine_frame(final, before))
        title = "What the model leaves, mean over the runs, over the workspace"
        files += _saved(residual_vectors(places, vectors, title=title), folder, "residual-vectors")
    against = against_effect(found, effect)
    if against is not None:
        files += _saved(
            residual_against_driver(
                against.at, against.before, title=f"{effect} is missing: the residual along {against.along} follows it",
                driver_name=against.driver, residual_name=f"residual along {against.along} / µm", group=against.groups,
                after_um=against.after,
            ),
            folder,
            "missing-effect-before-after",
        )  # fmt: skip
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
