"""Groups and selections of runs: by a column, by bins of a condition, by a condition typed as text.

``warm_up == true and hours >= 6`` selects runs; a named selection is a group like a day is, and several
selections can be compared side by side even where they overlap.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, NotFoundError

Column = npt.NDArray[np.generic]

OPERATORS: Mapping[str, Any] = {
    ">=": operator.ge,
    "<=": operator.le,
    "!=": operator.ne,
    "==": operator.eq,
    "=": operator.eq,
    ">": operator.gt,
    "<": operator.lt,
}
_CLAUSE = re.compile(
    r"\s*(?P<column>\w+)\s*(?P<operator>>=|<=|!=|==|=|>|<)\s*(?P<value>'[^']*'|\"[^\"]*\"|\S+)\s*"
)


@dataclass(frozen=True)
class Selection:
    """Runs chosen by a condition: ``mask`` (n,) over the runs, ``condition`` as typed."""

    name: str
    condition: str
    mask: npt.NDArray[np.bool_]


def _column(columns: Mapping[str, npt.ArrayLike], name: str) -> Column:
    if name not in columns:
        raise NotFoundError(f"no column {name!r}; there are {', '.join(sorted(columns))}.")
    return np.asarray(columns[name])


def _value(text: str, column: str, kind: str) -> object:
    """The typed value in the type of its column."""
    quoted = text[0] in "'\""
    word = text[1:-1] if quoted else text
    if kind == "b":
        if word.lower() not in ("true", "false"):
            raise DataError(f"{column} is compared with {word!r}; it is true or false.")
        return word.lower() == "true"
    if kind in "fiu":
        try:
            return float(word)
        except ValueError:
            raise DataError(f"{column} is compared with {word!r}; it holds numbers.") from None
    if kind == "M":
        try:
            moment = datetime.fromisoformat(word)
        except ValueError:
            raise DataError(f"{column} is compared with {word!r}; it holds ISO 8601 times.") from None
        if moment.tzinfo is not None:
            moment = moment.astimezone(UTC).replace(tzinfo=None)
        return np.datetime64(moment)
    return word


def select_runs(columns: Mapping[str, npt.ArrayLike], condition: str, *, name: str = "") -> Selection:
    """The runs for which ``condition`` holds: ``column operator value``, several joined by ``and``.

    ``columns`` maps names to (n,) arrays (numbers, booleans, text, datetime64). Text with spaces or with
    the word and needs quotes. Raises ``NotFoundError`` for an unknown column, ``DataError`` for text that
    is no condition and for a selection without runs.
    """
    clauses = re.split(r"\s+and\s+(?=(?:[^'\"]*['\"][^'\"]*['\"])*[^'\"]*$)", condition.strip())
    mask: npt.NDArray[np.bool_] | None = None
    for clause in clauses:
        match = _CLAUSE.fullmatch(clause)
        if match is None:
            raise DataError(
                f"{clause!r} is no condition; write column, operator ({' '.join(OPERATORS)}), value, "
                "for example: warm_up == true and ambient_degC < 24"
            )
        column = _column(columns, match["column"])
        value = _value(match["value"], match["column"], column.dtype.kind)
        part = np.asarray(OPERATORS[match["operator"]](column, value), dtype=np.bool_)
        mask = part if mask is None else mask & part
    if mask is None or not mask.any():
        raise DataError(f"no run meets {condition!r}.")
    return Selection(name or condition, condition, mask)


def group_by(
    columns: Mapping[str, npt.ArrayLike], by: str, *, edges: npt.ArrayLike | None = None
) -> npt.NDArray[np.str_]:
    """Labels (n,) of the runs by column ``by``; with ``edges`` its numbers are binned, ``[low, high)``.

    Edges are in the unit of the column and must rise; values outside them fall in the open bins at the
    ends. Without edges every distinct value is a group: right for day, warm_up, operator; a recorded
    temperature is refused then, because every run would be a group of its own.
    """
    column = _column(columns, by)
    if edges is None:
        if column.dtype.kind == "f" and len(np.unique(column)) == len(column) > 1:
            raise DataError(f"every run has its own {by}; give edges to bin it.")
        width = len(str(np.max(column))) if column.dtype.kind in "iu" else 0
        return np.array([str(value).rjust(width) for value in column])
    if column.dtype.kind not in "fiu":
        raise DataError(f"{by} holds no numbers; edges do not apply.")
    bounds = np.asarray(edges, dtype=np.float64)
    if bounds.ndim != 1 or bounds.size == 0 or not np.isfinite(bounds).all() or (np.diff(bounds) <= 0).any():
        raise DataError(f"edges is {np.asarray(edges).tolist()}; finite rising numbers are needed.")
    if not np.isfinite(column.astype(np.float64)).all():
        raise DataError(f"{by} is not recorded for every run; select the runs that have it first.")
    texts = [f"below {bounds[0]:g}", *(f"{a:g} to {b:g}" for a, b in pairwise(bounds))]
    texts.append(f"{bounds[-1]:g} and above")
    return np.array(texts)[np.digitize(column.astype(np.float64), bounds)]
