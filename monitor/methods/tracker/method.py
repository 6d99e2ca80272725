"""Tracker: reflectors on the tool of any serial chain, observed from outside at given joint readings.

Location errors of the joints and gains of linear axes are identified together with the tracker's frame and the places
of the reflectors, of which nothing has to be known. Source: B. Mooring, Z. Roth, M. Driels, Fundamentals of manipulator
calibration, Wiley 1991, chapters 3 to 5; conventions as in docs/conventions.md. Axes on the work side are not seen
and do not take part.
"""

from __future__ import annotations

import numpy as np

from monitor.machine import Chain
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.chain.identification import AsStated
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import still_joints
from monitor.methods.method import ChainMethod, Nouns, Unable
from monitor.methods.rehearsal import Rehearsal
from monitor.methods.tracker.assembly import NAME, problem_of, tool_side
from monitor.methods.tracker.problem import TrackingProblem
from monitor.methods.tracker.virtual import virtual_robot
from monitor.refusal import Advice, AdviceKind


def tracker_base(chain: Chain) -> tuple[str, ...]:
    """The effects that are free in every run: those of the tool's side, observed from outside."""
    return base_effects(tool_side(chain), outside=True)


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan did not move and would have to move."""
    still = tuple(joint.name for joint in still_joints(problem, run))
    if still:
        return Advice(AdviceKind.STOOD_STILL, still)
    if len(np.unique(problem.context.target[problem.context.run == run])) == 1:
        return Advice(AdviceKind.MORE_REFLECTORS)
    return Advice(AdviceKind.MORE_POSES)


def exact_scale(problem: ChainProblem) -> tuple[AsStated, ...]:
    """The scale of the tracker where it is taken as exact, and what counts from it."""
    assert isinstance(problem, TrackingProblem)
    return problem.exact_scales()


METHOD = ChainMethod(
    name=NAME,
    title="tracker",
    description="reflectors on a robot or any serial machine, seen by a laser tracker or camera",
    nouns=Nouns(target="reflector", row="reading"),
    problem_of=problem_of,
    advice=advice,
    base_effects=tracker_base,
    trial_rows=150,
    shares_base=True,
    as_stated=exact_scale,
    rehearsal=Rehearsal("robot", virtual_robot, noise_um=20.0),
    coordinates=Unable("points seen by a tracker stand in another frame in every run"),
)
