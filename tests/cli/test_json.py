"""Every verb with ``--json``: one document with the keys of the contract, units in the keys, nothing beside it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from by_path import simulator

THIRTEEN = list(simulator().SAMBA_PARAMETERS)
MOMENT = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z")


def numbers(found: Any) -> Iterator[float]:
    if isinstance(found, dict):
        for inner in found.values():
            yield from numbers(inner)
    elif isinstance(found, list):
        for inner in found:
            yield from numbers(inner)
    elif isinstance(found, float):
        yield found


def test_import(typed: Any, examples: Path, db: Path) -> None:
    answer = typed("import", examples / "five-days", examples / "nothing-hidden", "--json", db=db)
    first, second = answer.document["imported"]
    assert set(first) >= {"campaign", "folder", "state", "runs", "probings"}
    assert (first["campaign"], first["state"], first["runs"]) == ("five-days", "unchanged", 20)
    assert (second["campaign"], second["state"], second["probings"]) == ("nothing-hidden", "imported", 1240)
    assert answer.err == ""


def test_campaigns(typed: Any, filled: Path) -> None:
    found = typed("campaigns", "--json", db=filled).document["campaigns"]
    assert [one["campaign"] for one in found] == ["five-days", "cold-cold", "hidden-reversal-x"]
    assert found[0]["scale_bar_mm"] == pytest.approx(304.98923, abs=1e-9)
    assert found[0]["probe_u_um"] == 1.0
    assert MOMENT.fullmatch(found[0]["first_run_at"])
    assert MOMENT.fullmatch(found[0]["imported_at"])


def test_runs(typed: Any, filled: Path) -> None:
    found = typed("runs", "cold-cold", "--json", db=filled).document
    assert found["campaign"] == "cold-cold"
    assert [one["run"] for one in found["runs"]] == list(range(1, 45))
    first = found["runs"][0]
    assert first["conditions"] == {"ambient_degC": 22.85}
    assert first["started_at"] == "2026-02-17T14:00:00Z"
    # Local time is the machine's own; it has no zone of its own here.
    assert first["started_at_local"] == "2026-02-17T09:00:00"
    assert first["warm_up"] is False


def test_identify_of_thirteen_parameters_in_every_run(typed: Any, filled: Path) -> None:
    found = typed("identify", "five-days", "--json", db=filled).document
    assert (found["campaign"], found["model"], len(found["runs"])) == ("five-days", "samba", 20)
    for run in found["runs"]:
        assert set(run) >= {"run", "parameters", "refused", "rms_um", "iterations"}
        assert list(run["parameters"]) == THIRTEEN
        assert run["refused"] == []
        for one in run["parameters"].values():
            assert set(one) == {"value", "u", "unit"}
            assert one["u"] > 0
    units = {name: one["unit"] for name, one in found["runs"][0]["parameters"].items()}
    assert units["EA0B"] == "µrad"
    assert units["EX0C1"] == "µm"
    assert units["EXX"] == "µm/m"
    # Full precision: more digits than any table shows.
    assert len(repr(found["runs"][0]["parameters"]["EX0C"]["value"])) > 12


def test_identify_names_what_a_plan_cannot_separate(typed: Any, filled: Path) -> None:
    found = typed("identify", "cold-cold", "--run", 7, "--json", db=filled).document
    (run,) = found["runs"]
    assert run["run"] == 7
    assert list(run["parameters"]) == [name for name in THIRTEEN if not name.endswith("C1")]
    refused = {name: one["why"] for one in run["refused"] for name in one["parameters"]}
    assert {"EX0C1", "EY0C1"} <= set(refused)
    assert "C1 stands at one angle throughout" in refused["EX0C1"]


def test_identify_of_all_campaigns_has_one_shape_however_many_there_are(
    typed: Any, db: Path, tmp_path: Path, examples: Path
) -> None:
    found = typed("identify", "--json", db=db).document
    assert {one["campaign"] for one in found["identifications"]} == {
        "five-days",
        "cold-cold",
        "hidden-reversal-x",
    }
    alone = tmp_path / "alone.duckdb"
    assert typed("import", examples / "cold-cold", db=alone).status == 0
    assert len(typed("identify", "--json", db=alone).document["identifications"]) == 1


def test_stats(typed: Any, filled: Path) -> None:
    found = typed("stats", "five-days", "--json", db=filled).document
    assert found["campaign"] == "five-days"
    assert list(found["parameters"]) == THIRTEEN
    one = found["parameters"]["EB0C"]
    assert set(one) >= {"unit", "n", "mean", "u_all", "u_pooled", "u_by_day", "bartlett_p", "anova_p"}
    assert one["n"] == 20
    assert list(one["u_by_day"]) == ["1", "2", "3", "4", "5"]
    # Issue 2: the step of EB0C on day 4 is seen.
    assert one["anova_p"] < 0.001
    assert one["u_all"] > 3 * one["u_pooled"]
    assert found["parameters"]["EC0B"]["anova_p"] > 0.01
    assert found["coordinates"]["n"] == 186
    assert len(found["coordinates"]["bartlett_p"]) == len(found["coordinates"]["anova_p"]) == 186
    for name in ("correlation_all", "correlation_pooled"):
        matrix = found[name]
        assert len(matrix) == len(matrix[0]) == 13
        assert all(matrix[k][k] == pytest.approx(1.0) for k in range(13))


@pytest.mark.parametrize("by", ["run", "warm_up", "hours", "ambient_degC"])
def test_stats_by_what_was_recorded(typed: Any, filled: Path, by: str) -> None:
    found = typed("stats", "five-days", "--by", by, "--json", db=filled).document
    assert found["by"] == by
    assert sum(found["groups"].values()) == 20


def test_stats_where(typed: Any, filled: Path) -> None:
    found = typed("stats", "five-days", "--where", "day < 3 and not warm_up", "--json", db=filled).document
    assert found["groups"] == {"1": 4, "2": 4}
    assert found["parameters"]["EA0B"]["n"] == 8


def test_uncertainty(typed: Any, filled: Path) -> None:
    found = typed(
        "uncertainty", "five-days", "--run", 20, "--digits", 1, "--seed", 7, "--json", db=filled
    ).document
    assert (found["campaign"], found["run"], found["p"]) == ("five-days", 20, 0.95)
    assert found["parameters"] == THIRTEEN
    for method in ("guf", "mcm"):
        assert set(found[method]) >= {"estimate", "u", "correlation", "k_p", "k_q", "lambda_max"}
        assert list(found[method]["u"]) == THIRTEEN
        assert len(found[method]["correlation"]) == 13
    assert set(found["mcm"]) >= {"trials", "not_converged", "seconds", "stable"}
    assert found["mcm"]["seed"] == 7
    # JCGM 102:2011, 6.5: chi of 13 dimensions, and the 13 intervals that hold at once with these correlations.
    assert found["guf"]["k_p"] == pytest.approx(4.7287, abs=2e-4)
    drawn = np.random.default_rng(1).multivariate_normal(np.zeros(13), found["guf"]["correlation"], 200_000)
    largest = float(np.quantile(np.abs(drawn).max(axis=1), 0.95))
    assert found["guf"]["k_q"] == pytest.approx(largest, abs=0.02)
    assert set(found["guf"]["coverage_sampling"]) >= {"seed", "trials"}
    assert set(found["validation"]) >= {"passed", "differences", "tolerances"}
    assert set(found["validation"]["differences"]) == set(found["validation"]["tolerances"])


def test_uncertainty_says_the_frame_of_every_parameter_and_the_machine_frame(
    typed: Any, filled: Path
) -> None:
    found = typed("uncertainty", "five-days", "--run", 20, "--method", "guf", "--json", db=filled).document
    assert list(found["frames"]) == THIRTEEN
    assert found["frames"]["EA0C"] == {"kind": "preceding axis", "axis": "B"}
    assert found["frames"]["EB0Z"] == {"kind": "machine frame", "axis": None}
    assert found["frames"]["EXX"] == {"kind": "own axis", "axis": "X"}
    frame, guf = found["machine_frame"], found["guf"]
    assert frame["sums"]["EA0C"] == {"EA0B": 1.0, "EA0C": 1.0}
    assert frame["estimate"]["EA0C"] == pytest.approx(guf["estimate"]["EA0B"] + guf["estimate"]["EA0C"])
    # GUM 5.2.2 of a sum of two, and of two sums that share one.
    u, names = guf["u"], found["parameters"]
    shared = guf["correlation"][names.index("EA0B")][names.index("EA0C")] * u["EA0B"] * u["EA0C"]
    assert frame["u"]["EA0C"] ** 2 == pytest.approx(u["EA0B"] ** 2 + u["EA0C"] ** 2 + 2.0 * shared)
    place, other = frame["parameters"].index("EA0C"), frame["parameters"].index("EA0B")
    assert frame["covariance"][place][other] == pytest.approx(u["EA0B"] ** 2 + shared)
    prose = typed("uncertainty", "five-days", "--run", 20, "--method", "guf", db=filled).out
    assert "EA0B + EA0C" in prose
    assert "the other location errors have the values above in the machine frame, too" in prose


def test_uncertainty_by_the_framework_alone(typed: Any, filled: Path) -> None:
    found = typed("uncertainty", "cold-cold", "--method", "guf", "--json", db=filled).document
    assert found["run"] == 44
    assert len(found["parameters"]) == 11
    assert {name for one in found["refused"] for name in one["parameters"]} >= {"EX0C1", "EY0C1"}
    assert "mcm" not in found
    assert "validation" not in found


COMPARISON = {
    "campaign",
    "model",
    "rms_um",
    "repeatability_um",
    "expected_rms_um",
    "lack_of_fit",
    "verdict",
    "by",
}


def test_compare(typed: Any, filled: Path) -> None:
    found = typed("compare", "hidden-reversal-x", "--json", db=filled).document
    assert set(found) >= COMPARISON
    assert set(found["lack_of_fit"]) >= {"f", "p"}
    assert found["verdict"] == "something is missing"
    assert set(found["by"]) >= {"target", "axis", "indexation", "run"}
    assert list(found["by"]["run"]) == [str(run) for run in range(1, 21)]
    # Each axis by its name: 'C0 C190' could be read two ways.
    assert "B=0 C=0 C1=90" in found["by"]["indexation"]
    assert found["rms_um"] > 1.5 * found["expected_rms_um"]


def test_compare_of_what_the_model_explains(typed: Any, filled: Path) -> None:
    assert typed("compare", "cold-cold", "--json", db=filled).document["verdict"] == "explained"


def test_explain(typed: Any, filled: Path) -> None:
    found = typed("explain", "hidden-reversal-x", "--json", db=filled).document
    assert set(found) >= COMPARISON | {"missing", "suspect_data", "changes", "blind_spots"}
    first = found["missing"][0]
    assert set(first) >= {
        "rank", "effect", "cause", "remedy", "amplitude", "u", "unit", "peak_um", "p_value", "q_value", "rms_before_um",
        "rms_after_um", "heldout_before_um", "heldout_after_um", "indistinguishable_from", "tell_apart_by",
    }  # fmt: skip
    assert (first["rank"], first["effect"]) == (1, "EXX:reversal")
    assert abs(first["amplitude"]) > 5 * first["u"]
    assert first["rms_after_um"] < first["rms_before_um"]
    for one in found["blind_spots"]:
        assert isinstance(one, str)


def test_trend(typed: Any, db: Path) -> None:
    assert typed("identify", db=db).status == 0
    found = typed("trend", "HU40-T", "--parameter", "EC0Y", "--json", db=db).document
    assert found["machine"] == "HU40-T"
    one = found["parameters"]["EC0Y"]
    assert set(one) >= {
        "unit", "slope_per_year", "u_slope", "p_value", "changes", "conditions", "limit", "crosses_limit_at",
        "crosses_limit_interval",
    }  # fmt: skip
    assert one["unit"] == "µrad"
    for change in one["changes"]:
        assert set(change) >= {"at", "size", "p_value"}
    for condition in one["conditions"]:
        assert set(condition) >= {"channel", "coefficient", "u", "p_value"}


@pytest.mark.parametrize(
    "verb", [["plan", "five-days"], ["map", "five-days"], ["fleet"], ["select"], ["report"]], ids="-".join
)
def test_the_other_verbs_print_one_document(typed: Any, db: Path, verb: list[str]) -> None:
    # The fleet is made of what was identified.
    assert typed("identify", "five-days", db=db).status == 0
    answer = typed(*verb, "--json", db=db)
    assert (answer.status, answer.err) == (0, "")
    assert isinstance(answer.document, dict)


def test_effects(typed: Any) -> None:
    found = typed("effects", "backlash", "--json").document
    assert found["base"][:2] == ["EA0B", "EC0B"]
    assert "EXX:reversal" in {one["effect"] for one in found["effects"]}
    for one in found["effects"]:
        assert set(one) >= {"effect", "unit", "meaning", "cause", "remedy"}
    everything = typed("effects", "--json").document["effects"]
    # Issue 5: at least 120 effects, all with words.
    assert len(everything) >= 120
    assert all(
        one["cause"].strip() and one["remedy"].strip() and one["meaning"].strip() for one in everything
    )
    assert typed("effects", "no such words", "--json").document["effects"] == []


@pytest.mark.parametrize("shape", ["step", "sawtooth"])
def test_effects_whose_places_are_searched_are_found(typed: Any, shape: str) -> None:
    found = typed("effects", shape, "--json").document["effects"]
    assert {one["effect"].partition("(")[0].rstrip("84m") for one in found} == {
        f"{error}:{shape}" for error in ("EXX", "EYY", "EZZ")
    }
    assert all("explain searches the places" in one["meaning"] for one in found)


def test_simulate(typed: Any) -> None:
    found = typed(
        "simulate", "virtual", "--effect", "EXX:reversal", "--peak", 4, "--seed", 3, "--json"
    ).document
    assert found["folder"] == found["campaign"] == "virtual"
    assert (found["effect"], found["peak_um"], found["noise_um"], found["seed"]) == (
        "EXX:reversal",
        4.0,
        1.0,
        3,
    )
    assert Path("virtual/probings.csv").is_file()


def test_verify_audit_and_event(typed: Any, db: Path) -> None:
    made = ["event", "HU40-T", 'it\'s "ü"', "--at", "2026-03-05T07:00:00-05:00", "--kind", "repair", "--json"]
    (event,) = typed(*made, db=db).document["events"]
    assert event["happened_at"] == "2026-03-05T12:00:00Z"
    assert event["happened_at_local"] == "2026-03-05T07:00:00"
    assert (event["kind"], event["description"]) == ("repair", 'it\'s "ü"')
    entries = typed("audit", "--last", 2, "--json", db=db).document["entries"]
    assert len(entries) == 2
    assert entries[0]["entry"] > entries[1]["entry"]
    assert entries[0]["subject"] == "event"
    assert entries[0]["actor"] != ""
    found = typed("verify", "--json", db=db).document
    assert found["ok"] is True
    assert (found["faults"], found["entries"]) == ([], entries[0]["entry"])


def test_backup_restore_and_export(typed: Any, db: Path) -> None:
    made = typed("backup", "copy.duckdb", "--json", db=db).document
    assert re.fullmatch("[0-9a-f]{64}", made["sha256"])
    back = typed("restore", "copy.duckdb", "--json", db=Path("back.duckdb")).document
    assert back["sha256"] == made["sha256"]
    assert len(typed("campaigns", "--json", db=Path("back.duckdb")).document["campaigns"]) == 3
    files = typed("export", "tables", "--format", "parquet", "--json", db=db).document["files"]
    assert all(Path(file).stat().st_size > 0 for file in files)
    assert any(file.endswith("v_parameters.parquet") for file in files)


def test_no_document_holds_what_json_lacks(typed: Any, filled: Path) -> None:
    for arguments in (
        ["stats", "five-days", "--where", "run < 3"],
        ["uncertainty", "five-days", "--method", "guf"],
    ):
        answer = typed(*arguments, "--json", db=filled)
        assert all(math.isfinite(value) for value in numbers(answer.document))
