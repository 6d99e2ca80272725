"""Files of instruments from Python: looked at, then imported under a name of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest

import monitor
from monitor.exceptions import InputError

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "files-of-a-plate"


def test_files_are_looked_at_and_imported_by_their_mapping(tmp_path: Path) -> None:
    files = [path for path in FOLDER.iterdir() if path.name not in ("README.md", "mapping.toml")]
    with monitor.open(tmp_path / "own.duckdb", new=True) as db:
        (seen,) = db.add(*files, mapping=FOLDER / "mapping.toml", campaign="plates", dry_run=True).to_dict()[
            "imported"
        ]
        assert (seen["state"], seen["probings"]) == ("not stored", 84)
        assert [file["format"] for file in seen["understood"]] == ["qif", "q-das", "probing log", "table"]
        assert len(db.campaigns()) == 0
        db.add(*files, mapping=FOLDER / "mapping.toml", campaign="plates")
        assert list(db.campaigns()["campaign"]) == ["plates"]
        with pytest.raises(InputError, match="campaign names what files of instruments make together"):
            db.add(FOLDER, campaign="plates")
