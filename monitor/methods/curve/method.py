"""The method ``curve``: one response over its inputs, a base model in one line, and the effects added to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.methods.curve.problem import NAME, CurveProblem, problem_of
from monitor.methods.method import CurveMethod, Nouns

if TYPE_CHECKING:
    from monitor.methods.curve.fit import CurveFit


def fit(problem: CurveProblem) -> CurveFit:
    """Fit a curve. Raises DataError, EffectError as ``monitor.methods.curve.fit.fit``."""
    # Loaded here: scipy costs a third of a second that nobody need wait who only asks what methods there are.
    from monitor.methods.curve.fit import fit as least_squares

    return least_squares(problem)


METHOD = CurveMethod(
    name=NAME,
    title="curve",
    description="one response over its inputs: no machine at all",
    nouns=Nouns(target="row", row="row"),
    problem_of=problem_of,
    fit=fit,
)
