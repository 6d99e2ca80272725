"""The method ``rotary-probing``: location errors of rotary axes from one test piece touched at indexed angles."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError
from monitor.methods.chain.deviation import Deviation
from monitor.methods.chain.gross import GrossReading, as_reading
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import still_joints
from monitor.methods.method import ChainMethod, Nouns
from monitor.methods.rotary_probing.base import rotary_base
from monitor.methods.rotary_probing.problem import FARTHEST_APART, NAME, problem_of
from monitor.records import Campaign
from monitor.refusal import Advice, AdviceKind
from monitor.row_files import rows_in


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan did not move and would have to move."""
    still = tuple(joint.name for joint in still_joints(problem, run, "rotary"))
    return Advice(AdviceKind.AXIS_STILL, still) if still else Advice(AdviceKind.MORE_FACES)


def refuse(campaign: Campaign, problem: ChainProblem) -> None:
    """DataError where a touch stands apart from the others of its point: no number of its run would hold."""
    apart = np.flatnonzero(problem.far_off)
    if not len(apart):
        return
    by_error = problem.evaluated(problem.start, problem.common_start, jacobian=True).by_error
    assert by_error is not None
    vectors = problem.vectors(problem.start, problem.common_start)
    touches = "; ".join(
        _what_would_be_right(
            problem, as_reading(problem, by_error, Deviation(row, tuple(vectors[row]), np.inf))
        )
        for row in apart.tolist()
    )
    raise DataError(
        f"touches stand more than {FARTHEST_APART:g} mm apart from the others of their point: {touches}. Correct the "
        f"rows, or leave them out of {rows_in(campaign)}: no number of their run would hold"
    )


def _what_would_be_right(problem: ChainProblem, reading: GrossReading) -> str:
    """Where a wrong touch stands in the file, and the reading that the other touches of its point ask for."""
    chain = problem.context.chain
    joint = chain.index(reading.axis.upper())
    typed = chain.joints[joint].sign * float(problem.context.positions[reading.row, joint])
    return (
        f"run {reading.run}, sequence {reading.sequence} (point {reading.target}): {reading.axis}_mm is {typed:.4f}, "
        f"off by {reading.size:+.3g} mm; some {typed - reading.size:.1f} would be right"
    )


METHOD = ChainMethod(
    name=NAME,
    title="rotary probing",
    description="a block, a part or spheres, touched at indexed angles of two rotary axes",
    nouns=Nouns(target="target", row="touch"),
    problem_of=problem_of,
    refuse=refuse,
    advice=advice,
    base_effects=rotary_base,
    taken_as_known=("the linear axes", "the stylus tip"),
)
