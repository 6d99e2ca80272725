"""Where the system is not POSIX: no ``fcntl``, none of the flags and calls that Windows lacks; files open all the same.

Shown in a process whose modules lack them; what Windows itself does is not tried here.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

# What Python's documentation says of os: "Availability: Unix" or "not Windows".
WITHOUT = """
import os, sys
missing = "O_NONBLOCK O_CLOEXEC O_NOFOLLOW fchmod geteuid getuid pread pwrite sched_getaffinity"
for name in missing.split():
    vars(os).pop(name, None)
sys.modules["fcntl"] = sys.modules["pwd"] = sys.modules["resource"] = sys.modules["grp"] = None
from monitor.cli import main
sys.exit(main(sys.argv[1:]))
"""


def typed(folder: Path, *words: str) -> str:
    answer = subprocess.run(
        [sys.executable, "-c", WITHOUT, *words], cwd=folder, capture_output=True, text=True, timeout=250
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def test_without_posix_campaigns_are_watched_and_read(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "load-cell").symlink_to(EXAMPLES / "load-cell")
    assert "load-cell: imported" in typed(tmp_path, "watch", "in", "--once", "--rest", "0")
    assert "load-cell" in typed(tmp_path, "campaigns")
    assert not list(tmp_path.glob("*.lock"))
