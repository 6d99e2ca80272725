"""The built site works from files without a network: its search finds, and no page asks anybody for anything."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

SITE = Path(__file__).resolve().parents[2] / "manual-output"
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = pytest.mark.skipif(not (SITE / "index.html").is_file(), reason="make manual builds it first")


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_the_search_finds_from_files_with_no_network(tmp_path: Path) -> None:
    assert CHROMIUM is not None
    printed = subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}",
         "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=10000", "--dump-dom",
         f"file://{SITE}/search.html?q=backlash"],
        capture_output=True, text=True, timeout=240, check=True,
    ).stdout  # fmt: skip
    summary = re.search(r"found (\d+) pages", printed)
    assert summary is not None
    assert int(summary[1]) >= 3


def test_formulas_are_mathml_without_left_over_commands() -> None:
    page = (SITE / "mathematics.html").read_text(encoding="utf-8")
    formulas = re.findall(r"<math.*?</math>", page, flags=re.DOTALL)
    assert len(formulas) > 30
    assert [
        formula for formula in formulas if "\\" in re.sub(r"<annotation.*?</annotation>", "", formula)
    ] == []
