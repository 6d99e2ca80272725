"""Fewer readings than unknowns: every question is refused in words, and no mistake of the file is made up."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import monitor
from monitor.exceptions import TooFewReadingsError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ("identify", r"9 readings for 13 unknowns; measure more poses$"),
        ("compare", "nothing is left over to judge it by; measure more poses$"),
        ("explain", "nothing is left over to judge it by; measure more poses$"),
        ("uncertainty", "nothing is left over to judge it by; measure more poses$"),
    ],
)
def test_three_poses_of_an_r_test(tmp_path: Path, question: str, said: str) -> None:
    folder = tmp_path / "r-test"
    shutil.copytree(EXAMPLES / "r-test", folder)
    lines = (folder / "probings.csv").read_text(encoding="utf-8").splitlines()
    (folder / "probings.csv").write_text("\n".join(lines[:4]) + "\n", encoding="utf-8")
    with monitor.open(tmp_path / "m.duckdb", new=True) as db:
        db.add(folder)
        with pytest.raises(TooFewReadingsError, match=said):
            db.ask(question, campaign="r-test")
