"""Runs statements with their values apart from the text, and without pandas where it is not loaded.

DuckDB looks at every value that Python binds, first of all whether it is ``pandas.NaT``, and loads pandas for that:
0.4 s of processor time in a command that reads for 0.1 s. A prepared statement takes its values without Python: the
text is prepared with its places, as it is when Python binds, and ``EXECUTE`` gives each place a constant of the value's
type. The values never enter the text of the query. What has no such constant here, and everything in a process that has
pandas, is bound by Python.
"""

from __future__ import annotations

import base64
import re
import sys
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from typing import Any

import duckdb

Parameters = Sequence[Any] | Mapping[str, Any]

#: The only kinds of statements that can be prepared and take values here.
_CAN_BE_PREPARED = re.compile(r"(?i)\s*(select|with|from|insert|update|delete)\b")
#: Integers of this size take the smaller of INTEGER and BIGINT that holds them, bound or as a constant; -2**31, read as
#: the negative of 2**31, would be BIGINT as a constant alone.
_LARGEST_INTEGER, _OTHERWISE = 2**63 - 1, -(2**31)
#: Longer constants than this, in characters, are bound: to read them costs more than to load pandas.
_LONGEST = 2_000_000


def execute(
    connection: duckdb.DuckDBPyConnection, sql: str, parameters: Parameters
) -> duckdb.DuckDBPyConnection:
    """Run a statement with its values; the connection holds the result, as after ``connection.execute``."""
    if not parameters:
        return connection.execute(sql)
    if "pandas" in sys.modules or not _CAN_BE_PREPARED.match(sql):
        return connection.execute(sql, parameters)
    constants = _constants(parameters)
    if constants is None:
        return connection.execute(sql, parameters)
    connection.execute(f"PREPARE asked AS {sql}")
    return connection.execute(f"EXECUTE asked({constants})")


def set_variables(connection: duckdb.DuckDBPyConnection, values: Mapping[str, Any]) -> None:
    """Give values to variables of the connection, which SQL reads by ``getvariable``.

    Statements that make a table cannot be prepared. Raises TypeError for a value that has no constant.
    """
    for name, value in values.items():
        text = constant(value)
        if text is None:
            raise TypeError(f"the variable {name} has no constant of SQL: {value!r}")
        connection.execute(f'SET VARIABLE "{name}" = {text}')


def _constants(parameters: Parameters) -> str | None:
    """Return the values as a list of constants, by name where they have names; None where one has no constant."""
    named = isinstance(parameters, Mapping)
    values = list(parameters.values()) if isinstance(parameters, Mapping) else list(parameters)
    constants = [constant(value) for value in values]
    if any(text is None for text in constants):
        return None
    names = [f'"{name}" := ' for name in parameters] if named else [""] * len(values)
    listed = ", ".join(f"{name}{text}" for name, text in zip(names, constants, strict=True))
    return listed if len(listed) <= _LONGEST else None


def constant(value: Any) -> str | None:
    """Return a value as a constant of SQL with the type that DuckDB gives it when Python binds it, or None.

    In a text a quote is doubled (ISO/IEC 9075-2, 5.3), and nothing else has a meaning; a NUL would end it, so a text
    that has one has no constant.
    """
    if value is None:
        return "NULL"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return None if "\0" in value else "'" + value.replace("'", "''") + "'"
    if type(value) is int:
        return str(value) if abs(value) <= _LARGEST_INTEGER and value != _OTHERWISE else None
    if isinstance(value, float):
        return f"CAST('{float(value)!r}' AS DOUBLE)"
    if type(value) is datetime:
        return None if value.tzinfo else f"TIMESTAMP '{value.isoformat(sep=' ')}'"
    if type(value) is date:
        return f"DATE '{value.isoformat()}'"
    if isinstance(value, bytes):
        return f"from_base64('{base64.b64encode(value).decode()}')"
    return _list_constant(value) if type(value) in (list, tuple) else None


def _list_constant(values: Sequence[Any]) -> str | None:
    """Return a list whose members are all of one kind; of others DuckDB's Python finds a common type."""
    if len({type(member) for member in values}) != 1 or not isinstance(values[0], str | int | float):
        return None
    constants = [constant(member) for member in values]
    return None if any(text is None for text in constants) else f"[{', '.join(map(str, constants))}]"
