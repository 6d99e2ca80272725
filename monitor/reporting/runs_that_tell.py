"""Words for what tells effects apart: runs, of those that go with time, the order of readings or a recorded column;
poses, of those that go with where the axes stand."""

from __future__ import annotations

import re
from collections.abc import Sequence

#: Drivers that nobody records, as they follow from the times of the readings: their names in words, and which runs give
#: them other values.
OF_TIMES = {
    "warmup": (
        "the time since the day's first run",
        "runs from a cold start until the machine is warm, and as many of a machine that is warm from the first on",
    ),
    "settling": ("the time since a run began", "runs after pauses of different length"),
    "run_time": (
        "the time within a run",
        "some runs in another order, so that place and time within a run do not go together",
    ),
    "sequence": (
        "the order within a run",
        "some runs in another order, so that place and order within a run do not go together",
    ),
    "each_run": (
        "the run",
        "more runs on other days: what differs from run to run shows over many of them only",
    ),
}

#: The highest order of what errs with the turn of a table; a higher one belongs to a gear.
HIGHEST_OF_TABLES = 3

#: What names of effects have that weight makes.
OF_WEIGHT = ("gravity", "compliance", "link_weights")

#: What tells a move within a run from an effect that is there in every run; which of two things moved.
MOVED_ONCE = "repeat the run: what moved once does not move again at that reading"
WHO_MOVED = (
    "repeat the run with targets that rest beside the machine, read again and again: they seem to move with the "
    "station, and stand still where the machine moved on its base"
)
#: Why no measurement at other poses tells turns of joints apart.
ONE_LINE = "they turn the same links about the same line wherever the axes stand"
NO_POSE_TELLS = "no pose that this machine reaches tells"


def more_runs(runs: int) -> str:
    """Return how many ``runs`` more tell effects apart which the poses do not, or not yet."""
    return f"{further_runs(runs)} at the present poses"


def further_runs(runs: int) -> str:
    """Return how many ``runs`` more to measure."""
    return f"measure {runs} {'run' if runs == 1 else 'runs'} more"


def runs_in_reversed_order(runs: int) -> str:
    """Return how many ``runs`` in the reversed order tell jumps at reversal apart."""
    return (
        f"measure {runs} {'run' if runs == 1 else 'runs'} more in the reversed order, from the last reading to the "
        "first, so that every axis comes from the other side"
    )


def runs_that_tell(drivers: Sequence[str], *, within_runs: bool) -> str:
    """Return which runs give one or two ``drivers`` other values, and what has to be recorded of them.

    What stays the same through a run shows nothing where they have to vary ``within_runs``.
    """
    if len(drivers) == 1 and drivers[0] in OF_TIMES:
        return OF_TIMES[drivers[0]][1]
    recorded = [driver for driver in drivers if driver not in OF_TIMES]
    names = " and ".join(OF_TIMES[driver][0] if driver in OF_TIMES else driver for driver in drivers)
    if len(drivers) == 1:
        runs = f"runs within which {names} changes" if within_runs else f"runs at several values of {names}"
        return f"{runs}, and record it"
    runs = f"runs within which {names} change, not together"
    if not within_runs:
        runs = f"runs in which {names} do not go together"
    if not recorded:
        return runs
    return f"{runs}, and record {recorded[0] if len(recorded) == 1 else 'both'}"


def poses_that_tell(axes: Sequence[str], effects: Sequence[str]) -> str:
    """Return which poses of ``axes`` tell ``effects`` apart; of what weight bends another load does, too, and of orders
    of a gear its ratio."""
    bends = any(word in effect for effect in effects for word in OF_WEIGHT)
    if bends and not axes:
        return "some poses under another load"
    poses = f"more poses over the whole range of {' and '.join(axes) or 'all axes'}"
    if bends:
        return f"{poses}, and some under another load"
    between = f"{poses}, between the present ones"
    return (
        f"{between}, or state the ratio of its gear or worm (gear_ratio)" if _of_a_gear(effects) else between
    )


def _of_a_gear(effects: Sequence[str]) -> bool:
    """Whether ``effects`` are one error at several orders, none of which an axis has without a gear."""
    waves = [effect.partition(":harmonic") for effect in effects]
    orders = {order for _, _, order in waves}
    return (
        len({error for error, _, _ in waves}) == 1
        and len(orders) > 1
        and all(re.fullmatch(r"[\d.]+", order) and float(order) > HIGHEST_OF_TABLES for order in orders)
    )


def positions_that_tell(axes: Sequence[str], step_mm: float) -> str:
    """Return which positions of ``axes`` tell apart what is one at positions so many mm apart."""
    names = " and ".join(axes)
    return (
        f"a run of the same movements with {names} at uneven positions, each off the present ones by another part of "
        f"their {step_mm:g} mm (ISO 230-2)"
    )
