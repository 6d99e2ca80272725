"""What every parameter refers to, on every topology of the examples: in SQL, in exports, in JSON, in the DCC's names.

The rule is written here once more from the topology string alone: a location error refers to the axis before it in its
branch, counted from the bed; an error motion to its own axis. Where only rotary axes carry the workpiece, the frame of
the machine is fixed to the first of them, and the tool's first axis refers to that.
"""

from __future__ import annotations

import csv
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from monitor.cli import main
from monitor.documents import from_document
from monitor.readers import read_campaign
from monitor.store import Database
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.selections.request import SideBySideAnswer

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
    of_work, of_tool = branches(topology)
    branch = of_work if location[1] in of_work else of_tool
    place = branch.index(location[1])
    if place == 0 and branch is not of_work and of_work and not set("XYZ").intersection(of_work):
        return f"axis {of_work[0]}"
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


def test_the_weekly_report_says_it_in_every_row(
    identified_examples: Path, tmp_path: Path, pdf_unread
) -> None:
    asked = ["--db", str(identified_examples), "report", "--week", "2026-W11", "--machine", "HU40-T"]
    with pdf_unread():
        assert main([*asked, "--out", str(tmp_path)]) == 0
    (page,) = tmp_path.glob("*.html")
    cells = re.findall(
        r"<td><strong>(E\w+)</strong></td>\s*<td>([^<]*)", page.read_text(encoding="utf-8"), re.DOTALL
    )
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    for symbol, words in cells:
        said = expected(symbol, topology)
        assert said is not None
        said = "machine frame" if said == "machine" else said
        ends = "in the axis&#39;s own frame" if said.endswith("itself") else said
        assert words.strip().replace("'", "&#39;").endswith(ends), (symbol, words)
    assert len(cells) == 13


def table_rows(text: str, heading: str) -> dict[str, str]:
    """What stands under "relative to" in the table whose first heading is ``heading``, by the first word of a row."""
    lines = text.splitlines()
    (number,) = [index for index, line in enumerate(lines) if line.strip().startswith(heading)]
    left = lines[number].index("relative to")
    rows = {}
    for line in lines[number + 1 :]:
        if not line.strip() or "relative to" in line:
            break
        if re.fullmatch(r"E[XYZABC][^\s:]*(:[a-z]\S*)?", line.split()[0]):
            rows[line.split()[0]] = re.split(r"\s{2,}", line[left:])[0].strip()
    return rows


def test_contributions_of_instruments_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--db", str(tmp_path / "m.duckdb")]
    assert main([*asked, "import", str(EXAMPLES / "four-instruments")]) == 0
    topology = read_campaign(EXAMPLES / "four-instruments").machine.topology
    capsys.readouterr()
    assert main([*asked, "contributions", "four-instruments"]) == 0
    printed = capsys.readouterr().out
    assert main([*asked, "contributions", "four-instruments", "--json"]) == 0
    rows = {
        row["parameter"]: row.get("refers_to") for row in json.loads(capsys.readouterr().out)["parameters"]
    }
    said = {symbol: expected(symbol, topology) for symbol in rows}
    assert rows == said
    assert len([frame for frame in said.values() if frame]) >= 10
    assert table_rows(printed, "parameter") == {symbol: frame for symbol, frame in said.items() if frame}
    assert set(table_rows(printed, "alone").items()) <= set(said.items())


def test_selections_side_by_side_say_it(
    identified_examples: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "m.duckdb"
    shutil.copy(identified_examples, path)
    asked = ["--db", str(path)]
    assert main([*asked, "select", "five-days", "--name", "first", "--where", "day <= 3"]) == 0
    capsys.readouterr()
    compared = ["select", "--compare", "first,five-days"]
    assert main([*asked, *compared]) == 0
    printed = table_rows(capsys.readouterr().out, "parameter")
    assert main([*asked, *compared, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    for scatter in document["selections"].values():
        said = {symbol: expected(symbol, topology) for symbol in scatter["units"]}
        assert scatter["refers_to"] == {symbol: frame for symbol, frame in said.items() if frame}
    assert printed == document["selections"]["first"]["refers_to"]
    assert len(printed) >= 10
    # Machines whose chains differ may stand side by side, too.
    answer = from_document(SideBySideAnswer, document)
    other = replace(answer.selections["first"], refers_to={"EB0C": "axis A"})
    both = replace(answer, selections={**answer.selections, "first": other})
    assert both.refers_to["EB0C"] == "axis A or axis B"


def test_models_and_their_history_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--db", str(tmp_path / "m.duckdb")]
    assert main([*asked, "import", str(EXAMPLES / "five-days")]) == 0
    for effect, name in (("EXX:reversal", "more"), ("EBC:harmonic2", "still-more")):
        parent = "samba" if name == "more" else "more"
        added = ["model", "add", effect, "--to", parent, "--as", name, "--campaign", "five-days"]
        assert main([*asked, *added]) == 0
    capsys.readouterr()
    assert main([*asked, "model", "show", "still-more", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    topology = read_campaign(EXAMPLES / "five-days").machine.topology
    said = {symbol: expected(symbol, topology) for symbol in (*shown["base"]["HU40-T"], *shown["effects"])}
    assert shown["refers_to"] == {"HU40-T": {name: frame for name, frame in said.items() if frame}}
    assert main([*asked, "model", "show", "still-more"]) == 0
    printed = capsys.readouterr().out
    assert "relative to axis B: EX0C EA0C EB0C" in printed
    assert printed.rstrip().endswith("relative to: axis C itself")
    assert main([*asked, "model", "history", "still-more", "--campaign", "five-days", "--json"]) == 0
    steps = json.loads(capsys.readouterr().out)
    added = [{}, {"EXX:reversal": "axis X itself"}, {"EBC:harmonic2": "axis C itself"}]
    assert [step["refers_to"] for step in steps] == added
    assert main([*asked, "model", "history", "still-more", "--campaign", "five-days"]) == 0
    lines = capsys.readouterr().out.splitlines()
    (head,) = [line for line in lines if "relative to" in line]
    (row,) = [line for line in lines if "EXX:reversal" in line]
    assert row[head.index("relative to") :].startswith("axis X itself ")


def test_a_comparison_says_whose_axes_its_residuals_are_along(
    identified_examples: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Of the ball's centre: the frame of the last axis of the workpiece; of one number along a normal: none.
    for name, axis in (("five-days", "C"), ("tilting-table", None), ("l-shape", None)):
        assert main(["--db", str(identified_examples), "compare", name, "--json"]) == 0
        said = json.loads(capsys.readouterr().out).get("refers_to")
        topology = read_campaign(EXAMPLES / name).machine.topology
        assert said == (axis and dict.fromkeys("xyz", f"axis {branches(topology)[0][-1]} itself"))
    assert main(["--db", str(identified_examples), "compare", "five-days"]) == 0
    lines = capsys.readouterr().out.splitlines()
    (number,) = [index for index, line in enumerate(lines) if "by axis" in line]
    left = lines[number].index("relative to")
    rows = [
        line[left:] for line in lines[number + 1 : number + 5] if line.split()[:1] in (["x"], ["y"], ["z"])
    ]
    assert len(rows) == 3
    assert all(row.startswith("axis C itself ") for row in rows)


def test_a_missing_effect_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--db", str(tmp_path / "m.duckdb")]
    assert main([*asked, "import", str(EXAMPLES / "hidden-reversal-x")]) == 0
    capsys.readouterr()
    assert main([*asked, "explain", "hidden-reversal-x"]) == 0
    assert "\n   relative to: axis X itself\n" in capsys.readouterr().out


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
