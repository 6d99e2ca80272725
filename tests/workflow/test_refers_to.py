"""What every parameter refers to, on every topology of the examples: in SQL, in exports, in JSON, in the DCC's names.

The rule is written here once more from the topology string alone: a location error refers to the axis before it in its
branch, counted from the bed; an error motion to its own axis.
"""

from __future__ import annotations

import csv
import json
import re
import shutil
from pathlib import Path

import pytest

from monitor.cli import main
from monitor.readers import read_campaign
from monitor.store import Database
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
#: An example of every topology.
NAMES = ("five-days", "tilting-table", "free-form-pins", "free-form-pocket", "l-shape")


def branches(topology: str) -> list[list[str]]:
    """Axes of both branches from the bed outwards."""
    work, tool = topology.split(" b ")
    return [work.split()[:0:-1], [name.strip("()") for name in tool.split()[:-1]]]


def expected(symbol: str, topology: str) -> str | None:
    """What an error of a chain refers to by the rule above; None for what is no error of the chain."""
    location = re.fullmatch(r"E[XYZABC]0([XYZABC]1?)([:(].*)?", symbol)
    motion = re.fullmatch(r"E[XYZABC]([XYZABC]1?)([:(].*)?", symbol)
    if location is None:
        return None if motion is None else f"axis {motion[1]} itself"
    (branch,) = (axes for axes in branches(topology) if location[1] in axes)
    place = branch.index(location[1])
    return "machine" if place == 0 else f"axis {branch[place - 1]}"


def test_the_examples_have_no_other_topology() -> None:
    texts = [path.read_text(encoding="utf-8") for path in EXAMPLES.glob("*/campaign.toml")]
    written = {match[1] for text in texts if (match := re.search(r'^topology = "(.*)"', text, re.MULTILINE))}
    assert written == {read_campaign(EXAMPLES / name).machine.topology for name in NAMES}


@pytest.fixture(scope="module")
def identified_examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("refers") / "m.duckdb"
    with Database(path) as db:
        import_folders(db, ImportRequest([EXAMPLES / name for name in NAMES]))
        for name in NAMES:
            identify(db, IdentifyRequest(name))
    return path


def test_views_and_csv_say_it_on_every_topology(identified_examples: Path, tmp_path: Path) -> None:
    assert (
        main(["--db", str(identified_examples), "export", str(tmp_path / "out"), "--tables", "v_parameters"])
        == 0
    )
    with (tmp_path / "out" / "v_parameters.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    topologies = {name: read_campaign(EXAMPLES / name).machine.topology for name in NAMES}
    assert {row["campaign"] for row in rows} == set(NAMES)
    chain_errors = 0
    for row in rows:
        said = expected(row["parameter"], topologies[row["campaign"]])
        assert (row["refers_to"] or None) == said, (row["campaign"], row["parameter"])
        chain_errors += said is not None
    assert chain_errors > 100


def test_the_workbook_says_it_in_both_sheets(identified_examples: Path, tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    path = tmp_path / "shop.xlsx"
    assert (
        main(
            ["--db", str(identified_examples), "export", str(path), "--tables", "parameters,parameters long"]
        )
        == 0
    )
    book = openpyxl.load_workbook(path)
    heads = [cell.value for cell in next(book["parameters long"].iter_rows(max_row=1))]
    assert any(head.startswith("refers_to") for head in heads)
    meanings = {
        row[1].value: row[2].value for row in book["about"].iter_rows() if row[0].value == "parameters"
    }
    # On `w C B X b` B hangs on X, C on B; on `w C A Y b` C hangs on A, on `w C B b` and `w C A b` too.
    assert meanings["EA0B / µrad"].endswith("refers to: axis X")
    assert meanings["EB0C / µrad"].endswith("refers to: axis A or axis B")


@pytest.mark.parametrize("name", NAMES)
def test_json_says_it(identified_examples: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    assert main(["--db", str(identified_examples), "identify", name, "--json"]) == 0
    frames = json.loads(capsys.readouterr().out)["frames"]
    topology = read_campaign(EXAMPLES / name).machine.topology
    kinds = {"machine frame": "machine", "preceding axis": "axis {}", "own axis": "axis {} itself"}
    for symbol, frame in frames.items():
        said = kinds[frame["kind"]].format(frame.get("axis"))
        assert said == expected(symbol, topology), symbol
    assert len(frames) >= 3


@pytest.mark.parametrize("verb", [("stats", "five-days"), ("trend", "HU40-T")])
def test_statistics_and_trend_say_it(
    identified_examples: Path, capsys: pytest.CaptureFixture[str], verb: tuple[str, str]
) -> None:
    assert main(["--db", str(identified_examples), *verb, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    for symbol in answer["parameters"]:
        assert answer["refers_to"].get(symbol) == expected(symbol, topology), symbol
    assert len(answer["refers_to"]) >= 10


@pytest.mark.parametrize("name", NAMES)
def test_a_map_says_what_its_parameters_and_its_vectors_refer_to(
    identified_examples: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    asked = ["--db", str(identified_examples), "map", name, "--points", "2"]
    assert main([*asked, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    topology = read_campaign(EXAMPLES / name).machine.topology
    named = [*answer["parameters"], *(left["parameter"] for left in answer["left_out"])]
    said = {symbol: expected(symbol, topology) for symbol in named}
    assert answer["refers_to"] == {symbol: frame for symbol, frame in said.items() if frame}
    assert set(answer["worst"]["by_parameter_um"]) <= set(answer["refers_to"])
    assert "relative to the workpiece, along X, Y and Z of the machine" in answer["vectors_refer_to"]


@pytest.mark.parametrize("verb", [("stats", "five-days"), ("trend", "HU40-T"), ("fleet", "--top", "0")])
def test_the_tables_say_it_in_every_row(
    identified_examples: Path, capsys: pytest.CaptureFixture[str], verb: tuple[str, ...]
) -> None:
    assert main(["--db", str(identified_examples), *verb]) == 0
    lines = capsys.readouterr().out.splitlines()
    (head,) = [line for line in lines if "relative to" in line and "unit" in line]
    left = head.index("relative to")
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    of_machine = [line for line in lines if verb[0] != "fleet" or " HU40-T " in line]
    said = {}
    for line in of_machine:
        symbol = next((word for word in line.split()[:3] if re.fullmatch(r"E[XYZABC]\w+", word)), None)
        if symbol and expected(symbol, topology):
            said[symbol] = re.split(r"\s{2,}", line[left:])[0].strip()
    assert len(said) >= 10
    assert said == {symbol: expected(symbol, topology) for symbol in said}


def test_limits_say_it(tmp_path: Path) -> None:
    folder = tmp_path / "five-days"
    shutil.copytree(EXAMPLES / "five-days", folder)
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write("\n[machine.tolerances]\nEA0C = 20.0\nEA0B = 20.0\n")
    with Database(tmp_path / "limits.duckdb") as db:
        import_folders(db, ImportRequest((folder,)))
        assert db.rows("SELECT DISTINCT refers_to FROM v_tolerances") == [(None,)]
        identify(db, IdentifyRequest("five-days"))
        limits = dict(db.rows("SELECT parameter, refers_to FROM v_tolerances"))
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    assert limits == {name: expected(name, topology) for name in ("EA0B", "EA0C")}
