"""Replacing a campaign that was imported wrongly, as a user types it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any


def test_a_wrong_campaign_is_replaced(typed: Any, db: Path, examples: Path, tmp_path: Path) -> None:
    corrected = tmp_path / "corrected"
    shutil.copytree(examples / "cold-cold", corrected)
    file = corrected / "campaign.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace("standard_uncertainty_um = 0.7", "standard_uncertainty_um = 0.8"), encoding="utf-8"
    )
    refused = typed("import", corrected, db=db)
    assert refused.status == 2
    assert "monitor withdraw cold-cold --reason" in refused.err
    said = typed("withdraw", "cold-cold", "--reason", "the probe's statement was wrong", db=db)
    assert said.status == 0
    assert (
        said.out == "cold-cold: withdrawn, it no longer counts; its name is free for the corrected folder\n"
    )
    assert "it was withdrawn on" in typed("identify", "cold-cold", db=db).err
    assert "cold-cold: imported" in typed("import", corrected, db=db).out
    assert typed("identify", "cold-cold", db=db).status == 0
    assert typed("verify", db=db).status == 0
    listed = typed("campaigns", db=db).out
    assert "cold-cold (the probe's statement was wrong)" in listed
    document = typed("campaigns", "--json", db=db).document
    assert [one["campaign"] for one in document["withdrawn"]] == ["cold-cold"]
    assert sorted(one["campaign"] for one in document["campaigns"]) == [
        "cold-cold",
        "five-days",
        "hidden-reversal-x",
    ]


def test_a_reason_is_asked_for(typed: Any, db: Path) -> None:
    assert "--reason" in typed("withdraw", "cold-cold", db=db).err
    assert "say why" in typed("withdraw", "cold-cold", "--reason", " ", db=db).err


def test_its_certificates_are_named_and_no_longer_verify(typed: Any, issued: Any) -> None:
    document = typed("withdraw", "five-days", "--reason", "wrong bar", "--json", db=issued.db).document
    assert document["certificates"] == ["2026-0001", "2026-0002"]
    assert (document["campaign"], document["machine"], document["reason"]) == (
        "five-days",
        "HU40-T",
        "wrong bar",
    )
    answer = typed("certificate", "verify", issued.file("2026-0001"), db=issued.db)
    assert answer.status == 1
    assert "which certificate 2026-0001 rests on, was withdrawn: wrong bar" in answer.out + answer.err
    withdrawn = typed("certificate", "withdraw", "2026-0001", "--reason", "its campaign was", db=issued.db)
    assert withdrawn.status == 0
    assert typed("certificate", "verify", issued.file("2026-0001"), db=issued.db).status == 1
    assert typed("verify", db=issued.db).status == 0


def test_the_list_of_campaigns_says_which_hold_runs_of_others(
    typed: Any, examples: Path, tmp_path: Path
) -> None:
    folder, db = tmp_path / "copy", tmp_path / "x.duckdb"
    shutil.copytree(examples / "r-test", folder)
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('"r-test"', '"copy"', 1).replace('"CENTRE-4"', '"CENTRE-5"', 1)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    assert typed("import", examples / "r-test", folder, db=db).status == 0
    said = "1 run of copy equals those of r-test of machine CENTRE-4 in every reading"
    assert said in typed("campaigns", db=db).out
    (copied,) = typed("campaigns", "--json", db=db).document["copied"]
    assert (copied["campaign"], copied["same_as_campaign"], copied["runs"]) == ("copy", "r-test", 1)
    told = typed("identify", "r-test", db=db).out.splitlines()[0]
    assert told.startswith(
        "1 run of r-test equals those of campaign copy of machine CENTRE-5 in every reading"
    )
