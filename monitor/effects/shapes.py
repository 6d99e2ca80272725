"""Shapes: how an effect depends on the position of its axis.

A shape is one small class with a ``pattern`` that its name matches, ``columns`` (n, k) of a position and
the ``unit`` that its coefficients have. Another shape is another class, registered by ``@shape`` or found by
the entry point group ``monitor.shapes``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from monitor.effects.context import Context
from monitor.effects.formula import Formula
from monitor.effects.registry import plug_ins
from monitor.exceptions import EffectError
from monitor.machine import Joint
from monitor.records import Array
from monitor.units import DEGREE, METRE, RADIAN, Unit

# Hats of `table`: seven nodes over the visited range resolve a guideway error of a third of the stroke and
# leave four touches a node with 15 indexations of 4 balls.
TABLE_NODES = 7


class Shape(Protocol):
    """What every shape offers."""

    @property
    def labels(self) -> tuple[str, ...]:
        """A suffix for each coefficient; one empty one where there is a single coefficient."""
        ...

    def columns(self, context: Context, joint: int) -> Array:
        """Basis functions (n, k) at every probing."""
        ...

    def unit(self, base: Unit, joint: Joint) -> Unit:
        """The unit of the coefficients, given that of the term."""
        ...


@dataclass(frozen=True)
class Const:
    """The same everywhere."""

    pattern: ClassVar[str] = r"const"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        return np.ones((len(context), 1))

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Poly:
    """A power of the position; the coefficient is per metre or radian to that power."""

    order: int
    pattern: ClassVar[str] = r"poly(?P<order>[1-9])"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        return context.places[:, joint, None] ** self.order

    def unit(self, base: Unit, joint: Joint) -> Unit:
        length = RADIAN if joint.turns else METRE
        power = {1: "", 2: "²", 3: "³"}.get(self.order, f"^{self.order}")
        return base.per(Unit(f"{length.name}{power}", length.factor**self.order))


@dataclass(frozen=True)
class Harmonic:
    """A cosine and a sine of a number of periods a turn; a gear has as many as its ratio, whole or not."""

    order: float
    pattern: ClassVar[str] = r"harmonic(?P<order>[1-9]\d{0,3}(?:\.\d+)?)"
    labels: ClassVar[tuple[str, ...]] = (".cos", ".sin")

    def columns(self, context: Context, joint: int) -> Array:
        if not context.chain.joints[joint].turns:
            name = context.chain.joints[joint].name
            raise EffectError(f"harmonic{self.order:g} belongs to a rotary axis; for {name} write cyclic20mm")
        angle = self.order * context.places[:, joint]
        return np.column_stack([np.cos(angle), np.sin(angle)])

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Cyclic:
    """A cosine and a sine of a pitch in millimetres, as a ball screw or a scale has."""

    pitch: float
    pattern: ClassVar[str] = r"cyclic(?P<pitch>\d+(?:\.\d+)?)mm"
    labels: ClassVar[tuple[str, ...]] = (".cos", ".sin")

    def columns(self, context: Context, joint: int) -> Array:
        if context.chain.joints[joint].turns:
            name = context.chain.joints[joint].name
            raise EffectError(f"cyclic{self.pitch:g}mm belongs to a linear axis; for {name} write harmonic1")
        if self.pitch <= 0:
            raise EffectError(f"the pitch of cyclic{self.pitch:g}mm must be above 0 mm")
        phase = 2.0 * np.pi * context.places[:, joint] / self.pitch
        return np.column_stack([np.cos(phase), np.sin(phase)])

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Reversal:
    """Half the reversal error, with the sign of the axis's last travel."""

    pattern: ClassVar[str] = r"reversal"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        return context.travel[:, joint, None]

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Lag:
    """In proportion to the last move: a reading taken before the axis has settled, or a reading that trails."""

    pattern: ClassVar[str] = r"lag"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        return context.moves[:, joint, None]

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base.per(RADIAN if joint.turns else METRE)


@dataclass(frozen=True)
class Compliance:
    """In proportion to the torque of weights further out, which its driver gives."""

    pattern: ClassVar[str] = r"compliance"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def columns(self, context: Context, joint: int) -> Array:
        return np.ones((len(context), 1))

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Table:
    """Hat functions on evenly spaced nodes over the range that the axis visited."""

    nodes: int = TABLE_NODES
    pattern: ClassVar[str] = r"table(?P<nodes>\d{1,2})?"

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f".node{number}" for number in range(1, self.nodes + 1))

    def columns(self, context: Context, joint: int) -> Array:
        if self.nodes < 2:
            raise EffectError(f"table{self.nodes} has too few nodes; write table or table2 and above")
        q = context.places[:, joint]
        grid = np.linspace(q.min(), q.max(), self.nodes)
        step = grid[1] - grid[0]
        if step == 0:
            return np.column_stack([np.ones(len(q)), np.zeros((len(q), self.nodes - 1))])
        hats: Array = np.clip(1.0 - np.abs(q[:, None] - grid) / step, 0.0, None)
        return hats

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


@dataclass(frozen=True)
class Nodes:
    """Hat functions on nodes that the user names: readings of the axis in mm or degrees, in rising order.

    Each is a coefficient of its own, called by its place, but for those that are ``held`` at zero (written with
    an exclamation mark). Beyond the last node the error stays as it is there.
    """

    places: tuple[tuple[float, bool], ...]
    pattern: ClassVar[str] = r"table\((?P<places>[^)]*)\)"

    @property
    def readings(self) -> tuple[float, ...]:
        """Where the nodes stand, held ones too."""
        return tuple(place for place, _ in self.places)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"({place:.9g})" for place, held in self.places if not held)

    def columns(self, context: Context, joint: int) -> Array:
        axis = context.chain.joints[joint]
        reading = axis.sign * context.places[:, joint] / (DEGREE.factor if axis.turns else 1.0)
        free = [number for number, (_, held) in enumerate(self.places) if not held]
        hats = np.eye(len(self.places))
        return np.column_stack(
            [np.interp(reading, self.readings, hats[number]) for number in free]
            or [np.zeros((len(reading), 0))]
        )

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


def parse_places(text: str) -> tuple[tuple[float, bool], ...]:
    """The nodes of ``-110,0!,110``; EffectError where they are no numbers in rising order."""
    try:
        places = tuple(
            (float(word.strip().removesuffix("!")), word.strip()[-1] == "!") for word in text.split(",")
        )
    except (ValueError, IndexError):
        places = ()
    readings = [place for place, _ in places]
    if not readings or not np.all(np.isfinite(readings)) or np.any(np.diff(readings) <= 0.0):
        raise EffectError(
            f"the nodes of table({text}) must be numbers in rising order, for example table(-100,0,100)"
        )
    return places


def nodes_text(readings: Iterable[float], held: Iterable[float] = ()) -> str:
    """The shape as written: ``table(-110,0!,110)``."""
    fixed = set(held)
    return f"table({','.join(f'{place:.9g}' + '!' * (place in fixed) for place in readings)})"


@dataclass(frozen=True)
class FormulaShape:
    """A formula of recorded columns, typed by the user; the coefficient multiplies it."""

    text: str
    pattern: ClassVar[str] = r"formula\((?P<text>.*)\)"
    labels: ClassVar[tuple[str, ...]] = ("",)

    def __post_init__(self) -> None:
        Formula(self.text).check()

    def columns(self, context: Context, joint: int) -> Array:
        return Formula(self.text).evaluate(context.columns, len(context))[:, None]

    def unit(self, base: Unit, joint: Joint) -> Unit:
        return base


BUILT_IN: tuple[type, ...] = (
    Const, Poly, Harmonic, Cyclic, Reversal, Lag, Compliance, Table, Nodes, FormulaShape,
)  # fmt: skip

# How the groups of a built-in pattern are read; those of a plug-in arrive as text.
READ: dict[str, Callable[[str], Any]] = {
    "order": lambda text: float(text) if "." in text else int(text),
    "nodes": int,
    "pitch": float,
    "places": parse_places,
}


def parse_shape(text: str) -> Shape:
    """The shape of a name; EffectError, listing the shapes there are, for one that does not exist."""
    for shape in (*BUILT_IN, *plug_ins("monitor.shapes")):
        match = re.fullmatch(shape.pattern, text)
        if match:
            given = {name: value for name, value in match.groupdict().items() if value is not None}
            if shape in BUILT_IN:
                made: Shape = shape(**{name: READ.get(name, str)(value) for name, value in given.items()})
            else:
                made = shape(**given)
            return made
    raise EffectError(
        f"there is no shape '{text}'; there are const, poly1 to poly9, harmonic1 to harmonic9999, cyclic20mm (any "
        "pitch), reversal, lag, compliance, table (or table9 for nine nodes, up to table99; table(-100,0,100) for your "
        "own nodes) and formula(...)"
    )
