"""What a Type B source does to the numbers that the rows of one run tell, quantity by quantity.

Every function returns what a source of size 1 (mm, rad or K) does: (n, d, q) in mm, for n rows of d numbers and q
independent values of the source. Signs are free: every law is symmetric about zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.effects import parse_effect
from monitor.effects.effect import ChainBasis
from monitor.exceptions import InputError
from monitor.machine import LOCATION, MOTION
from monitor.records import Array, Campaign
from monitor.sources import Quantity, Source
from monitor.uncertainty.linear_axes import interpolated, node_names
from monitor.uncertainty.runs.measured_run import MeasuredRun

#: Angles (rad) and parts of a unit vector that differ by less are one pose and one direction: 1 µrad, half a degree.
_SAME_ANGLE, _SAME_DIRECTION = 1e-6, 1e-2


#: What the values of a source are of, by row: rows of one target, pose or angle share them, in every run alike.
Groups = tuple[tuple[Any, ...], ...]


@dataclass(frozen=True)
class Scene:
    """One run at its least-squares point: derivatives of the rows by errors of the chain and by the tip."""

    run: MeasuredRun
    campaign: Campaign
    by_error: Array
    by_tip: Array

    @property
    def rows(self) -> int:
        """The number of rows n."""
        return self.run.probings

    def observed(self, moved: Array) -> Array:
        """The numbers (n, d, q) that are told of displacements (n, 3, q) in mm."""
        return self.run.problem.observe(moved)

    def joint(self, name: str | None) -> int:
        """The place of an axis in the chain. Raises InputError where the machine has none of that name."""
        joints = self.run.problem.context.chain.joints
        for index, joint in enumerate(joints):
            if joint.name == name:
                return index
        raise InputError(f"the machine has no axis '{name}'; it has {', '.join(j.name for j in joints)}")

    @property
    def one_for_all(self) -> Groups:
        """All rows share the values of the source."""
        return ((),) * self.rows

    def alike(self, *columns: npt.NDArray[Any]) -> Groups:
        """Rows with equal entries of ``columns``, (n,) or (n, k) each, share values, which these entries name."""
        tables = [column.reshape(self.rows, -1).tolist() for column in columns]
        return tuple(tuple(entry for part in parts for entry in part) for parts in zip(*tables, strict=True))

    @property
    def poses(self) -> Array:
        """The angles (n, k) of the axes that turn, as whole numbers of what counts as equal."""
        context = self.run.problem.context
        turning = [index for index, joint in enumerate(context.chain.joints) if joint.turns]
        return np.round(context.positions[:, turning] / _SAME_ANGLE)

    @property
    def targets(self) -> npt.NDArray[Any]:
        """The name (n,) of every row's target."""
        return np.asarray(self.run.problem.context.target).astype(str)


#: What a source of size 1 does to the rows (n, d, q), and which rows share its values.
Shared = tuple[Array, Groups]


def _needs_touches(scene: Scene, source: Source) -> None:
    problem = scene.run.problem
    if not problem.touches_centres and problem.touch_normals is None:
        raise InputError(
            f"source '{source.name}': {source.quantity.value} belongs to touches with a stylus, of which this method "
            "has none; leave it out"
        )


def _ball_form(scene: Scene, source: Source) -> Shared:
    """Another place of the ball is touched at every pose: values of their own for every ball, pose and direction."""
    problem = scene.run.problem
    balls = problem.touched_balls
    if not balls.any():
        raise InputError(f"source '{source.name}': no ball is touched in this campaign; leave it out")
    if problem.touch_normals is None:
        turned = np.eye(3)[None].repeat(scene.rows, axis=0)
        return scene.observed(turned), scene.alike(scene.targets, scene.poses)
    along = np.round(problem.touch_normals / _SAME_DIRECTION)
    return balls[:, None, None].astype(np.float64), scene.alike(scene.targets, along)


def _probe_lobing(scene: Scene, source: Source) -> Shared:
    """A value for every direction of touch in the tool's frame; of centres, a vector for every ball and pose."""
    _needs_touches(scene, source)
    normals = scene.run.problem.touch_normals
    if normals is None:
        turned = np.eye(3)[None].repeat(scene.rows, axis=0)
        return scene.observed(turned), scene.alike(scene.targets, scene.poses)
    in_tool = np.einsum("nij,ni->nj", scene.by_tip, normals)
    return np.ones((scene.rows, 1, 1)), scene.alike(np.round(in_tool / _SAME_DIRECTION))


def _stylus_axis(scene: Scene) -> Array:
    """The stylus (n, 3) in the frame of the last work axis: towards the tip where the file says it, else along Z."""
    tip = np.array(scene.campaign.probe.tip or (0.0, 0.0, 0.0))
    length = float(np.linalg.norm(tip))
    axis = tip / length if length > 1.0 else np.array([0.0, 0.0, 1.0])
    return np.asarray(scene.by_tip @ axis)


def _stylus_bending(scene: Scene, source: Source) -> Shared:
    """A stylus bends across its axis: the part of the touch across it counts, of centres what is left along it."""
    _needs_touches(scene, source)
    axis = _stylus_axis(scene)
    normals = scene.run.problem.touch_normals
    if normals is None:
        return scene.observed(axis[:, :, None]), scene.one_for_all
    across = 1.0 - np.einsum("ni,ni->n", normals, axis) ** 2
    return across[:, None, None], scene.one_for_all


def _ball_size(scene: Scene, source: Source) -> Shared:
    """The radius grows: what a touch tells along its normal; a centre does not tell it."""
    problem = scene.run.problem
    if problem.touches_centres:
        raise InputError(
            f"source '{source.name}': the readings are centres of balls, which do not depend on their size; leave "
            f"{source.quantity.value} out (what moves the balls is drift, or an effect such as artefact:expansion)"
        )
    balls = problem.touched_balls
    if not balls.any():
        raise InputError(f"source '{source.name}': no ball is touched in this campaign; leave it out")
    radius = {ball.id: 0.5 * ball.diameter for ball in scene.campaign.artefact.balls}
    radii = np.array([radius.get(str(name), 0.0) for name in problem.context.target]) * balls
    by_size = (
        source.expansion_coefficient
        if source.quantity is Quantity.BALL_TEMPERATURE
        else source.temperature_offset
    )
    assert by_size is not None  # the reader asks for it
    return (radii * by_size)[:, None, None], scene.one_for_all


def _drift(scene: Scene, source: Source) -> Shared:
    """The tool's side moves against the work's, in the directions of the bed, in proportion to the time in the run."""
    context = scene.run.problem.context
    chain = context.chain
    # Next to the bed a shift is along the machine's own directions.
    nearest = len(chain.work) if chain.tool else 0
    along = [("XYZ").index(source.along)] if source.along else [0, 1, 2]
    moved = scene.by_error[:, :, nearest, LOCATION, :3][:, :, along]
    return scene.observed(moved * context.run_time[:, None, None]), scene.one_for_all


def _rotary_readout(scene: Scene, source: Source) -> Shared:
    """An angle of the axis about itself, with a value of its own at every angle where it stands."""
    index = scene.joint(source.axis)
    turned = np.einsum(
        "nik,k->ni",
        scene.by_error[:, :, index, MOTION, 3:],
        np.array(scene.run.problem.context.chain.joints[index].direction),
    )
    angle = np.round(scene.run.problem.context.positions[:, index] / _SAME_ANGLE)
    return scene.observed(turned[:, :, None]), scene.alike(angle)


def _table_deflection(scene: Scene, source: Source) -> Shared:
    """The table turns and tilts once a revolution of its axis, as a load beside the axis makes it: a sine of unknown
    amplitude and phase about each direction, of the same standard uncertainty at every angle."""
    index = scene.joint(source.axis)
    angle = scene.run.problem.context.positions[:, index, None, None]
    turned = scene.by_error[:, :, index, MOTION, 3:]
    both = np.concatenate([turned * np.cos(angle), turned * np.sin(angle)], axis=2)
    return scene.observed(both), scene.one_for_all


def _linear(scene: Scene, source: Source) -> Shared:
    """Independent values at nodes an unknown distance apart, straight between them, along or across the travel."""
    index = scene.joint(source.axis)
    joint = scene.run.problem.context.chain.joints[index]
    assert source.node_spacing is not None  # the reader asks for it
    root = interpolated(scene.run.problem.context.positions[:, index], source.node_spacing)
    along = source.quantity is Quantity.LINEAR_POSITIONING
    directions = [axis for axis in range(3) if (axis == joint.main) == along]
    parts = [
        scene.observed(scene.by_error[:, :, index, MOTION, axis][:, :, None] * root[:, None, :])
        for axis in directions
    ]
    return np.concatenate(parts, axis=2), scene.one_for_all


def _effect(scene: Scene, source: Source) -> Shared:
    """An effect of the language, whose largest value over the rows is the size."""
    problem = scene.run.problem
    assert source.effect is not None  # the reader asks for it
    effect = parse_effect(source.effect, problem.context.chain)
    if effect.text in [present.text for present in (*problem.base, *problem.added)]:
        raise InputError(
            f"source '{source.name}': {effect.text} is what this model identifies, so it is a result and no source; "
            "leave it out"
        )
    basis = effect.basis(problem.context)
    moved = basis.displacement(scene.by_error)
    if isinstance(basis, ChainBasis):
        largest = np.abs(basis.columns).max(axis=0)
    else:
        largest = np.linalg.norm(moved, axis=1).max(axis=0)
    return scene.observed(moved / np.where(largest > 0.0, largest, 1.0)), scene.one_for_all


_ROWS: Mapping[Quantity, Callable[[Scene, Source], Shared]] = {
    Quantity.BALL_FORM: _ball_form,
    Quantity.PROBE_LOBING: _probe_lobing,
    Quantity.STYLUS_BENDING: _stylus_bending,
    Quantity.BALL_TEMPERATURE: _ball_size,
    Quantity.BALL_EXPANSION: _ball_size,
    Quantity.DRIFT: _drift,
    Quantity.ROTARY_READOUT: _rotary_readout,
    Quantity.TABLE_DEFLECTION: _table_deflection,
    Quantity.LINEAR_POSITIONING: _linear,
    Quantity.LINEAR_STRAIGHTNESS: _linear,
    Quantity.EFFECT: _effect,
}


def rows_of(scene: Scene, source: Source) -> Shared:
    """What a source of size 1 does to the rows, and which rows share its values. Raises InputError, EffectError."""
    return _ROWS[source.quantity](scene, source)


def names_of_values(scene: Scene, source: Source, count: int) -> tuple[Any, ...]:
    """What tells the ``count`` values of rows of one group apart, the same in every run: their number, or the node of
    an error of a linear axis."""
    if source.quantity not in (Quantity.LINEAR_POSITIONING, Quantity.LINEAR_STRAIGHTNESS):
        return tuple(range(count))
    assert source.node_spacing is not None  # the reader asks for it
    position = scene.run.problem.context.positions[:, scene.joint(source.axis)]
    nodes = node_names(position, source.node_spacing)
    return tuple((direction, *node) for direction in range(count // len(nodes)) for node in nodes)
