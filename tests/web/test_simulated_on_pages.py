"""A campaign that nobody measured says so on the pages that show it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(("line", "is_said"), [("virtual = true\n", True), ("", False)])
def test_lists_and_campaign_say_that_it_was_simulated(
    tmp_path: Path, serve: Any, line: str, is_said: bool
) -> None:
    folder = shutil.copytree(EXAMPLES / "nothing-hidden", tmp_path / "nothing-hidden")
    file = folder / "campaign.toml"
    file.write_text(
        file.read_text(encoding="utf-8").replace("[machine]\n", f"[machine]\n{line}", 1), encoding="utf-8"
    )
    path = tmp_path / "a.duckdb"
    with Database(path, threads=1) as db:
        import_folders(db, ImportRequest([folder]))
    client = serve(path, False).client
    for address in ("/campaigns", "/campaign?name=nothing-hidden", "/machine?name=HU40-T"):
        assert ("samba, simulated" in client.get(address).text) == is_said
