"""The variants of an effect that a scan looks at: time constants and pitches that are not known beforehand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.scene import ChainVariant, MachineEffect
from monitor.discovery.machine.shapes.grids_askew import is_bend_of_another, series_of_setups
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect, Context, TurnEffect, parse_effect, with_time_constant
from monitor.effects.driver import HeatDriver
from monitor.effects.drivers import (
    Always,
    Driver,
    EachRun,
    LaggedTemperature,
    Settling,
    SettlingDriver,
    WarmUp,
    parse_driver,
)
from monitor.effects.drivers.gravity import Gravity
from monitor.effects.shapes import Compliance, Cyclic, Harmonic, parse_shape
from monitor.effects.shapes.poly import Poly
from monitor.effects.shapes.windup import unit_of_width
from monitor.effects.weight import LinkWeights, Load
from monitor.machine import COMPONENTS, Chain
from monitor.records import Array

# Warm-up takes from ten minutes (a small spindle) to a shift (a machine bed); neighbours differ by a factor of
# two, within which exponentials seen over some hours agree to a few per cent.
TIME_CONSTANTS_S = tuple(600.0 * 2.0**step for step in range(7))
# A part follows its sensor in ten minutes to some hours; what is slower hardly moves within a shift.
LAGS_S = TIME_CONSTANTS_S[:5]
# What settles within every run does so in minutes; what takes longer than the run is a line in its time.
PAUSES_S = tuple(300.0 * 2.0**step for step in range(4))
# Pitches searched for an unknown cycle, from fine screw leads up to a third of a small machine's stroke. The
# grid is even in 1/pitch; its step is half a period over the travel, of which a wave between two steps leaves its
# neighbour a fifth at most. Axes of less travel have that of 400 mm.
SHORTEST_PITCH_MM, LONGEST_PITCH_MM, SHORT_TRAVEL_MM = 4.0, 130.0, 400.0
# Over more than 3 m of travel the shortest pitches are left out: every one of them is columns of all readings.
MOST_PERIODS = 750.0

# Widths over which a reversal builds up, from what a long screw gives way to that of covers that drag.
WIDTHS_MM = tuple(10.0 * 2.0**step for step in range(6))
WIDTHS_DEG = tuple(5.0 * 2.0**step for step in range(6))

# Positions that lie together within this are one; a cycle needs its two coefficients, the base's zero and gain, and
# some to spare.
GRID_TOLERANCE_MM, FEWEST_POSITIONS = 0.5, 6
# A wave of fewer periods over the travel, as the positions show it, is a bend.
FEWEST_PERIODS = 2.0

# A driver that hardly varies makes nearly the same columns as none; where the data cannot decide, the plain effect
# leads and the driven one is reported as its rival. 2 log 400 = 12 is what counts as decided.
ODDS_OF_A_DRIVER = 400.0
# A screw that does not turn hardly warms up: what moves the tip alike leads, and that of the still axis is its rival.
ODDS_OF_A_STILL_SCREW = 3.0
# A pitch that positions on a grid askew show as a bend of another axis: the bend leads, the cycle is its rival.
ODDS_OF_A_PITCH_ASKEW = ODDS_OF_A_DRIVER


# Odds against a cube: over positions of one sign it bends as a square does, which leads where both do as well.
ODDS_OF_A_CUBE = 20.0
# Odds against a temperature that is followed late, and against what settles anew in every run: one that is followed at
# once, and a line in the time of the run, do where both do as well.
ODDS_OF_A_LAG = 20.0

# Odds against a reversal that builds up over a width: a play leads where it does as well.
ODDS_OF_A_WIDTH = 20.0

# Odds against what is named beside a finding and never found itself; any evidence of a campaign is smaller.
NEVER_FOUND = 1e300
# A period counts as travelled a little before its end.
WHOLE_PERIOD = 0.95
# Fewer periods over a part of a turn are a smooth bend: other low orders and flexure follow it nearly as well.
BEND_PERIODS, HIGHEST_OF_BENDS = 1.5, 8
# Over less than a quarter of a period a cosine and a sine are a slope and a parabola, to 5 % of what they bend.
SHORTEST_PART = 0.25
# An axis is level where it leans less than 15 degrees: there three quarters of flexure lie about it alone.
LEVEL = 0.26


def without_part_periods(variants: Iterable[ChainVariant], context: Context) -> list[ChainVariant]:
    """The variants, with what only bends over the travel of its axis never found where other causes bend alike, and at
    the odds of a driver elsewhere.

    Over a part of a period a cosine and a sine are a bend of any cause, and so are the components of gravity in the
    frame of an axis, each with a coefficient of its own. About an axis that lies level flexure and refraction bend so,
    too; about any other one they depend on the other axes as well, and poses tell them apart.
    """
    return [
        replace(variant, odds=variant.odds * _odds_of_a_bend(variant.effect, context)) for variant in variants
    ]


def _odds_of_a_bend(effect: MachineEffect, context: Context) -> float:
    """The odds against an effect that may be no more than a bend over the travel of its axis; 1 for all others."""
    if not isinstance(effect, ChainEffect) or not effect.joint.turns:
        return 1.0
    is_slope = isinstance(effect.shape, Poly) and isinstance(effect.driver, Always)
    part = part_of_period(effect, context)
    if part is None and not is_slope:
        return 1.0
    told_apart = isinstance(effect.driver, Always) and not _is_level(effect.term.joint, context)
    long_enough = part is None or part > SHORTEST_PART
    return ODDS_OF_A_DRIVER if told_apart and long_enough else NEVER_FOUND


def _is_level(joint: int, context: Context) -> bool:
    """Whether a turning axis lies level at all poses."""
    along = np.array(context.chain.joints[joint].direction)
    return bool(np.abs(context.gravity[:, joint] @ along).max() < LEVEL)


def part_of_period(effect: MachineEffect, context: Context) -> float | None:
    """The part of its period that the axis of an effect turned; None for whole periods, and for what has none."""
    part = _periods_turned(effect, context)
    return part if part is not None and part < WHOLE_PERIOD else None


def part_of_bend(effect: MachineEffect, context: Context) -> float | None:
    """The periods of an effect that its axis turned where these are so few that it is a smooth bend; None for more, for
    whole turns, after which every order comes back, and for what has no period."""
    part = _periods_turned(effect, context)
    if part is None or part >= BEND_PERIODS:
        return None
    assert isinstance(effect, ChainEffect)
    turned = float(np.ptp(context.positions[:, effect.term.joint])) / (2.0 * np.pi)
    return part if turned < WHOLE_PERIOD else None


def _periods_turned(effect: MachineEffect, context: Context) -> float | None:
    """How many periods of an effect its axis turned; None where it did not turn, and for what has no period."""
    if not isinstance(effect, ChainEffect) or not effect.joint.turns:
        return None
    if isinstance(effect.shape, Harmonic):
        periods = float(effect.shape.order)
    elif isinstance(effect.driver, Gravity | LinkWeights):
        periods = 1.0
    else:
        return None
    turned = float(np.ptp(context.positions[:, effect.term.joint])) / (2.0 * np.pi)
    return periods * turned or None


def bends_of(effect: MachineEffect, context: Context) -> list[ChainVariant]:
    """What the same error looks like over a part of a period: a slope and bends of any cause, the other waves that are
    no more than a bend there, and the weight on it."""
    if not isinstance(effect, ChainEffect):
        return []
    plain = replace(effect, driver=Always(), driver_text="")
    texts = ["poly1", "poly2", "poly3", *(f"harmonic{order}" for order in range(1, HIGHEST_OF_BENDS + 1))]
    bends = [replace(plain, shape=parse_shape(text), shape_text=text) for text in texts]
    bends = [
        bend
        for bend in bends
        if not isinstance(bend.shape, Harmonic)
        or (bend.shape_text != effect.shape_text and part_of_bend(bend, context) is not None)
    ]
    weight = replace(
        effect, shape=parse_shape("const"), shape_text="const", driver=Gravity(), driver_text="gravity"
    )
    return [Variant(bend.text, bend) for bend in (*bends, weight)]


def variants_of(effect: MachineEffect) -> list[ChainVariant]:
    """The effect itself, or one variant for every time constant where it has none of its own."""
    if isinstance(effect.driver, SettlingDriver) and effect.driver.time_constant_s is None:
        constants = constants_of(effect.driver)
        odds = 1.0 if isinstance(effect.driver, WarmUp) else ODDS_OF_A_LAG
        return [
            Variant(effect.text, with_time_constant(effect, tau), len(constants), odds) for tau in constants
        ]
    odds = 1.0
    if isinstance(effect, ChainEffect) and isinstance(effect.shape, Compliance):
        # A drive gives way before a bearing does, and one load is simpler than the weight of every link.
        # A load that changes with the run is the last thing to think of.
        one_load = isinstance(effect.driver, Load) and not isinstance(effect.driver, EachRun)
        simple = one_load and effect.term.component == 3 + effect.joint.main
        odds = 1.0 if simple else ODDS_OF_A_DRIVER
    if isinstance(effect, ChainEffect) and isinstance(effect.shape, Poly) and effect.shape.order > 2:
        odds = ODDS_OF_A_CUBE
    return [Variant(effect.text, effect, odds=odds)]


def constants_of(driver: Driver) -> tuple[float, ...]:
    """The time constants in s that are searched of a driver; none where it has none to search."""
    if not isinstance(driver, SettlingDriver) or driver.time_constant_s is not None:
        return ()
    if isinstance(driver, LaggedTemperature):
        return LAGS_S
    return PAUSES_S if isinstance(driver, Settling) else TIME_CONSTANTS_S


def cycles_of_unknown_pitch(context: Context) -> tuple[ChainVariant, ...]:
    """Positioning errors of every linear axis with every pitch of the grid; where its positions stand so far apart that
    they show hardly any of these, with pitches up to half of its travel."""
    limits = pitch_limits(context)
    travels: list[tuple[str, float, float]] = []
    for joint in context.chain.joints:
        if joint.kind == "linear":
            shortest, travel = limits[joint.name]
            coarse = LONGEST_PITCH_MM < 2.0 * shortest < float("inf")
            longest = max(LONGEST_PITCH_MM, longest_pitch(travel) if coarse else 0.0)
            term = f"E{COMPONENTS[joint.main]}{joint.name}"
            travels.append((term, max(travel, SHORT_TRAVEL_MM), longest))
    return _cycles_over(context.chain, tuple(travels))


@lru_cache(maxsize=16)
def _cycles_over(chain: Chain, travels: tuple[tuple[str, float, float], ...]) -> tuple[ChainVariant, ...]:
    """Those of positioning errors, each with the travel of its axis and the longest pitch in mm."""
    variants: list[ChainVariant] = []
    for term, travel, longest in travels:
        pitches = pitches_over(travel, longest)
        for pitch in pitches:
            text = f"{term}:cyclic{pitch:.6g}mm"
            variants.append(Variant(f"{term}:cyclic", parse_effect(text, chain), len(pitches)))
    return tuple(variants)


def columns_of_pitches(context: Context) -> int:
    """How many columns the cycles of unknown pitch have that are searched: most of a search over long axes."""
    return 2 * len(resolvable(cycles_of_unknown_pitch(context), context))


def frequency_step(travel: float) -> float:
    """The step in 1/mm of the grid of pitches of an axis that travelled so many mm."""
    return 0.5 / max(travel, SHORT_TRAVEL_MM)


def pitches_over(travel: float, longest: float) -> list[float]:
    """The grid of pitches in mm of an axis that travelled so many mm, from the ``longest`` down."""
    step, low = frequency_step(travel), 1.0 / longest
    high = min(1.0 / SHORTEST_PITCH_MM, MOST_PERIODS / travel)
    return [1.0 / (low + number * step) for number in range(int((high - low) / step) + 1)]


def reversals_of_unknown_width(context: Context) -> list[ChainVariant]:
    """Positioning errors of every axis that build up after a reversal, with every width within its travel.

    Of a rotary axis widths within half of it: over a part of a turn that is not reversed what builds up for longer is
    a line, and a turn that is a line has simpler names.
    """
    variants: list[ChainVariant] = []
    for index, joint in enumerate(context.chain.joints):
        term = f"E{COMPONENTS[joint.main + 3 * joint.turns]}{joint.name}"
        travel = float(np.ptp(context.positions[:, index]))
        unit, grid = unit_of_width(joint), WIDTHS_MM
        if joint.turns:
            travel, grid = float(np.rad2deg(travel)) / 2.0, WIDTHS_DEG
        texts = [f"{term}:windup{width:g}{unit}" for width in grid if width < travel]
        variants += [
            Variant(f"{term}:windup", parse_effect(text, context.chain), len(texts), ODDS_OF_A_WIDTH)
            for text in texts
        ]
    return variants


def resolvable(variants: Iterable[ChainVariant], context: Context) -> list[ChainVariant]:
    """The cycles that the plan can separate from longer ones, by the positions of their axis.

    Positions that all stand on a grid (modules 50 mm apart) take every pitch below twice its step for a longer one
    (Nyquist), and a cycle between fewer than ``FEWEST_POSITIONS`` positions fits whatever is there. Positions that lie
    anyhow have no such limit. A period longer than half of what was travelled is a bend. So is what on a grid that
    stands askew goes round along the other axes alone: the bend leads, and that is its rival.
    """
    limits = pitch_limits(context)
    shown = (variant for variant in variants if _is_resolvable(variant.effect, limits))
    return [
        replace(variant, odds=ODDS_OF_A_PITCH_ASKEW)
        if _is_bend_of_another(variant.effect, context)
        else variant
        for variant in shown
    ]


def without_aliases(
    variants: Iterable[ChainVariant], context: Context, stated: Mapping[str, float]
) -> list[ChainVariant]:
    """The variants, with usual leads never found that at the positions of their axis look like a bend; ``stated`` are
    pitches by axis that the file gives, which may be.

    On positions 50 mm apart a lead of 12 mm is a wave of 300 mm: over 300 mm of travel nobody can say that it repeats.
    """
    limits = pitch_limits(context)
    return [
        replace(variant, odds=NEVER_FOUND)
        if isinstance(effect := variant.effect, ChainEffect)
        and isinstance(effect.shape, Cyclic)
        and effect.shape.pitch != stated.get(effect.joint.name)
        and not _repeats(effect.shape.pitch, *limits[effect.joint.name])
        else variant
        for variant in variants
    ]


def that_moves_first(variants: Iterable[ChainVariant], context: Context) -> list[ChainVariant]:
    """The variants, with the heat of linear axes that never moved less likely beforehand."""
    still = np.ptp(context.positions, axis=0) < GRID_TOLERANCE_MM
    return [
        replace(variant, odds=ODDS_OF_A_STILL_SCREW * variant.odds)
        if isinstance(effect := variant.effect, ChainEffect)
        and isinstance(effect.driver, HeatDriver)
        and not effect.joint.turns
        and still[effect.term.joint]
        else variant
        for variant in variants
    ]


def _repeats(pitch: float, shortest: float, travel: float) -> bool:
    """Whether a cycle repeats at positions of which ``shortest`` is the shortest pitch that they show, twice their step
    on a grid."""
    if not 0.0 < shortest < float("inf"):
        return shortest == 0.0 and pitch <= travel
    return apparent_frequency(1.0 / pitch, 2.0 / shortest) * travel >= FEWEST_PERIODS


def apparent_frequency(frequency: float, steps: float) -> float:
    """The frequency in 1/mm that a wave has at positions of which so many ``steps`` are in a mm."""
    return float(abs(frequency - steps * np.round(frequency / steps)))


def _is_bend_of_another(effect: MachineEffect, context: Context) -> bool:
    """Whether a cycle shows nothing but a bend of another axis."""
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Cyclic)
    return is_bend_of_another(effect.shape.pitch, effect.term.joint, context)


def _is_resolvable(effect: MachineEffect, limits: Mapping[str, tuple[float, float]]) -> bool:
    """Whether the positions of its axis separate a cycle from longer ones and from a bend."""
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Cyclic)
    shortest, travel = limits[effect.joint.name]
    # Names of pitches have six digits.
    return shortest <= effect.shape.pitch <= (1.0 + 1e-5) * longest_pitch(travel)


def longest_pitch(travel: float) -> float:
    """The longest pitch in mm that is told of an axis that travelled so many mm: of fewer periods it is a bend."""
    return travel / FEWEST_PERIODS


def pitch_limits(context: Context) -> dict[str, tuple[float, float]]:
    """The shortest and the longest pitch in mm that the positions of every linear axis can show."""
    limits = {}
    for index, joint in enumerate(context.chain.joints):
        if joint.kind == "linear":
            # A search asks for them some twenty times.
            shortest, travel = context.remembered(
                _pitch_limits_of, index, partial(_pitch_limits_of, context, index)
            )
            limits[joint.name] = float(shortest), float(travel)
    return limits


def _pitch_limits_of(context: Context, index: int) -> Array:
    positions = context.positions[:, index]
    return np.array([_shortest_of(positions, series_of_setups(context)), np.ptp(positions)])


def _shortest_of(positions: Array, series: Sequence[npt.NDArray[np.int64]]) -> float:
    """The shortest pitch in mm that any of the series shows; all positions together where each has too few.

    What is free in every series takes up the place of its grid: of several that lie elsewhere none shows what repeats
    at all of its own positions.
    """
    shortest = min((_shortest_pitch(positions[rows]) for rows in series), default=float("inf"))
    return shortest if shortest < float("inf") else _shortest_pitch(positions)


def _shortest_pitch(positions: Array) -> float:
    """The shortest pitch in mm that positions (n,) of an axis can show, 0 where they lie anyhow; infinite where there
    are too few."""
    ordered = np.sort(positions)
    # Touches of one nominal place scatter by less than a step of the grid.
    stops = np.split(ordered, np.flatnonzero(np.diff(ordered) > SHORTEST_PITCH_MM / 2.0) + 1)
    if max(float(stop[-1] - stop[0]) for stop in stops) > GRID_TOLERANCE_MM:
        return 0.0
    if len(stops) < FEWEST_POSITIONS:
        return float("inf")
    steps = np.diff([float(stop.mean()) for stop in stops])
    multiples = steps / steps.min()
    if np.any(np.abs(multiples - np.round(multiples)) >= 0.02):
        return 0.0
    return 2.0 * float(np.sum(steps) / np.sum(np.round(multiples)))


def that_lag(effects: Iterable[MachineEffect], context: Context) -> list[ChainVariant]:
    """The effects of axes that follow a temperature at once, following it late, where it changes within a run."""
    variants = []
    for effect in effects:
        if isinstance(effect, ChainEffect) and (name := _can_lag(effect.driver_text, context)):
            driven = replace(effect, driver=parse_driver(name), driver_text=name)
            variants += variants_of(driven)
    return variants


def _can_lag(driver: str, context: Context) -> str | None:
    """The driver that follows a temperature late; None for what is none, and for one that changes between runs only."""
    values = context.columns.get(driver)
    if values is None or not driver.endswith("_degC") or not np.all(np.isfinite(values)):
        return None
    runs = (values[context.run == run] for run in np.unique(context.run))
    return f"lagged_{driver}" if any(np.ptp(of_run) > 0.0 for of_run in runs) else None


def with_drivers(effect: MachineEffect, drivers: Iterable[str]) -> list[ChainVariant]:
    """The effect multiplied by every driver, where it has none; without its driver, where it has one.

    A driver must earn its place: beforehand the plain effect is the likelier one. No shape settles within the minutes
    after a run's begin: a guideway does not bend and a table does not tilt by what stood still for a while.
    """
    if not isinstance(effect, ChainEffect) or isinstance(effect.shape, Compliance):
        return []
    if not isinstance(effect.driver, Always):
        bare = replace(effect, driver=Always(), driver_text="")
        return [Variant(bare.text, bare)]
    variants: list[ChainVariant] = []
    for name in drivers:
        driven = replace(effect, driver=parse_driver(name), driver_text=name)
        if isinstance(driven.driver, Settling):
            continue
        variants += [replace(variant, odds=ODDS_OF_A_DRIVER) for variant in variants_of(driven)]
    return variants


def each_run(effect: MachineEffect) -> ChainVariant | None:
    """The effect with another size in every run; None where it has a driver already."""
    if not isinstance(effect, ChainEffect | TurnEffect) or not isinstance(effect.driver, Always):
        return None
    varying = replace(effect, driver=EachRun(), driver_text="each_run")
    return Variant(varying.text, varying)
