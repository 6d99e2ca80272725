"""The first page of the weekly report: six questions answered, pictures with dates and limits, no page left empty."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from datetime import date, datetime, timedelta

import numpy as np
import pypdf
import pytest

from monitor.documents import from_document, to_document
from monitor.reporting.health import render
from monitor.reporting.health.answers import answers
from monitor.reporting.health.attention import attention, look_at
from monitor.reporting.health.comparison import MissingEffect, ModelHealth
from monitor.reporting.health.news import CheckKind, NextCheck
from monitor.reporting.health.page import fleet_context
from monitor.reporting.health.records import (
    Change,
    ChangeKind,
    DataQuality,
    Drift,
    Fleet,
    History,
    MachineHealth,
    ParameterHealth,
    State,
    by_urgency,
    fleet_row,
)
from monitor.reporting.health.render import health_html, health_pdf
from monitor.reporting.health.trend_picture import trend_picture
from monitor.reporting.plain_names import plain_name

LAST = datetime(2026, 3, 6, 9)


def parameter(
    name: str = "EC0Y",
    *,
    value: float = 24.0,
    per_month: float = 4.0,
    tolerance: float | None = 20.0,
    runs: int = 30,
) -> ParameterHealth:
    """A run a week on a straight line that ends at ``value``."""
    times = [LAST - timedelta(days=7 * (runs - 1 - index)) for index in range(runs)]
    values = [value + per_month * (time - LAST).days / 30.4375 for time in times]
    beyond = [tolerance is not None and abs(at) > tolerance for at in values]
    since = times[runs - beyond[::-1].index(False)] if beyond[-1] and not all(beyond) else None
    crosses = None
    if tolerance is not None and per_month and abs(value) < 1e6:
        crosses = (LAST + timedelta(days=(tolerance - value) / per_month * 30.4375)).date()
    drift = Drift(
        12 * per_month, 1.2, (12 * per_month - 2.4, 12 * per_month + 2.4), 1e-6 if per_month else 0.6,
        crosses, (crosses, crosses), at_last=value, since=times[0],
    )  # fmt: skip
    out = None if tolerance is None else float(beyond[-1])
    return ParameterHealth(
        name, name, "µrad", value, 1.2, 4.0, tolerance, out, since,
        History(tuple(times), tuple(values), (1.2,) * runs, tuple(time > LAST - timedelta(days=5) for time in times)),
        (), drift, plain_name(name, "w C B X b Z Y (C1) t", (name,)),
    )  # fmt: skip


def machine(name: str, state: str, *parameters: ParameterHealth, **fields: object) -> MachineHealth:
    measured = state != "not measured"
    return MachineHealth(
        **{
            "machine": name, "description": "a machine", "location": "hall 1", "state": State(state),
            "changed": "nothing",
            "since": parameters[0].out_since if parameters else None, "probability_out": None, "next_check": "now",
            "run": "run 1" if measured else "",
            "basis": "repeated runs", "factor": "U = 3.3 u", "parameters": parameters,
            "changes": (), "conditions": (), "model": None,
            "quality": DataQuality(1, 62, 0, (), (), (), (), ()), "map": None,
            **fields,
        }
    )  # fmt: skip


def fleet(*machines: MachineHealth) -> tuple[Fleet, list[MachineHealth]]:
    by_state = sorted(machines, key=lambda health: by_urgency(fleet_row(health)))
    rows = tuple(fleet_row(health) for health in by_state)
    return Fleet(
        "2026-W10", date(2026, 3, 2), date(2026, 3, 8), datetime(2026, 3, 9, 6), "software", 0.05, rows,
        attention=tuple(by_state[:3]),
    ), by_state  # fmt: skip


CHANGED = machine(
    "Stepped", "changed",
    replace(parameter("EA0C", value=3.0, per_month=0.0), changed_at=(datetime(2026, 3, 4),)),
    since=datetime(2026, 3, 4), next_check="by 2026-05-01: EA0C stays in tolerance with 95 % until then",
    changes=(
        Change(ChangeKind.CHANGE, datetime(2026, 2, 27), datetime(2026, 3, 4), "EA0C stepped by +12 µrad", 1e-5, True),
    ),
)  # fmt: skip
DRIFTED = machine("Drifted", "out of tolerance", parameter(), probability_out=0.99)
GOOD = machine("Good", "in tolerance", parameter(value=2.0, per_month=0.0))
AWAY = machine("Away", "not measured")


def pages_of(*machines: MachineHealth) -> list[str]:
    reader = pypdf.PdfReader(io.BytesIO(health_pdf(*fleet(*machines))))
    return [" ".join(page.extract_text().split()) for page in reader.pages]


def test_the_six_questions_are_answered_in_plain_words_on_page_one() -> None:
    page = pages_of(GOOD, AWAY, CHANGED, DRIFTED)[0]
    assert "Worst machine? Drifted (hall 1): out of tolerance; also Stepped." in page
    assert (
        "Why? Squareness X-Y (EC0Y) is +24.0 µrad (U = 4.0, tolerance ± 20.0) and grows by 4.00 µrad a month; "
        "out of tolerance with a probability of > 99.9 %." in page
    )
    # 24 µrad less 4 a month: 20 is passed a month before the last run, and the next weekly run is beyond it.
    assert "Since when? Since 2026-02-06: every run since then lies beyond the tolerance." in page
    assert "What to do? Adjust or compensate squareness X-Y (EC0Y) and measure again now." in page
    assert "What is fine? 1 of 4 machines: Good." in page
    assert "Not judged? Not measured this week: Away; no tolerances are stated for 1 of 3 machines" in page
    # The second machine has its card as well.
    assert "EA0C stepped by +12 µrad (squareness of axis C to Y)." in page
    assert "find out what was done or happened then" in page.lower()


def test_machines_that_no_tolerance_orders_are_in_no_order() -> None:
    """The first by the alphabet stood as the worst, of robots with 57 and 83 um behind it."""
    one, other = machine("A", "model fails"), machine("B", "model fails")
    assert (
        "Worst machine? A (hall 1): model fails; also B (no tolerance says which with model fails is the worst)."
        in pages_of(other, one, GOOD)[0]
    )


def test_a_quiet_week_says_so() -> None:
    page = pages_of(GOOD)[0]
    assert "Worst machine? None: no machine that was measured needs attention." in page
    assert "What is fine? 1 of 1 machine: Good." in page
    assert "Not judged? Everything was judged." in page


@pytest.mark.parametrize(
    ("health", "kind", "sentence"),
    [
        (CHANGED, "since", "Between 2026-02-27 and 2026-03-04."),
        (machine("M", "out of tolerance"), "do", "Adjust or compensate its errors and measure again now."),
        (
            machine("M", "not evaluated", next_check="now: the last run could not be evaluated"),
            "do",
            "Mend what its page names and measure again (next check: now, the last run could not be evaluated).",
        ),
        (machine("M", "may be out of tolerance"), "since", "Not known: this is not stated run by run."),
        (AWAY, "worst", "Not known: no machine was measured this week."),
        (AWAY, "why", "No machine was measured this week, so nothing is known of its state."),
        (
            GOOD,
            "why",
            "No parameter is out of its tolerance, none changed, and the models explain the measurements.",
        ),
        (
            machine("M", "no change seen", probability_out=0.01),
            "why",
            "No parameter that has a tolerance is out of it (not every one has), none changed, and the models explain "
            "the measurements.",
        ),
        (AWAY, "fine", "No machine could be stated to be fine."),
        (
            machine("M", "no change seen", probability_out=0.01),
            "unjudged",
            "Not every parameter has a tolerance: M.",
        ),
        (machine("M", "no change seen"), "unjudged", "Nothing was judged: no tolerances are stated."),
        (machine("M", "model fails"), "unjudged", "Nothing was judged: no tolerances are stated."),
        (
            machine("M", "no change seen"),
            "why",
            "No parameter changed, and the models explain the measurements; no tolerances are stated.",
        ),
    ],
)
def test_every_state_has_its_answer(health: MachineHealth, kind: str, sentence: str) -> None:
    assert {answer.kind: answer.sentence for answer in answers(fleet(health)[0])}[kind] == sentence


def test_without_machines_nothing_is_said_to_have_been_judged() -> None:
    """It read *Everything was judged* of an empty database."""
    sentences = {answer.kind: answer.sentence for answer in answers(fleet()[0])}
    assert sentences["unjudged"] == "Nothing was there to judge: no machines yet."


def test_tolerances_without_uncertainties_are_not_said_to_be_lacking() -> None:
    bare = machine("Bare", "no change seen", next_check=NextCheck(CheckKind.NO_TOLERANCE))
    limited = machine("Limited", "no change seen", next_check=NextCheck(CheckKind.NO_FORECAST))
    sentences = {answer.kind: answer.sentence for answer in answers(fleet(limited)[0])}
    assert sentences["unjudged"] == ("Not against the tolerances stated, for want of uncertainties: Limited.")
    assert sentences["why"] == (
        "No parameter changed, and the models explain the measurements; without uncertainties nothing is held against "
        "the tolerances."
    )
    sentences = {answer.kind: answer.sentence for answer in answers(fleet(limited, bare)[0])}
    assert sentences["unjudged"] == (
        "Not against the tolerances stated, for want of uncertainties: Limited; no tolerances are stated for 1 of 2 "
        "machines evaluated: Bare."
    )
    sentences = {answer.kind: answer.sentence for answer in answers(fleet(bare)[0])}
    assert sentences["unjudged"] == "Nothing was judged: no tolerances are stated."


def test_machines_without_tolerances_are_counted_among_those_that_have_some() -> None:
    week = fleet(GOOD, DRIFTED, CHANGED, AWAY, machine("Bare", "no change seen"))[0]
    sentences = {answer.kind: answer.sentence for answer in answers(week)}
    assert sentences["unjudged"] == (
        "Not measured this week: Away; no tolerances are stated for 2 of 4 machines evaluated: Stepped, Bare."
    )


def test_a_page_without_tolerances_says_that_nothing_was_judged() -> None:
    page = pages_of(machine("Bare", "no change seen"), AWAY)[0]
    assert "Not judged? Nothing was judged: no tolerances are stated; not measured this week: Away." in page
    for question in ("Worst machine?", "Why?", "Since when?", "What to do?", "What is fine?", "Not judged?"):
        assert question in page


def test_a_drift_that_will_reach_its_limit_is_said_with_the_day() -> None:
    soon = machine("M", "may be out of tolerance", parameter(value=18.0, per_month=1.0))
    soon = replace(soon, parameters=(replace(soon.parameters[0], probability_out=0.06),))
    sentences = {answer.kind: answer.sentence for answer in answers(fleet(soon)[0])}
    # 2 µrad at 1 a month: two months of 30.4375 days after the sixth of March.
    assert "grows by 1.00 µrad a month, so that it reaches its tolerance about 2026-05-06" in sentences["why"]


def test_the_forecast_is_drawn_up_to_the_limit_and_the_dates_stand_below() -> None:
    drawn = parameter(value=15.0, per_month=2.0)
    svg = trend_picture("M", drawn)
    assert re.findall(r">(20\d\d-\d\d)<", svg)
    dashed = re.search(r'<path d="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)"[^>]*stroke-dasharray="12 9"', svg)
    assert dashed is not None
    limit = re.search(r'<path d="M[\d.]+ ([\d.]+)L[\d.]+ [\d.]+"[^>]*stroke-dasharray="14 8"', svg)
    assert limit is not None
    heights = [
        float(y) for y in re.findall(r'd="M[\d.]+ ([\d.]+)L[\d.]+ [\d.]+"[^>]*stroke-dasharray="14 8"', svg)
    ]
    assert float(dashed[4]) == pytest.approx(min(heights), abs=4.0)  # ends on the upper limit (y points down)


@pytest.mark.parametrize("runs", [1, 2, 200, 2000])
@pytest.mark.parametrize("value", [0.0, 1e-9, 1e7, -24.0])
def test_the_picture_takes_any_history(runs: int, value: float) -> None:
    svg = trend_picture(
        "A machine with a name that is longer than any picture is wide " * 2,
        parameter(value=value, runs=runs),
    )
    assert "nan" not in svg
    assert "inf" not in svg
    numbers = np.array([float(x) for x in re.findall(r"[MLV ](-?\d+\.\d)", svg)])
    assert np.all(np.abs(numbers) < 2e3)


@pytest.mark.slow
def test_a_short_report_is_set_closer_where_that_saves_an_almost_empty_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machines = [
        replace(GOOD, machine=f"M{index}", parameters=(parameter(value=2.0, per_month=0.0, runs=20),) * 13)
        for index in range(2)
    ]
    assert len(pages_of(*machines)) == 2
    monkeypatch.setattr(render, "_LAID_OUT_AGAIN", 0)
    assert len(pages_of(*machines)) == 3
    *_, last = pages_of(*machines)
    # What is left over of the table of the second machine, a row has the symbol twice.
    assert 0 < last.count("EC0Y") < 2 * 13


def test_a_narrow_screen_gets_one_column_with_the_names_of_the_cells() -> None:
    html = "".join(health_html(*fleet(DRIFTED, GOOD)))
    assert "max-width: 700px" in html
    assert 'data-name="Next check"' in html
    assert 'name="viewport"' in html


def due(name: str = "Mitsui", parameter_name: str = "EC0Y") -> MachineHealth:
    """Near its limit and growing: in tolerance when it was measured, and by now perhaps not."""
    check = NextCheck(CheckKind.PASSED, parameter_name, date(2026, 3, 7), 200.0)
    return machine(
        name, "in tolerance", parameter(parameter_name, value=18.0), probability_out=0.01, next_check=check,
        due=parameter_name,
    )  # fmt: skip


def test_a_machine_that_its_drift_may_have_taken_out_is_not_fine_but_due() -> None:
    week, pages = fleet(GOOD, due(), AWAY)
    sentences = {answer.kind: answer.sentence for answer in answers(week)}
    assert sentences["worst"] == "None: no machine that was measured needs attention."
    assert sentences["fine"] == "1 of 3 machines: Good."
    assert sentences["do"] == (
        "Measure again now: Mitsui (EC0Y stayed in tolerance with 95 % until 2026-03-07 only); the others as planned."
    )
    assert [row.machine for row in week.rows] == ["Away", "Mitsui", "Good"]
    page = " ".join(pypdf.PdfReader(io.BytesIO(health_pdf(week, pages))).pages[0].extract_text().split())
    assert "◔ Mitsui: due for a check" in page
    assert (
        "due for a check nothing is wrong so far, but by its drift it need not be in tolerance any more"
        in page
    )
    assert "grows by 4.00 µrad a month, so that it reaches its tolerance about 2026-03-21." in page
    assert (
        "What to do: Measure it again now, EC0Y stayed in tolerance with 95 % until 2026-03-07 only." in page
    )
    # Beside a machine with which something is wrong it is named as well.
    week, _ = fleet(DRIFTED, due(), due("Okuma"))
    sentences = {answer.kind: answer.sentence for answer in answers(week)}
    assert sentences["do"] == (
        "Adjust or compensate squareness X-Y (EC0Y) and measure again now; measure again now as well: Mitsui, Okuma."
    )


def test_a_stored_record_is_due_as_the_one_that_was_made() -> None:
    """The first page and the pages of machines are written from stored records, whose sentences are words alone."""
    stored = from_document(MachineHealth, to_document(due()))
    assert str(stored.next_check) == str(due().next_check)
    assert not isinstance(stored.next_check, NextCheck)
    week, _ = fleet(GOOD, stored)
    assert [card["state"] for card in cards_of(week)] == ["due for a check"]


def cards_of(week: Fleet) -> list[dict[str, str]]:
    """Machine, state and likes of every card of a first page."""
    return [
        {"machine": card.head.machine, "state": card.head.state, "alike": card.alike}
        for card in fleet_context(week)["cards"]
    ]


def drawn_of(*machines: MachineHealth) -> tuple[list[str], dict[str, tuple[str, ...]]]:
    drawn, alike = attention([look_at(health) for health in machines])
    return list(drawn), alike


def test_cards_do_not_repeat_one_finding_while_another_is_not_drawn() -> None:
    """Five machines of one finding before a change and one that is due: each finding has its card, and the others
    of the first are named on it."""
    out = [replace(DRIFTED, machine=f"Drifted {index}") for index in range(1, 6)]
    shop = [*out, CHANGED, due(), AWAY, GOOD]
    drawn, alike = drawn_of(*shop)
    assert drawn == ["Drifted 1", "Stepped", "Mitsui"]
    assert alike == {"Drifted 1": ("Drifted 2", "Drifted 3", "Drifted 4", "Drifted 5")}
    records = tuple(health for health in shop if health.machine in drawn)
    week = replace(fleet(*shop)[0], attention=records, alike=alike)
    assert "<strong>The same on:</strong> Drifted 2, Drifted 3, Drifted 4, Drifted 5</p>" in "".join(
        health_html(week, [])
    )
    # With room for all of them every machine has its picture.
    assert drawn_of(*out[:2], CHANGED, GOOD) == (["Drifted 1", "Drifted 2", "Stepped"], {})
    assert drawn_of(GOOD) == (["Good"], {})


def test_cards_look_at_every_machine_and_count_those_that_they_do_not_name() -> None:
    """Forty machines of one finding, and one of another behind them all."""
    out = [replace(DRIFTED, machine=f"D{index:02d}") for index in range(40)]
    drawn, alike = drawn_of(*out, CHANGED, GOOD)
    assert drawn == ["D00", "D01", "Stepped"]
    assert alike == {"D00": tuple(f"D{index:02d}" for index in range(2, 40))}
    week = replace(fleet(*out, CHANGED, GOOD)[0], attention=(out[0], out[1], CHANGED), alike=alike)
    page = "".join(health_html(week, []))
    assert "<strong>The same on:</strong> D02, D03, D04, D05, D06, D07 and 32 more</p>" in page


def test_what_the_model_lacks_is_why_a_machine_may_be_out() -> None:
    effect = MissingEffect(
        "EXX:reversal", "positioning of X, jumping", "backlash", "Check the nut of X.", 6.0, None, None, ()
    )
    model = ModelHealth(
        "c", "runs", "samba", "something is missing", "it lacks one", 2.5, 1.0, 28.0, 1e-5, (effect,), 1.0, None, None,
        (),
    )  # fmt: skip
    wide = replace(parameter(value=-8.0, per_month=0.0), expanded=22.0, probability_out=0.075)
    week, _ = fleet(machine("Makino", "may be out of tolerance", wide, probability_out=0.09, model=model))
    sentences = {answer.kind: answer.sentence for answer in answers(week)}
    assert sentences["why"].endswith(
        "; the model lacks positioning of X, jumping (EXX:reversal), and its lack of fit is part of what is uncertain."
    )
    assert sentences["do"] == "Check the nut of X; then measure again now."


def test_a_stated_u_wider_than_the_scatter_of_its_run_is_drawn_with_ends() -> None:
    plain = parameter()
    assert "with ends: U" not in trend_picture("M", plain)
    # u holds lack of fit, which the readings of single runs do not.
    wide = replace(plain, u=6.0, expanded=20.0)
    drawn = trend_picture("M", wide)
    assert "bars: scatter; with ends: U" in drawn
    assert drawn.count("h18") == 2


@pytest.mark.parametrize("missing", [True, False])
@pytest.mark.parametrize(
    ("verdict", "refuted_p"), [("something is missing", None), ("the model explains it", 1e-6)]
)
def test_nothing_is_adjusted_by_values_of_a_model_that_does_not_explain_its_readings(
    verdict: str, refuted_p: float | None, missing: bool
) -> None:
    effect = MissingEffect("EXX:reversal", "a jump", "backlash", "Check the nut of X.", 6.0, None, None, ())
    model = ModelHealth(
        "C-1", "runs", "samba", verdict, "", 2.5, 1.0, 28.0, 1e-5, (effect,) if missing else (), 1.0, None, None, (),
        refuted_p=refuted_p,
    )  # fmt: skip
    week, _ = fleet(replace(DRIFTED, model=model))
    do = {answer.kind: answer.sentence for answer in answers(week)}["do"]
    assert do == (
        "Check the nut of X; then measure again now."
        if missing
        else "Adjust nothing by these values yet: see first what the model lacks (monitor explain C-1)."
    )
    explained = replace(model, verdict="the model explains it", refuted_p=None, missing=())
    week, _ = fleet(replace(DRIFTED, model=explained))
    assert {answer.kind: answer.sentence for answer in answers(week)}["do"].startswith("Adjust or compensate")


def test_readings_that_contradict_their_statement_are_asked_of_that_first() -> None:
    model = ModelHealth(
        "c", "runs", "instruments", "something is missing", "No effect explains more.", 0.5, None, None,
        None, (), 0.06, None, None, (), times_stated=7.9,
    )  # fmt: skip
    sentences = {
        each.kind: each.sentence for each in answers(fleet(machine("M", "model fails", model=model))[0])
    }
    assert sentences["why"] == "No effect explains more; residuals 7.9 times the stated uncertainty."
    assert sentences["do"].startswith(
        "See whether campaign.toml states too small an uncertainty, or another unit than the readings have; else look "
        "at its page for where the model fails, and measure again"
    )


def test_where_work_points_are_elsewhere_the_file_is_looked_at() -> None:
    """Was: look at its page for where the model fails, and measure again."""
    model = ModelHealth(
        "c", "runs", "instruments", "something is missing", "The work points come out elsewhere.", 0.5, None, None,
        None, (), 0.5, None, None, (), work_points_elsewhere="The work points come out elsewhere.",
    )  # fmt: skip
    sentences = {
        each.kind: each.sentence for each in answers(fleet(machine("M", "model fails", model=model))[0])
    }
    assert sentences["do"].startswith("Look at the work points")
    assert "measure again" not in sentences["do"]
