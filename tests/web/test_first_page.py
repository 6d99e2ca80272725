"""What the first page of a server waits for: nothing that computes, and not the libraries of tables."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")
pytest.importorskip("plotly", reason="the extra web is not installed")

LISTING = """
import json, sys
from pathlib import Path
from monitor.web.asking import Asker
from monitor.web.opening import opened
import monitor.web.app
folder, path = map(Path, sys.argv[1:])
with opened(path, folder) as served:
    user = monitor.web.app.User("somebody", monitor.web.app.Role.VIEWER)
    machines = Asker(served.db)(user, "machines")
print(json.dumps([len(machines.rows), sorted(sys.modules)]))
"""


def test_the_first_page_loads_nothing_that_computes(imported: Path, tmp_path: Path) -> None:
    """Measured in processor time: 2.5 s to start and 0.6 s a page with all of it, 1.2 s and 0.2 s without."""
    listing = subprocess.run(
        [sys.executable, "-c", LISTING, str(tmp_path), str(imported)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    machines, modules = json.loads(listing.stdout)
    assert machines == 1
    loaded = set(modules)
    assert "monitor.web.pages.model" in loaded
    for heavy in (
        "pandas",
        "scipy",
        "matplotlib",
        "monitor.discovery",
        "monitor.methods",
        "monitor.uncertainty",
    ):
        assert heavy not in loaded, heavy
