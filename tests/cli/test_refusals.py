"""Wrong input of every kind: status 2, one plain message that names what is wrong, nothing printed, nothing stored."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database

AT = "2026-03-05T07:00:00-05:00"
RUN = ["uncertainty", "five-days"]
ADD = ["model", "add", "EXX:reversal", "--to"]
ISSUE = ["certificate", "issue", "five-days", "--run", "20", "--laboratory"]

WRONG = [
    (["identify", "nope"], "there is no campaign 'nope'; there are cold-cold, five-days, hidden-reversal-x"),
    (["identify", ""], "there is no campaign ''"),
    (["identify", "five'days"], 'there is no campaign "five\'days"'),
    (["identify", 'five"days'], "there is no campaign 'five\"days'"),
    (["identify", "x'; DROP TABLE run; --"], "there is no campaign"),
    (["identify", "ü∂ß 日本"], "there is no campaign 'ü∂ß 日本'"),
    (["identify", "[red]x[/red]"], "there is no campaign '[red]x[/red]'"),
    (["identify", "five-days", "--run", "99"], "campaign five-days has no run 99; it has 1, 2, 3"),
    (["identify", "five-days", "--run", "-1"], "campaign five-days has no run -1"),
    (["identify", "--run", "30"], "--run 30 is a run of one campaign: name it"),
    (["identify", "five-days", "--model", "nope"], "there is no model 'nope'; there are "),
    (["identify", "five-days", "--model", "samba@x"], "after @ comes the number of a version, for example samba@1"),
    (["identify", "five-days", "--model", "samba@9"], "model 'samba' has no version 9"),
    (["identify", "five-days", "--model", "x'; DROP TABLE model; --"], "there is no model"),
    (["runs", "nope"], "there is no campaign 'nope'"),
    (["stats", "nope"], "there is no campaign 'nope'"),
    (["stats", "five-days", "--by", "nope"], "--by nope: there is no such column; there are run, day, warm_up, hours"),
    (["stats", "five-days", "--by", ""], "there is no such column"),
    (["stats", "five-days", "--by", "day; DROP TABLE run"], "there is no such column"),
    (["stats", "five-days", "--where", ""], "cannot be read; an example is hours > 6"),
    (["stats", "five-days", "--where", "1==1; DROP TABLE run"], "cannot be read"),
    (["stats", "five-days", "--where", "day == 1 OR 1=1"], "cannot be read"),
    (["stats", "five-days", "--where", "day == 1) UNION SELECT (1"], "cannot be read"),
    (["stats", "five-days", "--where", "__import__('os').system('touch pwned')"], "which is not allowed"),
    (["stats", "five-days", "--where", "(lambda: 1)()"], "which is not allowed"),
    (["stats", "five-days", "--where", "day.__class__"], "which is not allowed"),
    (["stats", "five-days", "--where", "[x for x in (1,)]"], "which is not allowed"),
    (["stats", "five-days", "--where", "'day'"], "which is not allowed"),
    (["stats", "five-days", "--where", "nope > 1"], "names 'nope', which was not recorded; recorded are"),
    (["stats", "five-days", "--where", "day / 0"], "is not a finite number at 20 of 20 runs"),
    (["stats", "five-days", "--where", "9**9**9"], "is not a finite number"),
    (["stats", "five-days", "--where", "(" * 300 + "1" + ")" * 300], "at most 500 characters"),
    (["stats", "five-days", "--where", "day == 99"], "at least two runs, but 0 of campaign five-days are chosen"),
    (["stats", "five-days", "--where", "run == 3"], "at least two runs, but 1 of campaign five-days are chosen"),
    (["stats", "five-days", "--figures", "text"], "the folder text cannot be made"),
    ([*RUN, "--method", "x"], "--method x: choose guf, mcm or both"),
    ([*RUN, "--digits", "0"], "--digits 0: choose 1 to 4"),
    ([*RUN, "--digits", "-2"], "--digits -2: choose 1 to 4"),
    ([*RUN, "--seed", "-1"], "--seed -1: a seed is a whole number from 0"),
    ([*RUN, "--seed", str(2**63)], "a seed is a whole number from 0"),
    ([*RUN, "-p", "nan"], "-p nan: a coverage probability lies between 0.5 and 0.9999"),
    ([*RUN, "-p", "1"], "-p 1.0: a coverage probability"),
    ([*RUN, "-p", "inf"], "-p inf: a coverage probability"),
    ([*RUN, "--run", "77"], "no run 77; there are runs 1, 2, 3"),
    ([*RUN, "--model", "nope"], "there is no model 'nope'"),
    (["compare", "nope"], "there is no campaign 'nope'"),
    (["compare", "five-days", "--model", "nope"], "there is no model 'nope'"),
    (["compare", "five-days", "--figures", "text"], "the folder text cannot be made"),
    (["compare", "five-days", "--figures", "text/below"], "the folder text/below cannot be made"),
    (["explain", "nope"], "there is no campaign 'nope'"),
    (["explain", "five-days", "--rate", "nan"], "the false discovery rate must lie between 0 and 1, not nan"),
    (["explain", "five-days", "--rate", "0"], "the false discovery rate must lie between 0 and 1"),
    (["explain", "five-days", "--rate", "-1"], "the false discovery rate must lie between 0 and 1"),
    ([*ADD, "nope"], "there is no model 'nope'"),
    ([*ADD, "samba", "--as", "a@b"], "cannot name a model: leave out @"),
    ([*ADD, "samba", "--as", " "], "cannot name a model"),
    ([*ADD, "samba", "--as", "m", "--campaign", "nope"], "there is no campaign 'nope'"),
    (["model", "add", "EXX:nope", "--to", "samba"], "there is no shape 'nope'; there are const, poly1"),
    (["model", "add", "XYZ", "--to", "samba"], "'XYZ' is no geometric error of"),
    (["model", "add", "", "--to", "samba"], "'' is no geometric error of"),
    (["model", "add", "EXX:formula(__import__('os'))", "--to", "samba"], "which is not allowed"),
    (["model", "add", "EXX:poly1", "--to", "samba"], "EXX:poly1 is free in every run already"),
    (["model", "add", "EA0B", "--to", "samba"], "EA0B is free in every run already"),
    (["model", "remove", "EXX:reversal", "--from", "samba"], "has no added effect EXX:reversal"),
    (["model", "show", "nope"], "there is no model 'nope'"),
    (["model", "history", "nope"], "there is no model 'nope'"),
    (["model", "history", "samba", "--campaign", "nope"], "there is no campaign 'nope'"),
    (["effects", "--topology", "nope"], "topology 'nope'"),
    (["effects", "--topology", ""], "topology '' must name w (workpiece), b (bed) and t (tool)"),
    (["simulate", "v", "--effect", "nope"], "'nope' is no geometric error of"),
    (["simulate", "v", "--seed", "-1"], "--seed -1: a seed is a whole number from 0 on"),
    (["simulate", "v", "--peak", "nan"], "--peak nan: the peak must be a number of µm"),
    (["simulate", "v", "--peak", "inf"], "--peak inf: the peak must be a number of µm"),
    (["simulate", "v", "--noise", "0"], "the noise of a reading must be above 0 µm"),
    (["simulate", "v", "--noise", "nan"], "the noise of a reading must be above 0 µm"),
    (["simulate", "v", "--noise", "-1"], "the noise of a reading must be above 0 µm"),
    (["simulate", "text"], "text is there already; give a folder that does not exist yet"),
    (["simulate", "folder"], "folder is there already"),
    (["event", "NOPE"], "there is no machine 'NOPE'; there are HU40-T"),
    (["event", "NOPE", "hi", "--at", AT], "there is no machine 'NOPE'; there are HU40-T"),
    (["event", "HU40-T", "hi"], "say when it happened: --at"),
    (["event", "HU40-T", "--at", AT], "say in words what happened"),
    (["event", "HU40-T", "--kind", "crash"], "say in words what happened"),
    (["sql", "SELECT 1", "--csv", "--json"], "--csv and --json are two forms of one answer; type one of them"),
    (["event", "HU40-T", "hi", "--at", "soon"], "--at soon: write a day or a time as 2026-03-05, 2026-03-05 07:00 or"),
    (["event", "HU40-T", "hi", "--at", "20260305"], "--at 20260305: write a day or a time as"),
    (["event", "HU40-T", " ", "--at", AT], "say in words what happened"),
    (["event", "HU40-T", "hi", "--at", AT, "--kind", ""], "an event needs a kind"),
    (["audit", "--last", "0"], "--last 0: how many entries"),
    (["audit", "--last", "-5"], "--last -5: how many entries"),
    (["audit", "--last", "9" * 30], "how many entries, a whole number"),
    (["backup", "nope/x"], "the folder of nope/x does not exist"),
    (["backup", "text"], "text exists already; name a new file"),
    (["export", "text"], "text is not an empty folder; name a new one"),
    (["export", "all.csv"], "all.csv is the name of one file, and an export is a folder of them: name a folder; one"),
    (["export", "all.xlsx", "--format", "csv"], "all.xlsx is the name of one file, and an export is a folder"),
    (["restore", "nope"], "there is no backup nope"),
    (["import", "nope"], "nope was refused, nothing of it was kept: 1 fault"),
    (["import", "text"], "this is a file; give the folder that holds campaign.toml"),
    (["import", "folder"], "campaign.toml: the file is missing; the folder holds nothing"),
    ([*ISSUE, "nope"], "nope cannot be read: No such file or directory"),
    ([*ISSUE, "folder"], "folder cannot be read: Is a directory"),
    ([*ISSUE, "text"], "text, line 1: this is not TOML"),
    (["trend", "NOPE"], "there is no machine 'NOPE'; there are HU40-T"),
    (["trend", "HU40-T", "--since", "nope"], "--since nope: write a day or a time as 2026-03-05"),
    (["trend", "HU40-T", "--reliability", "nan"], "--reliability nan: a probability lies between 0 and 1"),
    (["trend", "HU40-T", "--reference", "x"], "--reference x: write two dates as 2026-01-01..2026-03-01"),
    (["plan", "nope"], "there is no campaign 'nope'"),
    (["plan", "five-days", "--balls", "0"], "--balls 0: choose 1 to 24"),
    (["plan", "five-days", "--poses", "-3"], "--poses -3: choose 3 to 40"),
    (["plan", "five-days", "--separate", "EXX:reversal"], "name two effects with a comma"),
    (["plan", "five-days", "--separate", "EXX:reversal,nope"], "'nope' is no geometric error of"),
    (["map", "nope"], "there is no campaign 'nope'"),
    (["map", "five-days", "--run", "99"], "no run 99; there are runs 1, 2, 3"),
    (["map", "five-days", "--compensation", "nope"], "--compensation nope: there are positioning-csv"),
    (["report", "--week", "nope"], "--week nope: write a year and a week of it, for example 2026-W10"),
    (["report", "--week", "2026-W60"], "--week 2026-W60: write a year and a week"),
    (["report", "--machine", "NOPE"], "there is no machine 'NOPE'; there are HU40-T"),
    (["certificate", "show", "2026-0001"], "there is no certificate '2026-0001'; none was made yet"),
    (["certificate", "verify", "nope.pdf"], "nope.pdf cannot be read: No such file or directory"),
    (["certificate", "verify", "folder"], "folder cannot be read: Is a directory"),
    (["certificate", "withdraw", "2026-0001", "--reason", "x"], "there is no certificate '2026-0001'"),
    (["certificate", "amend", "2026-0001", "--laboratory", "x.toml", "--reason", "x"], "no certificate '2026-0001'"),
]  # fmt: skip


def entries(path: Path) -> int:
    with Database(path) as db:
        return int(
            db.rows("SELECT count(*) FROM audit WHERE subject <> 'model' OR key NOT LIKE 'samba%'")[0][0]
        )


def added(path: Path, before: bytes, copy: Path) -> int:
    """How many entries a database got since it had these bytes; it is opened only where they are others."""
    if path.read_bytes() == before:
        return 0
    copy.write_bytes(before)
    return entries(path) - entries(copy)


@pytest.fixture(scope="module")
def untouched(filled_once: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database that every refused verb leaves as it is."""
    path = tmp_path_factory.mktemp("untouched") / "x.duckdb"
    path.write_bytes(filled_once.read_bytes())
    return path


@pytest.mark.parametrize(
    ("arguments", "words"), WRONG, ids=lambda one: " ".join(one)[:60] if isinstance(one, list) else ""
)
@pytest.mark.parametrize("how", [[], ["--json"]], ids=["", "json"])
def test_wrong_input(
    typed: Any, untouched: Path, tmp_path: Path, arguments: list[str], words: str, how: list[str]
) -> None:
    Path("text").write_text("hello\n")
    Path("folder").mkdir()
    here = {path.name for path in Path().iterdir()}
    before = untouched.read_bytes()
    answer = typed(*arguments, *how, db=untouched)
    assert (answer.status, answer.out) == (2, ""), answer.err
    assert answer.err.startswith("monitor: ")
    assert words in answer.err
    assert "Traceback" not in answer.err
    assert "fault of the software" not in answer.err
    # Of a refused import nothing is kept but that it was refused.
    assert added(untouched, before, tmp_path / "before.duckdb") == (arguments[0] == "import")
    assert {path.name for path in Path().iterdir()} == here


def test_import_goes_on_after_a_refusal_and_ends_with_a_list(
    typed: Any, examples: Path, tmp_path: Path
) -> None:
    path = tmp_path / "new.duckdb"
    answer = typed("import", examples / "load-cell", "nope", examples / "cold-cold", "neither", db=path)
    assert answer.status == 2
    assert answer.out.startswith("load-cell: imported, 44 rows\n")
    assert "\ncold-cold: imported" in answer.out
    assert "monitor: nope was refused, nothing of it was kept" in answer.err
    assert answer.err.endswith("monitor: 2 of 4 folders refused: nope, neither\n")
    names = [campaign["campaign"] for campaign in typed("campaigns", "--json", db=path).document["campaigns"]]
    assert names == ["load-cell", "cold-cold"]
    again = typed("import", "--json", examples / "load-cell", "nope", db=path)
    document = json.loads(again.out)
    assert (again.status, [folder["state"] for folder in document["imported"]]) == (2, ["unchanged"])
    assert [refused["folder"] for refused in document["refused"]] == ["nope"]


def test_every_fault_of_a_folder_is_told_at_once(
    typed: Any, examples: Path, tmp_path: Path, db: Path
) -> None:
    folder = tmp_path / "broken"
    folder.mkdir()
    for name in ("campaign.toml", "runs.csv", "probings.csv"):
        (folder / name).write_bytes((examples / "cold-cold" / name).read_bytes())
    rows = (folder / "probings.csv").read_text().splitlines()
    for number in (3, 8):
        rows[number] = rows[number].replace(".", "x", 1)
    (folder / "probings.csv").write_text("\n".join(rows) + "\n")
    answer = typed("import", folder, db=db)
    assert answer.status == 2
    assert "2 faults" in answer.err
    assert "probings.csv, line 4" in answer.err
    assert "probings.csv, line 9" in answer.err


def test_the_same_name_with_other_content_is_refused(
    typed: Any, examples: Path, tmp_path: Path, db: Path
) -> None:
    folder = tmp_path / "cold-cold"
    folder.mkdir()
    for name in ("campaign.toml", "runs.csv", "probings.csv"):
        (folder / name).write_bytes((examples / "cold-cold" / name).read_bytes())
    with (folder / "campaign.toml").open("a") as more:
        more.write("# another word\n")
    answer = typed("import", folder, db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "cold-cold" in answer.err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(typed: Any, db: Path, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    for arguments in (["backup", closed / "x"], ["export", closed / "x"], ["simulate", closed / "x"],
                      ["compare", "cold-cold", "--figures", closed / "x"]):  # fmt: skip
        answer = typed(*arguments, db=db)
        assert (answer.status, answer.out) == (2, "")
        assert "ermission denied" in answer.err


def test_what_stands_behind_two_dashes_is_a_name_and_no_option(typed: Any, untouched: Path) -> None:
    """A campaign may be called so, and has to be withdrawn under its name."""
    for words in (["runs", "--", "-dash"], ["withdraw", "--reason", "x", "--", "-dash"]):
        answer = typed("--db", untouched, *words)
        assert answer.status == 2
        assert "there is no campaign '-dash'" in answer.err


def test_a_name_that_is_too_long_for_a_file_is_no_fault_of_the_software(
    typed: Any, examples: Path, tmp_path: Path, made_anew: None
) -> None:
    for length in (251, 300):
        answer = typed("import", examples / "load-cell", db=tmp_path / ("x" * length))
        assert answer.status == 2, answer.err
        assert "ile name too long" in answer.err
