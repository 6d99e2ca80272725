"""Effects of a curve in words: what each is, what usually causes it, what to do about it, where it is described."""

from __future__ import annotations

from monitor.effects.curve import SEQUENCE, CurveEffect
from monitor.effects.words import Words

# Where the shapes and their treatment are described.
CALIBRATION = "NIST/SEMATECH e-Handbook 2.3.6 (instrument calibration over a regime)"
FIT = "NIST/SEMATECH e-Handbook 4.6.1 (load cell calibration)"
DRIFT = "NIST/SEMATECH e-Handbook 2.3.7 and 2.2 (statistical control of a measurement process)"
PERIODIC = "NIST/SEMATECH e-Handbook 1.4.2.5 (beam deflections)"
GROUPS = "NIST/SEMATECH e-Handbook 2.6 (case studies: probes, runs, days); ISO 5725-2:2019"

#: Periods that the calendar or the sun gives, by unit: length, name, usual cause.
_SEASON = "the seasons: humidity, room temperature or heating act on what is measured or on the instrument"
_DAY = "the course of the day: temperature, sun, traffic, load of the mains or shift work"
_HARMONIC = "a cycle of the seasons that is not a pure sine"
CALENDAR = {
    "d": ((365.2422, "a year", _SEASON), (182.6211, "half a year", _HARMONIC), (7.0, "a week", "the working week"),
          (1.0, "a day", _DAY), (0.5, "half a day", "the tide, or a daily cycle that is not a pure sine")),
    "year": ((1.0, "a year", _SEASON), (0.5, "half a year", _HARMONIC)),
    "month": ((12.0, "a year", _SEASON), (6.0, "half a year", _HARMONIC)),
    "week": ((52.1775, "a year", _SEASON), (26.0887, "half a year", _HARMONIC)),
    "h": ((24.0, "a day", _DAY), (12.0, "half a day", "a daily cycle that is not a pure sine"),
          (168.0, "a week", "the working week")),
    "min": ((1440.0, "a day", _DAY), (60.0, "an hour", "a controller or machine that works by the hour")),
    "s": ((86400.0, "a day", _DAY), (3600.0, "an hour", "a controller or machine that works by the hour")),
}  # fmt: skip
TEMPERATURES = ("degC", "K", "degF")


def calendar_period(period: float, u: float, unit: str) -> float | None:
    """The period of the calendar that a found one agrees with, if it is known well enough to say so."""
    for length, _, _ in CALENDAR.get(unit, ()):
        if abs(period - length) < 2.0 * u and u < 0.05 * length:
            return length
    return None


def _calendar(effect: CurveEffect, unit: str) -> tuple[str, str] | None:
    for length, name, cause in CALENDAR.get(unit, ()):
        if effect.value is not None and abs(effect.value - length) < 1e-3 * length:
            return name, cause
    return None


def describe_curve(effect: CurveEffect, response: str, unit: str = "", *, clock: bool = False) -> Words:
    """An effect of a curve in plain sentences; ``unit`` is that of its input, ``clock`` says that it is the time."""
    name = effect.column
    time = clock or name == SEQUENCE
    where = "from row to row" if name == SEQUENCE else f"with {name}"
    warm = unit in TEMPERATURES
    if effect.shape == "group":
        return Words(
            f"{response} differs between the groups of {name}",
            f"each {name} has a bias of its own: another device, hand, set-up or condition that belongs to it",
            f"calibrate every {name} against the same standard and correct for its bias, or count the spread between "
            "them as an uncertainty",
            GROUPS,
        )
    if effect.shape == "sin":
        known = _calendar(effect, unit) if time else None
        period = known[0] if known else f"{effect.value:.4g} {unit or ('rows' if time else '')}".strip()
        if effect.value is None:
            period = "a period that is searched"
        cause = (
            "something that comes back regularly: a rotating part, a controller, the mains, tides or weather"
        )
        if not time:
            cause = (
                "interpolation error of a scale or converter, or an eccentric part: it repeats with the input"
            )
        return Words(
            f"{response} goes up and down {where}, repeating every {period.removeprefix('a ')}"
            if known and known[0].startswith("a ")
            else f"{response} goes up and down {where}, with a period of {period}",
            known[1] if known else cause,
            "record what has this period and correct for it, or shield the measurement from it"
            if time
            else "check scale, converter and bearings for this period; correct for the cycle",
            PERIODIC,
        )
    if effect.shape == "exp":
        settling = effect.value is None or effect.value > 0
        return Words(
            f"{response} {'settles' if settling else 'grows'} exponentially {where}",
            "warming up, creep, or charging after the start" if time
            else ("a quantity that follows an exponential law (thermistor, absorption, leakage)"),
            "wait until it has settled before measuring, or correct for it with its time constant" if time
            else f"use the exponential law of {name} in the calibration function",
            DRIFT if time else CALIBRATION,
        )  # fmt: skip
    if effect.shape == "step":
        at = "" if effect.value is None else f" at {effect.value:.6g} {unit}".rstrip()
        return Words(
            f"{response} jumps {where}{at}",
            "something was changed, repaired, adjusted, knocked or replaced at that moment" if time
            else "the instrument changes its range, or a part comes into contact",
            "find out what happened then; calibrate again and treat the parts separately" if time
            else f"calibrate the ranges of {name} on either side separately",
            DRIFT if time else CALIBRATION,
        )  # fmt: skip
    if effect.shape == "formula":
        return Words(
            f"{response} follows {effect.column}", "what the user knows of it", "as the user sees fit", FIT
        )
    power = {1: "in proportion to", 2: "with the square of", 3: "with the cube of"}
    if time:
        what = "drifts steadily" if effect.order == 1 else f"drifts at a changing rate (power {effect.order})"
        return Words(
            f"{response} {what} {where}",
            "ageing of what is measured or of the instrument, wear, or a slow change of the surroundings",
            "correct for the drift, shorten the calibration interval, and predict when its limit is reached",
            DRIFT,
        )
    if warm:
        return Words(
            f"{response} changes {power.get(effect.order, f'with power {effect.order} of')} the temperature {name}",
            "temperature acts on what is measured or on the instrument",
            f"keep {name} steady, or correct by its coefficient",
            CALIBRATION,
        )
    if effect.order == 1:
        return Words(
            f"{response} changes in proportion to {name}",
            f"{name} acts on what is measured, and the base model leaves it out",
            f"put {name} into the calibration function, or keep it steady",
            CALIBRATION,
        )
    return Words(
        f"{response} is not straight: it changes {power.get(effect.order, f'with power {effect.order} of')} {name}",
        "the sensor is not linear: its elastic body, its element or its amplifier",
        f"use a calibration function with the {'square' if effect.order == 2 else f'power {effect.order}'} of {name}",
        FIT,
    )
