"""What a calibration method is: its names, its functions, and what it can do.

A method is one folder of this package whose ``method.py`` has a ``METHOD``: a ``ChainMethod`` where a machine was
measured, a ``CurveMethod`` where one response was measured over its inputs. The rest of the program asks these fields
and never for a name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING, Protocol

from monitor.exceptions import DataError
from monitor.machine import Chain
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.chain.problem import ChainProblem, Solver, solve_problem
from monitor.methods.model import Model
from monitor.methods.rehearsal import YES, Able, Rehearsal
from monitor.records import Array, Campaign, CurveCampaign, Setup
from monitor.units import Unit

if TYPE_CHECKING:
    from monitor.methods.chain.identification import AsStated, Identification, StepwiseCoefficient, TakenUp
    from monitor.methods.chain.least_squares import Solution
    from monitor.methods.chain.results import AdviceOf
    from monitor.methods.curve.fit import CurveFit
    from monitor.methods.curve.problem import CurveProblem
    from monitor.methods.standard_test import StandardTestRows


@dataclass(frozen=True)
class Unable:
    """The method has no answer to the question; ``why`` is half a sentence that can follow a colon."""

    why: str


@dataclass(frozen=True)
class TouchPlan(Able):
    """Plans are targets and indexations: the method's problem is a ``TouchProblem``."""


@dataclass(frozen=True)
class AnglePlan(Able):
    """Plans are angles of a table, of which ``candidates_of`` weighs those in degrees that are given."""

    candidates_of: Callable[[Campaign, Model, Sequence[float]], AngleCandidates]


@dataclass(frozen=True)
class Stepwise(Able):
    """One run can be identified step by step too, beside the fit of all unknowns at once."""

    coefficients: Callable[[ChainProblem, Solution, int], tuple[StepwiseCoefficient, ...]]


class ExpectedAngles(Protocol):
    """What a plan of ``angles`` of a table with so many ``probings`` promises.

    ``shape`` are standard uncertainties of the shape's points in mm and ``u`` those of all parameters in internal
    units, NaN where the plan gives no number; ``nullity`` counts the dimensions that it leaves open and ``left_out``
    the points that would lie beyond the nodes.
    """

    @property
    def angles(self) -> tuple[float, ...]: ...
    @property
    def probings(self) -> int: ...
    @property
    def left_out(self) -> int: ...
    @property
    def nullity(self) -> int: ...
    @property
    def u(self) -> dict[str, float]: ...
    @property
    def shape(self) -> Array: ...


class AngleCandidates(Protocol):
    """Angles of a ``table`` (degrees) to choose from, with the ``present`` plan of the first run.

    ``conditions`` are those on the shape, ``units`` the display units of the parameters.
    """

    @property
    def present(self) -> tuple[float, ...]: ...
    @property
    def table(self) -> str: ...
    @property
    def conditions(self) -> Mapping[str, str]: ...
    @property
    def units(self) -> Mapping[str, Unit]: ...

    def expected(self, angles: Sequence[float]) -> ExpectedAngles:
        """What a plan of these angles promises."""

    def next_angles(self, count: int) -> tuple[Sequence[ExpectedAngles], tuple[float, ...]]:
        """Every single angle added to the present plan, best first, and the best ``count`` angles."""


class PlannedTest(Protocol):
    """A test that could be made: its setup, the positions (m, J) of the joints, whether the campaign has it."""

    @property
    def setup(self) -> Setup:
        """Return the setup."""
        ...

    @property
    def positions(self) -> Array:
        """Return the positions (m, J) of the joints, mm and rad."""
        ...

    @property
    def available(self) -> bool:
        """Whether the campaign has the instrument."""
        ...


@dataclass(frozen=True)
class ExpectedTest:
    """What a test promises beside the readings that are there: standard uncertainties in internal units by parameter,
    NaN where there is no number."""

    test: PlannedTest
    u: Mapping[str, float]


class TestForecast(Protocol):
    """Tests that could follow a run, and what they promise."""

    def unit_of(self, parameter: str) -> Unit:
        """The display unit of a parameter that the run or a test has."""

    def present(self) -> Mapping[str, float]:
        """Standard uncertainties of the run as it was measured."""

    def expected(self, *, first_places: bool = False) -> Iterable[ExpectedTest]:
        """What every single test promises; with ``first_places`` one of those of a setup that move the same axes."""

    def together(self, tests: Sequence[PlannedTest]) -> ExpectedTest:
        """What several tests promise together."""

    def limit(self, tests: Sequence[PlannedTest], parameter: str) -> tuple[float, tuple[str, ...]]:
        """The u of a parameter that no repetition of the run and of tests goes below, and what limits it in words."""


@dataclass(frozen=True)
class InstrumentPlan(Able):
    """Plans are tests of instruments, of which ``forecast`` weighs those that the limits of the joints allow."""

    forecast: Callable[[Campaign, Model, int, Mapping[str, tuple[float, float]]], TestForecast]


@dataclass(frozen=True)
class InstrumentShare:
    """What one instrument says of the k base parameters of a run, in internal units.

    ``name`` as people call it, its ``setups``, ``numbers`` read and ``chi_square`` of their weighted residuals.
    ``variance`` (k,) is its part of the variance in the joint fit; ``alone`` (k,) and ``alone_variance`` (k,) are the
    estimate of its readings by themselves, NaN where they do not determine a parameter. ``alone_freedom`` (k,) are the
    degrees of freedom of that variance, infinite where the readings scatter no more than stated.
    """

    name: str
    setups: tuple[str, ...]
    numbers: int
    chi_square: float
    variance: Array
    alone: Array
    alone_variance: Array
    alone_freedom: Array


class SharesOf(Protocol):
    """Gives what each instrument says of the parameters of a ``run``, and their variance (k,) by what is known
    beforehand of the setups."""

    def __call__(
        self, problem: ChainProblem, solution: Solution, run: int
    ) -> tuple[tuple[InstrumentShare, ...], Array]: ...


class ContrastKind(StrEnum):
    """What is held against all others: a setup, an instrument of several, or a number that several setups share and
    that is stated beforehand (the length of a bar)."""

    SETUP = "setup"
    INSTRUMENT = "instrument"
    STATED = "stated"


@dataclass(frozen=True)
class Contrast:
    """What one of a ``kind`` says against all others of a run, by ``name``: it goes with ``setups``, and consists of
    ``members``, which are setups and stated numbers.

    They can differ in so many ``directions``, do by ``size`` (root of the mean square in standard uncertainties), and
    chance alone makes ``p`` as much; ``freedom`` are the degrees of freedom of the scatter, infinite where it is as
    stated. Without it the others have so many comparisons left, ``others_left``, and contradict each other as chance
    makes them in at most ``others_p``; both are None where ``p`` is too large to ask, and where the others contradict
    each other for certain.
    """

    name: str
    kind: ContrastKind
    setups: tuple[str, ...]
    members: frozenset[str]
    directions: int
    size: float
    freedom: float
    p: float
    others_left: int | None = None
    others_p: float | None = None


@dataclass(frozen=True)
class SetupScatter:
    """The readings of a ``setup``, fitted by themselves, scatter ``times`` what it states, by so many ``numbers`` more
    than unknowns; chance alone leaves ``p`` as little."""

    setup: str
    times: float
    p: float
    numbers: float


@dataclass(frozen=True)
class SetupDrift:
    """What a ``number`` of a ``setup`` ran off from its first row of a ``run`` to its last, beside what a fit knows.

    ``size`` and ``u`` in mm, of ``angular`` readings what they come to at one metre; ``p`` is how often chance alone
    makes one as large.
    """

    run: int
    setup: str
    number: str
    size: float
    u: float
    p: float
    angular: bool


@dataclass(frozen=True)
class Instruments(Able):
    """Several instruments measure one machine; ``shares`` says what each of them does for a run, ``contrasts`` what
    each setup says against all others (of a problem, a solution, a run, and what makes numbers (..., R, N) of all runs
    independent, if anything) and ``contrast`` what one of them does, by its name, ``scatters`` what its readings
    scatter, ``drifts`` which setups run off with the time, ``misread`` which ones read something else than they are set
    up for, without a fit."""

    shares: SharesOf
    contrasts: Callable[..., tuple[Contrast, ...]]
    contrast: Callable[[ChainProblem, Solution, int, str], Contrast | None]
    scatters: Callable[[ChainProblem, Solution, int], tuple[SetupScatter, ...]]
    drifts: Callable[[ChainProblem, Solution], tuple[SetupDrift, ...]]
    misread: Callable[[ChainProblem], tuple[str, ...]]


@dataclass(frozen=True)
class StandardTests(Able):
    """Rows are tests that standards evaluate; ``tests`` are those of a problem."""

    tests: Callable[[ChainProblem], tuple[StandardTestRows, ...]]


@dataclass(frozen=True)
class Nouns:
    """What a ``target`` and a ``row`` of a campaign are called, in the singular."""

    target: str
    row: str


@dataclass(frozen=True)
class Method:
    """A calibration method: ``name`` as campaigns write it, ``title`` and ``description`` as people read them.

    The other fields say to which questions the method has an answer; ``coordinates`` is whether the probed
    coordinates of several runs can stand side by side in the statistics.
    """

    name: str
    title: str
    description: str
    nouns: Nouns
    statistics: Able | Unable
    coordinates: Able | Unable
    uncertainty: Able | Unable
    plan: TouchPlan | AnglePlan | InstrumentPlan | Unable
    stepwise: Stepwise | Unable
    map: Able | Unable
    trend: Able | Unable
    certificate: Able | Unable
    rehearsal: Rehearsal | Unable
    standards: StandardTests | Unable
    instruments: Instruments | Unable

    @property
    def own_model(self) -> Model:
        """The model that a campaign of the method is identified with unless another is named."""
        return Model(self.name)


class ProblemOf(Protocol):
    """Makes the least-squares problem of a campaign under a model.

    Raises DataError where the readings or the machine do not suffice, EffectError for an effect that they lack.
    """

    def __call__(self, campaign: Campaign, model: Model = ...) -> ChainProblem: ...


class CurveProblemOf(Protocol):
    """Makes the least-squares problem of a curve under a model; EffectError for an effect that it does not have."""

    def __call__(self, campaign: CurveCampaign, model: Model = ...) -> CurveProblem: ...


def nothing_to_refuse(campaign: Campaign, problem: ChainProblem) -> None:
    """Accept every campaign that has a problem."""


def nothing_taken_up(problem: ChainProblem) -> tuple[TakenUp, ...]:
    """Name no error."""
    return ()


def nothing_as_stated(problem: ChainProblem) -> tuple[AsStated, ...]:
    """Name no stated place."""
    return ()


NO_REHEARSAL = Unable("there is no virtual machine for it")
NO_STANDARDS = Unable(
    "its rows are no test of ISO 230-2, -4, -6 or -7; set up a laser or a ball bar (method instruments) for that"
)
ONE_INSTRUMENT = Unable("one instrument measured all of it; uncertainty has the budget of its sources")
NO_STEPWISE = Unable("all unknowns are identified at once, so type identify without --stepwise")
NO_TOUCH_PLAN = Unable(
    "plan works for touches of balls, angles of a workpiece's table and instruments only; identify lists what the "
    "present plan cannot separate, and what to do about it"
)


@dataclass(frozen=True, kw_only=True)
class ChainMethod(Method):
    """A method that measures a machine: readings on its kinematic chain.

    ``refuse`` raises DataError for a campaign of which no fit would hold. ``gross_times`` stated standard
    uncertainties in the residual are first of all a mistake of the file; of a run of more than ``trial_rows`` some
    poses suffice to try such a mistake (None: all rows are needed). ``taken_as_known`` counts as free of errors, so
    that no reading speaks of them; ``taken_up`` are the errors that no plan gives a number of their own, ``as_stated``
    the stated places of instruments that numbers count from;
    ``shares_base`` says that all runs of a campaign may share the base effects.
    """

    problem_of: ProblemOf
    advice: AdviceOf
    base_effects: Callable[[Chain], tuple[str, ...]] = base_effects
    refuse: Callable[[Campaign, ChainProblem], None] = nothing_to_refuse
    gross_times: float = 100.0
    trial_rows: int | None = None
    taken_as_known: tuple[str, ...] = ()
    taken_up: Callable[[ChainProblem], tuple[TakenUp, ...]] = nothing_taken_up
    as_stated: Callable[[ChainProblem], tuple[AsStated, ...]] = nothing_as_stated
    shares_base: bool = False
    statistics: Able | Unable = YES
    coordinates: Able | Unable = YES
    uncertainty: Able | Unable = YES
    plan: TouchPlan | AnglePlan | InstrumentPlan | Unable = NO_TOUCH_PLAN
    stepwise: Stepwise | Unable = NO_STEPWISE
    map: Able | Unable = YES
    trend: Able | Unable = YES
    certificate: Able | Unable = YES
    rehearsal: Rehearsal | Unable = NO_REHEARSAL
    standards: StandardTests | Unable = NO_STANDARDS
    instruments: Instruments | Unable = ONE_INSTRUMENT

    def identify(
        self, campaign: Campaign, model: Model | None = None, solve: Solver = solve_problem
    ) -> Identification:
        """The geometric errors of every run of a campaign, with the covariance of the stated uncertainties.

        ``solve`` gives the solution of the problem. Raises DataError where the readings do not suffice or contradict
        the machine file, EffectError where the model names an effect that the machine or the data do not have.
        """
        from monitor.methods.chain.gross_in_parts import gross_of
        from monitor.methods.chain.memory import TIMES_OF_FIT, within_memory
        from monitor.methods.chain.results import identification
        from monitor.methods.chain.sufficiency import refuse_exact_fits
        from monitor.methods.chain.suspects import with_suspects

        model = model or self.own_model
        problem = self.problem_of(campaign, model)
        self.refuse(campaign, problem)
        with within_memory(problem, 0 if problem.is_in_parts else TIMES_OF_FIT):
            try:
                solution = solve(problem)
            except DataError as error:
                raise with_suspects(
                    error, campaign, problem, partial(self.problem_of, model=model)
                ) from error
        refuse_exact_fits(problem, solution)
        search = gross_of(campaign, problem, solution, partial(self.problem_of, model=model))
        return replace(
            identification(campaign, model, problem, solution, self.advice, search.readings),
            unsearched=search.unsearched,
            taken_up=self.taken_up(problem),
            as_stated=self.as_stated(problem),
        )


NO_MACHINE = Unable(
    "it is a curve, not a machine; it can be identified, compared and explained "
    "(monitor identify, compare, explain, model)"
)


@dataclass(frozen=True, kw_only=True)
class CurveMethod(Method):
    """A method that measures one response over its inputs: no machine, no runs."""

    problem_of: CurveProblemOf
    fit: Callable[[CurveProblem], CurveFit]
    statistics: Able | Unable = Unable(
        "it is a curve, not a machine: one run; identify gives the uncertainties of its coefficients"
    )
    coordinates: Able | Unable = NO_MACHINE
    uncertainty: Able | Unable = Unable(
        "it is a curve, not a machine; identify gives the uncertainties of its coefficients"
    )
    plan: TouchPlan | AnglePlan | InstrumentPlan | Unable = NO_MACHINE
    stepwise: Stepwise | Unable = NO_STEPWISE
    map: Able | Unable = NO_MACHINE
    trend: Able | Unable = NO_MACHINE
    certificate: Able | Unable = NO_MACHINE
    rehearsal: Rehearsal | Unable = NO_REHEARSAL
    standards: StandardTests | Unable = NO_STANDARDS
    instruments: Instruments | Unable = ONE_INSTRUMENT
