"""Sentences as data: their words, and that a document holds the words alone."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime

import pytest

from monitor.documents import Said, Sentence, from_document, to_document
from monitor.reporting.health.news import (
    BallMoved,
    CheckKind,
    Drifting,
    ImportsRefused,
    ModelLacks,
    NewThisWeek,
    NextCheck,
    NotMeasured,
    ParameterChanged,
    SteppedAtEvent,
)
from monitor.reporting.health.sentences import (
    BadPoint,
    ErrorOf,
    Factor,
    MachineNamed,
    Pose,
    Position,
    RunsNamed,
    ScatteringBall,
)
from monitor.reporting.lacks import Undecided
from monitor.web.schemas import Schemas

DAY = datetime(2026, 3, 4, 7, 30)


@dataclass(frozen=True)
class Page:
    """A record with sentences."""

    check: Said
    remarks: tuple[Said, ...]
    last: Said | None


def test_a_document_holds_the_sentence_and_restores_it() -> None:
    page = Page(NextCheck(CheckKind.ALARM), (BallMoved("B", 12.34, "µm", 7), "from a stored report"), None)
    document = to_document(page)
    assert document == {
        "check": "now",
        "remarks": ["ball B moved by 12.3 µm (run 7)", "from a stored report"],
        "last": None,
    }
    restored = from_document(Page, document)
    assert restored == Page("now", ("ball B moved by 12.3 µm (run 7)", "from a stored report"), None)
    assert to_document(restored) == document


def test_the_schema_of_a_sentence_is_a_text() -> None:
    schemas = Schemas()
    assert schemas.of(Said) == {"type": "string"}
    assert schemas.of(Said | None) == {"anyOf": [{"type": "string"}, {"type": "null"}]}
    assert schemas.of(tuple[Said, ...]) == {"type": "array", "items": {"type": "string"}}


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            ParameterChanged("EXX", "step", -3.21, 0.45, "µm"),
            "EXX stepped by −3.21 µm (u = 0.45 µm)",
        ),
        (
            ParameterChanged("EXX", "slope", 0.5, 0.12, "µm"),
            "EXX began to drift by +0.50 µm a day (u = 0.12 µm a day)",
        ),
        (ParameterChanged("EXX", "decay", 5.0, 1.0, "µm"), "EXX: decay of +5.0 µm (u = 1.0 µm)"),
        (
            SteppedAtEvent("EXX", "crash", 5.0, 1.0, "µm", None),
            "EXX stepped by +5.0 µm at the event 'crash' (u = 1.0 µm)",
        ),
        (
            SteppedAtEvent("EXX", "crash", 5.0, 1.0, "µm", Undecided.ONE_DAY_EACH),
            "EXX differs by +5.0 µm before and after the event 'crash' (u = 1.0 µm by the runs alone): "
            f"{Undecided.ONE_DAY_EACH}",
        ),
        (
            SteppedAtEvent("EXX", "crash", 5.0, 1.0, "µm", Undecided.DAYS_MAY_DO),
            f"EXX differs by +5.0 µm before and after the event 'crash' (u = 1.0 µm): {Undecided.DAYS_MAY_DO}",
        ),
        (
            NewThisWeek(
                (SteppedAtEvent("EXX", "crash", 5.0, 1.0, "µm", Undecided.FEW_DAYS), "repair: zero set")
            ),
            "EXX may have stepped by +5.0 µm (not decided); repair: zero set",
        ),
        (
            NewThisWeek((SteppedAtEvent("EXX", "crash", 5.0, 1.0, "µm", None),)),
            "EXX stepped by +5.0 µm at the event 'crash' (u = 1.0 µm)",
        ),
        (
            ScatteringBall("3", 6.12, 6.08),
            "ball 3 scatters 6.1 times as much as the others (6.1 µm): it may be loose or dirty",
        ),
        (BadPoint(3, 17, "B", "Z", -41.26), "run 3, touch 17, ball B: Z is off by -41.3 µm"),
        (
            BadPoint(1, 49, "ball-3", "x", -3.61, "reading", "target"),
            "run 1, reading 49, target ball-3: x is off by -3.6 µm",
        ),
        (BadPoint(1, 49, "", "x", -3.61, "reading", "target"), "run 1, reading 49: x is off by -3.6 µm"),
        (NewThisWeek(()), "nothing this week"),
        (
            NewThisWeek(("a", "b", "c"), 2, (ModelLacks("EXX:reversal"),)),
            "a; b; c; and 2 more; the model lacks EXX:reversal",
        ),
        (
            NewThisWeek((), drifting=(Drifting("EC0Y", 77.2, 5.0, "µrad"),)),
            "EC0Y drifts by +6.43 µrad a month",
        ),
        (
            NotMeasured("five", last=DAY, state="out of tolerance", refused=(ImportsRefused(1, DAY),)),
            "no run this week; its last run was on 2026-03-04 (five), when it was reported as: out of tolerance; "
            "an import was refused on 2026-03-04",
        ),
        (
            NotMeasured("five", first=DAY, refused=(ImportsRefused(2, DAY),)),
            "not yet measured in this week: its first run was on 2026-03-04 (five); 2 imports were refused, the last "
            "on 2026-03-04",
        ),
        (NotMeasured(), "not yet measured: the database holds no run of it"),
        (
            NextCheck(CheckKind.SHORT_HISTORY, "EXX", date(2026, 3, 9), 4.6),
            "next week: 5 days of history allow no longer forecast",
        ),
        (
            NextCheck(CheckKind.PASSED, "EXX", date(2026, 3, 9)),
            "now: EXX stayed in tolerance with 95 % until 2026-03-09 only",
        ),
        (
            NextCheck(CheckKind.IN_TOLERANCE_UNTIL, "EXX", date(2026, 3, 9)),
            "by 2026-03-09: EXX stays in tolerance with 95 % until then",
        ),
        (
            NextCheck(CheckKind.AS_FAR_AS_HISTORY, "EXX", date(2026, 3, 9)),
            "by 2026-03-09: in tolerance as far ahead as the history is long",
        ),
        (
            Factor(3.456, 13, 0.95, 19.2),
            "U = 3.46 u: all 13 intervals hold at once with 95 %, 19 degrees of freedom",
        ),
        (Factor(3.456, 13, 0.95, None), "U = 3.46 u: all 13 intervals hold at once with 95 %"),
        (RunsNamed("five", 1, 0, DAY, DAY), "the one run of five, 2026-03-04"),
        (
            RunsNamed("five", 4, 16, DAY, datetime(2026, 3, 6)),
            "4 of 20 runs of five, 2026-03-04 to 2026-03-06; the others began after the week",
        ),
        (MachineNamed("Maker", "", "12", "t-X"), "Maker, serial number 12, chain t-X"),
        (ErrorOf("samba@2", ("EXX:reversal",), ("EYY:poly1",)), "samba@2: + EXX:reversal − EYY:poly1"),
        (ErrorOf("samba@1"), "samba@1: as it is"),
        (Position((("x_mm", -178.94), ("b_deg", -90.0))), "X −178.9 mm, B −90°"),
        (Pose(()), "no rotary axes"),
    ],
)
def test_a_sentence_of_a_health_report_says_its_numbers(said: Sentence, words: str) -> None:
    assert str(said) == words


def test_every_kind_of_next_check_has_its_words() -> None:
    words = {str(NextCheck(kind, "EXX", date(2026, 3, 9), 10.0)) for kind in CheckKind}
    assert len(words) == len(CheckKind)
