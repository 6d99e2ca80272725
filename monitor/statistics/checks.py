"""The public door of the room: arrays are checked here once, with messages that say what would be right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array


def as_vector(values: npt.ArrayLike, name: str, *, length: int | None = None, least: int = 1) -> Array:
    """A finite float vector (n,); ``DataError`` names the argument, the rule and the offending position."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise DataError(f"{name} has shape {array.shape}; one dimension is needed.")
    if length is not None and array.shape[0] != length:
        raise DataError(f"{name} has {_counted(array, 'value')}; {length} are needed, one for each run.")
    if array.shape[0] < least:
        raise DataError(f"{name} has {_counted(array, 'value')}; at least {least} are needed.")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise DataError(f"{name}[{bad[0]}] is {array[bad[0]]}; every value must be finite.")
    return array


def _counted(array: Array, word: str) -> str:
    return f"{len(array)} {word}{'' if len(array) == 1 else 's'}"


def as_positive(values: npt.ArrayLike, name: str, *, length: int | None = None) -> Array:
    """A finite vector whose values are all above zero."""
    array = as_vector(values, name, length=length)
    bad = np.flatnonzero(array <= 0.0)
    if bad.size:
        raise DataError(f"{name}[{bad[0]}] is {array[bad[0]]}; every value must be above zero.")
    return array


def as_matrix(values: npt.ArrayLike, name: str, *, least: int = 2) -> Array:
    """A finite float matrix (n, p); a vector (n,) becomes one column."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2:
        raise DataError(f"{name} has shape {array.shape}; runs by quantities (n, p) are needed.")
    if array.shape[0] < least:
        raise DataError(f"{name} has {_counted(array, 'row')}; at least {least} runs are needed.")
    if array.shape[1] < 1:
        raise DataError(f"{name} has no columns; at least one quantity is needed.")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        row, column = bad[0]
        raise DataError(f"{name}[{row}, {column}] is {array[row, column]}; every value must be finite.")
    return array


def as_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """One distinct name for each column; without names the columns are numbered from 0."""
    if names is None:
        return tuple(str(i) for i in range(count))
    result = tuple(names)
    if len(result) != count:
        raise DataError(f"names has {len(result)} entries; values has {count} columns.")
    if len(set(result)) != count:
        twice = sorted({name for name in result if result.count(name) > 1})
        raise DataError(f"names holds {twice[0]!r} twice; each column needs its own name.")
    return result


def as_probability(value: float, name: str) -> float:
    """A probability strictly between 0 and 1."""
    if not 0.0 < value < 1.0:
        raise DataError(f"{name} is {value}; it must lie between 0 and 1, both excluded.")
    return float(value)


def check_history(
    values: Mapping[str, npt.ArrayLike], t: Array, u: Mapping[str, npt.ArrayLike], false_alarm: float
) -> None:
    """Refuse a history of parameters whose times fall, or that has none, or a ``u`` of another."""
    if (np.diff(t) < 0.0).any():
        raise DataError(
            f"times falls at index {int(np.argmax(np.diff(t) < 0.0)) + 1}; sort the runs by time."
        )
    if not values:
        raise DataError("values holds no parameter; at least one is needed.")
    as_probability(false_alarm, "false_alarm")
    unknown = sorted(set(u) - set(values))
    if unknown:
        raise DataError(f"u names {unknown[0]!r}; values has {', '.join(values)}.")
