"""Names of what a residual may depend on, each with its unit, as they stand at the axis of a figure."""

from __future__ import annotations

SINCE_DAY_BEGAN = "time since the day's first start / min"
WARM_UP_WITHIN_RUN = "warm-up, from its mean in the run"
PART_OF_RUN = "part of the run / %"
TIME_IN_RUN = "time_in_run / min"
TIME_OF_DAY = "time_of_day / h"


def predicted(effect: str) -> str:
    """Return the name of the displacement that an effect predicts."""
    return f"what {effect} predicts / µm"


def reading(axis: str, *, turns: bool) -> str:
    """Return the name of an axis's reading."""
    return f"{axis} / {'°' if turns else 'mm'}"


def last_travel(axis: str) -> str:
    """Return the name of the direction in which an axis came."""
    return f"direction of the last travel of {axis}"


def within_pitch(axis: str, pitch_mm: float) -> str:
    """Return the name of an axis's reading within a pitch."""
    return f"{axis} within its pitch of {pitch_mm:g} mm / mm"


def channel(column: str, unit: str, *, late: bool = False) -> str:
    """Return the name of a recorded channel ``temperature_x_degC``, which may be followed late."""
    return f"{_spoken(column, late)} / {unit}"


def channel_within_run(column: str, unit: str, *, late: bool = False) -> str:
    """Return the name of a recorded channel less its mean in the run."""
    return f"{_spoken(column, late)}, from its mean in the run / {unit}"


def _spoken(column: str, late: bool) -> str:
    return column.rpartition("_")[0].replace("_", " ") + (", followed late" if late else "")
