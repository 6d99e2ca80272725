"""What a test would say of a machine's parameters beside what was measured, before anyone measures.

The derivatives of the rows at the machine without errors, whitened by what each setup states, are the information;
unknowns of a setup (centre of a bar, turn of a beam, zero) are taken out of its rows first, as a later fit would do;
what setups of one instrument share (a bar's length, a laser's scale, a tool point) is one unknown of all tests. A test
belongs to one run together with the readings that are there. First order: errors of 1 mrad change u by 1e-3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from monitor.effects import parse_effect
from monitor.machine import evaluate
from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE
from monitor.methods.instruments.assembly import SETUP, problem_of
from monitor.methods.instruments.base import instrument_base
from monitor.methods.instruments.candidates import CandidateTest, Workspace, usual_instruments
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.reading import Rows
from monitor.methods.instruments.readings import readings
from monitor.methods.instruments.readings.direction import Direction
from monitor.methods.method import ExpectedTest, PlannedTest
from monitor.methods.model import Model, chain_of
from monitor.records import Array, Campaign, Probings, Setup
from monitor.units import Unit

#: How many times better readings count as without noise: what is left of u is what they cannot lower.
WITHOUT_NOISE = 1e3
#: A quantity that would lower that by less than this part, were it exact, does not limit it.
LIMITS = 0.02
#: What is left of a column without the unknowns of its setup, below this part of it, is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class _Known:
    """A quantity that setups share: what people call it (``called``), and the ``u`` to which it is known beforehand."""

    called: str
    u: float


@dataclass(frozen=True)
class _Information:
    """The derivatives (k, k) of all rows by base and added coefficients and by what several setups ``share``, as a
    triangle; what is shared with the u that it is known to beforehand, infinite where it is not."""

    names: tuple[str, ...]
    triangle: Array
    share: Mapping[str, _Known]

    def joined(self, other: _Information) -> _Information:
        """Both together, among the coefficients of either: what one instrument does wrong is in its rows alone."""
        names = tuple(dict.fromkeys((*self.names, *other.names)))
        both = [information.among(names).triangle for information in (self, other)]
        return _Information(names, _triangle(np.vstack(both)), {**self.share, **other.share})

    def among(self, names: tuple[str, ...]) -> _Information:
        """The same among more coefficients, of which these rows say nothing."""
        if names == self.names:
            return self
        wider = np.zeros((len(self.triangle), len(names)))
        wider[:, [names.index(name) for name in self.names]] = self.triangle
        rows = np.vstack([wider, np.zeros((len(names), len(names)))])
        return _Information(names, _triangle(rows), self.share)

    def u(self) -> dict[str, float]:
        """Standard uncertainties in internal units; NaN where the rows do not determine a coefficient."""
        prior = np.diag([1.0 / self.share[name].u if name in self.share else 0.0 for name in self.names])
        rows = np.vstack([self.triangle, prior])
        scale = np.linalg.norm(rows, axis=0)
        scale[scale == 0.0] = 1.0
        _, strength, vectors = np.linalg.svd(np.linalg.qr(rows / scale, mode="r"), full_matrices=True)
        rank = int(np.count_nonzero(strength > RANK_TOLERANCE * strength.max(initial=0.0)))
        spread = np.sqrt(np.sum((vectors[:rank] / strength[:rank, None]) ** 2, axis=0)) / scale
        is_open = np.abs(vectors[rank:]).max(axis=0, initial=0.0) >= MEMBER_SHARE
        u = zip(self.names, np.where(is_open, np.nan, spread).tolist(), strict=True)
        return {name: value for name, value in u if name not in self.share}

    def limit(self, parameter: str) -> tuple[float, tuple[str, ...]]:
        """The standard uncertainty that readings without noise would leave, and what limits it, in words."""
        better = replace(self, triangle=WITHOUT_NOISE * self.triangle)
        least = better.u().get(parameter, np.nan)
        limiting = []
        for name, quantity in self.share.items():
            exact = replace(
                better, share={**self.share, name: replace(quantity, u=quantity.u / WITHOUT_NOISE)}
            )
            if np.isfinite(quantity.u) and exact.u()[parameter] < (1.0 - LIMITS) * least:
                limiting.append(quantity.called)
        return least, tuple(dict.fromkeys(limiting))


class InstrumentForecast:
    """The readings of one ``run`` of a campaign under a model, and tests that could follow within ``limits`` of the
    joints (mm and rad, by name)."""

    def __init__(
        self, campaign: Campaign, model: Model, run: int, limits: Mapping[str, tuple[float, float]]
    ) -> None:
        rows = campaign.probings.run == run
        runs = tuple(single for single in campaign.runs if single.run == run)
        self.campaign = replace(campaign, runs=runs, probings=campaign.probings.rows(rows))
        self.model, self.chain = model, chain_of(campaign.machine)
        self.problem = problem_of(self.campaign, model)
        self.workspace = Workspace(self.chain, limits)

    def unit_of(self, parameter: str) -> Unit:
        """The display unit of a parameter."""
        if parameter in self._units:
            return self._units[parameter]
        # An effect of an instrument that a test would bring: its coefficients are named after it.
        added = (parse_effect(text, self.chain) for text in self.model.added)
        return next(effect.unit for effect in added if f"{parameter}.".startswith(f"{effect.text}."))

    @cached_property
    def _units(self) -> dict[str, Unit]:
        setups = {test.setup.id: test.setup for test in self.tests}.values()
        texts = dict.fromkeys(text for setup in setups for text in self._base(setup))
        effects = (*(parse_effect(text, self.chain) for text in texts), *self.problem.added)
        context = self.problem.context
        return {name: effect.unit for effect in effects for name in effect.parameters(context)}

    @cached_property
    def tests(self) -> tuple[CandidateTest, ...]:
        """Tests of the campaign's own instruments, then of usual ones that it does not have."""
        owned = self.problem.setups
        have = {(setup.reading, setup.direction) for setup in owned}
        point = next((setup.tool_point for setup in owned if any(setup.tool_point)), (0.0, 0.0, 0.0))
        others = [setup for setup in usual_instruments(point) if (setup.reading, setup.direction) not in have]
        return (
            *self.workspace.tests(owned, available=True),
            *self.workspace.tests(others, available=False),
        )

    def present(self) -> dict[str, float]:
        """Standard uncertainties in internal units of one run as it was measured, NaN where there is no number."""
        return self._measured(tuple(effect.text for effect in self.problem.base)).u()

    def expected(self, *, first_places: bool = False) -> Iterable[ExpectedTest]:
        """What every test promises, beside the readings that are there; with ``first_places`` one of those of a setup
        that move the same axes."""
        first = {
            (test.setup.id, tuple(np.ptp(test.positions, axis=0) > 0.0)): test for test in self.tests[::-1]
        }
        for test in reversed(first.values()) if first_places else self.tests:
            yield self._expected((test,))

    def together(self, tests: Sequence[PlannedTest]) -> ExpectedTest:
        """What several tests promise together; the last one is named."""
        return self._expected(tuple(test for test in tests if isinstance(test, CandidateTest)))

    def limit(self, tests: Sequence[PlannedTest], parameter: str) -> tuple[float, tuple[str, ...]]:
        """The u that no repetition of the run and of ``tests`` goes below, and what limits it."""
        return self._together(tuple(test for test in tests if isinstance(test, CandidateTest))).limit(
            parameter
        )

    def _expected(self, tests: tuple[CandidateTest, ...]) -> ExpectedTest:
        return ExpectedTest(tests[-1], self._together(tests).u())

    def _together(self, tests: tuple[CandidateTest, ...]) -> _Information:
        base = self._base(*(test.setup for test in tests))
        information = self._measured(base)
        for test in tests:
            information = information.joined(self._of(test, base))
        return information

    def _base(self, *setups: Setup) -> tuple[str, ...]:
        """The base of a campaign with further setups."""
        if self.model.base:
            return self.model.base
        return tuple(text for text in self._whole_base(*setups) if text not in self.model.added)

    def _whole_base(self, *setups: Setup) -> tuple[str, ...]:
        others = tuple(replace(setup, work_point=(0.0, 0.0, 0.0)) for setup in setups)
        have = {replace(setup, id="", work_point=(0.0, 0.0, 0.0)) for setup in self.problem.setups}
        new = {setup.id: setup for setup in others if replace(setup, id="") not in have}
        return instrument_base(self.chain, (*self.problem.setups, *new.values()))

    def _measured(self, base: tuple[str, ...]) -> _Information:
        if base not in self._of_base:
            problem = problem_of(self.campaign, replace(self.model, base=base))
            self._of_base[base] = _information(problem)
        return self._of_base[base]

    def _of(self, test: CandidateTest, base: tuple[str, ...]) -> _Information:
        """The information of a test, computed once."""
        key = (id(test), base)
        if key not in self._of_test:
            self._of_test[key] = _information(self._problem(test, base))
        return self._of_test[key]

    @cached_property
    def _of_test(self) -> dict[tuple[int, tuple[str, ...]], _Information]:
        return {}

    @cached_property
    def _of_base(self) -> dict[tuple[str, ...], _Information]:
        return {}

    def _problem(self, test: CandidateTest, base: tuple[str, ...]) -> InstrumentProblem:
        """The problem of a test alone, read from a machine without errors."""
        count, setup = len(test.positions), test.setup
        channels = {SETUP: np.ones(count)}
        for name, values in zip(readings()[setup.reading].columns, self._read(test).T, strict=True):
            channels[name] = values
        probings = Probings(
            np.full(count, self.campaign.runs[0].run), np.arange(1, count + 1), np.arange(count, dtype=np.float64),
            np.full(count, setup.id),
            {
                joint.name: joint.sign * test.positions[:, index]
                for index, joint in enumerate(self.chain.joints)
            },
            channels,
        )  # fmt: skip
        artefact = replace(self.campaign.artefact, setups=(setup,))
        campaign = replace(self.campaign, artefact=artefact, probings=probings)
        return problem_of(campaign, replace(self.model, base=base))

    def _read(self, test: CandidateTest) -> Array:
        """What a machine without errors shows (m, k) in the columns of the kind, as far as a search begins there."""
        setup, count = test.setup, len(test.positions)
        columns = readings()[setup.reading].columns
        if setup.reading == "direction":
            rows = Rows(
                self.chain, np.zeros(count, dtype=np.int64), np.full(count, setup.id), np.zeros((count, 3)),
                test.positions, np.full((count, 3), np.nan), np.zeros(count), np.zeros((count, 0)),
            )  # fmt: skip
            return Direction(setup).pointed(rows)
        if setup.reading == "point":
            none = np.zeros((count, len(self.chain.joints), 2, 6))
            tool = np.tile(setup.tool_point, (count, 1))
            return evaluate(self.chain, test.positions, none, np.zeros((count, 3)), tool).residual
        return np.zeros((count, len(columns)))


def _information(problem: InstrumentProblem) -> _Information:
    """The derivatives of a run by base and added coefficients and by what its setups share, their other unknowns taken
    out."""
    at = replace(problem, is_whole=True).linearise(problem.start, problem.common_start)
    count, share = len(problem.base_names), _shared(problem)
    is_shared = np.array([number in share for number in range(len(problem.own_names))], dtype=bool)
    local = at.local[0].copy()
    # What is known of these counts once, whatever tests there are.
    beforehand = len(local) - len(problem.extra_names)
    of_shared = np.array([problem.own_names.index(name) in share for name in problem.extra_names], dtype=bool)
    local[beforehand:][of_shared] = 0.0
    wanted = np.hstack([local[:, :count], at.common[0], local[:, count:][:, is_shared]])
    by_own = local[:, count:][:, ~is_shared]
    scale = np.linalg.norm(by_own, axis=0)
    scale[scale == 0.0] = 1.0
    vectors, strength, _ = np.linalg.svd(by_own / scale, full_matrices=False)
    basis = vectors[:, strength > RANK_TOLERANCE * strength.max(initial=0.0)]
    size = np.linalg.norm(wanted, axis=0)
    wanted = wanted - basis @ (basis.T @ wanted)
    wanted = np.where(np.linalg.norm(wanted, axis=0) > ROUNDING * size, wanted, 0.0)
    rows = np.vstack([wanted, np.zeros((wanted.shape[1], wanted.shape[1]))])
    names = (*problem.base_names, *problem.added_names, *(share[number][0] for number in sorted(share)))
    return _Information(names, _triangle(rows), dict(share.values()))


def _shared(problem: InstrumentProblem) -> dict[int, tuple[str, _Known]]:
    """What setups of one instrument share, by its place among the own unknowns: what it is in words, and the u to which
    it is known beforehand."""
    share = {}
    for part, columns in zip(problem.parts, problem.own_columns, strict=True):
        u_of = dict(part.prior())
        for index, (name, column) in enumerate(zip(part.unknowns, columns.tolist(), strict=True)):
            what = part.shared(name, None)
            if what is not None:
                share[column] = (
                    f"{name} of {what}",
                    _Known(f"the {name} of {part.instrument}", u_of.get(index, float("inf"))),
                )
    return share


def _triangle(rows: Array) -> Array:
    """The triangle (k, k) with the information of rows (m, k)."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)
