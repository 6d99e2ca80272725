"""A run that was copied within a folder is refused; simulated runs without noise are equal by right."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import CampaignError
from monitor.methods.samba.virtual import virtual_campaign
from monitor.readers import write_campaign
from monitor.store import Database, list_campaigns
from monitor.workflow.intake.campaigns import RunsRequest, campaigns, runs
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def with_a_copy(folder: Path, of: int, to: int) -> Path:
    """``cold-cold`` whose run ``to`` holds the rows of run ``of``."""
    shutil.copytree(EXAMPLES / "cold-cold", folder)
    file = folder / "probings.csv"
    header, *rows = file.read_text(encoding="utf-8").splitlines()
    copied = [re.sub(rf"^{of},", f"{to},", row) for row in rows if row.startswith(f"{of},")]
    kept = [row for row in rows if not row.startswith(f"{to},")]
    file.write_text("\n".join([header, *kept, *copied]) + "\n", encoding="utf-8")
    return folder


def test_a_copied_run_is_refused_in_words(tmp_path: Path) -> None:
    folder = with_a_copy(tmp_path / "cold-cold", 2, 5)
    with (
        Database(tmp_path / "shop.duckdb") as db,
        pytest.raises(CampaignError, match=r"runs 2 and 5 are equal in every reading of their \d+ probings"),
    ):
        import_folders(db, ImportRequest([folder]))
    with Database(tmp_path / "shop.duckdb") as db:
        import_folders(db, ImportRequest([EXAMPLES / "cold-cold"]))
        assert len(list_campaigns(db)) == 1


def test_the_refusal_is_recorded(tmp_path: Path) -> None:
    folder = with_a_copy(tmp_path / "cold-cold", 2, 5)
    with Database(tmp_path / "shop.duckdb") as db:
        with pytest.raises(CampaignError, match=r"remove the copies here and from runs\.csv"):
            import_folders(db, ImportRequest([folder]))
        assert db.rows("SELECT campaign, fault_count FROM v_refused_imports") == [("cold-cold", 1)]


def test_runs_without_noise_are_equal_by_right(tmp_path: Path) -> None:
    exact = virtual_campaign("exact", np.random.default_rng(1), noise=0.0)
    write_campaign(exact, tmp_path / "exact")
    with Database(tmp_path / "shop.duckdb") as db:
        (found,) = import_folders(db, ImportRequest([tmp_path / "exact"])).imported
        assert found.state == "imported"
        assert len(found.notes) == 1
        assert "simulated without noise they count as runs, but their scatter means nothing" in found.notes[0]


def test_a_campaign_that_came_in_under_another_name_is_told(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "cold-cold", tmp_path / "again")
    file = tmp_path / "again" / "campaign.toml"
    file.write_text(
        file.read_text(encoding="utf-8").replace('campaign = "cold-cold"', 'campaign = "again"'),
        encoding="utf-8",
    )
    with Database(tmp_path / "shop.duckdb") as db:
        first, second = import_folders(
            db, ImportRequest([EXAMPLES / "cold-cold", tmp_path / "again"])
        ).imported
        assert first.notes == ()
        assert "runs of again equal those of campaign cold-cold in every reading" in second.notes[0]
        assert runs(db, RunsRequest("again")).notes == second.notes
        assert campaigns(db).withdrawn == ()
