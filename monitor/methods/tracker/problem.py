"""Observation from outside: reflectors carried by the tool, measured by a tracker or camera in a frame of its own.

A run's own unknowns are the frame (as a small motion away from a first guess), the places of the reflectors on the
tool in the frame of the last tool axis, and those of reflectors fixed beside the machine. The first guess comes
from linear least squares: with the rotation's nine numbers taken as free, frame and reflectors are linear in what
the nominal chain says; the nearest rotation then takes their place (Horn, Hilden and Negahdaripour, J. Opt. Soc.
Am. A 5 (1988) 1127). It needs no start of its own: a frame metres away or upside down is as good as any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.effects.artefact.tracker import measured_points
from monitor.effects.catalogue import of_tracker
from monitor.machine import ChainPose, evaluate
from monitor.machine.chain import rotation_about
from monitor.methods.chain.exact_scales import exact_scales
from monitor.methods.chain.first_frame import all_axes_meet, best_frame, frame_equations
from monitor.methods.chain.identification import AsStated
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.size_of_points import left_of, refuse_other_size
from monitor.records import Array
from monitor.sources import SCALE, CommonQuantity

FRAME = ("frame x", "frame y", "frame z", "frame a", "frame b", "frame c")
# A zero that is off by more than 20 degrees is another zero; mastering errors stay below some degrees.
LARGEST_TURN = 0.35
# Robots hide larger effects than machine tools: a joint that gives way under a payload, or a reversal, of a few
# millimetres at the tool; a tilt or turn of a degree.
LARGEST_DISPLACEMENT, LARGEST_ANGLE = 5.0, 0.02
# Geometry alone leaves a robot some tenths of a millimetre over a metre. Where a fiftieth of the spread of the
# points is left, the chain is another one.
CONTRADICTS = 0.02
AXES: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class TrackingProblem(ChainProblem):
    """Points of reflectors (n rows); ``context.nominal`` (n, 3) holds them in the machine's frame by the first guess,
    ``reflectors`` (T, 3) their places by it in the order of ``targets``, ``fixed`` names those beside the machine,
    ``gear_ratios`` are those that the machine file gives. ``observer`` is the tracker's name, ``scale`` that of its
    lengths where it states how well it knows it: an unknown of every run then; ``is_scale_known``: exact as stated."""

    reflectors: tuple[tuple[float, float, float], ...] = ()
    fixed: tuple[str, ...] = ()
    gear_ratios: tuple[tuple[str, float], ...] = ()
    observer: str = ""
    scale: CommonQuantity | None = None
    is_scale_known: bool = False

    @cached_property
    def own_names(self) -> tuple[str, ...]:
        """The frame's motion, the coordinates of the reflectors, then the scale where it is not exact."""
        places = (f"reflector {target} {axis}" for target in self.targets for axis in "xyz")
        return (*FRAME, *places, *self.extra_names)

    @cached_property
    def own_start(self) -> Array:
        """The first guess (R, q)."""
        start = np.concatenate(
            [np.zeros(6), np.array(self.reflectors).reshape(-1), np.zeros(len(self.extra_names))]
        )
        return np.tile(start, (len(self.runs), 1))

    def guessed_anew(self) -> Self:
        """The problem with one frame a run, guessed of all rows that belong to it now."""
        carried, places = first_guess(self.context, measured_points(self.context), self.fixed)
        return replace(self, context=replace(self.context, nominal=carried), reflectors=as_triples(places))

    @property
    def shared_by_rows(self) -> tuple[str, ...]:
        """The middles of the runs."""
        return ("_centre",)

    @property
    def largest_error(self) -> float:
        """A turn of 20 degrees."""
        return LARGEST_TURN

    @property
    def target_word(self) -> str:
        """A reflector."""
        return "reflector"

    @property
    def resting(self) -> tuple[str, ...]:
        """Reflectors beside the machine."""
        return self.fixed

    @property
    def largest_effect(self) -> tuple[float, float]:
        """Displacement in mm and angle in rad that a robot may hide."""
        return LARGEST_DISPLACEMENT, LARGEST_ANGLE

    def method_effects(self, drivers: Sequence[str]) -> tuple[str, ...]:
        """What poses seen from outside can show besides the errors of every chain."""
        return of_tracker(self.context.chain, drivers, dict(self.gear_ratios), len(self.runs))

    @cached_property
    def _fixed(self) -> npt.NDArray[np.bool_]:
        """Rows (n,) of reflectors beside the machine."""
        return np.isin(self.context.target, list(self.fixed))

    @cached_property
    def _centre(self) -> Array:
        """The middle (R, 3) of every run's points, about which its frame turns."""
        return np.array(
            [self.context.nominal[self._run == run].mean(axis=0) for run in range(len(self.runs))]
        )

    def _turned(self, nuisance: Array) -> tuple[Array, Array, Array]:
        """Rotations (R, 3, 3) of the frames, and those of their two outer turns."""
        about_c = rotation_about(AXES[2], nuisance[:, 5])
        about_cb = about_c @ rotation_about(AXES[1], nuisance[:, 4])
        return about_cb @ rotation_about(AXES[0], nuisance[:, 3]), about_cb, about_c

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """The measured points in the machine's frame, and the reflectors in that of the last axis."""
        turn, _, _ = self._turned(nuisance)
        points = self._arms(turn) + self._centre[self._run] + nuisance[self._run, :3]
        if self.scale is not None:
            # About the middle: where the tracker stands is the frame's.
            points += self._arms(turn) * nuisance[self._run, -1:]
        end = 6 + 3 * len(self.targets)
        places = nuisance[:, 6:end].reshape(len(self.runs), len(self.targets), 3)
        return points, places[self._run, self._target]

    def _arms(self, turn: Array) -> Array:
        """The measured points (n, 3) from the middle of their run, as ``turn`` (R, 3, 3) has their frame."""
        arm = self.context.nominal - self._centre[self._run]
        arms: Array = np.einsum("nij,nj->ni", turn[self._run], arm)
        return arms

    def evaluated(self, local: Array, common: Array, *, jacobian: bool = False) -> ChainPose:
        """The chain at (R, p) and (c,); reflectors beside the machine are not carried by it."""
        errors, points, places = self.state(local, common)
        context = self.context
        pose = evaluate(context.chain, context.positions, errors, points, places, jacobian=jacobian)
        if not self._fixed.any():
            return pose
        residual, by_tip = pose.residual.copy(), pose.by_tip.copy()
        residual[self._fixed] = (places - points)[self._fixed]
        by_tip[self._fixed] = np.eye(3)
        by_error = pose.by_error
        if by_error is not None:
            by_error[self._fixed] = 0.0
        return replace(pose, residual=residual, by_tip=by_tip, by_error=by_error)

    def squares(self, local: Array, common: Array) -> float | None:
        """The sum of squares of the whitened residuals: derivatives would cost twice as much again."""
        if self.is_in_parts:
            return None
        extra, _ = self.extras(self.own_of(local))
        return float(np.sum((self.vectors(local, common) / self.sigma) ** 2) + np.sum(extra**2))

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 3, q) by frame and reflectors."""
        derivatives = np.zeros((len(self.context), 3, nuisance.shape[1]))
        derivatives[:, :, :3] = -np.eye(3)
        turn, about_cb, about_c = self._turned(nuisance)
        turned = self._arms(turn)
        # d(R_C R_B R_A) turns about R_C R_B x, R_C y and z.
        for index, axes in enumerate((about_cb[:, :, 0], about_c[:, :, 1], np.tile(AXES[2], (len(turn), 1)))):
            derivatives[:, :, 3 + index] = -np.cross(axes[self._run], turned)
        rows = np.arange(len(self.context))
        for axis in range(3):
            derivatives[rows, :, 6 + 3 * self._target + axis] = pose.by_tip[:, :, axis]
        if self.scale is not None:
            derivatives[:, :, -1] = -turned
        return derivatives

    @property
    def extra_names(self) -> tuple[str, ...]:
        """The scale, where the tracker states how well it knows it."""
        return () if self.scale is None else (SCALE,)

    @property
    def common_quantities(self) -> tuple[CommonQuantity | None, ...]:
        """The scale."""
        return () if self.scale is None else (self.scale,)

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """What the scale is off, in its standard uncertainty."""
        if self.scale is None:
            return super().extras(nuisance)
        by_own = np.zeros((len(nuisance), 1, nuisance.shape[1]))
        by_own[:, 0, -1] = 1.0 / self.scale.u
        return nuisance[:, -1:] / self.scale.u, by_own

    def exact_scales(self) -> tuple[AsStated, ...]:
        """The tracker, where it does not say how well it knows its scale, nor that it does, with what that moves."""
        if self.scale is not None or self.is_scale_known:
            return ()
        turn, _, _ = self._turned(self.own_start)
        return tuple(exact_scales(self, {self.observer: (self.targets, self._arms(turn))}))

    def contradiction(self, solution: Solution) -> str | None:
        """Why the readings cannot come from this chain, in words; None where they may."""
        residual = self.vectors(solution.local, solution.common)
        weight = np.isfinite(self.sigma[:, 0]) & ~self._fixed
        spread = float(np.sqrt(np.mean((self.context.nominal - self._centre[self._run])[weight] ** 2)))
        rms = float(np.sqrt(np.mean(residual[weight] ** 2)))
        if rms <= CONTRADICTS * spread:
            return None
        return (
            f"after the fit {rms:.3g} mm are left over points that spread by {spread:.3g} mm, which no errors of this "
            "chain explain; check the order of the axes, their signs, directions and offsets, and the units"
        )


def as_triples(places: Array) -> tuple[tuple[float, float, float], ...]:
    """Places (T, 3) as the problem keeps them."""
    return tuple((float(x), float(y), float(z)) for x, y, z in places)


def first_guess(context: Context, points: Array, fixed: Sequence[str]) -> tuple[Array, Array]:
    """Points (n, 3) carried into the machine's frame, and the places (T, 3) of all targets, by the nominal chain.

    ``points`` (n, 3) mm are in the tracker's frame, a frame of its own in every run; places of reflectors on the
    tool are in the frame of the last axis, of fixed ones in the machine's.
    """
    count = len(context)
    none = np.zeros((count, len(context.chain.joints), 2, 6))
    pose = evaluate(context.chain, context.positions, none, np.zeros((count, 3)), np.zeros(3))
    targets = np.unique(context.target)
    carried = np.empty((count, 3))
    sums, times = np.zeros((len(targets), 3)), np.zeros(len(targets))
    for run in np.unique(context.run):
        rows = np.flatnonzero(context.run == run)
        tool = rows[~np.isin(context.target[rows], list(fixed))]
        names, at = np.unique(context.target[tool], return_inverse=True)
        turn, shift, places = _frame(pose.by_tip[tool], pose.residual[tool], points[tool], at)
        carried[rows] = points[rows] @ turn.T + shift
        for name, position in zip(names, places, strict=True):
            number = int(np.flatnonzero(targets == name)[0])
            sums[number] += position
            times[number] += 1.0
        for number, name in enumerate(targets):
            target_rows = rows[context.target[rows] == name]
            if name in fixed and len(target_rows):
                sums[number] += carried[target_rows].mean(axis=0)
                times[number] += 1.0
    return carried, sums / np.maximum(times, 1.0)[:, None]


def _frame(
    rotation: Array, origin: Array, points: Array, at: npt.NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Rotation (3, 3) and shift (3,) of the tracker's frame and places (K, 3) such that
    rotation_i place + origin_i = turn point_i + shift, as well as may be. Where all axes meet in a point or there is
    only one, these equations have no right-hand side, and the guess is improved in turn."""
    kinds = int(at.max()) + 1
    middle = points.mean(axis=0)
    arm = points - middle
    size = max(float(np.sqrt(np.mean(arm**2))), 1.0)
    if all_axes_meet(origin, size):
        return best_frame(rotation, origin, points, at, np.zeros((kinds, 3)), False)
    flat, wanted = frame_equations(rotation, origin, arm / size, at, kinds)
    free = np.linalg.lstsq(flat, wanted, rcond=1e-8)[0]
    u, _, vt = np.linalg.svd(free[:9].reshape(3, 3) / size)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    remainder = (origin - arm @ turn.T).reshape(-1)
    rest = np.linalg.lstsq(flat[:, 9:], -remainder, rcond=1e-8)[0]
    linear = (turn, rest[:3] - turn @ middle, rest[3:].reshape(kinds, 3))
    if left_of(linear, rotation, origin, points, at) <= CONTRADICTS * size:
        return linear
    # Axes that nearly meet, or a geometry that is far off: which guess is better shows in what it leaves.
    guesses = (linear, best_frame(rotation, origin, points, at, np.zeros((kinds, 3)), False))
    rms, best = min(
        (left_of(guess, rotation, origin, points, at), number) for number, guess in enumerate(guesses)
    )
    refuse_other_size(rotation, origin, points, at, rms, "the tracker's columns")
    return guesses[best]
