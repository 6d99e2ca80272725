"""What is said of the calibrations that a history rests on, and of steps between them; as ``messages``."""

from __future__ import annotations

from collections.abc import Collection


def calibrations_not_stored(campaigns: Collection[str]) -> str:
    """Return that identifications do not say what their runs have of calibrated scales and lengths."""
    names = ", ".join(campaigns)
    return (
        f"an older version identified {names} and did not store what the runs have of calibrated scales and lengths: "
        "all of their u counts as that in levels and forecasts; type `monitor identify` for each"
    )


def stated_differently(of: str, certificate: str, quantity: str, surest: str, other: str) -> str:
    """Return that campaigns state one calibration with different uncertainties."""
    named = f"{of} ({certificate})" if certificate else f"{of}, without a certificate,"
    return (
        f"campaigns state the {quantity} of {named} with u = {surest} and with {other}: {surest} counts as common to "
        "all, the rest as their own; a calibration of another day has another certificate"
    )


def step_between_instruments(
    before: str, after: str, stated: str | None, may_be_all: bool, together: Collection[str] = ()
) -> str:
    """Return what is said of a step between instruments; ``stated`` is u of their difference, None without any, and
    ``together`` are the parameters that were judged at once."""
    measured = f"measured by {before} before and by {after} after it"
    if stated is None:
        return f"{measured}: it may be theirs, nothing is known here of their calibrations"
    what = f"all of the steps of {', '.join(together)} at once" if together else "all of it"
    return f"{measured}: their calibrations (u = {stated}) {'can be' if may_be_all else 'are not'} {what}"


def calibrations_apart(before: str, after: str) -> str:
    """Return that the calibrations of instruments have no part in a step between them."""
    return f"measured by {before} before and by {after} after it: their calibrations have no part in it"


def steps_between_instruments(
    before: str, after: str, parameters: Collection[str], may_be_all: bool, p_value: str
) -> str:
    """Return what is said once of the steps of several parameters between the same instruments."""
    names = ", ".join(parameters)
    verdict = (
        f"one error of their calibrations explains all of these ({p_value})"
        if may_be_all
        else f"no error of their calibrations explains all of these ({p_value})"
    )
    return f"{names}: measured by {before} before and by {after} after their steps: {verdict}"
