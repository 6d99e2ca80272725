"""The method ``rotary-probing``: location errors of rotary axes from one test piece touched at indexed angles."""

from __future__ import annotations

from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import still_joints
from monitor.methods.method import ChainMethod, Nouns
from monitor.methods.rotary_probing.base import rotary_base
from monitor.methods.rotary_probing.problem import NAME, problem_of


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> str:
    """What the plan did not move and would have to move."""
    still = [joint.name for joint in still_joints(problem, run, "rotary")]
    if still:
        return f": {' and '.join(still)} stands at one angle throughout; index it too"
    return "; touch more faces or other angles: the same points at opposite angles, and faces that look elsewhere"


METHOD = ChainMethod(
    name=NAME,
    title="rotary probing",
    description="a block, a part or spheres, touched at indexed angles of two rotary axes",
    nouns=Nouns(target="target", row="touch"),
    problem_of=problem_of,
    advice=advice,
    base_effects=rotary_base,
    taken_as_known=("the linear axes", "the stylus tip"),
)
