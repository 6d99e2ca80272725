"""Lines above a compensation table, for a control: of which machine it is, what is added to what, what is not in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN

_CIRCUMSTANCES = (
    "Every point is approached towards growing readings of all axes; what depends on a temperature or a time",
    "is taken at the mean of the run.",
)


@dataclass(frozen=True)
class AxisValue:
    """A number of an axis, in rad where it ``turns``, else in mm."""

    axis: str
    value: float
    turns: bool


@dataclass(frozen=True)
class TableOrigin:
    """Of what a table is."""

    machine: str
    topology: str
    campaign: str
    run: int
    model: str

    def __str__(self) -> str:
        return f"machine {self.machine}, {self.topology}; campaign {self.campaign}, run {self.run}, model {self.model}"


def positioning_lines(
    origin: TableOrigin,
    turns: bool,
    remaining: Mapping[str, float],
    jumps: Mapping[str, int],
    reversals: Sequence[AxisValue],
    steps: Sequence[StepPlace] = (),
) -> list[str]:
    """Return the lines above the tables of linear axes, or of the rotary ones.

    ``remaining`` is what straight lines between the rows leave at most, mm or rad, ``jumps`` at how many
    readings the error jumps between two rows, by axis; ``steps`` are steps of whose place the range alone is known.
    """
    unit, small = ("deg", "urad") if turns else ("mm", "um")
    show = (MICRORADIAN if turns else MICROMETRE).to_display
    correction = "correction_deg" if turns else "correction_um"
    example = "-0.0010 deg at 90 deg: send 89.9990 deg" if turns else "-5.0 um at 100 mm: send 99.9950 mm"
    left_over = ", ".join(f"{max(show(size), 0.01):.2f} {small} ({axis})" for axis, size in remaining.items())
    return [
        str(origin),
        f"ADD {correction} to the commanded reading reading_{unit} of the same axis ({example}).",
        f"error_{small} is the actual less the commanded reading of the axis; the correction is -error. Both are of",
        "the reading as the control shows it: the axis's sign and its side of the bed are in already.",
        "A control that subtracts its table takes the error instead.",
        "Only the errors of each axis along itself are in this table.",
        "Use it or the volumetric table of the run, not both.",
        *_CIRCUMSTANCES,
        f"Between two rows: a straight line, which leaves at most {left_over}.",
        *(line for axis, count in jumps.items() for line in _of_jumps(axis, count)),
        *(line for reversal in reversals for line in _of_reversal(reversal)),
        *_unknown(steps),
    ]


def _of_jumps(axis: str, count: int) -> Iterator[str]:
    """Lines on an axis whose error jumps within its travel."""
    readings = "1 reading" if count == 1 else f"{count} readings"
    yield f"{axis}: the error jumps at {readings}, each between two rows 0.002 mm apart. A control that wants its"
    yield "points further apart leaves up to the whole jump near it."


def _of_reversal(reversal: AxisValue) -> Iterator[str]:
    """Lines on an axis whose reversal value is known: approached the other way it stands elsewhere by that value."""
    unit, small = (MICRORADIAN, "urad") if reversal.turns else (MICROMETRE, "um")
    value = unit.to_display(reversal.value)
    yield f"{reversal.axis}: reversal value {value:.2f} {small} (ISO 230-2). Approached towards falling"
    yield f"readings its error is the printed one less {value:.2f} {small}; a control that compensates the"
    yield f"backlash itself takes the printed error less {value / 2:.2f} {small}, the mean of both directions."


def volumetric_lines(
    origin: TableOrigin,
    linear: Sequence[str],
    turning: Sequence[str],
    tip: tuple[float, float, float],
    zero: Sequence[AxisValue] | None,
    between: Sequence[BetweenPoints | StepPlace] = (),
) -> list[str]:
    """Return the lines above the table of the volumetric error.

    ``linear`` and ``turning`` are the axes, ``tip`` (mm) is that of the tool in the frame of the spindle, ``zero``
    where the workpiece's zero was set; None: where the axes say. ``between`` are errors that its rows do not follow,
    and steps of whose place the range alone is known.
    """
    added = ", ".join(f"correction_{name.lower()}_um to the reading {name.lower()}_mm" for name in linear)
    held = f"; {' and '.join(turning)} stay at the commanded reading" if turning else ""
    x, y, z = tip
    return [
        str(origin),
        f"ADD to the commanded readings of the same row, all together: {added}{held}.",
        "The corrections are of readings as the control shows them: each axis's sign, its side of the bed and the turn",
        "of the rotary axes are in already.",
        "error_x_um, error_y_um, error_z_um: where the tip is less where it should be, relative to the workpiece,",
        "along X, Y, Z of the machine. DO NOT add these, nor their negatives, to readings: an axis that carries the",
        "workpiece may move it the other way.",
        "The place of the tip is corrected, the direction of the tool is not.",
        f"The rows hold for a tool whose tip stands at x {x:.3f}, y {y:.3f}, z {z:.3f} mm in the frame of the",
        "spindle, as the stylus of the probing did. Squareness, tilts and angular errors act with the length of",
        "the tool: another tool needs a table of its own, or an error of 1 um remains for every 100 mm and 10 urad.",
        "not_corrected_um is what no linear axis can move.",
        "The positioning errors of the axes are in this table.",
        "Use it or the positioning table of the run, not both.",
        _of_zero(zero),
        *(f"NOT FOLLOWED {effect}." for effect in between if isinstance(effect, BetweenPoints)),
        *_unknown(step for step in between if isinstance(step, StepPlace)),
        *_CIRCUMSTANCES,
    ]


def _unknown(steps: Iterable[StepPlace]) -> Iterator[str]:
    """Lines on steps of whose place the range alone is known."""
    return (f"PLACE UNKNOWN {step}." for step in steps)


def _of_zero(zero: Sequence[AxisValue] | None) -> str:
    if zero is None:
        return "Absolute: the workpiece's zero is where the axes say; offsets of axes appear whole."
    at = ", ".join(
        f"{axis.axis} {DEGREE.to_display(axis.value) if axis.turns else axis.value:.4f}"
        f"{' deg' if axis.turns else ' mm'}"
        for axis in zero
    )
    return f"The workpiece's zero is set at {at}, where all corrections are zero."
