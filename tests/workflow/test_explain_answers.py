"""What compare, explain and identify answer is what they store, for machines and for curves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from monitor.discovery import Verdict
from monitor.documents import from_document
from monitor.exceptions import InputError
from monitor.reporting.adjusting import remedy_holds_for
from monitor.reporting.machine_finding import (
    TOLERATED,
    UNSEEN,
    MachineFinding,
    MissingEffect,
    Move,
    machine_sentences,
)
from monitor.reporting.runs_that_tell import runs_that_tell
from monitor.store import Database, load_analysis
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.compare_answer import CompareAnswer, CurveComparison, MachineComparison
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.explain_answer import CurveMissing, ExplainAnswer, MachineMissing
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.identify.answer import IdentifyAnswer
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
KINDS = {
    "load-cell": (CurveComparison, CurveMissing),
    "hidden-reversal-x": (MachineComparison, MachineMissing),
}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("answers") / "x.duckdb") as db:
        import_folders(db, ImportRequest([EXAMPLES / name for name in KINDS]))
        yield db


@pytest.mark.parametrize("campaign", KINDS)
def test_a_comparison_is_restored_from_what_was_stored(measured: Database, campaign: str) -> None:
    answer = compare(measured, CompareRequest(campaign))
    stored = load_analysis(measured, "comparison", campaign=campaign)
    assert from_document(CompareAnswer, stored.document) == answer
    assert isinstance(answer.comparison, KINDS[campaign][0])
    assert answer.comparison.verdict is Verdict.SOMETHING_IS_MISSING


@pytest.mark.parametrize("campaign", KINDS)
def test_an_explanation_is_restored_from_what_was_stored(measured: Database, campaign: str) -> None:
    answer = explain(measured, ExplainRequest(campaign))
    stored = load_analysis(measured, "explanation", campaign=campaign)
    assert from_document(ExplainAnswer, stored.document) == answer
    assert isinstance(answer.explanation.missing[0], KINDS[campaign][1])
    # Its comparison says so as well.
    assert UNSEEN not in answer.explanation.answer


def test_the_coefficients_of_a_curve_are_restored_from_what_was_stored(measured: Database) -> None:
    answer = identify(measured, IdentifyRequest("load-cell"))
    stored = load_analysis(measured, "identification", campaign="load-cell")
    assert from_document(IdentifyAnswer, stored.document) == answer


def test_a_rate_is_checked_with_the_request() -> None:
    with pytest.raises(InputError, match="the false discovery rate must lie between 0 and 1, not 1"):
        ExplainRequest("any", rate=1.0)


def test_what_moved_comes_first_where_nothing_is_missing() -> None:
    """Was: "Nothing is missing that this plan can see. ball 2 moved by ..."."""
    ball = Move("ball 2", False, 9.13, "µm", 3, 36)
    zero = Move("eb0c", True, 15.1, "µrad", 13, None)
    nothing = MachineFinding(True, [], 0, [ball, zero], (), 8, (), False, ())
    assert machine_sentences(nothing) == (
        "Ball 2 moved by 9.1 µm within run 3, from sequence 36 on. eb0c stepped by 15.1 µrad at run 13. "
        "Nothing else is missing that this plan can see."
    )
    missing = MissingEffect("EXA:harmonic4", "axial displacement of the A axis", None, False, ())
    assert machine_sentences(replace(nothing, missing=[missing])).startswith("The model lacks EXA:harmonic4")


@pytest.mark.parametrize("unseen", [True, False])
def test_an_effect_that_all_residuals_together_do_not_show_is_said_to_be_small(unseen: bool) -> None:
    """`compare` said "explained" of a campaign, and `explain` that something was missing, without a word on why."""
    missing = MissingEffect("EXA:harmonic4", "axial displacement of the A axis", None, False, ())
    finding = MachineFinding(False, [missing], 0, (), (), 8, (), False, (), unseen=unseen)
    sentence = "The model lacks EXA:harmonic4: axial displacement of the A axis."
    assert machine_sentences(finding) == (f"{sentence} {UNSEEN}" if unseen else sentence)
    # "agrees with noise" was said beside a residual that exceeds its statement with p = 4e-16.
    larger = replace(finding, tolerated=True)
    assert machine_sentences(larger) == (f"{sentence} {TOLERATED}" if unseen else sentence)


def test_what_may_be_more_of_an_unknown_shape_is_not_said_to_hold() -> None:
    """Was: "The other effects hold whatever its shape is", of refraction beside a bump of the elevation."""
    shaped = MissingEffect("EBEL:free(11,16)", "angular positioning error of EL", "EBEL:windup", False, ())
    bent = MissingEffect("sight:up:formula(1/tan(elevation))", "bent up", None, False, ("EBEL:harmonic2",))
    other = MissingEffect("EBAZ:harmonic2", "tilt of AZ", None, False, ("EBAZ:harmonic2@warmup",))

    def told(*further: MissingEffect) -> str:
        return machine_sentences(MachineFinding(False, [shaped, *further], 0, (), (), 8, (), False, ()))

    assert told(other).endswith(
        "The other effects hold whatever its shape is. It also lacks EBAZ:harmonic2 (or "
        "EBAZ:harmonic2@warmup, which these data do not rule out)."
    )
    assert "hold whatever" not in told(bent, other)
    assert told(bent, other).endswith(
        "It also lacks EBAZ:harmonic2 (or EBAZ:harmonic2@warmup, which these data do not rule out). "
        "These data cannot tell sight:up:formula(1/tan(elevation)) from more of the shape of EBEL."
    )
    assert "hold whatever" not in told()


def test_rivals_are_said_of_every_effect_and_many_of_them_are_counted() -> None:
    """Was: "It also lacks EZZ:reversal." of one among 15, with a play of 9 µm to be entered in the control."""
    rivals = ("EBX:reversal", "EXX:reversal", "probe:lobing3", "EXY:reversal")
    plain = MissingEffect("EYB:harmonic2", "axial displacement of B", None, False, ())
    tied = MissingEffect("EZZ:reversal", "positioning error of Z", None, False, rivals)
    many = replace(tied, others=(*rivals, "EBY:reversal"))

    def told(*missing: MissingEffect) -> str:
        return machine_sentences(MachineFinding(False, missing, 0, (), (), 8, (), False, ()))

    assert told(plain, many).endswith(
        " It also lacks EZZ:reversal (or EBX:reversal, EXX:reversal, probe:lobing3 or one of 2 more, which these data "
        "do not rule out)."
    )
    assert "(or EBX:reversal or EXX:reversal or probe:lobing3 or EXY:reversal, which" in told(plain, tied)
    assert told(many).endswith("apart from EBX:reversal, EXX:reversal, probe:lobing3 and 2 more.")
    assert told(tied).endswith("apart from EBX:reversal, EXX:reversal, probe:lobing3, EXY:reversal.")
    assert remedy_holds_for("EZZ:reversal", rivals) == (
        ", if it is EZZ:reversal and not one of those named below"
    )
    assert remedy_holds_for("EZZ:reversal", ("EZZ:windup7mm",)) == ""


@pytest.mark.parametrize("driver", ["warmup", "settling", "run_time", "sequence", "each_run"])
@pytest.mark.parametrize("within_runs", [True, False])
def test_nobody_is_asked_to_record_what_follows_from_the_times(driver: str, within_runs: bool) -> None:
    alone = runs_that_tell((driver,), within_runs=within_runs)
    assert driver not in alone
    assert "record" not in alone
    beside = runs_that_tell((driver, "ambient_degC"), within_runs=within_runs)
    assert beside.endswith(", and record ambient_degC")
    recorded = runs_that_tell(("ambient_degC",), within_runs=within_runs)
    assert recorded.endswith(
        "ambient_degC changes, and record it" if within_runs else "ambient_degC, and record it"
    )


def test_an_error_that_the_shape_in_the_model_does_not_follow_is_said_last() -> None:
    finding = MachineFinding(False, (), 0, (), (), 8, (), False, (), not_followed=("EXX", "EYY"))
    first, last = machine_sentences(finding).split(". ")
    assert first == "The model does not explain the measurements, but no other error explains more"
    assert last.startswith("What is left of EXX and EYY is not followed by the shape that was added")
