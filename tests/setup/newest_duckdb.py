"""Run the whole suite against another version of DuckDB than the pinned one: what differs, and nothing else.

``python tests/setup/newest_duckdb.py [VERSION] [PYTEST ARGUMENTS...]`` makes an environment with that version
(default: the newest) before everything of the present one, so that processes that tests start have it, too. The lake is
left out: its extensions exist for the pinned version alone. A test that fails is printed at once, with its fault: of a
run that is broken off, what it saw stays. It ends with status 1 where a test fails that is not in ``DIFFERENT``, and
where one of these passes: then the list is out of date.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path

import duckdb
import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
HERE = "--here"  # run pytest in this process, which has the other version

OF_THE_LAKE = (
    "tests/store/test_lake.py",
    "tests/store/test_torn_catalogue.py",
    "tests/store/test_object_store.py",
    "tests/store/lake",
)
# What a wheel holds is no matter of the engine, and the checkout is found here by its path alone.
OF_THE_WHEEL = ("tests/test_wheel.py",)

# Tests that fail with DuckDB 2.0, by their beginnings, and why (docs/reliability.md).
DIFFERENT = {
    "tests/cli/test_attacks.py::test_a_full_disk_in_a_migration_ends_in_words_and_loses_nothing[8000]":
        "2.0 writes views otherwise",
    "tests/archives/test_archives.py::test_archive_opens_and_holds_what_it_held[": "2.0 writes views otherwise",
    "tests/cli/test_kill_then_verb.py::test_a_file_that_lost_rows_from_an_index_is_repaired_when_it_is_opened":
        "2.0 loses none",
    "tests/cli/test_kill_then_verb.py::test_verify_names_an_index_that_lost_rows": "2.0 loses none",
    "tests/store/test_foreign_log.py::test_duckdb_itself_mixes_them": "2.0 refuses the log of another file itself",
    "tests/store/test_foreign_log.py::test_a_log_that_ends_in_zeros_is_replayed_as_one_that_is_cut_off[behind the h":
        "2.0 takes zeros behind the head of a log for no log",
    "tests/store/test_half_a_block.py::test_duckdb_1_5_half_a_block_without_its_header_damages_the_state_before":
        "2.0 keeps the state before",
    "tests/store/test_incremental.py::test_a_backup_of_every_release_is_put_back[": "2.0 writes views otherwise",
    "tests/store/test_retention.py::test_compaction_gives_the_room_back_and_changes_no_row": "2.0 gives back less",
    "tests/store/test_schema.py::test_the_fingerprint_is_that_of_the_migrations": "the fingerprint is that of 1.5",
}  # fmt: skip


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


class AtOnce:
    """Print each test that fails when it fails, and remember which ran."""

    def __init__(self) -> None:
        self.ran: set[str] = set()
        self.failed: set[str] = set()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.ran.add(report.nodeid)
        if report.failed:
            self.failed.add(report.nodeid)
            known = [why for begin, why in DIFFERENT.items() if report.nodeid.startswith(begin)]
            text = known[0] if known else report.longreprtext
            print(f"\n{report.nodeid}: {text}", file=sys.__stdout__, flush=True)


def run_here(arguments: list[str]) -> int:
    """Run pytest with the DuckDB of this process; return the status."""
    watch = AtOnce()
    status = pytest.main(
        [
            "-p",
            "no:cacheprovider",
            "--tb=short",
            *(f"--ignore={file}" for file in (*OF_THE_LAKE, *OF_THE_WHEEL)),
            *arguments,
        ],
        plugins=[watch],
    )
    listed = {name for name in watch.ran if name.startswith(tuple(DIFFERENT))}
    fresh, gone = sorted(watch.failed - listed), sorted(listed - watch.failed)
    print(f"DuckDB {duckdb.__version__}: {len(watch.ran)} tests, {len(watch.failed)} differ")
    for name in fresh:
        print(f"not in the list: {name}")
    for name in gone:
        print(f"in the list, and passed: {name}")
    return 1 if fresh or gone or status not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED) else 0


def main() -> int:
    if sys.argv[1:2] == [HERE]:
        return run_here(sys.argv[2:])
    version, arguments = (sys.argv[1], sys.argv[2:]) if len(sys.argv) > 1 else ("", [])
    with tempfile.TemporaryDirectory() as folder:
        python = environment(Path(folder), f"duckdb=={version}" if version else "duckdb")
        at_once = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
        command = [python, "-u", __file__, HERE, *at_once, *arguments]
        return subprocess.run(command, cwd=CHECKOUT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
