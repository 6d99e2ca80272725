"""Mistakes of whole columns, and of the names of targets throughout: what each is, and what undoes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from monitor.methods import campaign_method
from monitor.records import Array, Campaign
from monitor.units import UNIT_WORDS, mistaken_for_mm

#: Every target is tried at every row up to so many; a part with a hundred points has a name for each.
MOST_TARGETS = 12
MEASURED = ("tracker_", "plane_", "paraboloid_", "point_", "dx_um", "dy_um", "dz_um", "reading_")
DIRECTION = ("direction_x", "direction_y", "direction_z")
#: What a left-handed frame of the directions is, where they are mapped and where they are written.
MIRRORED = (
    "the directions were mirrored (`azimuth_from` of their mapping counts the other way round; or of the columns "
    "direction_x, direction_y and direction_z two were exchanged or one has the other sign)"
)
#: Columns of a sensor of two spots, and the columns of its spots.
SPOTS = (("plane_u_um", "plane_v_um"), ("paraboloid_u_um", "paraboloid_v_um"))
ACROSS = (("plane_u_um", "paraboloid_u_um"), ("plane_v_um", "paraboloid_v_um"))

#: Units that deviations are written in, by the ending of the column, and how much of its unit each is.
IN_UNITS = {
    "_um": {"mm": 1e3, "nm": 1e-3, "thousandths of an inch": 25.4, "inches": 25.4e3},
    "_urad": {"mrad": 1e3, "nrad": 1e-3, "arc seconds": 1e6 * np.pi / 648e3, "degrees": 1e6 * np.pi / 180.0},
}

#: A bar is of the length that its balls are declared apart but for this part, half of a gain that is refused; declared
#: in whole millimetres they may be 0.4 mm off.
NEAR_LENGTH = 0.005
#: Units are told apart by a length that is as near as that.
NEAR_UNIT = 0.02

#: A campaign with a mistake undone.
Undo = Callable[[Campaign], Campaign]
#: Columns with a mistake undone.
Change = Callable[[Mapping[str, Array]], dict[str, Array]]
#: A mistake in words, and what undoes it.
Trial = tuple[str, Undo]


def column_mistakes(campaign: Campaign) -> Iterator[Trial]:
    """Every mistake that is tried of whole columns and of names throughout."""
    machine, readings = campaign.machine, campaign.probings.readings
    linear = [axis for axis in readings if machine.is_linear(axis)]
    turning = turning_axes(campaign)
    measured = measured_columns(campaign)
    directed = DIRECTION[0] in campaign.probings.channels
    if directed:
        # Any of the three columns will do: the frame of what is seen turns as it likes.
        yield MIRRORED, _of_channels(_scaled(DIRECTION[1:2], -1.0))
    yield from exchanged_axes(linear, turning)
    yield from turned_axes(linear, turning)
    yield from reading_mistakes(campaign)
    yield from _axes_in_other_units(linear, turning)
    if directed:
        yield from _angles_of_mounts(turning)
    if measured and measured[0].startswith("tracker_"):
        yield f"{', '.join(measured)} were in metres", _of_channels(_scaled(measured, 1e3))
    yield from _length_of_bar(campaign)
    yield from _exchanged_targets(campaign)


def measured_columns(campaign: Campaign) -> list[str]:
    """The columns of what was measured, directions aside."""
    channels = campaign.probings.channels
    return [name for name in channels if name.startswith(MEASURED) and name not in DIRECTION]


def reading_mistakes(campaign: Campaign) -> Iterator[Trial]:
    """Exchanged columns of what was measured, and their signs."""
    measured = measured_columns(campaign)
    yield from _exchanged_channels(measured, campaign.probings.channels)
    for name in measured:
        yield sign_turned(name), _of_channels(_scaled((name,), -1.0))


def sign_turned(name: str) -> str:
    """The words of a column with another sign."""
    return f"the sign of {name} were the other way round"


def all_signs(measured: Sequence[str]) -> Iterator[Trial]:
    """The signs of all columns of what was measured together."""
    if len(measured) > 1:
        what = f"the signs of {', '.join(measured)} were the other way round"
        yield what, _of_channels(_scaled(measured, -1.0))


def unit_mistakes(measured: Sequence[str], least: float = 0.0) -> Iterator[Trial]:
    """Deviations in another unit than their columns say, of more than ``least`` of it."""
    for ending, units in IN_UNITS.items():
        columns = [name for name in measured if name.endswith(ending)]
        for unit, factor in units.items() if columns else ():
            if factor <= least:
                continue
            verb = "was" if len(columns) == 1 else "were"
            yield f"{', '.join(columns)} {verb} in {unit}", _of_channels(_scaled(columns, factor))


def direction_mistakes(campaign: Campaign) -> Iterator[Trial]:
    """Mistakes of single columns of directions: tried where nothing of ``column_mistakes`` is enough, since all of them
    mirror the directions, and where their frame may turn one is like the other."""
    directions = [name for name in campaign.probings.channels if name in DIRECTION]
    yield from _exchanged_channels(directions, campaign.probings.channels)
    for name in directions:
        yield f"the sign of {name} were the other way round", _of_channels(_scaled((name,), -1.0))


def target_word(campaign: Campaign) -> str:
    """The noun for a target of the campaign."""
    return campaign_method(campaign).nouns.target


def _column(axis: str, linear: Sequence[str]) -> str:
    return f"{axis.lower()}_{'mm' if axis in linear else 'deg'}"


def exchanged_axes(
    linear: Sequence[str], turning: Sequence[str], moved: Sequence[str] | None = None
) -> Iterator[Trial]:
    """Exchanged columns of axes, of which at least one is among those that ``moved``."""
    for group in (linear, turning):
        for first, second in combinations(group, 2):
            if moved is not None and first not in moved and second not in moved:
                continue
            columns = f"the columns {_column(first, linear)} and {_column(second, linear)}"
            yield f"{columns} were exchanged", _of_readings(_exchanged([(first, second)]))


def turned_axes(linear: Sequence[str], turning: Sequence[str]) -> Iterator[Trial]:
    """Axes whose sign was the other way round."""
    for axis in turning:
        hint = f" (`sign` of {axis} in campaign.toml)"
        yield f"the sign of {axis} were the other way round{hint}", _of_readings(_scaled((axis,), -1.0))
    for axis in linear:
        yield f"the sign of {axis} were the other way round", _of_readings(_scaled((axis,), -1.0))


def signs_of_turning(campaign: Campaign) -> Iterator[Trial]:
    """The signs of the axes that turn and moved."""
    return turned_axes([], turning_axes(campaign))


def turning_axes(campaign: Campaign) -> list[str]:
    """The axes that turn, as far as they moved."""
    readings = campaign.probings.readings
    return [axis for axis in readings if not campaign.machine.is_linear(axis) and np.ptp(readings[axis]) > 0]


def _exchanged_channels(measured: Sequence[str], channels: Mapping[str, Array]) -> Iterator[Trial]:
    """Exchanges of columns that stand in the same rows: another instrument's column would leave a setup no readings."""
    for first, second in combinations(measured, 2):
        if np.array_equal(np.isfinite(channels[first]), np.isfinite(channels[second])):
            yield (
                f"the columns {first} and {second} were exchanged",
                _of_channels(_exchanged([(first, second)])),
            )
    if all(name in measured for pair in SPOTS for name in pair):
        yield "u and v of the sensor were exchanged in both pairs of columns", _of_channels(_exchanged(SPOTS))
        yield "the columns of plane and paraboloid were exchanged", _of_channels(_exchanged(ACROSS))


def _axes_in_other_units(linear: Sequence[str], turning: Sequence[str]) -> Iterator[Trial]:
    for axes, unit, factor in (
        (linear, "in metres", 1e3),
        (linear, "in inches", 25.4),
        (turning, "in radians", 180.0 / np.pi),
    ):
        together = [tuple(axes)] if len(axes) > 1 else []
        for group in (*together, *((axis,) for axis in axes)):
            columns = ", ".join(_column(axis, linear) for axis in group)
            verb = "was" if len(group) == 1 else "were"
            yield f"{columns} {verb} {unit}", _of_readings(_scaled(group, factor))


def _angles_of_mounts(turning: Sequence[str]) -> Iterator[Trial]:
    """Angles as observatories write them: in hours, or from the zenith or the pole instead of from the horizon or the
    equator."""
    for axis in turning:
        column = _column(axis, ())
        yield f"{column} was in hours (15 degrees each)", _of_readings(_scaled((axis,), 15.0))
        yield (
            f"{column} was counted from 90 degrees (a zenith or polar distance)",
            _of_readings(_complement(axis)),
        )


def _length_of_bar(campaign: Campaign) -> Iterator[Trial]:
    """The length of a bar whose balls are declared further apart or nearer: in another unit, or as declared."""
    bar = campaign.artefact.scale_bar
    if bar is None:
        return
    first, second = (
        np.array(ball.nominal) for name in bar.balls for ball in campaign.artefact.balls if ball.id == name
    )
    declared = float(np.linalg.norm(first - second))
    if abs(bar.length - declared) <= NEAR_LENGTH * declared:
        return
    apart = f"its balls {' and '.join(bar.balls)} are declared {declared:.4g} mm apart"
    units = mistaken_for_mm(bar.length / declared, NEAR_UNIT)
    if units:
        what = f"the length of the scale bar was {UNIT_WORDS[units[0]]} (length_mm = {bar.length:g}; {apart})"
        yield what, _with_length(bar.length * units[0].factor)
    else:
        what = f"the scale bar were of another length than {bar.length:g} mm (`length_mm`; {apart})"
        yield what, _with_length(declared)


def _with_length(length: float) -> Undo:
    def undo(campaign: Campaign) -> Campaign:
        artefact = campaign.artefact
        assert artefact.scale_bar is not None
        bar = replace(artefact.scale_bar, length=length)
        return replace(campaign, artefact=replace(artefact, scale_bar=bar))

    return undo


def _exchanged_targets(campaign: Campaign) -> Iterator[Trial]:
    names = [str(name) for name in np.unique(campaign.probings.target)]
    if len(names) > MOST_TARGETS:
        return
    identified = _identified_targets(campaign)
    for first, second in combinations(names, 2):
        if identified.intersection((first, second)):
            what = f"{target_word(campaign)}s {first} and {second} were exchanged throughout"
            yield what, _with_targets_exchanged(first, second)


def _identified_targets(campaign: Campaign) -> set[str]:
    """Targets that are more than a name: exchanged throughout, others only get each other's unknown position."""
    artefact = campaign.artefact
    if artefact.l_shape is not None:
        return {module.id for module in artefact.l_shape.modules}
    fixed = {reflector.id for reflector in artefact.reflectors if reflector.fixed}
    return fixed | set(() if artefact.scale_bar is None else artefact.scale_bar.balls)


def _of_readings(change: Change) -> Undo:
    def undo(campaign: Campaign) -> Campaign:
        probings = campaign.probings
        return replace(campaign, probings=replace(probings, readings=change(probings.readings)))

    return undo


def _of_channels(change: Change) -> Undo:
    def undo(campaign: Campaign) -> Campaign:
        probings = campaign.probings
        return replace(campaign, probings=replace(probings, channels=change(probings.channels)))

    return undo


def _exchanged(pairs: Sequence[tuple[str, str]]) -> Change:
    """Exchange pairs of columns."""
    source = dict(pairs) | {second: first for first, second in pairs}
    return lambda columns: {name: columns[source.get(name, name)] for name in columns}


def _scaled(names: Sequence[str], factor: float) -> Change:
    """Multiply some columns."""
    return lambda columns: {
        name: values * (factor if name in names else 1.0) for name, values in columns.items()
    }


def _complement(name: str) -> Change:
    """Count a column of angles (rad) from a right angle."""
    return lambda columns: {**columns, name: np.pi / 2.0 - columns[name]}


def _with_targets_exchanged(first: str, second: str) -> Undo:
    def undo(campaign: Campaign) -> Campaign:
        target = campaign.probings.target
        swapped = np.where(target == first, second, np.where(target == second, first, target))
        return replace(campaign, probings=replace(campaign.probings, target=swapped))

    return undo
