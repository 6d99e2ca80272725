"""What breaks a tie: for every rival that the data do not rule out, what to do differently in the next run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

from monitor.documents import OMITTED
from monitor.effects.artefact import PROBE_HEAD
from monitor.effects.instrument import HEADS as INSTRUMENT_HEADS
from monitor.records import SecondSetup
from monitor.workflow.plan.test_answer import TestAnswer

if TYPE_CHECKING:
    from monitor.discovery import ChainMissing

#: Drivers that follow from where the axes stand.
OF_POSES = ("", "gravity", "link_weights")


class TieBreak(Enum):
    """What tells an effect from its rivals."""

    #: The poses of ``tell_apart_by``.
    POSES = "poses"
    #: Columns that go with each other today: recorded, and different, in the next runs.
    DRIVERS = "drivers"
    #: More indexations while the driver, which both have, acts.
    INDEXATIONS = "indexations"
    #: Poses that `monitor plan --separate` selects for one pair, while ``drivers`` act.
    PLAN = "plan"
    #: So many ``runs`` more of the present plan, whose poses tell them apart.
    MORE_RUNS = "more_runs"
    #: No pose that the machine reaches; ``runs`` more of the present plan, where these are not too many.
    NO_POSES = "no_poses"
    #: Another run: what moved once within one does not move again at that reading.
    REPEATED = "repeated"
    #: Targets that rest beside the machine, before and after a move: of the station, or of the machine on its base.
    REFERENCES = "references"
    #: So many ``runs`` of the present plan in the reversed order: jumps at reversal that no pose between the present
    #: ones tells apart.
    REVERSED_ORDER = "reversed_order"
    #: More poses over the whole range of ``axes``, of what gives way another load: the method has no plan for pairs.
    MORE_POSES = "more_poses"
    #: The same movements with ``axes`` at uneven positions: on the present ones, ``step_mm`` apart, they are one.
    UNEVEN_POSITIONS = "uneven_positions"
    #: Another instrument at the same movement, or the ``measurement`` that a plan of instruments names.
    INSTRUMENT = "instrument"
    #: No pose of the present set-up does; ``runs`` with another stylus do, or with targets elsewhere (``setup``).
    SETUP = "setup"
    #: Turns of joints that turn about one line, wherever the axes stand and whatever is measured: no pose tells them.
    ONE_LINE = "one_line"
    #: They move the tip alike wherever this machine can touch these targets: a correction serves for both.
    NOTHING = "nothing"


@dataclass(frozen=True)
class Tie:
    """``rivals`` that the same action tells from the effect; ``drivers`` are the columns or conditions to vary,
    ``axes`` those to index or to move, ``measurement`` the test of an instrument, ``runs`` those to measure besides,
    ``setup`` the second set-up to measure in, ``step_mm`` how far apart these are. What stays the same through a run
    shows nothing where ``drivers`` have to vary ``within_runs``."""

    rivals: tuple[str, ...]
    broken_by: TieBreak
    drivers: tuple[str, ...] = field(default=(), metadata=OMITTED)
    axes: tuple[str, ...] = field(default=(), metadata=OMITTED)
    within_runs: bool = field(default=False, metadata=OMITTED)
    runs: int | None = field(default=None, metadata=OMITTED)
    measurement: TestAnswer | None = field(default=None, metadata=OMITTED)
    setup: SecondSetup | None = field(default=None, metadata=OMITTED)
    step_mm: float | None = field(default=None, metadata=OMITTED)


def ties_of(effect: ChainMissing, rivals: Sequence[str], *, is_planned: bool) -> tuple[Tie, ...]:
    """What breaks the tie between an effect and each of its ``rivals``, by the action; ``is_planned`` says that
    `monitor plan --separate` selects poses for the campaign."""
    actions: dict[tuple[TieBreak, tuple[str, ...], tuple[str, ...], SecondSetup | None], list[str]] = {}
    in_order = dict(effect.separation.by_order)
    runs: dict[tuple[TieBreak, SecondSetup | None], int] = {}
    for rival in rivals:
        kind, drivers, axes = _action(effect, rival)
        setup, wanted = None, None
        if kind is TieBreak.NOTHING and (anew := _setup(effect, rival)) is not None:
            kind, (setup, wanted) = TieBreak.SETUP, anew
        if kind is not TieBreak.DRIVERS and any(map(is_of_instrument, (effect.effect, rival))):
            kind, drivers, axes, setup, wanted = TieBreak.INSTRUMENT, (), (), None, None
        if kind is TieBreak.PLAN and rival in in_order:
            kind, wanted = TieBreak.REVERSED_ORDER, in_order[rival]
        if kind is TieBreak.PLAN and not is_planned:
            kind, axes = TieBreak.MORE_POSES, axes_of(effect.effect, rival)
        if wanted is not None:
            runs[kind, setup] = max(wanted, runs.get((kind, setup), 0))
        actions.setdefault((kind, drivers, axes, setup), []).append(rival)
    return tuple(
        Tie(
            tuple(names),
            kind,
            drivers,
            axes,
            kind is TieBreak.DRIVERS and effect.within_runs,
            runs.get((kind, setup)),
            setup=setup,
        )
        for (kind, drivers, axes, setup), names in actions.items()
    )


def _setup(effect: ChainMissing, rival: str) -> tuple[SecondSetup, int] | None:
    """The second set-up that tells a rival which no pose does, and in how many runs."""
    pairs = zip(effect.separation.together, effect.separation.setups, strict=False)
    return next((setup for pair, setup in pairs if {effect.effect, rival} == set(pair)), None)


def is_of_instrument(text: str) -> bool:
    """Whether an effect is an error of an instrument, or of the probe."""
    return text.partition(":")[0] in (*INSTRUMENT_HEADS, PROBE_HEAD)


def _action(effect: ChainMissing, rival: str) -> tuple[TieBreak, tuple[str, ...], tuple[str, ...]]:
    if {effect.effect, rival} in [set(pair) for pair in effect.separation.together]:
        turns = all(re.match("E[ABC]", text) for text in (effect.effect, rival))
        return (TieBreak.ONE_LINE, (), axes_of(effect.effect, rival)) if turns else (TieBreak.NOTHING, (), ())
    moved = [":moved(" in text for text in (effect.effect, rival)]
    if any(moved):
        return (TieBreak.REFERENCES if all(moved) else TieBreak.REPEATED), (), ()
    driver, other = _driver(effect.effect), _driver(rival)
    if driver not in OF_POSES or other not in OF_POSES:
        # What one run did does not act again while others are indexed.
        if driver != other or driver == "each_run":
            columns = (_recorded(name) for name in (driver, other) if name not in OF_POSES)
            return TieBreak.DRIVERS, tuple(dict.fromkeys(columns)), ()
        return TieBreak.INDEXATIONS, (driver,), axes_of(effect.effect, rival)
    return (TieBreak.POSES if effect.separation.poses else TieBreak.PLAN), (), ()


def _driver(text: str) -> str:
    name = text.rpartition("@")[2] if "@" in text else ""
    # A run that drifts unlike the others (@run_time(3)) does not come again: more runs show whether another does.
    name = re.sub(r"^(run_time\(\d+\)|stepped\(.*\)|load_each_run)$", "each_run", name)
    # A time constant that was searched (@warmup45min) is no other driver.
    return re.sub(r"^(warmup|settling|lagged)[\d.]+min", r"\1", name)


def _recorded(driver: str) -> str:
    """The column to vary: of what follows a temperature late that temperature, changed faster than it follows."""
    return driver.removeprefix("lagged_")


def axes_of(*effects: str) -> tuple[str, ...]:
    """The axes that effects name, each once."""
    return tuple(dict.fromkeys(filter(None, map(_axis, effects))))


def _axis(text: str) -> str:
    """The axis that a term names last: C1 of EXC1:const, of a location error C1 of EX0C1; empty where it names none."""
    term = text.partition(":")[0].partition("@")[0]
    return term[2:].lstrip("0123456789") if re.match("E[XYZABC]", term) else ""
