"""Rotary probing: location errors of rotary axes from touching one test piece at indexed angles.

A touch measures one number: how far the stylus tip's centre stands from the surface, along its normal. The same points
are touched at several angles, so their heights are unknowns of the run, and place and shape of the piece cancel. A
sphere is touched from several sides at every pose; its centre and its effective radius (its own and the tip's) are
unknowns. The linear axes and the stylus tip count as known: their errors go into the result (docs/rotary-probing.md
says how far), as none of these touches separates them from errors of the rotary axes.

Any chain with rotary axes, any poses, faces with any normals. Source: S. Ibaraki, T. Iritani, T. Matsushita, 2012;
its closed forms are a reference of the tests. Two products of small numbers are neglected: the tilt of a face against
its stated normal times the location errors (2 mrad and 30 µm: 0.06 µm), and the curvature of a sphere over the
change of the touched place between two identifications (below 1 nm).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import Context, context_of
from monitor.exceptions import DataError
from monitor.machine import ChainPose, evaluate
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.model import Model, chain_of
from monitor.methods.rotary_probing.base import rotary_base
from monitor.records import Array, Campaign

NAME = "rotary-probing"
DEFAULT_MODEL = Model(NAME)
NORMAL = ("normal_x", "normal_y", "normal_z")
# One point of the piece comes back to the same place of the table's frame to within set-up and location errors. More
# than this apart (mm) and the machine file is wrong, or two points share a name.
FARTHEST_APART = 2.0
# A third of the touches of a point may be single mistakes; of more nobody can say which are right.
MOST_APART = 1.0 / 3.0
# A stated normal and the direction from a sphere's centre to the tip agree to this (rad), or one of them is wrong.
LARGEST_TILT = 0.2
# The direction from a sphere's centre is taken from the solution before: each time the rest falls by the ratio of
# the location errors to the radius, so from 50 µm and 10 mm it is 3 nm after two.
DIRECTIONS = 3


@dataclass(frozen=True)
class RotaryProblem(ChainProblem):
    """Touches of faces and spheres. ``normal`` (n, 3) is the direction that a touch measures, outwards, in the frame of
    the last work axis; ``reference`` (n, 3) mm where the touched point lies in it, a sphere's centre for its touches;
    ``ball`` (n,) whether the target is a sphere; ``apart`` (n,) whether a touch stands apart from the others of its
    point; ``tip`` (3,) mm the tip's centre in the spindle frame."""

    normal: Array
    reference: Array
    ball: npt.NDArray[np.bool_]
    apart: npt.NDArray[np.bool_]
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def _kinds(self) -> tuple[tuple[str, bool], ...]:
        balls = set(self.context.target[self.ball].tolist())
        return tuple((name, name in balls) for name in self.targets)

    @cached_property
    def _first(self) -> npt.NDArray[np.int64]:
        """Place (n,) of the first own unknown of every touch's target."""
        sizes = [4 if ball else 1 for _, ball in self._kinds]
        return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)[self._target]

    @cached_property
    def own_names(self) -> tuple[str, ...]:
        """Heights of the points, centres and effective radii of the spheres."""
        names: list[str] = []
        for name, ball in self._kinds:
            names += (
                [f"ball {name} {what}" for what in ("x", "y", "z", "radius")] if ball else [f"height {name}"]
            )
        return tuple(names)

    @cached_property
    def own_start(self) -> Array:
        """Points at their references, spheres at theirs with no radius: the problem is all but linear."""
        return np.zeros((len(self.runs), len(self.own_names)))

    @property
    def far_off(self) -> npt.NDArray[np.bool_]:
        """Touches that stand apart from the others of their point."""
        return self.apart

    @property
    def shared_by_rows(self) -> tuple[str, ...]:
        """Which targets are spheres."""
        return ("_kinds",)

    @property
    def components(self) -> tuple[str, ...]:
        """The one number of a touch."""
        return ("normal",)

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """The linear axes: they stop where the tip meets the surface."""
        return tuple(index for index, joint in enumerate(self.context.chain.joints) if not joint.turns)

    @property
    def touch_normals(self) -> Array:
        """The normals."""
        return self.normal

    @property
    def touched_balls(self) -> npt.NDArray[np.bool_]:
        """The touches of spheres."""
        return self.ball

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """Points of the surface (of the surface that the tip's centre meets) and the tip."""
        mine = nuisance[self._run]
        rows = np.arange(len(self.context))
        height = mine[rows, self._first + 3 * self.ball]
        ends = self.reference + height[:, None] * self.normal
        for axis in range(3):
            ends[self.ball, axis] += mine[self.ball, self._first[self.ball] + axis]
        return ends, np.broadcast_to(np.array(self.tip), ends.shape)

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 3, q) by heights, centres and radii."""
        derivatives = np.zeros((len(self.context), 3, nuisance.shape[1]))
        rows = np.arange(len(self.context))
        derivatives[rows, :, self._first + 3 * self.ball] = -self.normal
        for axis in range(3):
            derivatives[rows[self.ball], axis, self._first[self.ball] + axis] = -1.0
        return derivatives

    def observe(self, rows: Array) -> Array:
        """The part along the normal (n, 1, ...)."""
        along_normal: Array = np.einsum("ni,ni...->n...", self.normal, rows)[:, None]
        return along_normal


def _normals(campaign: Campaign) -> Array:
    missing = [name for name in NORMAL if name not in campaign.probings.channels]
    if missing:
        raise DataError(
            f"campaign {campaign.name} has no column {' nor '.join(missing)}; {NAME} needs the outward normal of every "
            "touched surface, in the frame of the last work axis"
        )
    normal = np.column_stack([campaign.probings.channels[name] for name in NORMAL])
    length = np.linalg.norm(normal, axis=1)
    if not np.all(np.isfinite(length)) or np.any(np.abs(length - 1.0) > 0.01):
        row = int(np.flatnonzero(~(np.abs(length - 1.0) <= 0.01))[0])
        raise DataError(
            f"run {campaign.probings.run[row]}, sequence {campaign.probings.sequence[row]}: a normal is a vector of "
            f"length 1, not {normal[row].tolist()}"
        )
    return np.asarray(normal / length[:, None])


def _references(
    context: Context, tips: Array, ball: npt.NDArray[np.bool_]
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Where each touched point lies (n, 3), the mean over its run and target, a sphere's nominal centre; and the
    touches (n,) that stand apart from the others of their point, which have no part in the mean.

    Raises DataError where more than single touches stand apart.
    """
    references = np.where(ball[:, None], context.nominal, 0.0)
    far_off = np.zeros(len(context), dtype=bool)
    for run in np.unique(context.run):
        for target in np.unique(context.target[(context.run == run) & ~ball]):
            rows = np.flatnonzero((context.run == run) & (context.target == target))
            near, apart = _near(tips[rows])
            if len(rows) - near.sum() > MOST_APART * len(rows):
                raise DataError(
                    f"run {run}: the touches of point {target} lie up to {apart:.3g} mm apart in the table's "
                    "frame: the readings contradict the machine file; check the axis signs, the topology, the tip and "
                    "that every point has its own name"
                )
            references[rows] = tips[rows[near]].mean(axis=0)
            far_off[rows[~near]] = True
    return references, far_off


def _near(tips: Array) -> tuple[npt.NDArray[np.bool_], float]:
    """Which tips (m, 3) of one point come back to the same place, and how far (mm) they lie apart."""
    apart = 2.0 * float(np.linalg.norm(tips - tips.mean(axis=0), axis=1).max())
    if apart <= 2.0 * FARTHEST_APART:
        return np.ones(len(tips), dtype=bool), apart
    # Some of few: the mean is pulled by what stands apart, the median is not.
    return np.linalg.norm(tips - np.median(tips, axis=0), axis=1) <= FARTHEST_APART, apart


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> RotaryProblem:
    """The least-squares problem of a campaign under a model.

    Every touch has the probe's stated standard uncertainty along the normal. Raises DataError for readings that
    contradict the machine file, a normal that is none, or a machine without a rotary axis.
    """
    chain = chain_of(campaign.machine)
    whole = model if model.base else replace(model, base=rotary_base(chain))
    context = context_of(campaign, chain)
    normal = _normals(campaign)
    ball = np.isin(context.target, [sphere.id for sphere in campaign.artefact.balls])
    tip = campaign.probe.tip or (0.0, 0.0, 0.0)
    none = np.zeros((len(chain.joints), 2, 6))
    tips = evaluate(chain, context.positions, none, np.zeros((len(context), 3)), np.array(tip)).residual
    reference, apart = _references(context, tips, ball)
    problem = RotaryProblem(
        context=replace(context, nominal=reference),
        base=whole.base_of(chain),
        added=whole.added_to(chain),
        sigma=np.full((len(context), 1), campaign.probe.standard_uncertainty),
        normal=normal,
        reference=reference,
        ball=ball,
        apart=apart,
        tip=tip,
    )
    if ball.any():
        problem = _directed(problem)
    return problem.foreseen() if problem.added else problem


def _directed(problem: RotaryProblem) -> RotaryProblem:
    """The problem with every touch of a sphere telling along the line from its centre to the tip."""
    plain = replace(problem, added=())
    stated = problem.normal[problem.ball]
    for _ in range(DIRECTIONS):
        solution = solve_problem(plain)
        nuisance = solution.local[:, len(plain.base_names) :]
        rows = np.flatnonzero(problem.ball)
        mine = nuisance[plain._run[rows]]
        shift = np.stack([mine[np.arange(len(rows)), plain._first[rows] + axis] for axis in range(3)], axis=1)
        # The vector leads from the sphere's surface to the tip; from its centre it is a radius along the normal more.
        vector = plain.evaluated(solution.local, solution.common).residual[rows]
        vector = vector + plain.ends(nuisance)[0][rows] - (plain.reference[rows] + shift)
        direction = vector / np.linalg.norm(vector, axis=1, keepdims=True)
        tilt = np.arccos(np.clip(np.sum(direction * stated, axis=1), -1.0, 1.0))
        if float(tilt.max()) > LARGEST_TILT:
            row = rows[int(tilt.argmax())]
            raise DataError(
                f"run {problem.context.run[row]}, sequence {problem.context.sequence[row]}: the stated normal and the "
                f"line from the centre of ball {problem.context.target[row]} to the tip are "
                f"{np.degrees(tilt.max()):.3g} degrees apart; check the normal, the ball's nominal_mm and the tip"
            )
        normal = problem.normal.copy()
        normal[rows] = direction
        plain = replace(plain, normal=normal)
    return replace(problem, normal=plain.normal)
