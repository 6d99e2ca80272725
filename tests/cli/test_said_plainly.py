"""What people met in their first hours: each is answered with what to type, and a list holds what it counts."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.cli.folder_patterns import in_full
from monitor.cli.identify_output import _doing_the_same
from monitor.exceptions import InputError
from monitor.workflow.true_values import TRUTH, TrueValue, write_truth
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_a_pattern_that_no_shell_wrote_out_is_written_out_here(tmp_path: Path) -> None:
    for name in ("b", "a", "c d"):
        (tmp_path / "shop" / name).mkdir(parents=True)
    assert in_full([tmp_path / "shop" / "*"]) == [tmp_path / "shop" / name for name in ("a", "b", "c d")]
    assert in_full([tmp_path / "no*", Path("x")][1:]) == [Path("x")]
    with pytest.raises(InputError, match=r"nothing matches .*z\*: the folder .*shop has a, b, c d$"):
        in_full([tmp_path / "shop" / "z*"])
    with pytest.raises(InputError, match=r"nothing matches .*: there is no folder .*mill$"):
        in_full([tmp_path / "mill" / "*"])
    (tmp_path / "[odd]").mkdir()
    assert in_full([tmp_path / "[odd]"]) == [tmp_path / "[odd]"]


def test_folders_by_a_pattern_are_imported(typed: Any, tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "tilting-table", tmp_path / "shop" / "tilting-table")
    db = tmp_path / "x.duckdb"
    assert "tilting-table: imported, 4 runs" in typed("import", tmp_path / "shop" / "*", db=db).out
    refused = typed("import", tmp_path / "shop" / "mill*", db=db)
    assert (refused.status, refused.out) == (2, "")
    assert "shop has tilting-table" in refused.err


def test_the_true_values_of_a_rehearsal_are_passed_over_beside_its_campaigns(
    typed: Any, tmp_path: Path
) -> None:
    """A pattern meets them, also where a shell wrote it out; alone, or of other columns, the file is refused."""
    shop, db = tmp_path / "shop", tmp_path / "x.duckdb"
    shutil.copytree(EXAMPLES / "tilting-table", shop / "tilting-table")
    truth = shop / TRUTH
    write_truth(truth, [TrueValue("M1", "tilting-table", 1, "2026-01-12T08:00:00", "EY0A", 1.0, "µrad")])
    for named in ([shop / "*"], [shop / "tilting-table", truth]):
        answer = typed("import", *named, db=db)
        assert (answer.status, answer.err) == (0, "")
        assert f"note: {truth} passed over: the true values of a rehearsal" in answer.out
    document = typed("import", shop / "*", "--json", db=db).document
    assert (document["passed_over"], document["refused"]) == ([str(truth)], [])
    assert "passed_over" not in typed("import", shop / "tilting-table", "--json", db=db).document
    assert typed("import", truth, db=db).status == 2
    truth.write_text("machine,campaign\n", encoding="utf-8")
    refused = typed("import", shop / "*", db=db)
    assert refused.status == 2
    assert f"1 of 2 folders refused: {truth}" in refused.err


@pytest.mark.slow
def test_the_fleet_has_a_row_for_a_machine_without_numbers(typed: Any, tmp_path: Path) -> None:
    db = tmp_path / "x.duckdb"
    assert typed("import", EXAMPLES / "tilting-table", EXAMPLES / "ball-bar", db=db).status == 0
    assert typed("identify", "tilting-table", db=db).status == 0
    answer = typed("fleet", "--json", db=db).document
    assert (answer["machines"], answer["without_numbers"]) == (1, ["CENTRE-4"])
    said = typed("fleet", db=db).out
    assert "2 machines, 1 of them without numbers, 32 values" in said
    assert re.search(r"computed on \d{4}-\d\d-\d\d; the latest values shown are of 2012-03-05\n", said)
    assert any(
        line.split()[:2] == ["-", "CENTRE-4"] and "not judged: not identified" in line
        for line in said.splitlines()
    )
    assert typed("identify", "ball-bar", db=db).status == 0
    for of in ([], ["--model", "rotary-probing"]):
        # Under the model of one method the machine of the other is not called unidentified.
        assert "without_numbers" not in typed("fleet", *of, "--json", db=db).document
        assert "not judged: not identified" not in typed("fleet", *of, db=db).out


def test_the_fleet_prints_no_more_machines_without_numbers_than_rows_asked_for(
    typed: Any, tmp_path: Path
) -> None:
    db = tmp_path / "x.duckdb"
    folders = [EXAMPLES / name for name in ("tilting-table", "ball-bar", "l-shape")]
    assert typed("import", *folders, db=db).status == 0
    assert typed("identify", "tilting-table", db=db).status == 0
    said = typed("fleet", "--top", "1", db=db).out
    assert said.count("not judged: not identified") == 1
    assert "1 more without numbers; --top 0 names all" in said
    assert typed("fleet", "--top", "0", db=db).out.count("not judged: not identified") == 2


def test_a_kind_of_event_is_no_note(typed: Any, db: Path) -> None:
    refused = typed("event", "HU40-T", "Crash", "--at", "2026-03-05", db=db)
    assert (refused.status, refused.out) == (2, "")
    assert "'crash' is a kind of event" in refused.err
    assert "give --kind crash and say in words what happened" in refused.err
    recorded = typed("event", "HU40-T", "spindle hit the vice", "--at", "2026-03-05", db=db)
    assert "recorded as a note, which does not split the history; --kind crash, repair" in recorded.out
    split = typed("event", "HU40-T", "spindle hit the vice", "--kind", "crash", "--at", "2026-03-05", db=db)
    assert "recorded as a note" not in split.out


def test_who_has_no_backup_learns_how_to_make_one(typed: Any, tmp_path: Path) -> None:
    refused = typed("restore", tmp_path / "none.duckdb", db=tmp_path / "back.duckdb")
    assert (refused.status, refused.out) == (2, "")
    assert "none.duckdb; `monitor backup FILE` makes one, to be put back later" in refused.err
    (tmp_path / "bare.duckdb").write_bytes(b"x")
    refused = typed("restore", tmp_path / "bare.duckdb", db=tmp_path / "back.duckdb")
    assert "so it cannot be checked; `monitor backup FILE` writes both" in refused.err


@pytest.mark.slow
def test_one_explanation_measures_by_one_root_mean_square(typed: Any, tmp_path: Path) -> None:
    """What is left with all findings is the RMS of the first line, beside the same expectation."""
    db = tmp_path / "x.duckdb"
    assert typed("import", EXAMPLES / "hidden-reversal-x", db=db).status == 0
    said = typed("explain", "hidden-reversal-x", db=db).out
    document = typed("explain", "hidden-reversal-x", "--json", db=db).document
    remaining, expected = document["remaining"]["rms_um"], document["expected_rms_um"]
    assert [effect["effect"] for effect in document["missing"]] == ["EXX:reversal"]
    assert f"expected {expected:.2f} µm from the stated uncertainty" in said
    assert (
        f"with what the model lacks added to it: RMS {remaining:.2f} µm, expected {expected:.2f} µm" in said
    )


def test_the_circles_of_a_ball_bar_say_about_which_centre(typed: Any, tmp_path: Path) -> None:
    db = tmp_path / "x.duckdb"
    assert typed("import", EXAMPLES / "ball-bar", db=db).status == 0
    said = typed("standards", "ball-bar", "--setup", "bar-xy", db=db).out
    assert "circular deviation about its least-squares circle, counter-clockwise" in said
    assert "bi-directional circular deviation about the least-squares circle of both senses" in said
    assert "largest radial deviation about the centre of G, clockwise" in said


def test_the_unknowns_of_the_setups_do_the_same_and_one_error_does() -> None:
    assert _doing_the_same(("the unknowns of the setups",)) == "the unknowns of the setups do the same"
    assert _doing_the_same(("EC0AZ",)) == "EC0AZ does the same"
    assert _doing_the_same(("EC0AZ", "the unknowns of the setups")).endswith("together do the same")


@pytest.mark.slow
def test_identify_says_that_readings_refute_the_model(typed: Any, tmp_path: Path) -> None:
    """The residuals are less than three times what is stated; the scatter of the runs is a tenth of them."""
    db = tmp_path / "x.duckdb"
    for name, refuted in (("hidden-reversal-x", True), ("nothing-hidden", False)):
        assert typed("import", EXAMPLES / name, db=db).status == 0
        said = typed("identify", name, db=db).out
        assert (f"the readings of {name} refute the model samba beyond noise" in said) == refuted
        assert "times what the stated uncertainties leave" not in said


@pytest.mark.parametrize(("noise_um", "is_larger"), [(0.58, True), (0.5, False)])
def test_a_residual_larger_than_stated_is_said_where_a_statement_may_be_wrong_by_as_much(
    typed: Any, tmp_path: Path, noise_um: float, *, is_larger: bool
) -> None:
    """Eight runs of a laser that states 0.5 um: what scatters by 0.58 was "explained" without a word."""
    rng, db = np.random.default_rng(6), tmp_path / "x.duckdb"
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    rows = [
        {
            "run": run,
            "setup": "laser",
            "X": x,
            "Y": 0.0,
            "Z": 0.0,
            "reading_um": 1e3 * x + rng.normal(0.0, noise_um),
        }
        for run in range(1, 9)
        for x in np.linspace(0.0, 500.0, 51)
    ]
    days = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 10)]
    typed("import", chain.write(tmp_path / "laser", laser(), rows, started=days), db=db)
    said = typed("compare", "laser", db=db).out
    assert "verdict: explained" in said
    assert ("the residual is larger than the stated uncertainty leaves (p < 0.0001)" in said) is is_larger
