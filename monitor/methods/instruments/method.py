"""The method ``instruments``: one machine, whatever instruments measured it."""

from __future__ import annotations

from monitor.machine import Chain
from monitor.methods.chain.identification import TakenUp
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import still_joints
from monitor.methods.instruments.as_stated import as_stated
from monitor.methods.instruments.assembly import NAME, problem_of
from monitor.methods.instruments.base import instrument_base, taken_up, usual_setups
from monitor.methods.instruments.contradiction import bars_of_one_direction, other_travels
from monitor.methods.instruments.contrasts import contrast, contrasts, scatters
from monitor.methods.instruments.drifts import drifts
from monitor.methods.instruments.forecast import InstrumentForecast
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.shares import shares
from monitor.methods.instruments.standard_tests import standard_tests
from monitor.methods.method import ChainMethod, InstrumentPlan, Instruments, Nouns, StandardTests, Unable
from monitor.refusal import Advice, AdviceKind


def usual_base(chain: Chain) -> tuple[str, ...]:
    """The effects that are free in every run of a machine of which no campaign says how it was measured."""
    return instrument_base(chain, usual_setups(chain))


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan did not move and would have to move."""
    still = tuple(joint.name for joint in still_joints(problem, run))
    if still:
        return Advice(AdviceKind.STOOD_STILL, still)
    # More poses of the same setups often do not help: a square, a level or an autocollimator does.
    return Advice(AdviceKind.OTHER_MEASUREMENT, parameters[:1])


def without_numbers(problem: ChainProblem) -> tuple[TakenUp, ...]:
    """What these setups cannot give a number, whatever the plan."""
    assert isinstance(problem, InstrumentProblem)
    centres = (
        TakenUp(f"the centre of {name} across its bar", ()) for name in bars_of_one_direction(problem.parts)
    )
    absent = (TakenUp(effect, (), why) for effect, why in problem.left_out.items())
    return (*taken_up(problem.context.chain, problem.setups), *centres, *absent)


def misread(problem: ChainProblem) -> tuple[str, ...]:
    """The lasers whose readings are not the travel along their direction."""
    assert isinstance(problem, InstrumentProblem)
    return tuple(name for name, _ in other_travels(problem.parts))


METHOD = ChainMethod(
    name=NAME,
    title="instruments",
    description="any instruments on one machine: where it points, points, distances, displacements, angles",
    nouns=Nouns(target="target", row="reading"),
    problem_of=problem_of,
    advice=advice,
    base_effects=usual_base,
    trial_rows=150,
    taken_up=without_numbers,
    as_stated=as_stated,
    instruments=Instruments(shares, contrasts, contrast, scatters, drifts, misread),
    standards=StandardTests(standard_tests),
    plan=InstrumentPlan(InstrumentForecast),
    coordinates=Unable("readings of instruments are no coordinates that could stand side by side"),
)
