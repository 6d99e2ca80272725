"""Files that would exhaust the machine, damaged databases, planted links: refused in words, nothing overwritten."""

from __future__ import annotations

import gzip
import os
import resource
import shutil
import stat
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pytest

from monitor.readers import read_campaign
from monitor.readers.doubts.doubts import doubts
from monitor.workflow.identify.fitting import machine_fit

ARCHIVE = Path(__file__).parents[1] / "archives" / "monitor-0.1.0.duckdb.gz"


@pytest.fixture
def folder(examples: Path, tmp_path: Path) -> Path:
    """A campaign folder of the test's own."""
    return Path(shutil.copytree(examples / "cold-cold", tmp_path / "cold-cold"))


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def pipe(path: Path) -> None:
    os.mkfifo(path)


def huge(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(6 * 1024**3)


@pytest.mark.parametrize("what", [endless, pipe, huge])
@pytest.mark.parametrize("file", ["campaign.toml", "probings.csv"])
def test_a_folder_exhausts_neither_memory_nor_time(
    typed: Any, folder: Path, tmp_path: Path, what: Any, file: str
) -> None:
    (folder / file).unlink()
    what(folder / file)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    said = typed("import", folder, db=tmp_path / "new.duckdb")
    assert said.status == 2
    assert "not a regular file" in said.err or "is larger than" in said.err
    # What was read is bounded, and has been freed: the process never had a gigabyte more than before.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1e6


@pytest.mark.parametrize("what", [endless, pipe, huge])
def test_files_named_beside_are_read_within_limits(typed: Any, db: Path, tmp_path: Path, what: Any) -> None:
    file = tmp_path / "named"
    what(file)
    for words in (
        ("certificate", "issue", "cold-cold", "--run", 1, "--laboratory", file),
        ("certificate", "verify", file),
        ("report", "--mail", file),
    ):
        said = typed(*words, db=db)
        assert (said.status, said.out) == (2, ""), words
        assert "not a regular file" in said.err or "is larger than" in said.err


def test_a_run_of_many_rows_is_looked_at_within_bounded_memory(examples: Path) -> None:
    """All pairs of 20 000 rows would take 3 GB for one array; a million, 9 TB."""
    from dataclasses import replace

    campaign = read_campaign(examples / "cold-cold")
    rows = np.arange(20_000) % len(campaign.probings.run)
    probings = replace(
        campaign.probings,
        run=np.full(len(rows), campaign.runs[0].run),
        sequence=np.arange(len(rows)),
        time=campaign.probings.time[rows],
        target=campaign.probings.target[rows],
        readings={axis: values[rows] for axis, values in campaign.probings.readings.items()},
        channels={name: values[rows] for name, values in campaign.probings.channels.items()},
    )
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    doubts(replace(campaign, probings=probings))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 0.5e6


#: Runs a verb and says how much memory this process alone took at most, in kB.
MEASURED = """
import re, sys
from monitor.cli import main
status = main(["--db", *sys.argv[1:]])
print("took", re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])
raise SystemExit(status)
"""


def _with_rows(folder: Path, count: int) -> None:
    """The touches of a campaign's first run again and again, 1 µm of noise, one of them off by 5 mm."""
    rows = (folder / "probings.csv").read_text().splitlines()
    of_first = [row.split(",") for row in rows[1:] if row.startswith("1,")]
    noise = np.random.default_rng(3).normal(0.0, 1e-3, (count, 3))
    with (folder / "probings.csv").open("w") as file:
        print(rows[0], file=file)
        for number, off in enumerate(noise.tolist()):
            touch = of_first[number % len(of_first)]
            off[1] += 5.0 * (number == count // 2)
            read = [f"{float(cell) + part:.6f}" for cell, part in zip(touch[4:7], off, strict=True)]
            print(1, number + 1, float(number), touch[3], *read, *touch[7:], sep=",", file=file)
    (folder / "runs.csv").write_text("".join((folder / "runs.csv").read_text().splitlines(True)[:2]))


def _says_within(most_bytes: float, rows: int, shop: Path, words: Sequence[str], said: str) -> None:
    measured = subprocess.run(
        [sys.executable, "-c", MEASURED, str(shop), *words], capture_output=True, text=True, check=False
    )
    assert measured.returncode == 0, measured.stderr
    assert said in measured.stdout
    assert f"run 1: sequence {rows // 2 + 1}, ball" in measured.stdout + measured.stderr
    assert int(measured.stdout.rpartition("took ")[2]) * 1024 < most_bytes


def _import_within(most_bytes: float, rows: int, folder: Path, shop: Path) -> None:
    _with_rows(folder, rows)
    _says_within(most_bytes, rows, shop, ("import", str(folder)), f"imported, 1 run, {rows} probings")


@pytest.mark.slow
def test_a_hundred_thousand_rows_in_one_run_are_imported_within_their_memory(
    folder: Path, tmp_path: Path
) -> None:
    _import_within(0.5e9, 100_000, folder, tmp_path / "shop.duckdb")


@pytest.mark.all_seeds
def test_a_million_rows_in_one_run_are_imported_and_identified_within_a_gigabyte(
    folder: Path, tmp_path: Path
) -> None:
    """The model of all rows at once took 6.9 GB."""
    shop = tmp_path / "shop.duckdb"
    _import_within(1e9, 999_990, folder, shop)
    _says_within(1e9, 999_990, shop, ("identify", folder.name, "--run", "1"), "EXX")


@pytest.mark.parametrize("verb", ["compare", "explain", "uncertainty"])
def test_a_verb_that_needs_more_memory_than_there_is_says_so(
    typed: Any, db: Path, verb: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel would end the process without a word."""
    monkeypatch.setattr("monitor.methods.chain.memory.SMALL", 1e6)
    monkeypatch.setattr("monitor.methods.chain.memory.free_memory", lambda: 2e6)
    # Not what another test fitted (computed_once).
    monkeypatch.setattr("monitor.workflow.uncertainty.evaluation.machine_fit", machine_fit)
    said = typed(verb, "cold-cold", db=db)
    assert (said.status, said.out) == (2, "")
    assert "1320 rows at once takes some" in said.err
    assert said.err.count("\n") == 1


def test_a_setting_of_another_kind_is_refused(typed: Any, db: Path, tmp_path: Path) -> None:
    mail = tmp_path / "mail.toml"
    mail.write_text('[mail]\nserver = "a"\nfrom = "a@b.c"\nto = ["a@b.c"]\nsecurity = []\n')
    said = typed("report", "--mail", mail, db=db)
    assert said.status == 2
    assert "security must be a str, but is []" in said.err


@pytest.mark.parametrize("damage", ["flipped", "cut"])
def test_a_damaged_database_is_said_to_be_one(typed: Any, db: Path, damage: str) -> None:
    content = bytearray(db.read_bytes())
    if damage == "flipped":
        # A byte in every block: the checksum of whichever is read no longer fits.
        content[20000::40000] = bytes(byte ^ 0x55 for byte in content[20000::40000])
    else:
        del content[-200_000:]
    db.write_bytes(content)
    for words in (("verify",), ("runs", "cold-cold"), ("identify", "cold-cold")):
        said = typed(*words, db=db)
        assert (said.status, said.out) == (2, ""), (words, said)
        assert "restore a backup" in said.err


@pytest.mark.parametrize("name", ["a\0b.duckdb", "folder\0/b.duckdb"])
def test_a_nul_in_the_name_of_a_database(typed: Any, name: str) -> None:
    said = typed("campaigns", "--db", name)
    assert said.status == 2
    assert said.err.count("\n") == 1


@pytest.mark.parametrize("words", [("export",), ("backup",), ("report", "--out"), ("archive",), ("import",)])
def test_a_nul_in_any_name_is_refused_in_words(typed: Any, db: Path, words: tuple[str, ...]) -> None:
    said = typed(*words, "a\0b", db=db)
    assert (said.status, said.out) == (2, "")
    assert "holds a character NUL" in said.err


@pytest.mark.parametrize("what", [endless, pipe, huge])
def test_a_token_is_read_within_limits(typed: Any, tmp_path: Path, what: Any) -> None:
    """Nobody is waited for who might write into a pipe."""
    what(tmp_path / "token")
    said = typed("campaigns", "--server", "http://127.0.0.1:1", "--server-token", tmp_path / "token")
    assert said.status == 2
    assert "not a regular file" in said.err or "is larger than" in said.err


def test_a_pipe_as_database_is_refused_at_once(typed: Any, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    said = typed("campaigns", db=tmp_path / "pipe")
    assert said.status == 2
    assert "is a pipe or device, not a file" in said.err


@pytest.mark.parametrize("kilobytes", [*(pytest.param(k, marks=pytest.mark.slow) for k in (100, 7000)), 8000])
def test_a_full_disk_in_a_migration_ends_in_words_and_loses_nothing(
    typed: Any, tmp_path: Path, environment: dict[str, str], kilobytes: int
) -> None:
    """Room for the log alone, or for a part of the checkpoint: whoever comes next with room finishes it."""
    path = tmp_path / "old.duckdb"
    path.write_bytes(gzip.decompress(ARCHIVE.read_bytes()))
    code = (
        "import resource, sys; from monitor.cli import main\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({kilobytes * 1024}, resource.RLIM_INFINITY))\n"
        "sys.exit(main(sys.argv[1:]))"
    )
    said = subprocess.run(
        [sys.executable, "-c", code, "--db", str(path), "campaigns"],
        capture_output=True, text=True, env=environment, check=False,
    )  # fmt: skip
    assert said.returncode in (0, 2), said.stderr
    assert "fault of the software" not in said.stderr
    assert typed("verify", db=path).status == 0


def test_show_writes_over_nothing_and_follows_no_planted_link(
    typed: Any, issued: Any, tmp_path: Path
) -> None:
    other = tmp_path / "other.pdf"
    other.write_bytes(issued.file("2026-0002").read_bytes())
    for option in ("--pdf", "--remake"):
        said = typed("certificate", "show", "2026-0001", option, other, db=issued.db)
        assert said.status == 2
        assert "is there already, with other content" in said.err
    assert other.read_bytes() == issued.file("2026-0002").read_bytes()
    victim, named = tmp_path / "victim", tmp_path / "named.pdf"
    victim.write_text("of somebody else")
    (tmp_path / "named.pdf.part").symlink_to(victim)
    assert typed("certificate", "show", "2026-0001", "--pdf", named, db=issued.db).status == 0
    assert victim.read_text() == "of somebody else"
    assert named.read_bytes() == issued.file("2026-0001").read_bytes()
    # The same again is no other content.
    assert typed("certificate", "show", "2026-0001", "--pdf", named, db=issued.db).status == 0
    noted = "0" * 64
    said = typed("certificate", "verify", named, "--expect", noted, db=issued.db)
    assert said.status == 1
    assert "not the one noted elsewhere" in said.out


def test_csv_runs_no_formula_in_a_spreadsheet(typed: Any, db: Path, tmp_path: Path) -> None:
    with duckdb.connect(str(db)) as connection:
        connection.execute("UPDATE registered_machine SET machine = '=cmd|x'")
    said = typed("sql", "--csv", "SELECT '=cmd|x' AS a, -1 AS b, '@SUM(1)' AS c", db=db)
    assert said.out.splitlines()[1] == "'=cmd|x,-1,'@SUM(1)"
    assert typed("export", tmp_path / "out", db=db).status == 0
    assert "'=cmd|x" in (tmp_path / "out" / "registered_machine.csv").read_text()


@pytest.mark.parametrize("text", [" =cmd|x", "\u00a0=cmd|x", "\t=cmd|x", "\n+1", " -2+3|x"])
def test_csv_runs_no_formula_behind_spaces(typed: Any, db: Path, tmp_path: Path, text: str) -> None:
    """A program that trims a cell would find the formula."""
    with duckdb.connect(str(db)) as connection:
        connection.execute("UPDATE registered_machine SET machine = ?", [text])
    said = typed("sql", "--csv", "SELECT machine, 1 AS b FROM registered_machine", db=db)
    assert f"'{text}" in said.out
    assert typed("export", tmp_path / "out", db=db).status == 0
    assert f"'{text}" in (tmp_path / "out" / "registered_machine.csv").read_text()


def test_an_export_that_was_killed_does_not_hinder_the_next(typed: Any, db: Path, tmp_path: Path) -> None:
    left = tmp_path / "out.partial"
    left.mkdir()
    (left / ".unfinished-export").touch()
    (left / "audit.csv").write_text("half")
    assert typed("export", tmp_path / "out", db=db).status == 0
    assert not left.exists()
    assert not (tmp_path / "out" / ".unfinished-export").exists()
    # A folder of that name which no export made is left as it is.
    (tmp_path / "two.partial").mkdir()
    (tmp_path / "two.partial" / "mine").write_text("mine")
    assert typed("export", tmp_path / "two", db=db).status == 2
    assert (tmp_path / "two.partial" / "mine").read_text() == "mine"


def test_a_backup_is_read_by_those_who_read_the_database(typed: Any, db: Path, tmp_path: Path) -> None:
    db.chmod(0o600)
    assert typed("backup", tmp_path / "copy.duckdb", db=db).status == 0
    assert stat.S_IMODE((tmp_path / "copy.duckdb").stat().st_mode) == 0o600
    assert typed("restore", tmp_path / "copy.duckdb", db=tmp_path / "again.duckdb").status == 0
    assert stat.S_IMODE((tmp_path / "again.duckdb").stat().st_mode) == 0o600


def test_verify_recomputes_and_knows_an_anchor(typed: Any, db: Path) -> None:
    first = typed("verify", "--json", db=db).document["last_sha256"]
    assert typed("identify", "cold-cold", db=db).status == 0
    said = typed("verify", "--json", "--anchor", first, db=db).document
    assert (said["ok"], said["recomputed"]) == (True, 1)
    assert (
        said["anchored_entry"] == said["entries"] - 2 if said["entries"] > 4 else said["anchored_entry"] >= 3
    )
    lost = typed("verify", "--anchor", "ab" * 32, db=db)
    assert lost.status == 1
    assert "which was kept elsewhere" in lost.out
    assert typed("verify", "--anchor", "ab", db=db).status == 2


def test_audit_names_the_entry_that_was_edited_removed_or_put_elsewhere(typed: Any, db: Path) -> None:
    assert "every entry of the audit is in its place" in typed("audit", "--check", db=db).out
    changes = {
        "UPDATE audit SET actor = 'nobody' WHERE entry = 2": "audit entry 2 was altered: it was edited",
        "DELETE FROM audit WHERE entry = 2": "audit entry 2 is missing",
        "UPDATE audit SET entry = 7 - entry WHERE entry IN (1, 2, 3)": "and put elsewhere",
        "DELETE FROM audit WHERE entry = (SELECT max(entry) FROM audit)": "is in the database, but not in the audit",
        "DELETE FROM audit": "campaign cold-cold is in the database, but not in the audit",
    }
    for change, fault in changes.items():
        shutil.copyfile(db, db.with_name("changed.duckdb"))
        with duckdb.connect(str(db.with_name("changed.duckdb"))) as connection:
            connection.execute(change)
        said = typed("audit", "--check", db=db.with_name("changed.duckdb"))
        assert said.status == 1
        assert fault in said.out, (change, said.out)


def test_a_passphrase_that_all_may_read_is_warned_of(typed: Any, db: Path, tmp_path: Path) -> None:
    secret = tmp_path / "passphrase"
    secret.write_text("x\n")
    words = (
        "certificate",
        "issue",
        "cold-cold",
        "--run",
        1,
        "--laboratory",
        "none.toml",
        "--sign",
        "none.p12",
    )
    for mode, warned in ((0o644, True), (0o600, False)):
        secret.chmod(mode)
        said = typed(*words, "--passphrase-file", secret, db=db)
        assert said.status == 2
        assert ("may be read by others than its owner" in said.err) is warned


def test_a_password_or_token_that_all_may_read_is_warned_of(typed: Any, db: Path, tmp_path: Path) -> None:
    secret, mail = tmp_path / "password", tmp_path / "mail.toml"
    secret.write_text("hunter2\n")
    mail.write_text(
        '[mail]\nserver = "127.0.0.1"\nport = 1\nsecurity = "tls"\nuser = "x"\npassword_file = "password"\n'
        'from = "a@example.org"\nto = ["b@example.org"]\n'
    )
    asked = (
        (("report", "--week", "2026-W60", "--out", tmp_path / "out", "--mail", mail), db),
        (("campaigns", "--server", "http://127.0.0.1:1", "--server-token", secret), None),
    )
    for words, database in asked:
        for mode, warned in ((0o644, True), (0o600, False)):
            secret.chmod(mode)
            said = typed(*words, db=database)
            assert said.status == 2
            assert (f"{secret} holds a secret and may be read by others" in said.err) is warned, said.err
            assert "hunter2" not in said.err + said.out
