"""Effects of a curve, and the inputs from which they are computed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.records import Array, CurveCampaign

#: The input that every curve has: the number of the row, from 1.
SEQUENCE = "sequence"
#: Shapes with a value that can be searched, and the name of that value.
SEARCHED = {"sin": "period", "exp": "constant", "step": "place", "knee": "place"}
#: Those whose value is looked for between the values of the input only.
PLACED = ("step", "knee")


@dataclass(frozen=True)
class CurveEffect:
    """One effect. ``value`` is the period, constant or place, None where it is to be searched; ``free`` says that
    it is estimated from the data."""

    column: str
    shape: str
    value: float | None = None
    free: bool = False

    @property
    def text(self) -> str:
        """The effect as written; 15 digits of a searched value, so that nothing of it is lost."""
        if self.shape == "formula":
            return f"formula({self.column})"
        value = "" if self.value is None else f"{'~' if self.free else ''}{self.value:.15g}"
        return f"{self.column}:{self.shape}{value}"

    @property
    def family(self) -> str:
        """The effect without its searched value."""
        return f"{self.column}:{self.shape}" if self.free else self.text

    @property
    def order(self) -> int:
        """The power of a polynomial, 1 for a drift, 0 for everything else."""
        if self.shape == "drift":
            return 1
        return int(self.shape[4:]) if self.shape.startswith("poly") else 0

    def at(self, value: float) -> CurveEffect:
        """Return the effect with another searched value."""
        return replace(self, value=value, free=True)


@dataclass(frozen=True)
class Inputs:
    """The inputs of effects: numbers (n,) and labels (n,) by name, n rows, and the unit of each number."""

    numbers: Mapping[str, Array]
    groups: Mapping[str, npt.NDArray[np.str_]]
    units: Mapping[str, str]
    count: int

    def names(self) -> str:
        """Return the columns, for a message."""
        return ", ".join([*(name for name in self.numbers if name != SEQUENCE), *self.groups])


def inputs_of(curve: CurveCampaign) -> Inputs:
    """Return the inputs of a curve, the number of the row among them."""
    count = len(curve)
    numbers = {name: values for name, values in curve.columns.items() if name != curve.response}
    return Inputs({**numbers, SEQUENCE: np.arange(1.0, count + 1.0)}, curve.groups, curve.units, count)


def group_names(labels: Iterable[str]) -> list[str]:
    """Return the labels of a group in the order in which they first occur."""
    return list(dict.fromkeys(map(str, labels)))
