"""What looks like a mistake in a campaign folder, but may be none: told in a sentence, never a reason to refuse.

A unit wrong by a thousand often still fits: the method finds the scale, or the model has room for it. Here the data are
held against what is known without a fit: the declared places of balls and modules, the strokes that calibrations
have, and the angles at which people index. What a fit has to see is told by `identify` and `explain`.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from itertools import chain, pairwise

import numpy as np

from monitor.readers.doubts.angle_doubts import angles_begun_anew, radians
from monitor.readers.doubts.axes_doubts import mistaken_axes
from monitor.readers.doubts.nominal_readings import nominal_words
from monitor.readers.doubts.plate_doubts import plate_doubts, tracker_doubts
from monitor.readers.doubts.repeated_rows import repeated_rows
from monitor.readers.doubts.still_columns import still_columns
from monitor.readers.doubts.tool_frames import ToolFrames, apart
from monitor.readers.doubts.unit_doubts import DISTANCE_TOLERANCE, off_places, runs_in_units
from monitor.readers.doubts.zero_rows import zero_rows
from monitor.readers.faults import and_of
from monitor.readers.setups.file import FORMATS
from monitor.records import Array, Campaign, Run
from monitor.row_files import runs_in
from monitor.units import METRE, MICROMETRE, MICRORADIAN, UNIT_WORDS, nearness_to_bar

#: No calibration moves its axes by less: the smallest artefacts (a ball plate for a micro-machine) have 10 mm.
SHORTEST_TRAVEL = 5.0
#: Standard uncertainties of length standards: a millionth of the length is good, a thousandth is no calibration.
LARGEST_SHARE = 1e-3
#: mm between the calibrated length of a bar and the declared distance of its balls. They are places on one artefact,
#: not set up by hand: declared in whole millimetres they may be 0.4 off (0.32 in hot-cold and cold-cold).
LARGEST_BAR_DIFFERENCE = 0.5
#: Standard uncertainties of probes and trackers in mm: 0.01 µm is finer than any, 1 mm coarser than any.
PROBE_RANGE = (1e-5, 1.0)
#: °C of shops and measuring rooms; spindles and motors are hotter, and not asked. 20 °C in kelvin are 293.
AIR_RANGE = (-40.0, 60.0)
#: Air of shops: 500 hPa is at 5 500 m, above all towns; humidity that is less than 1 % is a share. What certificates
#: print as conditions, with the unit in words. 760 mmHg under a header of hPa is the air of 2 400 m, and not seen.
OTHER_CONDITIONS = {"pressure_hPa": (500.0, 1100.0, "hPa"), "humidity_percent": (1.0, 100.0, "percent")}
#: Two days begin at least so far apart: two shifts of one date do not.
APART = timedelta(hours=12)
#: Clocks of machines and of this computer differ by less.
CLOCKS = timedelta(hours=1)
#: Diameters of calibrated balls in mm.
BALL_RANGE = (0.1, 300.0)


def doubts(campaign: Campaign, frames: ToolFrames | None = None) -> tuple[str, ...]:
    """Sentences on what to look at, each with the numbers that it rests on; empty for most campaigns.

    Where the points that instruments read should have moved is asked only with the ``frames`` of the tool.
    """
    return tuple(
        chain(
            _short_runs(campaign),
            _travel(campaign, frames),
            radians(campaign),
            angles_begun_anew(campaign),
            _places(campaign),
            exchanged_columns(campaign),
            _units_of_runs(campaign),
            _statements(campaign),
            _temperatures(campaign),
            _pressure_and_humidity(campaign),
            _days(campaign),
            _same_start(campaign),
            _to_come(campaign),
            repeated_rows(campaign),
            nominal_words(campaign),
            still_columns(campaign),
            plate_doubts(campaign),
            tracker_doubts(campaign),
            zero_rows(campaign, frames),
        )
    )


def column_doubts(campaign: Campaign, frames: ToolFrames | None = None) -> tuple[str, ...]:
    """The sentences on columns exchanged, of other sign or unit, or of zeros, and on the length of a bar, each of which
    refutes a fit."""
    return (*result_doubts(campaign, frames), *zero_rows(campaign, frames))


def result_doubts(campaign: Campaign, frames: ToolFrames | None = None) -> tuple[str, ...]:
    """The sentences that a result has to repeat: a mirrored or shrunken world fits as well as the true one, where the
    places of the targets are unknown too, and only what was declared of them tells it."""
    return tuple(
        chain(
            _travel(campaign, frames),
            radians(campaign),
            _places(campaign),
            exchanged_columns(campaign),
            _units_of_runs(campaign),
            _length_of_bar(campaign),
            nominal_words(campaign),
            still_columns(campaign),
            plate_doubts(campaign),
            tracker_doubts(campaign),
        )
    )


def _short_runs(campaign: Campaign) -> Iterator[str]:
    runs, counts = np.unique(campaign.probings.run, return_counts=True)
    if len(runs) < 2:
        return
    values, times = np.unique(counts, return_counts=True)
    # The commonest number, of two equally common ones the larger: a plan may grow, a file is only cut off.
    usual = int(values[np.lexsort((values, times))[-1]])
    for run, count in zip(runs.tolist(), counts.tolist(), strict=True):
        if count < usual:
            others = int(np.sum(counts == usual))
            yield (
                f"run {run} has {count} probings, {others} other{'s have' if others > 1 else ' has'} {usual}: if it "
                "was broken off, its file may lack rows"
            )


def _spans(columns: dict[str, Array]) -> dict[str, float]:
    return {name: float(np.ptp(values)) for name, values in columns.items() if len(values)}


def _travel(campaign: Campaign, frames: ToolFrames | None) -> Iterator[str]:
    """Columns in metres: nothing moves by more than a few millimetres."""
    machine, probings = campaign.machine, campaign.probings
    groups = (
        {
            f"{axis.lower()}_mm": values
            for axis, values in probings.readings.items()
            if machine.is_linear(axis)
        },
        {name: values for name, values in probings.channels.items() if name.startswith("tracker_")},
    )
    notes = [_span_in_metres(columns, "") for columns in groups]
    of_setups = {} if frames is None else dict(_points_of_setups(campaign, frames))
    notes += [_span_in_metres(columns, f" of setup {setup}") for setup, columns in of_setups.items()]
    yield from filter(None, notes)


def _span_in_metres(columns: dict[str, Array], of: str) -> str:
    """What is said of columns that span so little as if they were in metres; nothing of others."""
    spans = _spans(columns)
    largest = max(spans.values(), default=0.0)
    if not 0.0 < largest < SHORTEST_TRAVEL:
        return ""
    return f"{and_of(spans)}{of} span {largest:.3g} mm at most: is the unit mm? Readings in metres look like this"


def _points_of_setups(campaign: Campaign, frames: ToolFrames) -> Iterator[tuple[str, dict[str, Array]]]:
    """The setups and the columns of points that each read of its own rows, where the axes moved all points of the tool.

    Axes that turn a head about its tip keep that in place (ISO 10791-6): a camera reads micrometres there.
    """
    probings, channels = campaign.probings, campaign.probings.channels
    for index, setup in enumerate(campaign.artefact.setups if "setup" in channels else ()):
        if setup.reading not in ("point", "pose"):
            continue
        mine = np.flatnonzero(channels["setup"] == index + 1)
        columns = {name: values[mine] for name, values in channels.items() if name.startswith("point_")}
        columns = {name: values[np.isfinite(values)] for name, values in columns.items()}
        short = 0.0 < max(_spans(columns).values(), default=0.0) < SHORTEST_TRAVEL
        if short and any(
            apart(frames(mine[probings.run[mine] == run])) > SHORTEST_TRAVEL
            for run in np.unique(probings.run[mine])
        ):
            yield setup.id, columns


def _places(campaign: Campaign) -> Iterator[str]:
    """Distances between targets that are not the declared ones."""
    off = off_places(campaign)
    if off is None:
        return
    head = (
        f"the distances between {off.noun} that were probed are {off.ratio:.3g} times the declared ones (median of "
        f"{off.count})"
    )
    if off.unit is None:
        yield (
            f"{head}; {off.share:.0%} of them differ by more than {DISTANCE_TOLERANCE:.0%}: check the declared places, "
            "the names of the targets and the units"
        )
        return
    columns = and_of([f"{axis.lower()}_mm" for axis in off.axes])
    yield (
        f"{head}: it looks as if {columns} {'were' if len(off.axes) > 1 else 'was'} {UNIT_WORDS[off.unit]}"
        + (", or the declared places in another unit than mm" if len(off.axes) > 1 else "")
    )


def exchanged_columns(campaign: Campaign) -> Iterator[str]:
    """Yield the sentence on columns of linear axes that are exchanged, or have the other sign; nothing for none."""
    mistaken = mistaken_axes(campaign)
    if mistaken is None:
        return
    columns = and_of([f"{axis.lower()}_mm" for axis in mistaken.axes])
    yield (
        f"at the pose with all rotary axes at zero the {mistaken.count} steps between {mistaken.noun} "
        f"{mistaken.holds} only with "
        + (
            f"the other sign of {columns}: check the sign of [machine.axes.{mistaken.axes}] and of the column"
            if mistaken.turned
            else f"{columns} exchanged: check the order of the columns"
        )
        + ", and whether the artefact stands as it is declared"
    )


def _units_of_runs(campaign: Campaign) -> Iterator[str]:
    """Single runs in another unit than the others."""
    for odd in runs_in_units(campaign):
        yield (
            f"run {odd.run}: {and_of(list(odd.columns))} {'span' if len(odd.columns) > 1 else 'spans'} {odd.ratio:.4g} "
            f"times the span in the other runs, as if {'they were' if len(odd.columns) > 1 else 'it was'} "
            f"{UNIT_WORDS[odd.unit]} there; lengths are in mm"
        )


def _uncertainties(campaign: Campaign) -> Iterator[str]:
    """Standard uncertainties that no probe and no instrument has, by the key that states them."""
    setups = campaign.artefact.setups
    if not setups:
        of_probe = campaign.probe.standard_uncertainty
        if not PROBE_RANGE[0] <= of_probe <= PROBE_RANGE[1]:
            u_um = f"{MICROMETRE.to_display(of_probe):g}"
            yield f"the probe's standard uncertainty is {u_um} µm: is standard_uncertainty_um in µm?"
    for setup in setups:
        u, is_angle = setup.standard_uncertainty, FORMATS[setup.reading].angular
        # An angle is as good as what it makes of a metre.
        if u is None or PROBE_RANGE[0] <= u * (METRE.factor if is_angle else 1.0) <= PROBE_RANGE[1]:
            continue
        unit = MICRORADIAN if is_angle else MICROMETRE
        key = f"standard_uncertainty_{'urad' if is_angle else 'um'}"
        yield f"setup {setup.id}: {key} is {unit.to_display(u):g}: is it in {unit.name}?"


def _statements(campaign: Campaign) -> Iterator[str]:
    """Numbers of campaign.toml that no probe, instrument, ball or length standard has."""
    yield from _uncertainties(campaign)
    balls = {ball.id: ball for ball in campaign.artefact.balls}
    for ball in balls.values():
        if not BALL_RANGE[0] <= ball.diameter <= BALL_RANGE[1]:
            yield f"ball {ball.id} has a diameter of {ball.diameter:g} mm: is diameter_mm in mm?"
    bar = campaign.artefact.scale_bar
    if bar is None:
        return
    if bar.standard_uncertainty > LARGEST_SHARE * bar.length:
        yield (
            f"the scale bar's standard uncertainty is {bar.standard_uncertainty:g} mm, more than a thousandth of its "
            f"length of {bar.length:g} mm: are both in mm?"
        )
    yield from _length_of_bar(campaign)


def _length_of_bar(campaign: Campaign) -> Iterator[str]:
    """A bar whose balls are declared further apart or nearer than it is long."""
    bar, difference = campaign.artefact.scale_bar, bar_difference(campaign)
    if bar is not None and difference is not None and abs(difference) > LARGEST_BAR_DIFFERENCE:
        yield (
            f"the scale bar is {bar.length:g} mm long, but its balls {' and '.join(bar.balls)} are declared "
            f"{bar.length - difference:.7g} mm apart: check length_mm and nominal_mm"
        )


def _temperatures(campaign: Campaign) -> Iterator[str]:
    """Air, bars and workpieces at which nobody measures: kelvin or Fahrenheit."""
    implausible: dict[str, list[tuple[int, float]]] = {}
    for run in campaign.runs:
        for name, value in implausible_temperatures(campaign, run.run).items():
            implausible.setdefault(name, []).append((run.run, value))
    for name, values in implausible.items():
        run_number, value = values[0]
        yield (
            f"{name} is {value:g} in run {run_number} ({len(values)} of {len(campaign.runs)} runs lie outside "
            f"{AIR_RANGE[0]:g} to {AIR_RANGE[1]:g} °C): is the unit °C?"
        )


def _pressure_and_humidity(campaign: Campaign) -> Iterator[str]:
    """Conditions that no shop has: pascals, bars, a share in place of percent."""
    for name, (least, most, unit) in OTHER_CONDITIONS.items():
        odd = [
            (run.run, value)
            for run in campaign.runs
            if (value := run.conditions.get(name)) is not None and not least <= value <= most
        ]
        # An empty cell is nan, and no doubt.
        odd = [(number, value) for number, value in odd if np.isfinite(value)]
        if odd:
            yield (
                f"{name} is {odd[0][1]:g} in run {odd[0][0]} ({len(odd)} of {len(campaign.runs)} runs lie outside "
                f"{least:g} to {most:g}): is the unit {unit}?"
            )


def _days(campaign: Campaign) -> Iterator[str]:
    """Days that are none: several numbers on one date, which an uncertainty over days would rest on."""
    first: dict[int, Run] = {}
    for run in sorted(campaign.runs, key=lambda run: run.started_at):
        first.setdefault(run.day, run)
    began = sorted(first.values(), key=lambda run: run.started_at)
    close = [
        (earlier, later)
        for earlier, later in pairwise(began)
        if earlier.started_at.date() == later.started_at.date()
        and later.started_at - earlier.started_at < APART
    ]
    if close:
        earlier, later = close[0]
        yield (
            f"days {earlier.day} and {later.day} (from runs {earlier.run} and {later.run} on) began on "
            f"{earlier.started_at:%Y-%m-%d} less than {APART.total_seconds() / 3600.0:g} hours apart ({len(close)} of "
            f"{len(began) - 1} such): are the numbers in the column day those of days? What days differ by is "
            f"estimated from them; runs of one date have one number, so give run {later.run} day {earlier.day} in "
            f"{runs_in(campaign)}"
        )


def _same_start(campaign: Campaign) -> Iterator[str]:
    """Runs that cannot have begun at one moment, on one machine."""
    by_moment: dict[datetime, list[Run]] = {}
    for run in campaign.runs:
        by_moment.setdefault(run.started_at, []).append(run)
    alike = [runs for runs in by_moment.values() if len(runs) > 1]
    if alike:
        first, second, *more = alike[0]
        named = f"{first.run}, {second.run}, ..." if more else f"{first.run} and {second.run}"
        yield (
            f"runs {named} state the same started_at, {first.started_at:%Y-%m-%d %H:%M} ({sum(map(len, alike))} of "
            f"{len(campaign.runs)} runs share theirs with another): one machine makes one run at a time. Was a header "
            f"copied? Correct started_at in {runs_in(campaign)}: warm-up of the day, drifts and trends count from it"
        )


def _to_come(campaign: Campaign) -> Iterator[str]:
    """Runs that nobody can have made yet."""
    latest = datetime.now(UTC) + CLOCKS
    later = [run for run in campaign.runs if run.started_at > latest]
    if later:
        run = later[0]
        yield (
            f"run {run.run} started at {run.started_at:%Y-%m-%d %H:%M}, which is still to come ({len(later)} of "
            f"{len(campaign.runs)} runs): correct started_at in {runs_in(campaign)} (year, order of day and month, "
            "offset from UTC); trend, report and plans of the next calibration count from the latest run"
        )


def implausible_temperatures(campaign: Campaign, run: int) -> dict[str, float]:
    """Temperatures of the air, a bar or a workpiece in a run that no place has, °C by name: the one that is farthest
    off."""
    rows = campaign.probings.run == run
    recorded: dict[str, Array] = {
        name: values[rows] for name, values in campaign.probings.channels.items() if name.endswith("_degC")
    }
    for measured in campaign.runs:
        if measured.run == run:
            recorded |= {name: np.array([value]) for name, value in measured.conditions.items()}
    result = {}
    for name, values in recorded.items():
        finite = values[np.isfinite(values)]
        if not len(finite) or nearness_to_bar(name) is None:
            continue
        farthest = float(finite[np.abs(finite - sum(AIR_RANGE) / 2.0).argmax()])
        if not AIR_RANGE[0] <= farthest <= AIR_RANGE[1]:
            result[name] = farthest
    return result


def bar_difference(campaign: Campaign) -> float | None:
    """The calibrated length of the scale bar less the declared distance of its balls in mm; None without either."""
    bar = campaign.artefact.scale_bar
    balls = {ball.id: ball for ball in campaign.artefact.balls}
    if bar is None or not all(name in balls for name in bar.balls):
        return None
    first, second = (np.array(balls[name].nominal) for name in bar.balls)
    return bar.length - float(np.linalg.norm(first - second))
