"""The method ``curve``: one response over its inputs, a base model in one line, and the effects added to it."""

from __future__ import annotations

from monitor.methods.curve.fit import fit
from monitor.methods.curve.problem import NAME, problem_of
from monitor.methods.method import CurveMethod, Nouns

METHOD = CurveMethod(
    name=NAME,
    title="curve",
    description="one response over its inputs: no machine at all",
    nouns=Nouns(target="row", row="row"),
    problem_of=problem_of,
    fit=fit,
)
