"""``formula(...)``: a formula of recorded columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.formula import Formula
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.records import Array


@dataclass(frozen=True)
class FormulaShape(DescribedShape):
    """A formula of recorded columns, typed by the user; the coefficient multiplies it."""

    text: str
    pattern: ClassVar[str] = r"formula\((?P<text>.*)\)"

    def __post_init__(self) -> None:
        Formula(self.text).check()

    def columns(self, context: Context, joint: int) -> Array:
        return Formula(self.text).evaluate(context.columns, len(context))[:, None]

    def phrase(self, error: JointError) -> str:
        return f", following {self.text}"


REGISTERED = (FormulaShape,)
