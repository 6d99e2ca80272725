"""Models as a user types them: add what is missing, watch the error fall, take it out again."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import DataError
from monitor.methods import ChainMethod, methods

REVERSAL = "EXX:reversal"


def test_add_then_history_shows_the_error_falling(typed: Any, db: Path) -> None:
    assert typed("compare", "hidden-reversal-x", db=db).status == 0
    made = typed(
        "model",
        "add",
        REVERSAL,
        "--to",
        "samba",
        "--as",
        'it\'s "warm" ü',
        "--note",
        "from explain",
        "--json",
        db=db,
    )
    found = made.document
    assert (found["model"], found["version"], found["effects"]) == ('it\'s "warm" ü', 1, [REVERSAL])
    assert (found["parent"], found["note"]) == ("samba", "from explain")
    assert found["meaning"][REVERSAL] == "positioning error of the X axis (X), jumping when X reverses"
    # Without --campaign it is the one on which the parent was last compared.
    steps = typed("model", "history", 'it\'s "warm" ü', "--json", db=db).document
    assert [one["added"] for one in steps] == [None, REVERSAL]
    for one in steps:
        assert set(one) >= {"model", "added", "rms_um", "heldout_rms_um", "repeatability_um", "lack_of_fit_p"}
        assert one["campaign"] == "hidden-reversal-x"
    assert steps[1]["rms_um"] < 0.7 * steps[0]["rms_um"]
    assert steps[1]["heldout_rms_um"] < 0.7 * steps[0]["heldout_rms_um"]
    assert steps[0]["lack_of_fit_p"] < 1e-6 < 0.01 < steps[1]["lack_of_fit_p"]
    assert steps == found["history"]


def test_history_for_people_and_as_a_figure(typed: Any, db: Path) -> None:
    assert (
        typed(
            "model", "add", REVERSAL, "--to", "samba", "--as", "m", "--campaign", "hidden-reversal-x", db=db
        ).status
        == 0
    )
    answer = typed("model", "history", "m", "--campaign", "hidden-reversal-x", "--figures", "fig ures", db=db)
    lines = answer.out.splitlines()
    assert lines[0] == "on campaign hidden-reversal-x"
    assert lines[2].split()[:2] == ["samba", "base"]
    assert lines[3].split()[:2] == ["m", REVERSAL]
    for file in ("fig ures/error-falling.svg", "fig ures/error-falling.png"):
        assert file in lines
        assert Path(file).stat().st_size > 1000


def test_versions_of_one_model_and_taking_an_effect_out_again(typed: Any, db: Path) -> None:
    assert typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", db=db).status == 0
    second = typed("model", "add", "EBB:harmonic2", "--to", "m", "--json", db=db).document
    assert (second["model"], second["parent"], second["effects"]) == ("m@2", "m", [REVERSAL, "EBB:harmonic2"])
    third = typed("model", "remove", REVERSAL, "--from", "m@2", "--json", db=db).document
    assert (third["model"], third["effects"], third["removed"]) == ("m@3", ["EBB:harmonic2"], [REVERSAL])
    assert "it has 1 to 3" in typed("model", "show", "m@4", db=db).err
    assert "EBB:harmonic2" in typed("model", "show", "m@2", db=db).out
    listed = typed("model", "list", "--json", db=db).document["models"]
    assert [one["model"] for one in listed if one["name"] == "m"] == ["m", "m@2", "m@3"]
    assert "samba" in {one["model"] for one in listed}
    assert typed("identify", "five-days", "--model", "m@2", "--json", db=db).document["model"] == "m@2"


def test_an_effect_is_added_once(typed: Any, db: Path) -> None:
    assert typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", db=db).status == 0
    again = typed("model", "add", REVERSAL, "--to", "m", db=db)
    assert again.status == 2
    assert f"model m has {REVERSAL} already" in again.err


def test_a_model_that_cannot_be_shown_on_its_campaign_is_not_kept(typed: Any, db: Path) -> None:
    answer = typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", "--campaign", "nope", db=db)
    assert answer.status == 2
    assert [one["model"] for one in typed("model", "list", "--json", db=db).document["models"]] == [
        name for name, method in methods().items() if isinstance(method, ChainMethod)
    ]


def test_an_effect_that_does_not_fit_is_to_blame_not_the_file(
    typed: Any, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the model fits without the effect, the message is about the effect."""

    def fitted(database: Any, version: Any, campaign: str | None) -> tuple[()]:
        if version.effects:
            raise DataError("did not converge: the readings contradict the machine file")
        return ()

    monkeypatch.setattr("monitor.workflow.model.change.fitted_version", fitted)
    answer = typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", "--campaign", "five-days", db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "EXX:reversal could not be fitted: beside the effects of model samba" in answer.err
    assert "contradict" not in answer.err


def test_an_effect_that_a_model_has_changes_nothing_for_anybody(typed: Any, db: Path) -> None:
    assert typed("model", "add", REVERSAL, "--to", "samba", "--as", "twice", db=db).status == 0
    answer = typed("model", "add", REVERSAL, "--to", "twice", db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "has EXX:reversal already" in answer.err
    assert "for everybody" not in answer.err


@pytest.mark.slow
def test_an_effect_that_the_readings_do_not_show_is_added_with_a_size_within_its_uncertainty(
    typed: Any, db: Path
) -> None:
    line = ("model", "add", "EZC1:const@warmup", "--to", "samba", "--as", "m", "--campaign", "five-days")
    assert typed(*line, db=db).status == 0
    out = typed("identify", "five-days", "--model", "m", db=db).out
    size, u = (float(word) for word in re.search(r"EZC1:const@warmup: (\S+) ± (\S+) µm", out).groups())  # type: ignore[union-attr]
    assert abs(size) < u


def test_a_model_before_any_comparison_has_no_history_yet(typed: Any, examples: Path, tmp_path: Path) -> None:
    path = tmp_path / "new.duckdb"
    assert typed("import", examples / "hidden-reversal-x", db=path).status == 0
    made = typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", "--json", db=path)
    assert made.document["history"] == []
    answer = typed("model", "history", "m", db=path)
    assert answer.status == 2
    assert "model m has not been compared with a campaign yet; name one with --campaign" in answer.err


def test_no_machine_no_effect(typed: Any, filled: Path, tmp_path: Path) -> None:
    from monitor.store import Database

    path = tmp_path / "empty.duckdb"
    Database(path).close()
    answer = typed("model", "add", REVERSAL, "--to", "samba", db=path)
    assert (answer.status, answer.out) == (2, "")
    assert "import a campaign first" in answer.err
    assert "the database has no campaign yet; type `monitor import FOLDER`" in typed("identify", db=path).err
    assert typed("campaigns", db=path).out == "no campaign yet; type `monitor import FOLDER`\n"


@pytest.mark.parametrize("verb", ["stats", "compare", "uncertainty"])
def test_every_verb_takes_a_version_of_a_model(typed: Any, db: Path, verb: str) -> None:
    assert typed("model", "add", REVERSAL, "--to", "samba", "--as", "m", db=db).status == 0
    more = ["--method", "guf"] if verb == "uncertainty" else []
    assert typed(verb, "hidden-reversal-x", "--model", "m@1", *more, db=db).status == 0


def test_adding_to_a_name_that_others_use_is_said(typed: Any, db: Path) -> None:
    said = typed("model", "add", "EXX:poly2", "--to", "samba", db=db)
    assert said.status == 0
    assert "'samba' without a version means samba@2 from now on, for everybody and every campaign" in said.out
    assert "samba@1 is what it was (--as NAME leaves samba alone)" in said.out
    own = typed("model", "add", "EXX:poly3", "--to", "samba", "--as", "mine", db=db)
    assert own.status == 0
    assert "without a version" not in own.out
    document = typed("model", "remove", "EXX:poly2", "--from", "samba", "--json", db=db).document
    assert "samba@2 is what it was" in document["note_on_name"]
