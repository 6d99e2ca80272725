"""Teeth: an error of a linear axis as a sawtooth of one searched pitch, whose edges are searched as well.

Racks, pinions and scales that count wrongly rise evenly and fall at once, on every pitch. Hats a twelfth of the travel
apart follow no five teeth, a wave and its overtones leave the edges, and waves of many pitches, or errors of other
axes in free shape, mimic what is left. A sawtooth has one coefficient; the search of pitch and edge is paid for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from monitor.discovery.machine.profiles import ErrorProfiles, Profiles
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.bends import foretells_poses
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.variants import (
    FEWEST_PERIODS,
    SHORTEST_PITCH_MM,
    frequency_step,
    pitch_limits,
    resolvable,
)
from monitor.discovery.search.candidate import SMALLEST_SHARE, Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.memory import Memory
from monitor.effects import ChainEffect
from monitor.effects.shapes import Cyclic, Sawtooth
from monitor.effects.shapes.sawtooth import sawtooths
from monitor.records import Array

# Fewer teeth over the travel are a step, which free shapes have; of some fifty positions ten teeth have five each.
FEWEST_TEETH, MOST_TEETH = 1.8, 10.0
# Neighbours on the grid differ by a quarter of a tooth over the travel, edges by a twelfth of a tooth.
STEP_OF_TEETH, EDGES = 0.25, 12
# About the best so many of the grid the best is looked for on a grid so many times finer, and once more about that.
STARTS, FINER = 3, 5
# An edge beyond this part of the travel is seen by hardly a position.
WITHIN_TRAVEL = 0.9
# Pitches are told to so many mm.
PITCH_DIGIT_MM = 0.01
# Sawtooths whose scores differ by less are the same at all positions.
SAME_SCORE = 0.1


@dataclass(frozen=True)
class _Sawtooths:
    """Sawtooths by pitch and edge in mm (k, 2) and by their teeth and phase (k, 2), as the data see them."""

    shapes: Array
    grid_points: Array
    profiles: Profiles


@dataclass(frozen=True)
class _Weighed:
    """A sawtooth by pitch and edge in mm, with its teeth and phase, and its score beside others."""

    shape: tuple[float, float]
    grid_point: tuple[float, float]
    score: float


@dataclass(frozen=True)
class TeethOfError:
    """The sawtooths of an error of a linear axis, on a grid of pitches and edges; ``effect`` is the error in any of its
    shapes."""

    scene: ChainScene
    effect: ChainEffect

    @cached_property
    def _range(self) -> tuple[float, float]:
        """Lowest reading in mm and travel."""
        return float(self._reading.min()), float(np.ptp(self._reading))

    @cached_property
    def _reading(self) -> Array:
        """The readings (n,) of the axis in mm."""
        places = self.scene.fit.problem.context.places
        return np.asarray(self.effect.joint.sign * places[:, self.effect.term.joint])

    @cached_property
    def _profiles(self) -> ErrorProfiles:
        return ErrorProfiles(self.scene, self.effect)

    def _shape(self, teeth: float, phase: float) -> tuple[float, float]:
        """Pitch and edge of so many teeth over the travel, one of which falls so many teeth after its middle."""
        low, travel = self._range
        pitch = round(travel / teeth, 2)
        # Counted from the middle, the edges of neighbouring pitches lie together.
        return pitch, round(low + (travel / 2.0 + phase * pitch) % pitch, 2)

    def _candidate(self, pitch: float, edge: float) -> ChainCandidate:
        shape, symbol = Sawtooth(pitch, edge), self.effect.term.symbol
        variant = Variant(
            f"{symbol}:sawtooth",
            replace(self.effect, shape=shape, shape_text=shape.text),
            self.tries,
            nearest=f"{symbol}:cyclic{shape.pitch:.3g}mm",
        )
        return scene_of(self.scene.fit, [variant]).candidates[0]

    @cached_property
    def _teeth(self) -> Array:
        """The numbers of teeth on the grid."""
        most = min(MOST_TEETH, self._range[1] / self._shortest_pitch)
        return np.arange(FEWEST_TEETH, most, STEP_OF_TEETH)

    @cached_property
    def _shortest_pitch(self) -> float:
        """The shortest pitch in mm that the positions show: below twice the step of a grid teeth look like anything."""
        shortest, _ = pitch_limits(self.scene.fit.problem.context)[self.effect.joint.name]
        return max(shortest, SHORTEST_PITCH_MM)

    @property
    def tries(self) -> int:
        """The pitches and edges that are tried."""
        return len(self._teeth) * EDGES

    @cached_property
    def _grid(self) -> _Sawtooths:
        return self._of(self._teeth, np.arange(EDGES) / EDGES)

    def _of(self, teeth: Array, phases: Array) -> _Sawtooths:
        """The sawtooths of every number of teeth at every phase of which a second edge lies within the travel: one
        alone is a step, which free shapes have."""
        low, travel = self._range
        grid_points = {
            self._shape(*grid_point): grid_point for grid_point in product(teeth.tolist(), phases.tolist())
        }
        shapes = np.array(list(grid_points)).reshape(-1, 2)
        shown = shapes.sum(axis=1) < low + WITHIN_TRAVEL * travel
        shown &= shapes[:, 0] > self._shortest_pitch - PITCH_DIGIT_MM
        shapes = shapes[shown]
        profiles = self._profiles.of(sawtooths(self._reading, shapes[:, 0], shapes[:, 1]))
        return _Sawtooths(shapes, np.array(list(grid_points.values())).reshape(-1, 2)[shown], profiles)

    @cached_property
    def _on_grid(self) -> Memory[list[_Weighed]]:
        return Memory()

    def _weighed_on_grid(self, others: Sequence[ChainCandidate]) -> list[_Weighed]:
        """The sawtooths of the grid beside others, the most convincing first."""
        return self._on_grid.answer(others, None, lambda: self._weighed(self._grid, others))

    def rough(self, others: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The sawtooth of the grid and the plain cycle that say most beside others, before they are looked for between;
        none where the error is among these or nothing is seen of any."""
        if self.effect.term.symbol in map(error_of, others):
            return []
        weighed = self._weighed_on_grid(others)
        if not weighed or weighed[0].score <= 0.0:
            return []
        cycles = [each.candidate for each in weigh_beside(self.scene, self._cycles, others)[:1]]
        return [self._candidate(*weighed[0].shape), *cycles]

    def beside(self, others: Sequence[ChainCandidate]) -> list[ChainCandidate]:
        """The error as the sawtooth that says most beside others, or as the plain cycle of so many periods where that
        says as much, alone; none where it is among them, where nothing is seen of any, or where it foretells no poses.
        """
        if self.effect.term.symbol in map(error_of, others):
            return []
        weighed = self._weighed_on_grid(others)
        if not weighed or weighed[0].score <= 0.0:
            return []
        wide = 1.5 * STEP_OF_TEETH, 1.5 / EDGES
        around = [self._weighed(self._near(each.grid_point, wide), others) for each in weighed[:STARTS]]
        best = max(around, key=lambda some: some[0].score)[0]
        fine = self._weighed(self._near(best.grid_point, (wide[0] / FINER, wide[1] / FINER)), others)
        simplest = self._cycle_instead(_middle(fine), others)
        return [simplest] if foretells_poses(self.scene, [simplest], others) else []

    def _cycle_instead(self, sawtooth: _Weighed, others: Sequence[ChainCandidate]) -> ChainCandidate:
        """The plain cycle that says at least as much as a sawtooth beside others, else that."""
        teeth = self._candidate(*sawtooth.shape)
        weighed = weigh_beside(self.scene, self._cycles, others)
        if not weighed:
            return teeth
        cycle = refine(self.scene, [*others, weighed[0].candidate], len(others)).candidate
        return cycle if weigh_beside(self.scene, [cycle], others)[0].score >= sawtooth.score else teeth

    @cached_property
    def _cycles(self) -> list[ChainCandidate]:
        """The plain cycles of so many periods over the travel that the data see."""
        travel, symbol = self._range[1], self.effect.term.symbol
        periods = np.arange(FEWEST_PERIODS, MOST_TEETH, travel * frequency_step(travel))
        variants = [
            Variant(
                f"{symbol}:cyclic",
                replace(
                    self.effect, shape=Cyclic(travel / number), shape_text=f"cyclic{travel / number:.6g}mm"
                ),
                len(periods),
            )
            for number in periods.tolist()
        ]
        shown = resolvable(variants, self.scene.fit.problem.context)
        return [each for each in scene_of(self.scene.fit, shown).candidates if each.visible]

    @cached_property
    def _looked_at(self) -> dict[tuple[float, ...], _Sawtooths]:
        return {}

    def _near(self, grid_point: tuple[float, float], widths: tuple[float, float]) -> _Sawtooths:
        """The sawtooths about a number of teeth and a phase, as far as these widths."""
        # Beside other effects the best of an error often is the same.
        if (*grid_point, *widths) not in self._looked_at:
            steps = np.linspace(-1.0, 1.0, 2 * FINER + 1)
            near = self._of(grid_point[0] + widths[0] * steps, grid_point[1] + widths[1] * steps)
            self._looked_at[*grid_point, *widths] = near
        return self._looked_at[*grid_point, *widths]

    def _weighed(self, sawtooths: _Sawtooths, others: Sequence[ChainCandidate]) -> list[_Weighed]:
        """Sawtooths beside others, the most convincing first; none where the data see none."""
        scores = self._profiles.scores(sawtooths.profiles, self.tries, others)
        ordered = np.argsort(-scores, kind="stable")
        ordered = ordered[sawtooths.profiles.shares[ordered] > SMALLEST_SHARE]
        return [
            _Weighed(shape, grid_point, score)
            for shape, grid_point, score in zip(
                map(tuple, sawtooths.shapes[ordered].tolist()),
                map(tuple, sawtooths.grid_points[ordered].tolist()),
                scores[ordered].tolist(),
                strict=True,
            )
        ]


def _middle(weighed: Sequence[_Weighed]) -> _Weighed:
    """The one in the middle of those that say as much as the first: wherever an edge lies between two positions, the
    readings are the same."""
    alike = [each for each in weighed if weighed[0].score - each.score < SAME_SCORE]
    grid_points = np.array([each.grid_point for each in alike])
    return alike[int(np.argmin(np.sum((grid_points - grid_points.mean(axis=0)) ** 2, axis=1)))]


def teeth_of(scene: ChainScene, shape: ChainCandidate) -> TeethOfError | None:
    """The teeth of the error of which a candidate is a shape; None where it turns or does not travel so far."""
    effect = shape.effect
    if not isinstance(effect, ChainEffect) or effect.joint.turns:
        return None
    travel = float(np.ptp(scene.fit.problem.context.places[:, effect.term.joint]))
    shortest, _ = pitch_limits(scene.fit.problem.context)[effect.joint.name]
    shown = travel > FEWEST_TEETH * max(shortest, SHORTEST_PITCH_MM)
    return TeethOfError(scene, effect) if shown else None
