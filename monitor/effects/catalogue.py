"""The catalogue: every effect that a chain and the recorded columns allow, put together from parts.

Families, each with its reason: guideways bend smoothly (poly1 to poly3 of all six motions of a linear axis);
drives and guides have play (reversal of all six, of every moving axis); screws and scales repeat (cyclic, in
the standard leads and the scale's pitch); tables and spindles repeat with their turn (harmonic1 to
harmonic3 of all six); heat moves axes and stretches screws (every base effect and the spindle with each
driver); weight bends what turns (gravity); the artefact grows and bends.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from monitor.effects.context import Context, InstrumentRows
from monitor.effects.effect import ParsedEffect, parse_effect
from monitor.effects.instrument import changes_of
from monitor.effects.turns.fork import carried_axes
from monitor.machine import COMPONENTS, Chain
from monitor.units import CONDITION_SUFFIXES

# ISO 3408-2: nominal leads of ball screws in mm, the ones that machine tools use.
SCREW_LEADS_MM = (5.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0, 40.0)


def _guideways(chain: Chain) -> Iterable[str]:
    for joint in chain.of_kind("linear"):
        for component in COMPONENTS:
            for order in (1, 2, 3):
                yield f"E{component}{joint.name}:poly{order}"


def _play(chain: Chain) -> Iterable[str]:
    for joint in chain.joints:
        if joint.kind != "spindle":
            for component in COMPONENTS:
                yield f"E{component}{joint.name}:reversal"


def _cycles(chain: Chain, pitches: Mapping[str, float]) -> Iterable[str]:
    for joint in chain.of_kind("linear"):
        along = COMPONENTS[joint.main]
        for pitch in sorted({*SCREW_LEADS_MM, *([pitches[joint.name]] if joint.name in pitches else [])}):
            yield f"E{along}{joint.name}:cyclic{pitch:g}mm"


def _turns(chain: Chain) -> Iterable[str]:
    for joint in chain.joints:
        if joint.turns:
            for component in COMPONENTS:
                for order in (1, 2, 3):
                    yield f"E{component}{joint.name}:harmonic{order}"


def _heat(chain: Chain, base: Iterable[str], drivers: Iterable[str]) -> Iterable[str]:
    spindle = [f"E{axis}{joint.name}:const" for joint in chain.of_kind("spindle") for axis in "XYZAB"]
    # Screws stretch also where a method takes their gains as known.
    gains = [f"E{COMPONENTS[joint.main]}{joint.name}:poly1" for joint in chain.of_kind("linear")]
    # What follows a driver already has only one.
    plain = [text for text in base if not parse_effect(text, chain).driver_text]
    for driver in drivers:
        for effect in (*plain, *gains, *spindle):
            yield f"{effect}@{driver}"


def _weight(chain: Chain) -> Iterable[str]:
    for joint in chain.of_kind("rotary"):
        for component in COMPONENTS:
            yield f"E{component}{joint.name}:const@gravity"


def at_searched_places(chain: Chain) -> tuple[str, ...]:
    """Return examples of what has a place that is searched, not listed: steps and teeth along linear axes."""
    return tuple(
        f"E{COMPONENTS[joint.main]}{joint.name}:{shape}"
        for joint in chain.of_kind("linear")
        for shape in ("step(120)", "sawtooth84mm(12)")
    )


def of_balls(drivers: Iterable[str]) -> tuple[str, ...]:
    """Return the effects of balls on stems, for methods that touch them."""
    return ("stem:gravity", *(f"artefact:expansion@{driver}" for driver in drivers))


def of_single_touches() -> tuple[str, ...]:
    """Return the effects of the probe, for methods whose rows are single touches along a normal."""
    return tuple(f"probe:lobing{lobes}" for lobes in (2, 3))


def of_tool_end(chain: Chain, drivers: Iterable[str]) -> tuple[str, ...]:
    """Return what grows beyond the last axis of the tool where no spindle stands in the chain: a shift of the tool."""
    if not chain.tool or chain.of_kind("spindle"):
        return ()
    last = chain.tool[-1].name
    return tuple(f"E{axis}{last}:const@{driver}" for driver in drivers for axis in "XYZ")


def of_work_end(chain: Chain, drivers: Iterable[str]) -> tuple[str, ...]:
    """Return what grows or shifts beyond the last axis of the work where that turns: what is clamped on a table."""
    if not chain.work or not chain.work[-1].turns:
        return ()
    last = chain.work[-1].name
    return tuple(f"E{axis}{last}:const@{driver}" for driver in drivers for axis in "XYZ")


def of_ram(chain: Chain, base: Iterable[str], drivers: Iterable[str]) -> tuple[str, ...]:
    """Return what grows before a head: shifts of linear axes that no axis has turned, in every direction for which the
    ``base`` has no location error of the first turning axis.

    Where no axis of the tool turns, such a shift is one of the tool.
    """
    if not any(joint.kind == "rotary" for joint in chain.tool):
        return ()
    stated = set(base)
    shifts: list[str] = []
    for branch in (chain.tool, chain.work):
        turning = [index for index, joint in enumerate(branch) if joint.turns]
        still = branch[: turning[0]] if turning else branch
        shifts += [f"E{COMPONENTS[joint.main]}{joint.name}" for joint in still if joint.kind == "linear"]
    firsts = [
        next(joint.name for joint in branch if joint.turns)
        for branch in (chain.tool, chain.work)
        if any(joint.turns for joint in branch)
    ]
    unstated = [shift for shift in shifts if not stated & {f"{shift[:2]}0{name}" for name in firsts}]
    return tuple(f"{shift}:const@{driver}" for driver in drivers for shift in unstated)


def of_zeros(chain: Chain, drivers: Iterable[str]) -> tuple[str, ...]:
    """Return what grows in a machine that instruments look at from its work: the places of its linear axes, tables
    along their own axes, and what the last axis of a head carries."""
    zeros = [f"E{COMPONENTS[joint.main]}0{joint.name}" for joint in chain.of_kind("linear")]
    placed = tuple(f"{zero}@{driver}" for driver in drivers for zero in zeros)
    tables = [f"E{COMPONENTS[joint.main]}{joint.name}:const" for joint in chain.work if joint.turns]
    placed += tuple(f"{growth}@{driver}" for driver in drivers for growth in tables)
    return (*placed, *(of_tool_end(chain, drivers) if chain.tool and chain.tool[-1].turns else ()))


def of_head(chain: Chain) -> tuple[str, ...]:
    """Return the constant errors of a head: of its turning axes, and of what it carries in place of the stated tool
    point.

    No run has them of its own, because a tool point that is not known takes them up; one that is stated does not.
    """
    turning = [joint.name for joint in chain.tool if joint.kind == "rotary"]
    if not turning or not chain.of_kind("linear"):
        return ()
    return (
        *(f"E{component}0{name}" for name in turning for component in COMPONENTS),
        *(f"E{axis}{chain.tool[-1].name}:const" for axis in "XYZ"),
    )


def of_tracker(
    chain: Chain, drivers: Iterable[str], ratios: Mapping[str, float] | None = None, runs: int = 1
) -> tuple[str, ...]:
    """Return effects that hundreds of poses, observed from outside, can show: of drives, gears, read-out and tracker.

    ``ratios`` are gear ratios by axis, as for ``of_drives``; between several ``runs`` the payload may have changed.
    """
    frame = [f"tracker:{motion}@{driver}" for driver in drivers for motion in ("shift", "turn")]
    # Only reflectors beside the robot tell a base that moves from a tracker that does.
    first = chain.tool[0].name
    base = [f"E{component}0{first}@{driver}" for driver in drivers for component in COMPONENTS]
    turning = [joint for joint in chain.tool if joint.turns and runs > 1]
    loads = [f"E{COMPONENTS[joint.main + 3]}{joint.name}:compliance@load_each_run" for joint in turning]
    return (*of_drives(chain, ratios), *loads, *frame, *base)


def of_drives(chain: Chain, ratios: Mapping[str, float] | None = None) -> tuple[str, ...]:
    """Return the effects of drives, gears and read-out.

    ``ratios`` are gear ratios by axis. A strain wave gear errs twice a turn of its generator, a gear pair once a
    turn of its pinion.
    """
    texts = []
    for joint in chain.joints:
        driven = f"{COMPONENTS[joint.main + 3 * joint.turns]}{joint.name}"
        texts.append(f"E{driven}:lag")
        if not joint.turns:
            continue
        texts += [f"E{driven}:compliance@{driver}" for driver in ("gravity", "link_weights")]
        texts += [
            f"E{axis}{joint.name}:compliance@gravity" for axis in "ABC" if f"{axis}{joint.name}" != driven
        ]
        if ratios and joint.name in ratios:
            texts += [f"E{driven}:harmonic{times * ratios[joint.name]:.6g}" for times in (1, 2)]
    return tuple(texts)


def of_sight(chain: Chain) -> tuple[str, ...]:
    """Return the effects of what points somewhere: tube, axes and forks sag, the air bends the line of sight, and a
    scale may count wrongly.

    The first axis of a mount sags alike wherever it turns: that is its own tilt, and left out.
    """
    sagging = [joint.name for joint in chain.tool[1:] if joint.turns]
    turning = [joint for joint in chain.tool if joint.turns]
    return (
        "flexure:tool@gravity",
        *(f"flexure:{name}@gravity" for name in sagging),
        *(f"fork:{name}@gravity" for name in carried_axes(chain)),
        "sight:up:formula(1/tan(elevation))",
        *(f"E{COMPONENTS[3 + joint.main]}{joint.name}:poly1" for joint in turning),
    )


def of_instruments(instruments: InstrumentRows, drivers: Iterable[str]) -> tuple[str, ...]:
    """Return the errors of the instruments themselves, of every setup that may have them."""
    return tuple(changes_of(instruments, drivers))


def drivers_of(context: Context) -> tuple[str, ...]:
    """Return the drivers that the recorded columns allow: time, and every channel that changes.

    A channel with empty cells is among them, so that its effects are refused with a message and not left out.
    """
    channels = [
        name
        for name, values in sorted(context.columns.items())
        if name.rpartition("_")[2] in CONDITION_SUFFIXES
        and len(recorded := values[np.isfinite(values)])
        and recorded.min() < recorded.max()
    ]
    # Where every run is the first of its day, what begins with the run and what begins with the day are the same.
    restarts = ("settling",) if np.any(context.day_time > context.time) else ()
    return ("warmup", "run_time", *restarts, *channels)


def catalogue(
    chain: Chain,
    base: Iterable[str],
    drivers: Iterable[str],
    pitches: Mapping[str, float] | None = None,
    more: Iterable[str] | None = None,
) -> tuple[ParsedEffect, ...]:
    """Return every effect of the catalogue that is not in ``base``, in the order of its families.

    ``drivers`` are names without @; ``pitches`` the scale pitch in mm of axes whose file gives one; ``more`` the
    effects that only the method can show, those of the balls where it is None.
    """
    base = tuple(base)
    drivers = tuple(drivers)
    texts = [
        *_guideways(chain),
        *_play(chain),
        *_cycles(chain, pitches or {}),
        *_turns(chain),
        *_heat(chain, base, drivers),
        *_weight(chain),
        *(of_balls(drivers) if more is None else more),
    ]
    excluded = {parse_effect(text, chain).text for text in base}
    effects: dict[str, ParsedEffect] = {}
    for text in texts:
        effect = parse_effect(text, chain)
        if effect.text not in excluded:
            effects.setdefault(effect.text, effect)
    return tuple(effects.values())
