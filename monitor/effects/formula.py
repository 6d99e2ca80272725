"""A formula of recorded columns, parsed into its own small tree and evaluated without Python's ``eval``.

Numbers, recorded columns, ``pi``, + - * / **, comparisons (1 where true, 0 where not), ``and``, ``or``,
``not``, and the functions of ``FUNCTIONS``. Anything else is refused by name.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.exceptions import EffectError
from monitor.records import Array

FUNCTIONS: dict[str, Callable[[Array], Array]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "sign": np.sign,
}
OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
    ast.And: np.logical_and,
    ast.Or: np.logical_or,
}
# A formula is typed by a person; one longer or deeper than this is an attack or an accident.
LONGEST = 500


class _AnyColumn(dict[str, Array]):
    """A mapping that has every column, with the value 1: to check a formula without data."""

    def __contains__(self, name: object) -> bool:
        return True

    def __missing__(self, name: str) -> Array:
        return np.ones(1)


@dataclass(frozen=True)
class Formula:
    """A formula as typed."""

    text: str

    def evaluate(self, columns: Mapping[str, Array], count: int) -> Array:
        """Evaluate the formula (count,) at every probing. Raises EffectError for what is unknown or not finite."""
        value = np.broadcast_to(self._computed(columns), (count,))
        bad = ~np.isfinite(value)
        if bad.any():
            raise EffectError(
                f"the formula '{self.text}' is not a finite number at {int(bad.sum())} of {count} probings"
            )
        return value.copy()

    def check(self) -> None:
        """Raise EffectError where the formula cannot be read or uses what is not allowed; needs no columns."""
        self._computed(_AnyColumn())

    def _computed(self, columns: Mapping[str, Array]) -> Array:
        if len(self.text) > LONGEST:
            raise EffectError(
                f"a formula may have at most {LONGEST} characters; this one has {len(self.text)}"
            )
        try:
            tree = ast.parse(self.text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise EffectError(
                f"the formula '{self.text}' cannot be read; an example is sin(2*pi*x_mm/20)"
            ) from None
        try:
            with np.errstate(all="ignore"):
                return np.asarray(self._value(tree, columns), dtype=float)
        except (RecursionError, OverflowError):
            # A chain of hundreds of signs, or a whole number beyond a double's range.
            raise EffectError(
                f"the formula '{self.text}' nests too deeply or holds a number too large to compute with"
            ) from None

    def _value(self, node: ast.expr, columns: Mapping[str, Array]) -> Any:
        match node:
            case ast.Constant(value=bool() | int() | float() as number):
                return float(number)
            case ast.Name(id="pi"):
                return np.pi
            case ast.Name(id=name):
                if name not in columns:
                    raise EffectError(
                        f"the formula '{self.text}' names '{name}', which was not recorded; recorded are "
                        f"{', '.join(sorted(columns))}"
                    )
                return columns[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return np.negative(self._value(operand, columns))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self._value(operand, columns)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return np.logical_not(self._value(operand, columns)).astype(float)
            case ast.BinOp(left=first, op=op, right=right) if type(op) in OPERATORS:
                return OPERATORS[type(op)](self._value(first, columns), self._value(right, columns))
            case ast.BoolOp(op=op, values=values):
                result = self._value(values[0], columns)
                for value in values[1:]:
                    result = OPERATORS[type(op)](result, self._value(value, columns)).astype(float)
                return result
            case ast.Compare(ops=ops) if all(type(sign) in OPERATORS for sign in ops):
                return self._compared(node, columns)
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
                return FUNCTIONS[name](self._value(argument, columns))
        raise EffectError(
            f"the formula '{self.text}' uses '{ast.unparse(node)}', which is not allowed; allowed are numbers, "
            f"recorded columns, pi, + - * / **, comparisons, and, or, not, and {', '.join(FUNCTIONS)}"
        )

    def _compared(self, node: ast.Compare, columns: Mapping[str, Array]) -> Any:
        """Return 1 where every comparison of a chain such as ``0 <= x < 2`` holds, 0 elsewhere."""
        result: Any = 1.0
        before = self._value(node.left, columns)
        for sign, comparator in zip(node.ops, node.comparators, strict=True):
            after = self._value(comparator, columns)
            result = np.multiply(result, np.asarray(OPERATORS[type(sign)](before, after), dtype=float))
            before = after
        return result
