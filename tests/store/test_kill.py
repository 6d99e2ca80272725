"""A process killed in the middle of imports leaves a database that opens, each campaign whole or not there."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from monitor.records import Campaign
from monitor.store import Database, import_campaign, load_campaign, verify_audit

#: Imports campaigns without end and says which were acknowledged.
_IMPORT = """
import dataclasses, pickle, sys
from monitor.store import Database, import_campaign
path, campaign, start = sys.argv[1], pickle.load(open(sys.argv[2], "rb")), int(sys.argv[3])
with Database(path) as db:
    for number in range(start, start + 100000):
        import_campaign(db, dataclasses.replace(campaign, name=f"campaign {number}"))
        print(number, flush=True)
"""


def test_kills_in_the_middle_of_imports(
    path: Path, tmp_path: Path, make_campaign: Callable[..., Campaign], thorough: bool
) -> None:
    campaign = make_campaign(files=(("probings.csv", b"0123456789" * 20000),))
    (tmp_path / "campaign.pickle").write_bytes(pickle.dumps(campaign))
    acknowledged: set[int] = set()
    for attempt in range(4 if thorough else 2):
        start = attempt * 1000
        with subprocess.Popen(
            [sys.executable, "-c", _IMPORT, str(path), str(tmp_path / "campaign.pickle"), str(start)],
            stdout=subprocess.PIPE,
            text=True,
        ) as process:
            assert process.stdout is not None
            # A different number of imports each time, so that the kills fall at different places.
            seen = [int(process.stdout.readline()) for _ in range(3 + 4 * attempt)]
            process.send_signal(signal.SIGKILL)
            seen += [int(line) for line in process.stdout if line.endswith("\n")]
        assert process.returncode == -signal.SIGKILL
        acknowledged |= set(seen)
        with Database(path) as db:
            assert verify_audit(db).faults == ()
            there = {int(name.split()[1]) for (name,) in db.rows("SELECT campaign FROM campaign")}
            assert acknowledged <= there
            # At most the one import under way was committed without having been acknowledged.
            assert len(there - acknowledged) <= attempt + 1
            for number in there:
                stored = load_campaign(db, f"campaign {number}")
                assert stored.files == campaign.files
                assert len(stored.probings) == len(campaign.probings)
            for table, rows in (("run", 2), ("probing", 6), ("source_file", 1), ("audit", 1)):
                assert db.rows(f"SELECT count(*) FROM {table}") == [(rows * len(there),)]
    with Database(path) as db:
        assert import_campaign(db, make_campaign("after")).state == "imported"
