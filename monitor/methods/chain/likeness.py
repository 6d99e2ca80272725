"""Readings that a machine with chosen errors would give under the plan of a campaign that was measured: for rehearsal.

Whatever a method measures, its problem says what is left of every row at given errors. The numbers that were read, the
linear axes of a touch or the columns of an instrument, are moved until just the noise is left.

Effects see the poses of the plan, where the pattern's own errors let the measured axes stop, and not the readings that
are sought: which way an axis came to its pose is the plan's; a reading moved by a micrometre must not turn it round.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from monitor.effects import Effect, parse_effect
from monitor.exceptions import DataError, EffectError
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem, solve_problem, stops
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.methods.method import ChainMethod
from monitor.records import Array, Campaign, Probings

#: The context's places of targets, which some methods measure.
NOMINAL = "nominal"
#: What rounding leaves of a point that was turned into another frame, mm.
EXACT_MM = 1e-7
#: Newton steps with the derivatives at the pattern: rows are linear in what was read but for products of errors and
#: turns of 1e-4, so four do there; larger errors (a mount's angles of minutes) get derivatives of their own, and more.
FIRST_STEPS, MOST_STEPS = 4, 24
#: What may be left of a row besides its noise, against its standard uncertainty, and where more steps gain nothing.
CLOSE_ENOUGH, EXACT = 1e-3, 1e-6
#: Step of the numerical derivative against the size of the numbers of a column.
STEP = 1e-6


@dataclass(frozen=True)
class Frames:
    """Recorded ``columns`` (k) of a point that a problem keeps in another frame: ``turns`` (n, k, 3) a row."""

    columns: tuple[str, ...]
    turns: Array

    def moved(self, probings: Probings, pattern: Probings) -> Array:
        """What the move of the columns from the pattern is (n, 3) in the problem's frame."""
        moves = np.stack([probings.channels[name] - pattern.channels[name] for name in self.columns], axis=-1)
        return np.asarray(np.einsum("nk,nkd->nd", moves, self.turns))


class Likeness:
    """A measured campaign with the errors that it shows, as the pattern of virtual ones."""

    def __init__(self, campaign: Campaign, method: ChainMethod) -> None:
        self.campaign, self.method = campaign, method
        problem = method.problem_of(campaign, method.own_model)
        method.refuse(campaign, problem)
        self.solution: Solution = solve_problem(problem)
        refuse_exact_fits(problem, self.solution)
        self.problem = _with_planned_poses(problem, self.solution)
        knows_columns = bool(self.problem.read_columns)
        self.kept = {} if knows_columns else _kept_numbers(self.problem, campaign.probings.channels)
        self.frames = None if knows_columns or self.kept else _frames(self.problem, campaign.probings)
        self.columns = self._measured_columns()

    @property
    def days(self) -> Array:
        """The day (R,) of every run."""
        numbers = {run.run: run.day for run in self.campaign.runs}
        return np.array([numbers[int(run)] for run in self.problem.runs])

    def hidden(self, text: str, peak: float) -> tuple[ChainProblem, Array]:
        """The problem with an effect, and its coefficients (c,) so that it moves a row by at most ``peak`` (mm).

        Raises EffectError for an effect that the machine does not have, or that does nothing under this plan.
        """
        effect = parse_effect(text, self.problem.context.chain)
        problem = replace(self.problem, added=(effect,))
        local, common = self.solution.local, np.zeros(len(problem.added_names))
        pose = problem.evaluated(local, common, jacobian=True)
        assert pose.by_error is not None
        basis = effect.basis(problem.context)
        moved = basis.displacement(pose.by_error) @ np.ones(basis.size)
        largest = float(np.linalg.norm(moved, axis=1).max())
        if largest == 0.0:
            raise EffectError(
                f"{text} does nothing at the probings of {self.campaign.name}; choose another effect"
            )
        common = problem.common_start.copy()
        common[: basis.size] = peak / largest
        return problem, common

    def campaign_with(
        self, local: Array, rng: np.random.Generator, added: tuple[ChainProblem, Array] | None = None
    ) -> Campaign:
        """The campaign as read from a machine with errors ``local`` (R, p), under the stated noise of every number.

        Rows without a weight keep their numbers. Raises DataError where no readings show such errors.
        """
        effects = () if added is None else added[0].added
        common = np.zeros(0) if added is None else added[1]
        noise = rng.normal(0.0, 1.0, self.problem.sigma.shape)
        weighed = np.isfinite(self.problem.sigma)
        wanted = np.where(weighed, noise * np.where(weighed, self.problem.sigma, 0.0), 0.0)
        probings = self.campaign.probings
        remaining = np.where(weighed, self._left(probings, local, common, effects) - wanted, 0.0)
        inverse = np.zeros((0, 0, 0))
        for step in range(MOST_STEPS):
            if self._worst(remaining) <= EXACT:
                break
            if step == 0 or step >= FIRST_STEPS:
                inverse = self._inverse(probings, local, common, effects)
            moved = np.einsum("nkd,nd->nk", inverse, remaining)
            probings = _moved(probings, dict(zip(self.columns, -moved.T, strict=True)))
            remaining = np.where(weighed, self._left(probings, local, common, effects) - wanted, 0.0)
        worst = self._worst(remaining)
        if worst > CLOSE_ENOUGH:
            raise DataError(
                f"no readings of the plan of {self.campaign.name} show these errors: {worst:.2g} standard "
                "uncertainties are left of a row; choose a smaller drift, step or peak"
            )
        return replace(self.campaign, probings=_as_written(probings, self.campaign.probings, self.columns))

    def _measured_columns(self) -> tuple[str, ...]:
        """The axes whose readings are measured, or the recorded columns that the rows depend on."""
        joints = self.problem.context.chain.joints
        if self.problem.measured_joints:
            return tuple(joints[index].name for index in self.problem.measured_joints)
        if self.problem.read_columns:
            channels = self.campaign.probings.channels
            return tuple(name for name in self.problem.read_columns if name in channels)
        if self.kept:
            return tuple(self.kept)
        if self.frames is not None:
            return self.frames.columns
        probings = self.campaign.probings
        local, common = self.solution.local, np.zeros(0)
        return tuple(
            name
            for name, values in probings.channels.items()
            if np.isfinite(values).all() and np.any(self._slope(probings, name, local, common, ()))
        )

    def _worst(self, remaining: Array) -> float:
        """The largest of what is left of the rows (n, d), in standard uncertainties; rows without a weight are zero."""
        sigma = np.where(np.isfinite(self.problem.sigma), self.problem.sigma, 1.0)
        return float(np.max(np.abs(remaining) / sigma, initial=0.0))

    def _inverse(self, probings: Probings, local: Array, common: Array, effects: tuple[Effect, ...]) -> Array:
        """The shortest moves (n, k, d) of the numbers of the columns for a row that changes by 1 mm."""
        slopes = np.stack(
            [self._slope(probings, column, local, common, effects) for column in self.columns], axis=-1
        )
        slopes[~np.isfinite(self.problem.sigma)] = 0.0
        return np.asarray(np.linalg.pinv(slopes))

    def _left(self, probings: Probings, local: Array, common: Array, effects: tuple[Effect, ...]) -> Array:
        return np.array(replace(self._problem_with(probings), added=effects).vectors(local, common))

    def _problem_with(self, probings: Probings) -> ChainProblem:
        """The problem with other numbers, its unknowns counted from where those of the pattern are."""
        if self.problem.measured_joints:
            context = self.problem.context
            positions = context.positions.copy()
            for index in self.problem.measured_joints:
                joint = context.chain.joints[index]
                positions[:, index] = joint.sign * probings.readings[joint.name]
            return replace(self.problem, context=replace(context, positions=positions))
        if self.problem.read_columns:
            return self.problem.with_read(probings.channels)
        if self.frames is not None:
            nominal = self.problem.context.nominal + self.frames.moved(probings, self.campaign.probings)
            return replace(self.problem, context=replace(self.problem.context, nominal=nominal))
        if not self.kept:
            return self.method.problem_of(replace(self.campaign, probings=probings), self.method.own_model)
        arrays: dict[str, Any] = {}
        nominal = self.problem.context.nominal.copy()
        for name, (field, index, factor) in self.kept.items():
            if field == NOMINAL:
                nominal[:, index] = factor * probings.channels[name]
            else:
                array = arrays.setdefault(field, getattr(self.problem, field).copy())
                array[:, index] = factor * probings.channels[name]
        return replace(self.problem, context=replace(self.problem.context, nominal=nominal), **arrays)

    def _slope(
        self, probings: Probings, column: str, local: Array, common: Array, effects: tuple[Effect, ...]
    ) -> Array:
        """Derivatives (n, d) of the rows by the numbers of a column, each by its own row's."""
        numbers = {**probings.channels, **probings.readings}[column]
        step = STEP * max(1.0, float(np.nanmedian(np.abs(numbers))))
        above, below = (
            self._left(_moved(probings, {column: np.full(len(probings), way * step)}), local, common, effects)
            for way in (1.0, -1.0)
        )
        return np.asarray((above - below) / (2.0 * step))


def _with_planned_poses(problem: ChainProblem, solution: Solution) -> ChainProblem:
    """The problem whose effects see where the measured axes stop under a solution, whatever is read later."""
    if problem.context.expected is not None or not problem.measured_joints:
        return problem
    return replace(problem, context=problem.context.expecting(stops(problem, solution)))


def _frames(problem: ChainProblem, probings: Probings) -> Frames | None:
    """The frame of each run in which a problem has the points that columns hold; None where it keeps none."""
    names = [name for name, values in probings.channels.items() if np.isfinite(values).all()]
    nominal = problem.context.nominal
    if not names or not np.isfinite(nominal).all():
        return None
    numbers = np.stack([probings.channels[name] for name in names], axis=-1)
    turns = np.zeros((len(nominal), len(names), 3))
    for run in problem.runs:
        rows = problem.context.run == run
        middle = numbers[rows].mean(axis=0)
        shifted = nominal[rows] - nominal[rows].mean(axis=0)
        turn, *_ = np.linalg.lstsq(numbers[rows] - middle, shifted, rcond=1e-9)
        if np.abs((numbers[rows] - middle) @ turn - shifted).max() > EXACT_MM:
            return None
        turns[rows] = turn
    used = np.abs(turns).max(axis=(0, 2)) > STEP
    return Frames(tuple(np.array(names)[used].tolist()), turns[:, used])


def _kept_numbers(problem: ChainProblem, channels: Mapping[str, Array]) -> dict[str, tuple[str, int, float]]:
    """Where a problem keeps the numbers of recorded columns: array, column of it, and the factor of its unit."""
    arrays = {
        field.name: values
        for field in fields(problem)
        if isinstance(values := getattr(problem, field.name), np.ndarray)
        and field.name != "sigma"
        and values.ndim == 2
        and values.dtype == np.float64
        and len(values) == len(problem.context)
    }
    arrays[NOMINAL] = problem.context.nominal
    selected = {}
    for name, numbers in channels.items():
        largest = int(np.argmax(np.abs(numbers)))
        for field, array in arrays.items():
            for index, column in enumerate(array.T):
                factor = float(column[largest] / numbers[largest]) if numbers[largest] else 0.0
                if factor and np.allclose(column, factor * numbers, rtol=1e-12, atol=0.0):
                    selected[name] = (field, index, factor)
    return selected


def _moved(probings: Probings, moves: dict[str, Array]) -> Probings:
    readings, channels = dict(probings.readings), dict(probings.channels)
    for name, move in moves.items():
        columns = readings if name in readings else channels
        columns[name] = columns[name] + move
    return replace(probings, readings=readings, channels=channels)


def _as_written(probings: Probings, pattern: Probings, columns: tuple[str, ...]) -> Probings:
    """The readings with the decimals that files of this kind have: nine of a number, below any resolution."""
    readings = {
        name: np.round(values, 9) if name in columns else pattern.readings[name]
        for name, values in probings.readings.items()
    }
    channels = {
        name: np.round(values, 9) if name in columns else pattern.channels[name]
        for name, values in probings.channels.items()
    }
    return replace(probings, readings=readings, channels=channels)
