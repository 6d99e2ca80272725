"""What is no file of one plant is not served, and a moment with a time zone is refused in words."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

from monitor.exceptions import InputError
from monitor.store import Database, run_query
from monitor.web.opening import opened


def test_a_lake_is_not_served(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match="not a lake of many plants: serve the file of a plant"),
        opened(Path("ducklake:lake.ducklake"), tmp_path),
    ):
        pass


@pytest.mark.skipif(
    importlib.util.find_spec("pytz") is not None, reason="pytz is installed, which shows them"
)
def test_a_moment_with_a_time_zone_says_how_to_cast_it() -> None:
    with Database(":memory:") as db:
        with pytest.raises(
            InputError, match=r"SELECT CAST\(now\(\) AS TIMESTAMP\): that is its moment in UTC"
        ):
            run_query(db, "SELECT now()")
        assert len(run_query(db, "SELECT CAST(now() AS TIMESTAMP)").rows) == 1
