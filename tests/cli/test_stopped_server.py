"""A server that is stopped as services are (SIGTERM) closes its database and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from monitor.cli import main
from monitor.store import Database


def test_a_server_stopped_by_sigterm_closes_its_database(
    tmp_path: Path, examples: Path, environment: dict[str, str]
) -> None:
    database, temporary = tmp_path / "shop.duckdb", tmp_path / "temporary"
    temporary.mkdir()
    assert main(["--db", str(database), "import", str(examples / "cold-cold")]) == 0
    server = subprocess.Popen(
        [sys.executable, "-m", "monitor", "--db", str(database), "serve", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment, "TMPDIR": str(temporary)},
    )
    assert server.stdout is not None
    assert "is served at" in server.stdout.readline()
    # Asked of the server, since its note lies beside the file: its log has something to be brought in.
    assert main(["--db", str(database), "event", "HU40-T", "x", "--at", "2026-03-05T07:00:00Z"]) == 0
    assert Path(f"{database}.wal").stat().st_size > 0
    server.send_signal(signal.SIGTERM)
    server.communicate()
    assert server.returncode == 0
    assert sorted(path.name for path in tmp_path.glob("shop*")) == ["shop.duckdb", "shop.duckdb.lock"]
    assert list(temporary.iterdir()) == []
    with Database(database, read_only=True) as db:
        assert db.rows("SELECT count(*) FROM event") == [(1,)]
