"""The vector from target to stylus tip, exact, for any number of poses at once, and its exact Jacobian.

Going outwards, every joint j adds ``L_j M_j(q_j) E_j`` to its branch: location error, nominal motion, error
motion; L and E are six small numbers each, rotations multiplied as R_C R_B R_A. The vector, in the frame of
the last work axis, is ``r = (T_work T_p)^-1 T_tool tip``. Nothing is linearised.

The Jacobian is exact too: a small change of an error is a small turn or shift of all that the joint carries,
and the axis of that turn in the bed's frame is known once the chain has been multiplied up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.machine.topology import Chain, Joint
from monitor.records import Array


@dataclass(frozen=True)
class ChainPose:
    """The chain at n poses.

    ``residual`` (..., 3) in mm, from target to tip in the frame of the last work axis. ``by_error``
    (..., 3, J, 2, 6) its derivative by every error of every joint (stage 0 location, 1 motion; components
    X Y Z A B C; mm/mm or mm/rad), None unless asked for. ``by_tip`` (..., 3, 3) its derivative by the tip.
    The derivative by the target is minus the identity. ``work_rotation`` (..., 3, 3) turns vectors of the
    last work axis's frame into the bed's.
    """

    residual: Array
    by_tip: Array
    work_rotation: Array
    by_error: Array | None


def rotation_about(direction: tuple[float, float, float], angle: Array) -> Array:
    """Rotation matrices (..., 3, 3) about a unit vector (Rodrigues)."""
    x, y, z = direction
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    rotation: Array = np.eye(3) + sine * skew + (1.0 - cosine) * (skew @ skew)
    return rotation


def small_turn(angles: Array, *, with_axes: bool) -> tuple[Array, Array]:
    """R_C R_B R_A (..., 3, 3) for small angles (..., 3) A, B and C, element by element: a stack of small products takes
    three times as long. In columns the axes (..., 3, 3) of their changes: R_C R_B x, R_C y and z, if asked for."""
    sine_a, sine_b, sine_c = np.moveaxis(np.sin(angles), -1, 0)
    cosine_a, cosine_b, cosine_c = np.moveaxis(np.cos(angles), -1, 0)
    turn = np.empty((*angles.shape, 3))
    turn[..., 0, 0], turn[..., 1, 0], turn[..., 2, 0] = cosine_b * cosine_c, cosine_b * sine_c, -sine_b
    turn[..., 0, 1] = sine_a * sine_b * cosine_c - cosine_a * sine_c
    turn[..., 1, 1] = sine_a * sine_b * sine_c + cosine_a * cosine_c
    turn[..., 2, 1] = sine_a * cosine_b
    turn[..., 0, 2] = cosine_a * sine_b * cosine_c + sine_a * sine_c
    turn[..., 1, 2] = cosine_a * sine_b * sine_c - sine_a * cosine_c
    turn[..., 2, 2] = cosine_a * cosine_b
    axes = np.zeros(turn.shape if with_axes else (0,))
    if with_axes:
        axes[..., :, 0] = turn[..., :, 0]
        axes[..., 0, 1], axes[..., 1, 1], axes[..., 2, 2] = -sine_c, cosine_c, 1.0
    return turn, axes


class _Branch:
    """Multiplies a branch up and remembers, where asked, the twist of every error in the bed's frame."""

    def __init__(self, shape: tuple[int, ...], keep: bool) -> None:
        self.rotation = np.broadcast_to(np.eye(3), (*shape, 3, 3))
        self.origin = np.zeros((*shape, 3))
        self.keep = keep
        self.shifts: list[Array] = []
        self.turns: list[Array] = []
        self.centres: list[Array] = []

    def _carry(self, translation: Array) -> None:
        self.origin = self.origin + np.einsum("...ij,...j->...i", self.rotation, translation)

    def small(self, error: Array) -> None:
        """Append a frame of six small numbers (..., 6)."""
        if self.keep:
            self.shifts.append(self.rotation)
        if np.any(error[..., :3]):
            self._carry(error[..., :3])
        before = self.rotation
        turned = bool(np.any(error[..., 3:]))
        if turned:
            turn, axes = small_turn(error[..., 3:], with_axes=self.keep)
            self.rotation = before @ turn
        if self.keep:
            self.turns.append(before @ axes if turned else before)
            self.centres.append(self.origin)

    def motion(self, joint: Joint, position: Array) -> None:
        """Append the nominal motion of a joint."""
        if joint.turns:
            self.rotation = self.rotation @ rotation_about(joint.direction, position)
        else:
            self._carry(position[..., None] * np.array(joint.direction))

    def offset(self, joint: Joint) -> None:
        """Append the constant step from the axis before."""
        if any(joint.offset):
            self._carry(np.array(joint.offset))


def _multiply(joints: tuple[Joint, ...], first: int, positions: Array, errors: Array, keep: bool) -> _Branch:
    branch = _Branch(np.broadcast_shapes(positions.shape[:-1], errors.shape[:-3]), keep)
    for index, joint in enumerate(joints, start=first):
        branch.offset(joint)
        branch.small(errors[..., index, 0, :])
        branch.motion(joint, positions[..., index])
        branch.small(errors[..., index, 1, :])
    return branch


def _derivatives(branch: _Branch, point: Array, to_work: Array, sign: float, out: Array) -> None:
    """Fill out (..., 3, joints, 2, 6): the motion of ``point`` with each error, seen in the work frame."""
    # All errors side by side in the bed's frame: one product turns them.
    moved = np.empty(out.shape)
    for index, (shift, turn, centre) in enumerate(
        zip(branch.shifts, branch.turns, branch.centres, strict=True)
    ):
        joint, stage = divmod(index, 2)
        moved[..., joint, stage, :3] = shift
        lever = point - centre
        for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            part = turn[..., y, :] * lever[..., z, None] - turn[..., z, :] * lever[..., y, None]
            moved[..., x, joint, stage, 3:] = part
    side_by_side = moved.reshape(*moved.shape[:-3], 6 * len(branch.turns))
    out[...] = ((sign * to_work) @ side_by_side).reshape(out.shape)


def evaluate(
    chain: Chain, positions: Array, errors: Array, target: Array, tip: Array, *, jacobian: bool = False
) -> ChainPose:
    """The vector from target to tip for every pose.

    ``positions`` (..., J) physical displacements in mm or rad in the order of ``chain.joints``; ``errors``
    (..., J, 2, 6) in mm and rad; ``target`` (..., 3) mm in the frame of the last work axis; ``tip`` (..., 3)
    mm in the frame of the last tool axis. Leading dimensions broadcast, so poses, runs and trials may be
    evaluated at once. Time and memory grow linearly with the number of poses.
    """
    return _pose(chain, *_branches(chain, positions, errors, jacobian), target, tip)


def _branches(chain: Chain, positions: Array, errors: Array, keep: bool) -> tuple[_Branch, _Branch]:
    """The branches of work and tool."""
    work = _multiply(chain.work, 0, positions, errors, keep)
    return work, _multiply(chain.tool, len(chain.work), positions, errors, keep)


def _pose(chain: Chain, work: _Branch, tool: _Branch, target: Array, tip: Array) -> ChainPose:
    """The vector between the ends of two branches, with its derivatives where these are kept."""
    count = len(chain.work)
    tip_in_bed = tool.origin + np.einsum("...ij,...j->...i", tool.rotation, tip)
    to_work = np.swapaxes(work.rotation, -1, -2)
    residual = np.einsum("...ij,...j->...i", to_work, tip_in_bed - work.origin) - target
    by_error = None
    if work.keep:
        by_error = np.empty((*residual.shape, len(chain.joints), 2, 6))
        # The work branch is inverted: r = T_work^-1 x, so dr = -R_work' (turn x (x - centre)).
        _derivatives(work, tip_in_bed, to_work, -1.0, by_error[..., :count, :, :])
        _derivatives(tool, tip_in_bed, to_work, 1.0, by_error[..., count:, :, :])
    return ChainPose(residual, to_work @ tool.rotation, work.rotation, by_error)


@dataclass(frozen=True)
class Orientation:
    """How both sides of the chain are turned at n poses, in the bed's frame.

    ``work`` and ``tool`` (..., 3, 3) turn vectors of the last work and tool axis's frame into the bed's. ``by_error``
    (..., 3, J, 2, 6) is the turn vector of the joint's own side by every error of every joint, None unless asked for.
    """

    work: Array
    tool: Array
    by_error: Array | None


def orientation(chain: Chain, positions: Array, errors: Array, *, jacobian: bool = False) -> Orientation:
    """The orientation of both sides of a chain; arguments as in ``evaluate``."""
    return _sides(chain, *_branches(chain, positions, errors, jacobian))


def evaluate_with_sides(
    chain: Chain, positions: Array, errors: Array, target: Array, tip: Array, *, jacobian: bool = False
) -> tuple[ChainPose, Orientation]:
    """As ``evaluate``, and the orientation of both sides, multiplied up once."""
    branches = _branches(chain, positions, errors, jacobian)
    return _pose(chain, *branches, target, tip), _sides(chain, *branches)


def _sides(chain: Chain, work: _Branch, tool: _Branch) -> Orientation:
    """How two branches are turned, with the derivatives where these are kept."""
    by_error = None
    if work.keep:
        by_error = np.zeros((*work.origin.shape, len(chain.joints), 2, 6))
        for branch, first in ((work, 0), (tool, len(chain.work))):
            for index, turn in enumerate(branch.turns):
                joint, stage = divmod(index, 2)
                by_error[..., first + joint, stage, 3:] = turn
    return Orientation(work.rotation, tool.rotation, by_error)
