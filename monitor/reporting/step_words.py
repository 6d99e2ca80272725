"""Says how large a step of an error is and between which readings it lies."""

from __future__ import annotations


def middle_within(low_mm: float, high_mm: float, width_mm: float | None) -> tuple[float, float]:
    """From where to where in mm the middle of a step lies, all of whose width lies between two readings: what answers
    of versions say that did not search its middle with its width."""
    half = (width_mm or 0.0) / 2.0
    return low_mm + half, high_mm - half


def step_in_words(
    effect: str, size: str, between_mm: tuple[float, float], width_mm: float | None = None
) -> str:
    """A step of an ``effect``: ``a step of 4.0 ± 0.3 µm in the scale of X between 110 and 125 mm``; ``size`` has its
    uncertainty and unit. One over a width is stated by where its middle lies."""
    error = effect.partition(":")[0]
    axis = error[2:]
    what = f"the scale of {axis}" if error[:2] == f"E{axis[:1]}" else f"{error} along {axis}"
    low_mm, high_mm = between_mm
    if width_mm:
        return (
            f"a step of {size} over some {width_mm:g} mm in {what}, its middle between {low_mm:.4g} and "
            f"{high_mm:.4g} mm"
        )
    return (
        f"a step of {size} in {what} between {low_mm:.4g} and {high_mm:.4g} mm; where between them these positions do "
        "not tell"
    )
