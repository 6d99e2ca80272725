"""The touch: linear readings at which the machine with all its errors puts the tip on the ball, by Newton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .chain import Axis, branch_matrix, carried
from .effects import Circumstances, Effect, artefact_columns, axis_columns, coefficients_over_runs, place
from .machine import SimulatedMachine

TOUCH_MM = 1e-10  # a touch is exact to this: a ten-thousandth of the sixth decimal
FIRST_TRAVEL = ("reading", "plus", "minus", "zero", "carry")


def travel_signs(readings: np.ndarray, run: np.ndarray, first: str) -> np.ndarray:
    """(N,) sign of the last change of one axis's reading; an unchanged reading keeps the sign before it.

    The first probing of a run: `reading`, as if coming from the reading zero, the sign of the reading;
    `plus`, `minus`, `zero`; `carry`, from the last reading of the run before (the first run: as `reading`).
    """
    new_run = np.diff(run, prepend=run[0] - 1) != 0
    sign = np.sign(np.diff(readings, prepend=0.0))
    if first == "reading":
        sign[new_run] = np.sign(readings[new_run])
    elif first != "carry":
        sign[new_run] = {"plus": 1.0, "minus": -1.0, "zero": 0.0}[first]
    count = np.arange(len(sign))
    last = np.maximum.accumulate(np.where((sign != 0) | (new_run & (first != "carry")), count, 0))
    return sign[last]


class Errors:
    """All error contributions of one machine over one campaign, ready to be evaluated at any readings."""

    def __init__(self, machine: SimulatedMachine, now: Circumstances, points: np.ndarray, tip: np.ndarray):
        self.chain, self.now, self.points, self.tip = machine.chain, now, points, tip
        self.count = len(points)

    def gap(
        self, readings: dict[str, np.ndarray], travel: dict[str, np.ndarray], effects: Sequence[Effect]
    ) -> np.ndarray:
        """(N, 3) vector from the ball's centre to the tip, in the bed's frame, mm."""
        location: dict[str, np.ndarray] = {}
        motion: dict[str, np.ndarray] = {}
        points = self.points
        for effect in effects:
            if effect.of_artefact:
                columns = artefact_columns(effect, self.points, self.now)
                points = points + (columns @ np.atleast_1d(np.asarray(effect.coefficients, float)))
                continue
            axis, fixed, slot = place(effect, self.chain)
            q = axis.sign * readings[axis.name]
            columns = axis_columns(effect, axis, fixed, q, travel[axis.name], self.now)
            weights = coefficients_over_runs(effect, columns.shape[1], self.now)
            six = (location if fixed else motion).setdefault(axis.name, np.zeros((self.count, 6)))
            six[:, slot] += (
                (columns * weights[:, 0][:, None]).sum(1) if weights.ndim == 2 else columns @ weights
            )
        work = branch_matrix(self.chain.work, readings, location, motion, self.count)
        tool = branch_matrix(self.chain.tool, readings, location, motion, self.count)
        return carried(tool, np.broadcast_to(self.tip, points.shape)) - carried(work, points)

    def slopes(
        self,
        readings: dict[str, np.ndarray],
        travel: dict[str, np.ndarray],
        effects: Sequence[Effect],
        axes: Sequence[Axis],
    ) -> np.ndarray:
        """(N, 3, 3) numerical derivative of the gap by the linear readings (central, 0.1 mm)."""
        h = 0.1
        columns = []
        for axis in axes:
            ahead = self.gap(readings | {axis.name: readings[axis.name] + h}, travel, effects)
            behind = self.gap(readings | {axis.name: readings[axis.name] - h}, travel, effects)
            columns.append((ahead - behind) / (2 * h))
        return np.stack(columns, axis=2)

    def touch(
        self, readings: dict[str, np.ndarray], travel: dict[str, np.ndarray], effects: Sequence[Effect]
    ) -> dict[str, np.ndarray]:
        """Readings at which the tip sits on the ball to `TOUCH_MM`, found by Newton from `readings`."""
        axes = self.chain.linear
        if len(axes) != 3:
            raise ValueError(f"a touch needs three linear axes; {self.chain.topology!r} has {len(axes)}")
        inverse = np.linalg.inv(self.slopes(readings, travel, (), axes))
        for step in range(40):
            gap = self.gap(readings, travel, effects)
            if np.abs(gap).max() < TOUCH_MM:
                return readings
            if step % 8 == 7:  # errors so large that the ideal machine's slopes do not do
                inverse = np.linalg.inv(self.slopes(readings, travel, effects, axes))
            move = (inverse @ gap[:, :, None])[:, :, 0]
            readings = readings | {axis.name: readings[axis.name] - move[:, k] for k, axis in enumerate(axes)}
        raise RuntimeError(f"the tip does not reach the ball: {np.abs(gap).max():.3g} mm are left")


def scaled(effect: Effect, errors: Errors, readings: dict[str, np.ndarray], first: str) -> Effect:
    """The effect with coefficients; a peak in µm is turned into them at the ideal machine's readings."""
    if effect.peak_um is None:
        if effect.coefficients is None:
            raise ValueError(f"effect {effect.name!r} needs coefficients or peak_um")
        return effect
    travel = {name: travel_signs(r, errors.now.run, first) for name, r in readings.items()}
    if effect.of_artefact:
        width = artefact_columns(effect, errors.points, errors.now).shape[2]
    else:
        axis, fixed, _ = place(effect, errors.chain)
        q = axis.sign * readings[axis.name]
        width = axis_columns(effect, axis, fixed, q, travel[axis.name], errors.now).shape[1]
    ratio = np.ones(width) if effect.direction is None else np.asarray(effect.direction, float)
    plain = errors.gap(readings, travel, ())
    probe, size = 1e-6, 0.0
    for _ in range(2):  # the second with the displacement of the size asked for, inside the linear range
        trial = replace(effect, coefficients=probe * ratio, peak_um=None)
        moved = np.linalg.norm(errors.gap(readings, travel, (trial,)) - plain, axis=1).max()
        if moved < 1e-15:
            raise ValueError(f"effect {effect.name!r} moves nothing in this plan: no peak to scale")
        size = effect.peak_um * 1e-3 / moved * probe
        probe = abs(size)
    return replace(effect, coefficients=size * ratio, peak_um=None)
