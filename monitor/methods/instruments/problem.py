"""The problem of readings of any instruments on one chain: every setup's rows in the numbers of its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from monitor.effects import ArtefactEffect, ChainEffect, Effect
from monitor.effects.catalogue import of_drives, of_head, of_instruments, of_sight, of_zeros
from monitor.effects.effect import InstrumentBasis
from monitor.machine import ChainPose, Orientation, evaluate, evaluate_with_sides, orientation
from monitor.methods.chain.least_squares import Linearisation, Solution
from monitor.methods.chain.measured import Displaced, Stopping
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sessions import KnownFromOthers, Stays, known_from_others
from monitor.methods.instruments.contradiction import contradiction, displaced_work_points, unsettled
from monitor.methods.instruments.first_guess import first_guess, stance_at
from monitor.methods.instruments.ideal_rows import ideal_rows
from monitor.methods.instruments.mistaken_axes import mistaken_axes
from monitor.methods.instruments.part import Part, own_columns_of
from monitor.methods.instruments.reading import Shown, Stance, in_mm
from monitor.methods.instruments.seen_errors import by_error_of, first_order
from monitor.methods.instruments.separated import projector_on_separated
from monitor.methods.instruments.touched_points import brought_to_points
from monitor.records import Array, Setup
from monitor.sources import CommonQuantity

# What points somewhere or is looked at from outside (a mount, a robot) hides more than a machine tool: the tube of a
# mount sags by a degree's fraction, a joint gives way by millimetres.
LARGEST_OUTSIDE = (5.0, 0.02)
# A zero that is off by more than 20 degrees is another zero.
LARGEST_TURN = 0.35


@dataclass(frozen=True)
class InstrumentPose(ChainPose):
    """The readings at n rows: ``residual`` (n, d) in mm, ``by_error`` (n, d, J, 2, 6), ``by_own`` (n, d, q)."""

    by_own: Array


@dataclass(frozen=True)
class InstrumentProblem(ChainProblem):
    """Readings of the setups ``parts``; a row of a kind with fewer than d numbers has no weight in the others.

    ``setups`` are those that have rows, ``gear_ratios`` those that the machine file gives. ``separated`` (R, p, p) is
    the projector of ``linearise`` where it was computed before; none is applied where the problem ``is_whole``.
    ``shares_bars``: whether the runs have their bars in common; ``from_others`` is what a run by itself knows of them
    from the others. ``masks`` are the errors that each setup reads where they were looked at before; ``has_products``:
    whether derivatives hold products of errors too.
    """

    parts: tuple[Part, ...] = ()
    setups: tuple[Setup, ...] = ()
    gear_ratios: tuple[tuple[str, float], ...] = ()
    separated: Array | None = None
    is_whole: bool = False
    shares_bars: bool = False
    from_others: KnownFromOthers | None = None
    absent: tuple[tuple[str, str], ...] = ()
    masks: dict[str, npt.NDArray[np.bool_]] | None = None
    has_products: bool = False

    @cached_property
    def own_names(self) -> tuple[str, ...]:
        """The unknowns of every setup; with several setups each begins with the setup's id."""
        several = len(self.parts) > 1
        names: dict[int, str] = {}
        for part, columns in zip(self.parts, self.own_columns, strict=True):
            for name, column in zip(part.unknowns, columns.tolist(), strict=True):
                names.setdefault(column, f"{part.id} {name}" if several else name)
        return tuple(names.values())

    @cached_property
    def own_columns(self) -> tuple[npt.NDArray[np.int64], ...]:
        """Where the unknowns of each setup stand among a run's own; what setups share stands there once."""
        return own_columns_of(self.parts)

    @cached_property
    def own_start(self) -> Array:
        """The first guesses (R, q): zeros, slopes and spheres as a machine without errors leaves them."""
        start = np.zeros((len(self.runs), len(self.own_names)))
        for part, columns in zip(self.parts, self.own_columns, strict=True):
            start[:, columns] = first_guess(part, len(start), self._nominal)
        return start

    @property
    def components(self) -> tuple[str, ...]:
        """The numbers of a row: by their names where there is one kind, else counted."""
        names = {part.reading.numbers for part in self.parts}
        counted = tuple(f"number {number + 1}" for number in range(self.sigma.shape[1]))
        return names.pop() if len(names) == 1 else counted

    @cached_property
    def is_number(self) -> npt.NDArray[np.bool_]:
        """The entries (n, d) that the kind of a row has."""
        numbers = np.zeros(self.sigma.shape, dtype=bool)
        for part in self.parts:
            numbers[part.at, : len(part.reading.numbers)] = True
        return numbers

    @property
    def is_length(self) -> npt.NDArray[np.bool_]:
        """The rows (n,) of setups in mm."""
        angles = [row for part in self.parts if part.reading.angular for row in part.at]
        return ~np.isin(np.arange(len(self.context)), angles)

    @property
    def series(self) -> npt.NDArray[np.int64]:
        """The setup of every row."""
        instruments = self.context.instruments
        return super().series if instruments is None else instruments.setup

    @cached_property
    def read_columns(self) -> tuple[str, ...]:
        """The columns of all kinds that there are."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.reading.columns))

    def with_read(self, channels: Mapping[str, Array]) -> Self:
        """Return the problem with other numbers in the columns of its kinds; frames and centres stay."""
        parts = []
        for part in self.parts:
            measured = part.rows.measured.copy()
            for index, name in enumerate(part.reading.columns[: measured.shape[1]]):
                if name in channels:
                    measured[:, index] = in_mm(name, channels[name][part.at])
            measured[np.isnan(part.rows.measured)] = np.nan
            parts.append(replace(part, rows=replace(part.rows, measured=measured)))
        return replace(self, parts=tuple(parts))

    @property
    def unsettled(self) -> str:
        """Lasers that read something else than the travel, and bars that kept one direction."""
        return unsettled(self.parts)

    @property
    def largest_error(self) -> float:
        """A turn of 20 degrees."""
        return LARGEST_TURN

    @property
    def target_word(self) -> str:
        """A target."""
        return "target"

    @cached_property
    def kinds(self) -> frozenset[str]:
        """The kinds of readings that there are."""
        return frozenset(part.reading.name for part in self.parts)

    @property
    def largest_effect(self) -> tuple[float, float]:
        """More where a mount or a robot is looked at from outside than on a machine tool."""
        return LARGEST_OUTSIDE if self.kinds & {"direction", "point"} else super().largest_effect

    @property
    def observes_numbers(self) -> bool:
        """A number may be the length of a vector, or a turn."""
        return True

    @property
    def stopping(self) -> Stopping:
        """The linear axes, at the balls of plates."""
        return brought_to_points(self.context, self.parts)

    def can_show(self, effect: Effect) -> bool:
        """Nothing of targets that are touched or tracked; angles alone show no displacement."""
        if isinstance(effect, ArtefactEffect):
            return False
        angular = all(part.reading.angular for part in self.parts)
        return not angular or not isinstance(effect, ChainEffect) or effect.term.is_rotation

    @property
    def needs_whole_periods(self) -> bool:
        """Over a part of a turn flexure and refraction look like any harmonic."""
        return True

    def method_effects(self, drivers: Sequence[str]) -> tuple[str, ...]:
        """Drives for all, the line of sight where something points, and what the instruments do wrong themselves."""
        chain, instruments = self.context.chain, self.context.instruments
        pointing = of_sight(chain) if self.context.sight is not None else ()
        of_setups = of_instruments(instruments, drivers) if instruments is not None else ()
        grown = (*of_head(chain), *of_zeros(chain, drivers))
        return (*pointing, *of_drives(chain, dict(self.gear_ratios)), *grown, *of_setups)

    def as_vectors(self, rows: Array) -> Array:
        """The shortest vectors (n, 3) mm, in the frame of the last work axis, that would show such numbers (n, d); of a
        turn the vector about which it is, of a direction where its end at one metre lies off."""
        return np.asarray(np.einsum("nik,nk->ni", self._inverse, rows))

    @cached_property
    def _inverse(self) -> Array:
        """Vectors (n, 3, d) for a unit of each number, at the start."""
        context = self.context
        errors, work, tool = self.state(self.start, self.common_start)
        vectors = evaluate(context.chain, context.positions, errors, work, tool).residual
        inverse = np.zeros((len(self.context), 3, self.sigma.shape[1]))
        for part, values in self._with_own(self.own_start):
            shown = part.shown(self._stance_of(part, vectors, self._nominal), values)
            along = shown.along if shown.along is not None else shown.by_shift
            assert along is not None
            inverse[part.at, :, : along.shape[1]] = np.linalg.pinv(along)
        return inverse

    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """The work points and tool points of all rows."""
        work, tool = np.zeros((2, len(self.context), 3))
        for part, values in self._with_own(nuisance):
            work[part.at], tool[part.at] = part.ends(values)
        return work, tool

    def _with_own(self, nuisance: Array) -> Iterator[tuple[Part, Array]]:
        """Every setup with its unknowns (m, q) row by row."""
        for part, columns in zip(self.parts, self.own_columns, strict=True):
            yield part, nuisance[part.rows.run][:, columns]

    @cached_property
    def _nominal(self) -> Orientation:
        """How the sides of a machine without errors stand."""
        return orientation(
            self.context.chain,
            self.context.positions,
            np.zeros((len(self.context), len(self.context.chain.joints), 2, 6)),
        )

    def evaluated(self, local: Array, common: Array, *, jacobian: bool = False) -> InstrumentPose:
        """The readings at (R, p) and (c,), less those that were read."""
        if not self.is_whole:
            local = self.start + np.einsum("rpq,rq->rp", self._separated, local - self.start)
        context, nuisance = self.context, self.own_of(local)
        errors, work, tool = self.state(local, common)
        pose, sides = evaluate_with_sides(
            context.chain, context.positions, errors, work, tool, jacobian=jacobian
        )
        count, numbers = len(context), self.sigma.shape[1]
        residual, by_own = np.zeros((count, numbers)), np.zeros((count, numbers, nuisance.shape[1]))
        by_error = np.zeros((count, numbers, len(context.chain.joints), 2, 6)) if jacobian else None
        for (part, values), columns in zip(self._with_own(nuisance), self.own_columns, strict=True):
            at = part.at
            shown = part.shown(self._stance_of(part, pose.residual, sides), values)
            kinds = shown.residual.shape[1]
            residual[at, :kinds] = np.nan_to_num(shown.residual)
            if shown.by_own is not None:
                by_own[np.ix_(at, np.arange(kinds), columns)] = shown.by_own
            if by_error is not None:
                derivatives = by_error_of(self.context.chain, shown, pose, sides, part)
                by_error[at, :kinds] = derivatives * self._first_order(part.id, shown, derivatives, pose, at)
        residual += self._of_instruments(local, common)
        return InstrumentPose(residual, pose.by_tip, pose.work_rotation, by_error, by_own)

    def _of_instruments(self, local: Array, common: Array) -> Array:
        """What effects of instruments add to the numbers (n, d)."""
        added = np.zeros(self.sigma.shape)
        for basis, columns in zip(self._bases, self.base_columns, strict=True):
            if isinstance(basis, InstrumentBasis):
                added += basis.added(local[self._run, columns])
        for shared, columns in zip(self.shared, self.common_columns, strict=True):
            unknowns = common[columns]
            basis = shared.basis(unknowns)
            if isinstance(basis, InstrumentBasis):
                added += basis.added(unknowns[: shared.size])
        return added

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives at (R, p) and (c,), those of what the setups cannot separate taken out.

        What a machine without errors leaves open stays where the search begins: with errors it leaves singular values
        of second order, 1e-4 for 0.1 mm on 600 mm, that turn with every step.
        """
        if self.is_whole:
            return super().linearise(local, common)
        is_first = "_separated" not in vars(self) and self.separated is None and not self._masks
        if is_first and np.array_equal(local, self.start) and np.array_equal(common, self.common_start):
            # What is separated is asked of the same derivatives: they are made once.
            whole = replace(self, is_whole=True)
            at = whole.linearise(local, common)
            self._masks.update(whole._masks)
            vars(self)["_separated"] = projector_on_separated(at.local)
        else:
            at = super().linearise(local, common)
        return replace(at, local=at.local @ self._separated)

    @cached_property
    def _separated(self) -> Array:
        """The projector (R, p, p) on the unknowns that the readings separate at the start."""
        if self.separated is not None:
            return self.separated
        whole = replace(self, is_whole=True)
        return projector_on_separated(whole.linearise(self.start, self.common_start).local)

    @cached_property
    def _masks(self) -> dict[str, npt.NDArray[np.bool_]]:
        """Which errors each setup reads, by its id, as they were first looked at, by the problem of which this one was
        taken if it is one."""
        return {} if self.masks is None else self.masks

    def with_base(self, effects: tuple[ChainEffect, ...]) -> Self:
        """Return the problem with further base effects, and nothing of what the setups cannot separate taken out."""
        return replace(super().with_base(effects), is_whole=True, separated=None, from_others=None)

    def with_products(self) -> Self:
        """The problem with all derivatives of its numbers, also those that are products of errors."""
        return replace(self, separated=self._separated, has_products=True)

    def _first_order(
        self, setup: str, shown: Shown, derivatives: Array, pose: ChainPose, at: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.bool_]:
        """Which errors (J, 2, 6) a setup reads more of than products of errors, as it was first looked at.

        A setup without rows shows nothing here; that says nothing of what it reads in other runs.
        """
        if self.has_products or not len(at):
            return np.ones(derivatives.shape[2:], dtype=bool)
        if setup not in self._masks:
            self._masks[setup] = first_order(shown, derivatives, pose, at)
        return self._masks[setup]

    def _stance_of(self, part: Part, vectors: Array, sides: Orientation) -> Stance:
        """How the sides stand at the rows of a setup, for ``vectors`` (n, 3) mm from work points to tool points."""
        nominal = stance_at(vectors[part.at], self._nominal, part.at)
        return replace(stance_at(vectors[part.at], sides, part.at), nominal=nominal)

    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, d, q) by the unknowns of the setups."""
        assert isinstance(pose, InstrumentPose)
        return pose.by_own

    @cached_property
    def _priors(self) -> tuple[tuple[int, float], ...]:
        """Own unknowns that are known with a standard uncertainty."""
        u_of = {
            int(columns[index]): u
            for part, columns in zip(self.parts, self.own_columns, strict=True)
            for index, u in part.prior()
        }
        return tuple(u_of.items())

    @property
    def extra_names(self) -> tuple[str, ...]:
        """What is known of the setups beforehand."""
        return tuple(self.own_names[index] for index, _ in self._priors)

    @property
    def common_quantities(self) -> tuple[CommonQuantity | None, ...]:
        """The lengths of bars and scales of instruments that have a name."""
        quantity_of = {
            int(columns[index]): part.common_quantity(part.unknowns[index], setup, u)
            for part, setup, columns in zip(self.parts, self.setups, self.own_columns, strict=True)
            for index, u in part.prior()
        }
        return tuple(quantity_of[index] for index, _ in self._priors)

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """What the unknowns are off what is known of them, in standard uncertainties."""
        by_own = np.zeros((len(self.runs), len(self._priors), nuisance.shape[1]))
        residual = np.zeros((len(self.runs), len(self._priors)))
        for number, (index, u) in enumerate(self._priors):
            residual[:, number] = nuisance[:, index] / u
            by_own[:, number, index] = 1.0 / u
        if (others := self.from_others) is not None:
            columns = others.columns - len(self.base_names)
            residual[:, others.rows] = (nuisance[:, columns] - others.values) @ others.root.T
            by_own[:, others.rows] = 0.0
            by_own[:, others.rows[:, None], columns] = others.root
        return residual, by_own

    @property
    def left_out(self) -> dict[str, str]:
        """Effects on instruments that measured nothing here."""
        return dict(self.absent)

    @cached_property
    def stays(self) -> Stays | None:
        """The lengths of bars and scales that are known beforehand: one bar has one length in all runs."""
        if not self.shares_bars or len(self.runs) < 2:
            return None
        rows = np.flatnonzero(self.extras_in_common)
        columns = np.array([self._priors[row][0] for row in rows], dtype=np.int64) + len(self.base_names)
        return Stays(columns, rows) if len(rows) else None

    @property
    def extras_in_common(self) -> npt.NDArray[np.bool_]:
        """The lengths of bars and scales; how an instrument is set up and drifts is another in each run."""
        staying = {
            int(columns[index])
            for part, columns in zip(self.parts, self.own_columns, strict=True)
            for index, name in enumerate(part.unknowns)
            if name in part.staying
        }
        return np.array([index in staying for index, _ in self._priors], dtype=bool)

    def beside_others(self, solution: Solution, run: int) -> Self:
        """The problem for ``run`` by itself, which knows of its bars what the other runs say."""
        if self.stays is None:
            return self
        index = int(np.searchsorted(self.runs, run))
        from_others = known_from_others(solution, self.stays, index, len(self.extra_names))
        return replace(self, shares_bars=False, from_others=from_others)

    def taken(self, rows: npt.NDArray[np.int64], run: npt.NDArray[np.int64]) -> Self:
        """The problem of chosen rows, with repetitions, that belong to the runs ``run``."""
        separated = self._separated_of(rows, run)
        if not self.has_products and any(len(part.at) and part.id not in self._masks for part in self.parts):
            # By all rows: what one run shows of a setup would hold for the others, as they come.
            self.evaluated(self.start, self.common_start, jacobian=True)
        problem = replace(super().taken(rows, run), separated=separated, shares_bars=False, masks=self._masks)
        index = np.searchsorted(problem.runs, run)
        parts = []
        for part in self.parts:
            where = np.full(len(self.context), -1)
            where[part.at] = np.arange(len(part.at))
            at = np.flatnonzero(where[rows] >= 0)
            parts.append(replace(part, rows=part.rows.taken(where[rows[at]], index[at]), at=at))
        return replace(problem, parts=tuple(parts))

    def guessed_anew(self) -> Self:
        """The problem with one frame a run for each setup, guessed of all rows that belong to it now."""
        parts = tuple(part.guessed_anew() for part in self.parts)
        context = replace(self.context, instruments=ideal_rows(self.context, parts))
        return replace(self, context=context, parts=parts, separated=None, masks=None)

    def _separated_of(self, rows: npt.NDArray[np.int64], run: npt.NDArray[np.int64]) -> Array | None:
        """The projectors of runs that are copies of whole runs; None where they are not."""
        _, first, counts = np.unique(run, return_index=True, return_counts=True)
        copied = np.searchsorted(self.runs, self.context.run[rows[first]])
        whole = np.array([np.count_nonzero(self.context.run == number) for number in self.runs])
        return self._separated[copied] if np.array_equal(counts, whole[copied]) else None

    def displaced(self, local: Array) -> tuple[Displaced, ...]:
        """Work points that the unknowns (p,) of a run put elsewhere than stated."""
        unknowns = (local[len(self.base_names) + columns] for columns in self.own_columns)
        return tuple(displaced_work_points(self.parts, unknowns))

    def contradiction(self, solution: Solution) -> str | None:
        """Positions in another unit, directions and lengths that are off by more than any machine's errors."""
        vectors = self.vectors(solution.local, solution.common)
        unknowns = [solution.local[:, len(self.base_names) + columns] for columns in self.own_columns]
        return contradiction(self.parts, unknowns, self.runs, self.sigma, vectors, self.context.nominal)

    def mistaken_axes(self) -> str | None:
        """Signs, columns or units of axes with which the tool point stays at the work points of its vectors."""
        return mistaken_axes(self.parts, self.runs, everywhere=False)
