"""The volumetric error over the stroke: the document of `map`, its figures and its compensation tables."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery import Fit
from monitor.documents import to_document
from monitor.exceptions import DataError, InputError
from monitor.machine import Chain
from monitor.records import Array, Campaign
from monitor.reporting.svg.map_slices import slices_of
from monitor.store import Database, StoredModel, save_analysis
from monitor.uncertainty.volumetric import GeometricErrors, VolumetricError, grid, middle, volumetric_error
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.campaign_parts import kind_of, method_of
from monitor.workflow.models import label
from monitor.workflow.uncertainty.documents import statement
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.evaluations import Evaluation, evaluation_of
from monitor.workflow.volumetric.known_errors import geometric_errors

Document = dict[str, Any]
# Points along each axis: an error of a serial machine with straight axes bends with the square of the position at
# most, so five show the worst; more make a finer picture.
POINTS = 7
AXES = "xyz"


@dataclass(frozen=True)
class Mapped:
    """A map: the errors of the machine, and what they do at every point of a grid over the strokes.

    ``ranges`` are the readings from and to of every linear axis, mm; ``poses`` (P, J) the rotary poses, at each of
    which the grid was laid; ``left_out`` says which parameters the map does not know, and why.
    """

    evaluated: Evaluation
    known: GeometricErrors
    ranges: dict[str, tuple[float, float]]
    from_strokes: bool
    poses: Array
    points: int
    error: VolumetricError
    left_out: dict[str, str]


def ranges_of(campaign: Campaign, chain: Chain) -> tuple[dict[str, tuple[float, float]], bool]:
    """Readings of the linear axes: the strokes of the machine file if it has all, else what was visited."""
    linear = [joint.name for joint in chain.joints if not joint.turns]
    strokes = {name: campaign.machine.axes[name].stroke for name in linear if name in campaign.machine.axes}
    given = {name: stroke for name, stroke in strokes.items() if stroke is not None}
    if len(given) == len(linear):
        return given, True
    readings = campaign.probings.readings
    visited = {
        name: (float(readings[name].min()), float(readings[name].max()))
        for name in linear
        if name in readings
    }
    return visited | given, False


def poses_of(chain: Chain, positions: Array) -> Array:
    """The rotary poses of the plan (P, J), all at zero first; the spindle at zero."""
    turned = np.array([joint.kind == "rotary" for joint in chain.joints])
    poses = np.unique(np.round(np.where(turned, positions, 0.0), 9), axis=0) + 0.0
    at_zero = np.zeros((1, len(chain.joints)))
    others = poses[np.any(poses != 0.0, axis=1)]
    return np.concatenate([at_zero, others])


def map_of(found: Evaluation, fit: Fit, points: int = POINTS, absolute: bool = False) -> Mapped:
    """The volumetric error of one evaluated run on a grid of ``points`` along every linear axis at every rotary pose.

    ``fit`` is the evaluated model fitted to the campaign. The workpiece's zero is set in the middle of the strokes with
    the rotary axes at zero, unless ``absolute``. Raises DataError where the run determines no error.
    """
    known, left_out = geometric_errors(found, fit)
    if not known.names:
        raise DataError(
            f"run {found.run} of campaign {found.campaign.name} determines no geometric error; there is nothing to map"
        )
    ranges, from_strokes = ranges_of(found.campaign, known.chain)
    poses = poses_of(known.chain, known.context.positions)
    datum = None if absolute else middle(known.chain, ranges)
    error = volumetric_error(known, grid(known.chain, ranges, points, poses), datum)
    return Mapped(found, known, ranges, from_strokes, poses, points, error, left_out)


def volumetric_map(
    db: Database,
    campaign: str,
    run: int | None = None,
    *,
    model: str | None = None,
    p: float = 0.95,
    points: int = POINTS,
    absolute: bool = False,
    model_uncertainty: bool = True,
    before: datetime | None = None,
) -> tuple[Document, Mapped]:
    """Map the volumetric error of one run (the last by default) over the strokes; the document is stored.

    The grid is that of ``map_of``. Runs that began at or after ``before`` (local time without a zone) take no part;
    the document is then stored as ``partial volumetric map``.
    """
    if not 2 <= points <= 41:
        raise InputError(f"--points {points}: choose 2 to 41 points along each axis")
    found = evaluate(
        db, campaign, run, model=model, method="guf", p=p, model_uncertainty=model_uncertainty, before=before
    )
    mapped = map_of(evaluation_of(statement(found), found.campaign, found.model), found.fit, points, absolute)
    document = map_document(mapped, p)
    save_map(db, document, found.model, before)
    return document, mapped


def save_map(db: Database, document: Document, model: StoredModel, before: datetime | None) -> None:
    """Keep a map, ``partial`` where runs from ``before`` on took no part."""
    save_analysis(
        db, kind_of("volumetric map", before), document, method=method_of("guf", before),
        campaign=document["campaign"], run=document["run"], model=model.name, model_version=model.version,
    )  # fmt: skip


def _um(length: float) -> float:
    return MICROMETRE.to_display(length)


def _at(chain: Chain, position: Array) -> Document:
    """Readings of a commanded point."""
    return {
        f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}": round(
            joint.sign * (DEGREE.to_display(float(value)) if joint.turns else float(value)), 6
        )
        + 0.0
        for joint, value in zip(chain.joints, position, strict=True)
        if joint.kind != "spindle"
    }


def _point(mapped: Mapped, place: int, k: float) -> Document:
    error = mapped.error
    u = float(error.u_lengths[place])
    return {
        "at": _at(mapped.known.chain, error.positions[place]),
        "error_um": _um(float(error.lengths[place])),
        "u_um": _um(u),
        "expanded_um": _um(k * u),
        "vector_um": {axis: _um(float(v)) for axis, v in zip(AXES, error.vectors[place], strict=True)},
        "u_vector_um": {
            axis: _um(float(np.sqrt(max(v, 0.0))))
            for axis, v in zip(AXES, np.diag(error.covariance[place]), strict=True)
        },
        "covariance_um2": (error.covariance[place] / MICROMETRE.factor**2).tolist(),
    }


@dataclass(frozen=True)
class AtZero:
    """The grid with the rotary axes at zero: the ``axes`` along X, Y and Z, ``readings_mm`` (n, 3) of these, error
    ``vectors_um`` (n, 3) along X, Y and Z, and the standard uncertainties ``u_um`` (n,) of its lengths."""

    axes: tuple[str, str, str]
    readings_mm: Array
    vectors_um: Array
    u_um: Array


def at_zero(mapped: Mapped) -> AtZero:
    """The part of a map that can be drawn. Raises InputError for a machine without three linear axes that moved."""
    error, chain = mapped.error, mapped.known.chain
    # In the order of the machine's directions, as the components of the vectors are; a chain has its own.
    linear = sorted(
        (place for place, joint in enumerate(chain.joints) if not joint.turns),
        key=lambda place: chain.joints[place].main,
    )
    if [chain.joints[place].main for place in linear] != [0, 1, 2]:
        raise InputError(
            f"the map is drawn for three linear axes along X, Y and Z; '{chain.topology}' has {len(linear)} linear axes"
            f"{', not along these' if len(linear) == 3 else ''}"
        )
    flat = [name for name, (first, last) in mapped.ranges.items() if not last > first]
    if flat:
        raise InputError(
            f"the map is drawn over a volume, but the campaign stood still along {' and '.join(flat)}: say the "
            "strokes in [machine.axes] of its campaign.toml, or leave the map out"
        )
    each = mapped.points**3  # the first pose
    signs = np.array([chain.joints[place].sign for place in linear])
    first, second, third = (chain.joints[place].name for place in linear)
    return AtZero(
        (first, second, third),
        error.positions[:each][:, linear] * signs,
        error.vectors[:each] / MICROMETRE.factor,
        error.u_lengths[:each] / MICROMETRE.factor,
    )


def _slices(mapped: Mapped, k: float) -> list[Document]:
    """The middle of the map for the page of a health report; empty where there is nothing to draw."""
    try:
        grid_at = at_zero(mapped)
    except InputError:
        return []
    return [
        to_document(one)
        for one in slices_of(grid_at.readings_mm, grid_at.vectors_um, k * grid_at.u_um, grid_at.axes)
    ]


def map_document(mapped: Mapped, p: float) -> Document:
    """A map as people see it, in display units."""
    error, chain = mapped.error, mapped.known.chain
    k = error.factor(p)
    mean, rms = error.mean, error.rms
    each = mapped.points ** len(mapped.ranges)
    worst_at = _point(mapped, error.worst, k)
    worst_at["by_parameter_um"] = {
        name: _um(value) for name, value in error.budget(error.worst).items() if np.isfinite(value)
    }
    return {
        "campaign": mapped.evaluated.campaign.name,
        "machine": mapped.evaluated.campaign.machine.id,
        "run": mapped.evaluated.run,
        "model": label(mapped.evaluated.model),
        "p": p,
        "k": k,
        "degrees_of_freedom": error.degrees_of_freedom if np.isfinite(error.degrees_of_freedom) else None,
        "region": {
            "readings_mm": {name: list(ends) for name, ends in mapped.ranges.items()},
            "from": "the machine file's strokes" if mapped.from_strokes else "what the campaign visited",
            "points_an_axis": mapped.points,
            "rotary_poses": len(mapped.poses),
            "points": len(error.lengths),
        },
        "datum": None if error.datum is None else _at(chain, error.datum),
        "parameters": list(error.names),
        "left_out": [{"parameter": name, "why": why} for name, why in mapped.left_out.items()],
        "worst": worst_at,
        "mean": {"error_um": _um(mean[0]), "u_um": _um(mean[1]), "expanded_um": _um(k * mean[1])},
        "rms": {"error_um": _um(rms[0]), "u_um": _um(rms[1]), "expanded_um": _um(k * rms[1])},
        "least_certain": _point(mapped, error.least_certain, k),
        "by_pose": [
            {
                "at": {name: value for name, value in _at(chain, pose).items() if name.endswith("_deg")},
                "worst_um": _um(float(error.lengths[number * each : (number + 1) * each].max())),
                "rms_um": _um(
                    float(np.sqrt(np.mean(error.lengths[number * each : (number + 1) * each] ** 2)))
                ),
            }
            for number, pose in enumerate(mapped.poses)
        ],
        "slices": _slices(mapped, k),
    }


def map_figures(document: Document, mapped: Mapped, folder: Path) -> list[str]:
    """The map as arrows and as slices, at the rotary axes' zero, and the errors along the axes."""
    from monitor.reporting.figures.style import save
    from monitor.reporting.figures.volumetric import volumetric_slices
    from monitor.workflow.figure_files import make_folder

    drawn = at_zero(mapped)
    worst = document["worst"]
    figure = volumetric_slices(
        drawn.readings_mm,
        drawn.vectors_um,
        drawn.u_um * document["k"],
        names=drawn.axes,
        title=f"{document['campaign']}, run {document['run']}: at worst {worst['error_um']:.1f} µm "
        f"± {worst['expanded_um']:.1f} µm, RMS {document['rms']['error_um']:.1f} µm",
        note=f"Rotary axes at zero. Colour: length of the error; arrows: its part in the slice; numbers: expanded "
        f"uncertainty (k = {document['k']:.2f}, p = {document['p']:g}). "
        f"The title is about all {document['region']['rotary_poses']} rotary poses of the plan.",
    )
    make_folder(folder)
    return [str(save(figure, folder / f"volumetric-error{ending}")) for ending in (".svg", ".png")]
