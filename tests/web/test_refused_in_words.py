"""What is no file of one plant is not served."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")

from monitor.exceptions import InputError
from monitor.web.opening import opened


def test_a_lake_is_not_served(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match="not a lake of many plants: serve the file of a plant"),
        opened(Path("ducklake:lake.ducklake"), tmp_path),
    ):
        pass
