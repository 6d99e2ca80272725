"""The volumetric error of one evaluated run over the strokes, and the part of it that can be drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery import Between, Fit, steps_of_model
from monitor.exceptions import DataError, InputError
from monitor.machine import Chain
from monitor.records import Array, Campaign
from monitor.reporting.refused import RefusedParameters, refused_parameters
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.outside_errors import outside_errors
from monitor.uncertainty.volumetric import VolumetricError, grid, middle, volumetric_error
from monitor.units import MICROMETRE
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.known_errors import geometric_errors
from monitor.workflow.volumetric.request import POINTS


@dataclass(frozen=True)
class VolumetricMap:
    """A map: the errors of the machine, and what they do at every point of a grid over the strokes.

    ``ranges`` are the readings from and to of every linear axis, mm; ``poses`` (P, J) the rotary poses, at each of
    which the grid was laid; ``left_out`` says which parameters the map does not know, and why. ``steps`` are, by
    effect, the readings between which each of its steps lies.
    """

    evaluated: StatedUncertainty
    errors: GeometricErrors
    ranges: dict[str, tuple[float, float]]
    from_strokes: bool
    poses: Array
    points: int
    error: VolumetricError
    left_out: dict[str, RefusedParameters]
    steps: Mapping[str, Sequence[Between]]


def ranges_of(campaign: Campaign, chain: Chain) -> tuple[dict[str, tuple[float, float]], bool]:
    """Readings of the linear axes: the strokes of the machine file if it has all, else what was visited."""
    linear = [joint.name for joint in chain.joints if not joint.turns]
    strokes = {name: campaign.machine.axes[name].stroke for name in linear if name in campaign.machine.axes}
    stated = {name: stroke for name, stroke in strokes.items() if stroke is not None}
    if len(stated) == len(linear):
        return stated, True
    readings = campaign.probings.readings
    visited = {
        name: (float(readings[name].min()), float(readings[name].max()))
        for name in linear
        if name in readings
    }
    return visited | stated, False


def poses_of(chain: Chain, positions: Array) -> Array:
    """The rotary poses of the plan (P, J), all at zero first; the spindle at zero."""
    turned = np.array([joint.kind == "rotary" for joint in chain.joints])
    poses = np.unique(np.round(np.where(turned, positions, 0.0), 9), axis=0) + 0.0
    at_zero = np.zeros((1, len(chain.joints)))
    others = poses[np.any(poses != 0.0, axis=1)]
    return np.concatenate([at_zero, others])


def map_of(
    evaluated: StatedUncertainty, fit: Fit, points: int = POINTS, absolute: bool = False
) -> VolumetricMap:
    """The volumetric error of one evaluated run on a grid of ``points`` along every linear axis at every rotary pose.

    ``fit`` is the evaluated model fitted to the campaign. The workpiece's zero is set in the middle of the strokes with
    the rotary axes at zero, unless ``absolute``. Raises DataError where the run determines no error.
    """
    errors, left_out = geometric_errors(evaluated, fit)
    if not errors.names:
        raise DataError(
            f"run {evaluated.run} of campaign {evaluated.campaign.name} determines no geometric error; "
            "there is nothing to map"
        )
    ranges, from_strokes = ranges_of(evaluated.campaign, errors.chain)
    poses = poses_of(errors.chain, errors.context.positions)
    datum = None if absolute else middle(errors.chain, ranges)
    error = volumetric_error(errors, grid(errors.chain, ranges, points, poses), datum)
    # Location errors are linear along the strokes: the corners show the largest.
    corners = grid(errors.chain, ranges, 2, poses)
    outside = outside_errors(fit.problem, errors, corners, datum, left_out)
    left_out |= {each.symbol: refused_parameters(each.refusal) for each in outside}
    steps = steps_of_model(fit)
    return VolumetricMap(evaluated, errors, ranges, from_strokes, poses, points, error, left_out, steps)


@dataclass(frozen=True)
class AtPose:
    """The grid at one rotary pose: the ``axes`` along X, Y and Z, ``readings_mm`` (n, 3) of these, error
    ``vectors_um`` (n, 3) along X, Y and Z, and the standard uncertainties ``u_um`` (n,) of its lengths."""

    axes: tuple[str, str, str]
    readings_mm: Array
    vectors_um: Array
    u_um: Array


def drawn_axes(chain: Chain, ranges: Mapping[str, tuple[float, float]]) -> list[int]:
    """Return the numbers of the linear axes along X, Y and Z, over whose ``ranges`` (mm) a map is drawn.

    Raises InputError for a machine without three linear axes that moved.
    """
    # In the order of the machine's directions, as the components of the vectors are; a chain has its own.
    linear = sorted(
        (index for index, joint in enumerate(chain.joints) if not joint.turns),
        key=lambda index: chain.joints[index].main,
    )
    if [chain.joints[index].main for index in linear] != [0, 1, 2]:
        raise InputError(
            f"the map is drawn for three linear axes along X, Y and Z; '{chain.topology}' has {len(linear)} linear axes"
            f"{', not along these' if len(linear) == 3 else ''}"
        )
    flat = [name for name, (first, last) in ranges.items() if not last > first]
    if flat:
        raise InputError(
            f"the map is drawn over a volume, but the campaign stood still along {' and '.join(flat)}: say the "
            "strokes in [machine.axes] of its campaign.toml, or leave the map out"
        )
    return linear


def at_pose(mapped: VolumetricMap, pose: int = 0) -> AtPose:
    """The part of a map that can be drawn; the first ``pose`` has all rotary axes at zero.

    Raises InputError for a machine without three linear axes that moved.
    """
    error, chain = mapped.error, mapped.errors.chain
    linear = drawn_axes(chain, mapped.ranges)
    each = mapped.points**3
    rows = slice(pose * each, (pose + 1) * each)
    signs = np.array([chain.joints[index].sign for index in linear])
    first, second, third = (chain.joints[index].name for index in linear)
    return AtPose(
        (first, second, third),
        error.positions[rows][:, linear] * signs,
        error.vectors[rows] / MICROMETRE.factor,
        error.u_lengths[rows] / MICROMETRE.factor,
    )
