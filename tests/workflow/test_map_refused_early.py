"""What no map can be drawn of is refused before the run is evaluated, which takes seconds of a page's patience."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.volumetric import over_stroke as asked

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("tracked-robot", r"drawn for three linear axes along X, Y and Z; .* has 0 linear axes"),
        ("free-form-pins", r"the campaign stood still along Z"),
    ],
)
def test_nothing_is_evaluated(name: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asked, "map_run", lambda *_: pytest.fail("the run was evaluated"))
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(EXAMPLES / name))
        with pytest.raises(InputError, match=why):
            asked.over_stroke(db, asked.OverStrokeRequest(name))
