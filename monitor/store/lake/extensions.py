"""The extensions of DuckDB that a lake needs, from the wheels of the extra; none is fetched from the network."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import duckdb

from monitor.exceptions import InputError


def load(connection: duckdb.DuckDBPyConnection, name: str) -> None:
    """Load an extension by its name. Raises InputError where the extra is not installed, or for another DuckDB."""
    connection.execute(f"LOAD {literal(str(_path(name)))}")


def _path(name: str) -> Path:
    spec = importlib.util.find_spec(f"duckdb_extension_{name}")
    if spec is None or spec.origin is None:
        raise InputError("a lake needs extensions of DuckDB: pip install 'machine-health-monitor[lake]'")
    path = Path(spec.origin).parent / "extensions" / f"v{duckdb.__version__}" / f"{name}.duckdb_extension"
    if not path.is_file():
        raise InputError(
            f"the extension {name} that is installed is not for DuckDB {duckdb.__version__}: "
            "pip install 'machine-health-monitor[lake]'"
        )
    return path


def literal(text: str) -> str:
    """Return a text as SQL writes it, where it cannot be bound."""
    return "'" + text.replace("'", "''") + "'"
