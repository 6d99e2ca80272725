"""The shapes, one a file, each with its pattern, its numbers and its words."""

from __future__ import annotations

from monitor.effects.registry import parse, plug_in_patterns, plug_ins
from monitor.effects.shape import Shape
from monitor.effects.shapes.compliance import Compliance
from monitor.effects.shapes.const import Const
from monitor.effects.shapes.cyclic import Cyclic
from monitor.effects.shapes.formula import FormulaShape
from monitor.effects.shapes.harmonic import Harmonic
from monitor.effects.shapes.harmonics import Harmonics, harmonics_text
from monitor.effects.shapes.lag import Lag
from monitor.effects.shapes.nodes import Nodes, nodes_text
from monitor.effects.shapes.poly import Poly
from monitor.effects.shapes.reversal import REVERSAL_VALUE, Reversal, has_reversal_value
from monitor.effects.shapes.sawtooth import Sawtooth
from monitor.effects.shapes.step import Step
from monitor.effects.shapes.table import TABLE_NODES, Table
from monitor.effects.shapes.windup import WindUp
from monitor.exceptions import EffectError, did_you_mean

__all__ = [
    "REVERSAL_VALUE",
    "TABLE_NODES",
    "Compliance",
    "Const",
    "Cyclic",
    "FormulaShape",
    "Harmonic",
    "Harmonics",
    "Lag",
    "Nodes",
    "Poly",
    "Reversal",
    "Sawtooth",
    "Step",
    "Table",
    "WindUp",
    "harmonics_text",
    "has_reversal_value",
    "nodes_text",
    "parse_shape",
]


#: What a mistyped shape is compared with.
_EXAMPLES = (
    "const", "poly1", "poly2", "poly3", "harmonic1", "harmonic2", "cyclic20mm", "sawtooth84mm(12)", "step(120)",
    "reversal", "windup40mm", "lag", "compliance", "table", "formula(...)",
)  # fmt: skip


def parse_shape(text: str) -> Shape:
    """Return the shape of a name. Raises EffectError, listing the shapes there are, for an unknown one."""
    shape: Shape | None = parse(text, __name__, plug_ins("monitor.shapes"))
    if shape is None:
        hint = did_you_mean(text, _EXAMPLES)
        raise EffectError(
            f"there is no shape '{text}'; {hint}"
            "there are const, poly1 to poly9, harmonic1 to harmonic9999, "
            "harmonics(1,2,121) (several at once), cyclic20mm (any pitch), sawtooth84mm(12) (any pitch, and where it "
            "falls), step(120) or step8mm(110,300) (a jump at each reading, evenly over a width), reversal, windup40mm "
            "or windup40deg (any width), lag, compliance, table (or table9 for nine nodes, up to table99; "
            f"table(-100,0,100) for your own nodes) and formula(...){plug_in_patterns('monitor.shapes')}"
        )
    return shape
