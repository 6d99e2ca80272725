"""Runs the tests of the store against another version of DuckDB than the pinned one: what differs, and nothing else.

``python tests/setup/newest_duckdb.py [VERSION] [PYTEST ARGUMENTS...]`` makes an environment with that version
(default: the newest) before everything of the present one, so that processes that tests start have it, too. The lake is
left out: its extensions exist for the pinned version alone.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
TESTS = ("tests/store", "tests/archives", "tests/cli/test_keeping.py", "tests/cli/test_kill_then_verb.py")

OF_THE_LAKE = ("tests/store/test_lake.py", "tests/store/test_torn_catalogue.py", "tests/store/lake")


def environment(folder: Path, requirement: str) -> Path:
    """Make the environment; return its Python."""
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    site = Path(
        subprocess.run(
            [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.strip()
    )
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(site), requirement]
    subprocess.run(pip, check=True)
    # Behind its own packages: the checkout, with what a wheel packs inside the package, and what is installed already.
    (site / "checkout.pth").write_text(f"{CHECKOUT}\n{sysconfig.get_path('purelib')}\n")
    return python


def main() -> int:
    version, arguments = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("", [])
    with tempfile.TemporaryDirectory() as folder:
        python = environment(Path(folder), f"duckdb=={version}" if version else "duckdb")
        subprocess.run([python, "-c", "import duckdb; print('DuckDB', duckdb.__version__)"], check=True)
        command = [
            python,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            *(f"--ignore={file}" for file in OF_THE_LAKE),
        ]
        return subprocess.run([*command, *(arguments or TESTS)], cwd=CHECKOUT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
