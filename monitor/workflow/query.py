"""Answers a query of the user's own in SQL, and lists machines and readings as tables; nothing is changed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any

from monitor.exceptions import InputError
from monitor.store import (
    Database,
    QueryResult,
    campaign_readings,
    column_comments,
    list_machines,
    load_campaign,
    run_query,
)

#: More rows than any database of this product holds; DuckDB counts in 64 bits.
MOST_ROWS = 10**12
Cell = str | int | float | bool | datetime | date | None


@dataclass(frozen=True)
class SqlRequest:
    """One query that reads, in DuckDB's SQL, and the most rows that are wanted (None: all)."""

    query: str
    limit: int | None = None

    def __post_init__(self) -> None:
        if self.limit is not None and not 1 <= self.limit <= MOST_ROWS:
            raise InputError(f"--limit {self.limit}: a number of rows, 1 to {MOST_ROWS}")


@dataclass(frozen=True)
class ReadingsRequest:
    """The campaign whose readings are listed."""

    campaign: str


@dataclass(frozen=True)
class TableAnswer:
    """A table by rows; ``types`` are DuckDB's, ``truncated`` says that there are more rows.

    ``meanings`` are what the comments of the views say of their columns, with the unit in brackets.
    """

    columns: tuple[str, ...]
    types: tuple[str, ...]
    meanings: Mapping[str, str]
    rows: tuple[tuple[Cell, ...], ...]
    truncated: bool


def sql(db: Database, request: SqlRequest) -> TableAnswer:
    """Run a query that may read and change nothing. Raises InputError."""
    return _table(run_query(db, request.query, request.limit), {})


def machines(db: Database) -> TableAnswer:
    """List the machines as the view ``v_machines`` has them: topology, maker, number of campaigns, latest run."""
    return _table(list_machines(db), column_comments(db, "v_machines"))


def readings(db: Database, request: ReadingsRequest) -> TableAnswer:
    """List the readings of a campaign as the view ``v_probings`` has them. Raises NotFoundError."""
    load_campaign(db, request.campaign)
    return _table(campaign_readings(db, request.campaign), column_comments(db, "v_probings"))


def _table(result: QueryResult, meanings: Mapping[str, str]) -> TableAnswer:
    rows = tuple(tuple(_cell(value) for value in row) for row in result.rows)
    return TableAnswer(result.columns, result.types, meanings, rows, result.truncated)


def _cell(value: Any) -> Cell:
    """Return a value as a cell: lists, maps and structures as JSON, whatever else there is as text."""
    if value is None or isinstance(value, str | int | float | datetime | date):
        return value
    if isinstance(value, dict | list | tuple):
        return json.dumps(value, default=str, ensure_ascii=False)
    return value.hex() if isinstance(value, bytes) else str(value)
