"""From files in foreign formats, written by a simulator that shares no code with the readers, to the truth.

The readings of one machine are written as laser, ball-bar, R-test, macro, CMM and tracker files, imported by their
mapping, and identified: every parameter lies within three standard uncertainties of what was simulated.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from monitor.cli import main
from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.store import Database, campaign_notes, load_campaign
from monitor.workflow.identify.identify import IdentifyRequest, identify
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.measured import load_measured
from tests.simulator import exports, four_instruments as shop

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("files-as-they-come", "files-of-a-plate")
#: The truth in the units of the answers; the machine names the squareness of X and Y by X.
TRUTH = {name: 1e3 * value if name in ("EX0C", "EY0C") else 1e6 * value for name, value in shop.TRUTH.items()}
TRUTH["EC0X"] = -TRUTH["EC0Y"]


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path / "own.duckdb") as opened:
        yield opened


def only(folder: Path, setups: tuple[str, ...], target: Path) -> Path:
    """A copy of a folder with the tables of these setups alone."""
    shutil.copytree(folder, target)
    head, *tables = re.split(r"\n(?=\[\[)", (folder / "mapping.toml").read_text(encoding="utf-8"))
    kept = [table for table in tables if any(f'"{setup}"' in table for setup in setups)]
    (target / "mapping.toml").write_text("\n".join([head, *kept]), encoding="utf-8")
    return target


ALL = {"EX0C", "EY0C", "EA0C", "EB0C", "EC0X", "EA0Z", "EB0Z", "EXX", "EYY", "EZZ"}
OF_A_GRID = {"EC0X", "EA0Z", "EB0Z", "EXX", "EYY", "EZZ"}


def assert_true(db: Database, folder: Path, campaign: str, expected: set[str]) -> None:
    """Import a folder, identify, and compare with what was simulated."""
    import_folders(db, ImportRequest([folder]))
    run = identify(db, IdentifyRequest(campaign)).runs[0]
    assert run.parameters.keys() >= expected
    for name in expected:
        parameter = run.parameters[name]
        assert abs(parameter.value - TRUTH[name]) < 3.0 * parameter.u, name


def test_the_truth_comes_back_from_all_files_together(db):
    assert_true(db, EXAMPLES / NAMES[0], NAMES[0], ALL)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize(
    ("writer", "expected"), [(exports.write_instruments, ALL), (exports.write_plate, OF_A_GRID)]
)
def test_the_truth_comes_back_with_any_noise(db, tmp_path, writer, expected, seed):
    writer(tmp_path / "written", seed=seed)
    assert_true(db, tmp_path / "written", "written", expected)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setups", "expected"),
    [
        (("laser-X", "laser-Y", "laser-Z"), {"EXX", "EYY", "EZZ"}),
        (("bar-xy", "bar-yz", "bar-zx"), {"EC0X", "EXX", "EYY", "EZZ"}),
    ],
)
def test_the_truth_comes_back_from_laser_and_bar_alone(db, tmp_path, setups, expected):
    assert_true(db, only(EXAMPLES / NAMES[0], setups, tmp_path / "alone"), NAMES[0], expected)


@pytest.mark.parametrize(
    ("folder", "setup", "expected"),
    [
        (NAMES[0], "r-test", {"EA0C", "EB0C"}),
        (NAMES[1], "plate-qif", OF_A_GRID),
        (NAMES[1], "plate-dfq", OF_A_GRID),
        (NAMES[1], "plate-probed", {"EC0X", "EXX", "EYY"}),
        (NAMES[1], "tracker", OF_A_GRID),
    ],
)
def test_the_truth_comes_back_from_each_file_alone(db, tmp_path, folder, setup, expected):
    assert_true(db, only(EXAMPLES / folder, (setup,), tmp_path / "alone"), folder, expected)


def test_the_examples_are_those_of_the_simulator(tmp_path):
    exports.write_examples(tmp_path)
    for name in NAMES:
        for file in sorted((EXAMPLES / name).iterdir()):
            # Sines differ in the last bit between processors; the files round to 10 nm.
            assert len((tmp_path / name / file.name).read_bytes()) == pytest.approx(
                len(file.read_bytes()), abs=9
            )


def test_a_macro_that_prints_is_read_to_the_last_digit():
    campaign = read_campaign(EXAMPLES / NAMES[0])
    rows = campaign.probings.channels["setup"] == 1 + [s.id for s in campaign.artefact.setups].index("square")
    lines = (EXAMPLES / NAMES[0] / "square.prn").read_text(encoding="ascii").splitlines()[3:-1]
    printed = np.array([[float(word[1:]) for word in line.split()] for line in lines])
    np.testing.assert_array_equal(campaign.probings.readings["Z"][rows], printed[:, 0])
    np.testing.assert_allclose(
        campaign.probings.channels["reading_um"][rows], 1e3 * printed[:, 1], rtol=1e-15
    )


def test_a_dry_run_says_all_and_stores_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = str(EXAMPLES / NAMES[0])
    assert main(["--db", "new.duckdb", "import", folder, "--dry-run", "--json"]) == 0
    (answer,) = json.loads(capsys.readouterr().out)["imported"]
    assert answer["state"] == "not stored"
    assert list(tmp_path.iterdir()) == []
    assert [file["file"] for file in answer["understood"]] == [
        *(f"laser-{axis}.rtl" for axis in "XYZ"), *(f"bar-{plane}.bar" for plane in ("xy", "yz", "zx")),
        "r-test.csv", "square.prn",
    ]  # fmt: skip
    r_test = answer["understood"][6]
    assert r_test["layout"] == "Windows-1252, cells separated by semicolons, decimal comma"
    assert (r_test["setup"], r_test["rows"], r_test["started"]) == ("r-test", 25, "03.03.2026 10:15")
    columns = {column["column"]: column for column in r_test["columns"]}
    assert columns["c_deg"]["source"] == "column C in deg"
    assert (columns["c_deg"]["smallest"], columns["c_deg"]["largest"]) == (0.0, 360.0)
    assert columns["c_deg"]["moves"] == "25 positions, once up, never down"
    # An ordinary campaign folder can be looked at, too.
    assert main(["--db", "new.duckdb", "import", str(EXAMPLES / "r-test"), "--dry-run"]) == 0
    assert "r-test: understood, 1 run, 25 probings; nothing was stored" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == []


def test_files_and_mapping_are_stored_byte_for_byte(db, tmp_path):
    folder = EXAMPLES / NAMES[0]
    mapping = tmp_path / "shop.toml"
    shutil.copy(folder / "mapping.toml", mapping)
    files = [path for path in folder.iterdir() if path.suffix in (".rtl", ".bar", ".csv", ".prn")]
    request = ImportRequest([*files, folder / "README.md"], mapping=mapping, campaign="week-12")
    (imported,) = import_folders(db, request).imported
    assert (imported.campaign, imported.state) == ("week-12", "imported")
    stored = dict(db.rows("SELECT file, sha256(content) FROM source_file"))
    assert stored.keys() == {"shop.toml", *(path.name for path in files)}
    assert {file.file: file.sha256 for file in imported.understood}.items() <= stored.items()
    assert campaign_notes(db, "week-12") == (
        "README.md is named by no [[exports]] of the mapping and was not read",
    )
    (again,) = import_folders(db, request).imported
    assert again.state == "unchanged"


@pytest.mark.parametrize(
    ("end", "told"),
    [("", r"laser-X\.rtl, line 62: .* the file is cut here"), ("\n", "run-count: 5 runs are announced and")],
)
def test_a_refusal_of_files_is_recorded_under_their_mapping(db, tmp_path, end, told):
    folder = tmp_path / "cut"
    shutil.copytree(EXAMPLES / NAMES[0], folder)
    text = (folder / "laser-X.rtl").read_text(encoding="ascii")
    half = text[: len(text) // 2]
    (folder / "laser-X.rtl").write_text(half[: half.rindex(end)] + end if end else half, encoding="ascii")
    with pytest.raises(CampaignError, match=told):
        import_folders(db, ImportRequest([folder]))
    assert db.rows("SELECT campaign FROM v_refused_imports") == [(NAMES[0],)]


def test_a_stored_campaign_names_the_row_of_its_own_file_and_keeps_the_hashes_of_a_folder(tmp_path, db):
    """The files are not loaded to identify a folder; what is said of rows, and certificates, rest on them."""
    folder = tmp_path / "lasers"
    shutil.copytree(EXAMPLES / NAMES[0], folder)
    lines = (folder / "laser-X.rtl").read_text().splitlines()
    lines[59] = " ".join([*lines[59].split()[:2], "999.00"])
    (folder / "laser-X.rtl").write_text("\n".join(lines) + "\n")
    import_folders(db, ImportRequest((str(folder), str(EXAMPLES / "r-test"))))
    answer = identify(db, IdentifyRequest(NAMES[0]))
    assert "correct or remove line 60 of laser-X.rtl" in answer.runs[0].note
    light, whole = load_measured(db, "r-test"), load_campaign(db, "r-test")
    assert [file.content for file in light.files] == [b""] * 3
    assert [(file.name, file.sha256) for file in light.files] == [
        (file.name, file.sha256) for file in whole.files
    ]
