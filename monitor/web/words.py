"""The words, shapes and colours of the pages: what is wrong, how urgent it is, and what to do next."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date, datetime
from typing import TYPE_CHECKING

from monitor.exceptions import MonitorError
from monitor.records import SecondSetup
from monitor.reporting.numbers import round_result, written
from monitor.reporting.runs_that_tell import (
    MOVED_ONCE,
    NO_POSE_TELLS,
    ONE_LINE,
    WHO_MOVED,
    further_runs,
    more_runs,
    poses_that_tell,
    positions_that_tell,
    runs_in_reversed_order,
    runs_that_tell,
)
from monitor.reporting.second_setup import IN_WORDS
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.explain.ties import Tie, TieBreak
from monitor.workflow.fleet.attention import ATTENTION, Attention

if TYPE_CHECKING:
    from monitor.web.ticket import Ticket
    from monitor.workflow.fleet.answer import FleetTableRow
    from monitor.workflow.plan.test_answer import TestAnswer


@dataclass(frozen=True)
class Urgency:
    """How urgent a class of the fleet is: a colour (class of the style sheet), a shape, a word, and the next step,
    which ``adjusts`` the machine by the values or not."""

    colour: str
    shape: str
    word: str
    next_step: str
    adjusts: bool = False


#: The colour of what cannot wait.
STOP = "stop"
_STOP = Urgency(STOP, "■", "act now", "")
_SOON = Urgency("soon", "▲", "plan", "")
_LOOK = Urgency("look", "◆", "look", "")
_GOOD = Urgency("good", "●", "as usual", "")
_OPEN = Urgency("open", "○", "not judged", "")
#: The classes of the fleet (``monitor.workflow.fleet.attention.ATTENTION``, the most urgent first) as people read them.
URGENCIES = dict(
    zip(
        ATTENTION,
        (
            Urgency(
                _STOP.colour,
                _STOP.shape,
                _STOP.word,
                "stop precision work; adjust or compensate, then measure again",
                adjusts=True,
            ),
            Urgency(
                _STOP.colour,
                _STOP.shape,
                _STOP.word,
                "measure again now, before precision work; if it stays, adjust or compensate",
                adjusts=True,
            ),
            Urgency(_SOON.colour, _SOON.shape, _SOON.word, "measure again before the next check is due"),
            Urgency(
                _SOON.colour,
                _SOON.shape,
                _SOON.word,
                "plan an adjustment before the limit is reached",
                adjusts=True,
            ),
            Urgency(
                _LOOK.colour,
                _LOOK.shape,
                _LOOK.word,
                "measure again; if it stays, ask what happened on that day",
            ),
            Urgency(_LOOK.colour, _LOOK.shape, _LOOK.word, "keep measuring; look for what wears or settles"),
            Urgency(_LOOK.colour, _LOOK.shape, _LOOK.word, "compare the days: temperature, set-up, warm-up"),
            Urgency(_GOOD.colour, _GOOD.shape, _GOOD.word, "nothing to do"),
            Urgency(_OPEN.colour, _OPEN.shape, _OPEN.word, "measure on another day"),
            Urgency(_OPEN.colour, _OPEN.shape, _OPEN.word, "compute a map (monitor map CAMPAIGN)"),
        ),
        strict=True,
    )
)


#: The class of machines of which no number is known, beside those of the fleet; and how urgent such a machine is.
WITHOUT_NUMBERS = "no numbers yet"
NOT_IDENTIFIED = Urgency(
    _OPEN.colour,
    _OPEN.shape,
    _OPEN.word,
    "identify: its readings are here, its errors are not computed from them by this version of its model yet",
)
BEING_COMPUTED = Urgency(_OPEN.colour, _OPEN.shape, _OPEN.word, "its numbers are being computed")
DOES_NOT_FIT = Urgency(_LOOK.colour, _LOOK.shape, _LOOK.word, "")
NOT_MEASURED = Urgency(_OPEN.colour, _OPEN.shape, "not measured", "measure it, and import the campaign")

#: Powers of ten below this are written as such.
SMALLEST_POWER = -5
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 3) -> str:
    """Return a number as the tables show it, a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{value:.0f}"
    return text.replace("-", "−")


def aligned(value: float | None, digits: int = 3) -> str:
    """Return a number of a column with all its digits, zeros at the end too: 41.0 beside 22.3."""
    text = number(value, digits)
    if value is None or not math.isfinite(value) or "e" in text:
        return text
    lacking = digits - len(text.lstrip("−0.").replace(".", ""))
    if lacking <= 0 or value == 0.0:
        return text
    return f"{text}{'' if '.' in text else '.'}{'0' * lacking}"


def as_fine_as(value: float | None, u: float | None) -> str:
    """Return a value with as many decimals as its uncertainty has of two digits (JCGM 100, 7.2.6)."""
    if value is None or u is None or not math.isfinite(value) or not math.isfinite(u) or u <= 0.0:
        return number(value)
    return written(round_result(value, u).estimate).replace("-", "−")


def channel(name: str) -> str:
    """Return a recorded condition as people write it: ``x axis / °C`` for ``x_axis_degC``."""
    return name.replace("_degC", " / °C").replace("_", " ")


def with_u(value: float | None, u: float | None, unit: str) -> str:
    """Return a value with its standard uncertainty, rounded together (JCGM 100, 7.2.6)."""
    if value is None or u is None or not math.isfinite(value) or not math.isfinite(u) or u <= 0.0:
        return f"{number(value)} {unit}"
    largest = math.floor(math.log10(max(abs(value), u)))
    if largest < SMALLEST_POWER:
        # Nobody counts seven zeros: a coefficient of a square in mm/N² is such a number.
        share = with_u(value * 10.0**-largest, u * 10.0**-largest, "").rstrip()
        return f"({share}) · 10{str(largest).translate(_RAISED)} {unit}"
    try:
        rounded = round_result(value, u)
    except (MonitorError, ArithmeticError):
        return f"{number(value)} ± {number(u, 2)} {unit}"
    return f"{written(rounded.estimate)} ± {written(rounded.uncertainty)} {unit}"


def probability(p: float | None) -> str:
    """Return a probability as text: "< 0.0001" instead of powers of ten."""
    if p is None or not math.isfinite(p):
        return "–"
    return "< 0.0001" if p < 1e-4 else f"{p:.4f}"


def percent(p: float) -> str:
    """Return a probability in percent, without the digits that nobody reads."""
    return "less than 0.01 %" if p < 1e-4 else f"{number(100.0 * p)} %"


def day(moment: str | datetime | None) -> str:
    """Return the date of a moment, a dash where there is none."""
    if moment is None:
        return "–"
    text = moment if isinstance(moment, str) else moment.isoformat()
    return text[:10]


def earliest_and_latest(interval: tuple[str | None, str | None] | None) -> str:
    """Say within which days something lies, in brackets; an end that is open is named as such."""
    if interval is None or interval == (None, None):
        return ""
    first, last = interval
    if last is None:
        return f" ({day(first)} at the earliest, perhaps never)"
    return f" ({day(last)} at the latest)" if first is None else f" (between {day(first)} and {day(last)})"


def how_far(row: FleetTableRow) -> str:
    """Say how far a parameter is, in words that its class asks for."""
    unit = "" if row.unit == "1" else f" {row.unit}"
    latest = f"{number(row.latest)}{unit}"
    if row.limit is not None and row.latest is not None and row.limit > 0.0:
        share = abs(row.latest) / row.limit
        return f"{latest}, {100.0 * share:.0f} % of its limit of {number(row.limit)}{unit}{_when_beyond(row)}"
    if row.attention is Attention.STANDS_OUT and row.mean is not None and row.latest is not None:
        return f"{latest}, where the days are at {number(row.mean)}{unit} on average"
    if row.attention is Attention.DRIFTS and row.slope_per_year is not None:
        return f"{latest}, moving by {number(row.slope_per_year)}{unit} a year"
    if row.attention is Attention.DAYS_DIFFER and row.sd_pooled:
        days, runs = number(row.between_days, 2), number(row.sd_pooled, 2)
        return f"{latest}; days scatter by {days}{unit}, runs by {runs}{unit}"
    return latest


def _when_beyond(row: FleetTableRow) -> str:
    """Say how likely a parameter is beyond its limit, or when it will be."""
    ahead = ""
    by_last_run = row.attention is Attention.OUT and abs(row.latest or 0.0) < (row.limit or 0.0)
    if (by_last_run or row.attention is Attention.MAY_BE_OUT) and row.probability_out is not None:
        ahead = f"; the last run is beyond it with {percent(row.probability_out)}"
    elif row.years_to_limit is not None:
        ahead = f"; reached in {_span(row.years_to_limit)} at this rate"
    if row.attention is Attention.DUE and row.in_tolerance_at_next_check is not None:
        at_check = f"in tolerance at the next check ({day(row.next_check)})"
        ahead += f"; {at_check} with {percent(row.in_tolerance_at_next_check)}"
    return ahead


def since(row: FleetTableRow) -> str:
    """Say since when a row holds, and what began then."""
    return "" if row.onset is None or row.onset_is is None else f"{day(row.onset)}, {row.onset_is}"


def how_long_ago(last: str, today: date) -> str:
    """Say how long before ``today`` a date as written (2026-03-06) is; nothing of one that is still to come."""
    days = (today - date.fromisoformat(last)).days
    if days < 0:
        return ""
    if days < 2:
        return ("today", "yesterday")[days]
    weeks, months, years = days // 7, int(12.0 * days / DAYS_PER_YEAR), int(days / DAYS_PER_YEAR)
    span = (
        counted(days, "day") if days < 14
        else counted(weeks, "week") if months < 2
        else counted(months, "month") if years < 2
        else counted(years, "year")
    )  # fmt: skip
    return f"{span} ago"


def _span(years: float) -> str:
    if years * DAYS_PER_YEAR < 60.0:
        return f"{max(years * DAYS_PER_YEAR, 0.0):.0f} days"
    return f"{12.0 * years:.0f} months"


def counted(count: int, word: str, plural: str | None = None) -> str:
    """Return "1 run", "2 runs"."""
    return f"{count} {word if count == 1 else plural or word + 's'}"


def so_far(ticket: Ticket) -> str:
    """Say how long something has been computed, what share of it is done or what it does, and whether it waits or is
    being stopped."""
    seconds = f"{counted(int(ticket.seconds), 'second')} so far"
    if ticket.shares and 0.01 <= ticket.shares[-1] < 1.0:
        seconds += f", about {100.0 * ticket.shares[-1]:.0f} % done"
    # As it is said in another thread, it may be over between two looks.
    doing = "".join(f"; {activity}" for activity in ticket.doing)
    if ticket.is_stopping:
        return f"{seconds}, {ticket.taken_back_by} is stopping it"
    return f"{seconds}{doing}" if ticket.is_running else f"{seconds}, waiting for others"


#: Of a question that a program asks so many keys are said, and so many letters of each with its value.
_MOST_SAID, _LONGEST_SAID = 12, 80


def importing(ticket: Ticket) -> str:
    """Say at which of its folders an import is."""
    total = len(ticket.document["folders"])
    if not ticket.said:
        return "The upload is here and waits for another import"
    return f"Importing {ticket.said[-1]}" + (f", {len(ticket.said)} of {total} folders" if total > 1 else "")


def asked_for(ticket: Ticket) -> str:
    """Say what is being computed: the question with what it is about."""
    folders = ticket.document.get("folders")
    if folders is not None:
        return f"import of {counted(len(folders), 'folder')}: {listed(folders)}"
    said = [
        f"{key} {value}" for key, value in ticket.document.items() if value is not None and value is not False
    ]
    return " ".join([ticket.question, *map(_cut, said[:_MOST_SAID])])


def _cut(text: str) -> str:
    """Return the beginning of a text that a program sent, in one line: it may be a query of a page."""
    line = " ".join(text[: 2 * _LONGEST_SAID].split())
    return line if len(line) <= _LONGEST_SAID else f"{line[:_LONGEST_SAID]}…"


def without_option(text: str) -> str:
    """Return a refusal without the dashes of the option that it begins with: the box of a page has its name."""
    return re.sub(r"^--([a-z-]+ )", r"\1", text)


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return some names and how many more there are."""
    every = list(names)
    rest = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + rest


def _another_instrument(test: TestAnswer | None) -> str:
    if test is None:
        return "measure the same movements with another instrument"
    ends = [
        f"{axis.rpartition('_')[0].upper()} {number(low)} to {number(high)}{' mm' if axis.endswith('_mm') else '°'}"
        for axis, (low, high) in test.axes.items()
        if low != high
    ]
    moving = f" with {', '.join(ends)}" if ends else ""
    return f"measure {counted(test.poses, 'pose')} with the {test.instrument}{moving}"


def what_breaks(tie: Tie) -> str:
    """Say what tells the rivals of a tie apart."""
    drivers = " and ".join(driver.replace("_", " ") for driver in tie.drivers)
    return {
        TieBreak.POSES: "probe at the poses below too",
        TieBreak.DRIVERS: f"measure {runs_that_tell(tie.drivers, within_runs=tie.within_runs).replace('_', ' ')}",
        TieBreak.INDEXATIONS: f"bring {' and '.join(tie.axes)} to other positions while {drivers} acts",
        TieBreak.PLAN: f"let the plan choose poses for the pair{f', to probe while {drivers} acts' * bool(drivers)}",
        TieBreak.MORE_RUNS: more_runs(tie.runs or 1),
        TieBreak.NO_POSES: f"{NO_POSE_TELLS} them apart{'' if tie.runs is None else f': {more_runs(tie.runs)}'}",
        TieBreak.REPEATED: MOVED_ONCE,
        TieBreak.REFERENCES: WHO_MOVED,
        TieBreak.REVERSED_ORDER: runs_in_reversed_order(tie.runs or 1),
        TieBreak.MORE_POSES: f"measure {poses_that_tell(tie.axes, tie.rivals)}",
        TieBreak.UNEVEN_POSITIONS: f"measure {positions_that_tell(tie.axes, tie.step_mm or 0.0)}",
        TieBreak.INSTRUMENT: _another_instrument(tie.measurement),
        TieBreak.SETUP: f"{further_runs(tie.runs or 1)} {IN_WORDS[tie.setup or SecondSetup.LONGER_STYLUS]}",
        TieBreak.ONE_LINE: f"no pose does: {ONE_LINE}",
        TieBreak.NOTHING: (
            "no touch of these targets does: they move the tip alike, and one correction serves both with this stylus"
        ),
    }[tie.broken_by]
