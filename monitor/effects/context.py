"""What an effect may depend on: position and last move of every axis, time, and recorded columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.machine import Chain, axis_frames, gravity_in_joint_frames
from monitor.records import Array, Campaign, Probings
from monitor.units import DEGREE

# ISO 1:2022: the reference temperature of geometrical specifications.
REFERENCE_TEMPERATURE_DEGC = 20.0
# A smaller move (mm, rad) reverses nothing: an axis that is sent to the same position again returns to a micrometre or
# a few microradians, and play and friction of guides and gears take a few of each to be turned round.
SMALLEST_MOVE_MM = 10e-3
SMALLEST_MOVE_RAD = 50e-6
# A measured axis stops where the surface is: errors of the machine and the lay of the piece shift the stops of touches
# that were sent to one position, by up to 40 um in examples/tilting-table and free-form-pocket, whose next larger moves
# are 0.3 mm. What no plan asked for reverses nothing either. Of the places of a plate, which the file states, each move
# was asked for.
SMALLEST_MOVE_BETWEEN_STOPS_MM = 0.1
# Columns of up to so many probings are held: 0.1 MB each, some hundred in a search.
MOST_REMEMBERED = 20_000


@dataclass(frozen=True)
class ReadBy:
    """A setup as effects know it: its ``id``, its ``instrument`` (empty where nobody says it), its ``kind`` of reading,
    how many ``numbers`` it reads a row, and whether they are along the axes of a frame of its own."""

    id: str
    instrument: str
    kind: str
    numbers: int
    has_own_frame: bool = False


@dataclass(frozen=True)
class InstrumentRows:
    """What instruments read at the n rows, d numbers a row.

    ``setup`` (n,) is the index of each row's setup among ``setups``; ``ideal`` (n, d) mm what a machine without errors
    shows to instruments that stand as stated, NaN where nothing is read; ``towards`` (n, d, 3) unit vectors along which
    the tool moves where a number grows, in the frame of the last tool axis, zero for angles. Angles stand in these
    numbers as what they come to at ``lever`` mm.
    """

    setups: tuple[ReadBy, ...]
    setup: npt.NDArray[np.int64]
    ideal: Array
    towards: Array
    lever: float

    def taken(self, rows: npt.NDArray[np.int64]) -> InstrumentRows:
        """Return the chosen rows, in that order, with repetitions; setups without rows stay named."""
        return replace(self, setup=self.setup[rows], ideal=self.ideal[rows], towards=self.towards[rows])


@dataclass(frozen=True)
class Context:
    """The n probings, as the effects need them.

    ``positions`` (n, J) physical displacements in mm and rad as read; ``expected`` (n, J) the same without each
    row's noise, where a method can compute it, for effects that follow fine steps; ``run`` (n,) the run's number;
    ``sequence`` (n,);
    ``time`` (n,) s since the run began; ``day_time`` (n,) s since the first run of the day began; ``run_time``
    (n,) from 0 to 1 within a run; ``target`` (n,) names; ``nominal`` (n, 3) mm, where the target should be in
    the frame of the last work axis, NaN where the file does not say; ``columns`` recorded columns by their names in
    the file, in its units; ``sight`` (n, 3) unit vectors along the tool in the frame of the last tool axis, None where
    nothing says them; ``instruments`` what read the rows, None where a method has one instrument alone; ``stretch``
    (n,) numbers the run as it was measured where runs are one set-up, None where that is ``run``; ``set_up`` (n,)
    numbers what was measured before an instrument was set up by hand, None where none was; ``measured`` the probings
    whose ranges scale shapes and drivers where these probings are only planned or a part of them, None where these are
    it;
    ``approach`` (n, J) is the sign of the move that ended at a row where the readings say so and positions do not, else
    0; ``resting`` names the targets beside the machine; ``stops_are_stated``: the file says where the axes stop that
    were brought to a target; ``part_of`` are the probings of the campaign of which these are the rows ``rows`` (n,), in
    runs that may have other numbers; None where these are all of them.
    """

    chain: Chain
    positions: Array
    run: npt.NDArray[np.int64]
    sequence: npt.NDArray[np.int64]
    time: Array
    day_time: Array
    run_time: Array
    target: npt.NDArray[np.str_]
    nominal: Array
    columns: Mapping[str, Array]
    expected: Array | None = None
    sight: Array | None = None
    instruments: InstrumentRows | None = None
    stretch: npt.NDArray[np.int64] | None = None
    set_up: npt.NDArray[np.int64] | None = None
    approach: npt.NDArray[np.int64] | None = None
    measured: Context | None = None
    resting: frozenset[str] = frozenset()
    stops_are_stated: bool = False
    part_of: Context | None = None
    rows: npt.NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return len(self.run)

    @property
    def stretches(self) -> tuple[npt.NDArray[np.int64], ...]:
        """The rows of each stretch without a break: before it nobody knows where the axes were."""
        if self.set_up is None:
            return self._as_measured
        return tuple(
            rows[self.set_up[rows] == number]
            for rows in self._as_measured
            for number in np.unique(self.set_up[rows])
        )

    @property
    def _as_measured(self) -> tuple[npt.NDArray[np.int64], ...]:
        """The rows of each run as it was measured."""
        of = self.run if self.stretch is None else self.stretch
        return tuple(np.flatnonzero(of == number) for number in np.unique(of))

    @property
    def places(self) -> Array:
        """The positions (n, J) of the axes for effects: ``expected`` where a method computed it, else as read.

        The position at which a measured axis stops depends on the noise of that touch. An effect of the reading would
        fit the noise that it is to explain.
        """
        return self.positions if self.expected is None else self.expected

    @property
    def scaling(self) -> Context:
        """The probings whose ranges scale shapes and drivers: these, or those measured before these were planned."""
        return self if self.measured is None else self.measured

    @property
    def campaign(self) -> Context:
        """The probings of the whole campaign: what runs, times and channels make of a row is told by all of them."""
        return self if self.part_of is None else self.part_of

    def of_campaign(self, columns: Array) -> Array:
        """Return of columns (N, ...) of the whole campaign those (n, ...) of these probings."""
        return columns if self.rows is None else np.asarray(columns[self.rows])

    def part(self, rows: npt.NDArray[np.int64]) -> Context:
        """Return the chosen rows as part of the campaign, of which drivers and ranges remain."""
        of_campaign = rows if self.rows is None else self.rows[rows]
        return replace(self.taken(rows), part_of=self.campaign, rows=of_campaign, measured=self.scaling)

    def taken(self, rows: npt.NDArray[np.int64]) -> Context:
        """Return the chosen rows (any number of them), in that order, with repetitions."""
        arrays: dict[str, Any] = {
            field.name: values[rows]
            for field in fields(self)
            if isinstance(values := getattr(self, field.name), np.ndarray)
        }
        return replace(
            self,
            **arrays,
            columns={name: values[rows] for name, values in self.columns.items()},
            instruments=None if self.instruments is None else self.instruments.taken(rows),
        )

    def expecting(self, expected: Array) -> Context:
        """Return the same probings with ``expected`` (n, J), in the columns of the axes' readings too."""
        columns = dict(self.columns)
        for index, joint in enumerate(self.chain.joints):
            name = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
            if name in columns and not np.array_equal(expected[:, index], self.positions[:, index]):
                columns[name] = joint.sign * expected[:, index] / (DEGREE.factor if joint.turns else 1.0)
        return replace(self, expected=expected, columns=columns)

    def remembered(self, source: object, joint: int | None, compute: Callable[[], Array]) -> Array:
        """What ``compute`` gives of a ``source`` (a shape, a driver) at a joint, computed once for these probings.

        A search looks at some thousand products of a few dozen of them. Sources that cannot be hashed are computed each
        time, and so are those of many probings, which would be held beside each other.
        """
        if len(self) > MOST_REMEMBERED:
            return compute()
        try:
            columns = self._columns.get((source, joint))
        except TypeError:
            return compute()
        if columns is None:
            columns = self._columns[source, joint] = compute()
        return columns

    @cached_property
    def _columns(self) -> dict[tuple[object, int | None], Array]:
        return {}

    @cached_property
    def travel(self) -> Array:
        """Sign (n, J) of every axis's last travel; before an axis has moved in a run, that of its position.

        The controller references every axis at zero, so a first position is reached from there. Moves are counted from
        the end of the last one; a move that is too small leaves the sign as it was, unless the row was approached anew.
        """
        turning = np.array([joint.turns for joint in self.chain.joints], dtype=bool)
        places = self.places
        stops = np.any(places != self.positions, axis=0)
        smallest = np.where(
            turning,
            SMALLEST_MOVE_RAD,
            np.where(stops & (not self.stops_are_stated), SMALLEST_MOVE_BETWEEN_STOPS_MM, SMALLEST_MOVE_MM),
        )
        signs = np.zeros_like(places)
        for rows in self.stretches:
            ended, last = np.zeros(places.shape[1]), np.zeros(places.shape[1])
            for row in rows:
                moved = np.abs(places[row] - ended) > smallest
                last = np.where(moved, np.sign(places[row] - ended), last)
                ended = np.where(moved, places[row], ended)
                if self.approach is not None:
                    last = np.where(self.approach[row] != 0, self.approach[row], last)
                signs[row] = last
        return signs

    @cached_property
    def moves(self) -> Array:
        """The move (n, J) in mm and rad by which every axis came to its pose; rows at one pose share it.

        Zero at the first pose of a run: nobody recorded where the axes were before.
        """
        moves = np.zeros_like(self.places)
        for rows in self.stretches:
            steps = np.diff(self.places[rows], axis=0)
            last = np.zeros(self.places.shape[1])
            for row, step in zip(rows[1:], steps, strict=True):
                last = step if np.any(step) else last
                moves[row] = last
        return moves

    @cached_property
    def run_order(self) -> Array:
        """From 0 at a run's first row to 1 at its last, by their order (n,)."""
        order = np.zeros(len(self))
        for rows in self._as_measured:
            order[rows] = np.arange(len(rows)) / max(len(rows) - 1, 1)
        return order

    @cached_property
    def gravity(self) -> Array:
        """Unit vectors (n, J, 3) of gravity in the frame of every axis."""
        return gravity_in_joint_frames(self.chain, self.positions)

    @cached_property
    def axis_frames(self) -> tuple[Array, Array]:
        """Rotations (n, J, 3, 3) and origins (n, J, 3) mm of the frames of every axis, by the nominal chain."""
        return axis_frames(self.chain, self.positions)


def positions_of(chain: Chain, readings: Mapping[str, Array]) -> Array:
    """Return physical displacements (n, J) of all joints; a joint without readings stands at zero."""
    count = len(next(iter(readings.values())))
    positions = np.zeros((count, len(chain.joints)))
    for index, joint in enumerate(chain.joints):
        if joint.name in readings:
            positions[:, index] = joint.sign * readings[joint.name]
    return positions


def _nominal(campaign: Campaign) -> Array:
    """Return nominal positions (n, 3) mm of the targets: of the ball, else ``nominal_x_mm`` and so on, else NaN."""
    probings = campaign.probings
    balls = {ball.id: ball.nominal for ball in campaign.artefact.balls}
    recorded = [probings.channels.get(f"nominal_{axis}_mm") for axis in "xyz"]
    unknown = 0.0 if any(column is not None for column in recorded) else np.nan
    rows = np.column_stack(
        [np.full(len(probings), unknown) if column is None else column for column in recorded]
    )
    for index, target in enumerate(probings.target):
        if target in balls:
            rows[index] = balls[target]
    return rows


def _day_time(campaign: Campaign) -> Array:
    """Return the time (n,) s since the first run of the day began."""
    first_of_day = {
        run.day: min(other.started_at for other in campaign.runs if other.day == run.day)
        for run in campaign.runs
    }
    starts = {run.run: (run.started_at - first_of_day[run.day]).total_seconds() for run in campaign.runs}
    day_time: Array = campaign.probings.time + np.array([starts[int(run)] for run in campaign.probings.run])
    return day_time


def _run_time(probings: Probings) -> Array:
    """Return the time (n,) within a run, from 0 at its first probing to 1 at its last."""
    run_time = np.zeros(len(probings))
    for number in np.unique(probings.run):
        rows = probings.run == number
        start, end = probings.time[rows].min(), probings.time[rows].max()
        run_time[rows] = (probings.time[rows] - start) / (end - start) if end > start else 0.0
    return run_time


def _columns(campaign: Campaign, chain: Chain) -> dict[str, Array]:
    """Return channels, conditions of the runs, readings of the axes and the time, by the names in the file."""
    probings = campaign.probings
    runs = {run.run: run for run in campaign.runs}
    columns: dict[str, Array] = dict(probings.channels)
    for name in sorted({name for run in campaign.runs for name in run.conditions}):
        if name not in columns:
            columns[name] = np.array([runs[int(run)].conditions.get(name, np.nan) for run in probings.run])
    turning = {joint.name for joint in chain.joints if joint.turns}
    for axis, values in probings.readings.items():
        turns = axis in turning
        columns[f"{axis.lower()}_{'deg' if turns else 'mm'}"] = values / DEGREE.factor if turns else values
    return {**columns, "time_s": probings.time}


def context_of(campaign: Campaign, chain: Chain) -> Context:
    """Return the context of all probings of a campaign, in file order. Raises DataError where there are none."""
    probings = campaign.probings
    if len(probings) == 0:
        raise DataError(f"campaign {campaign.name} has no probings")
    return Context(
        chain=chain,
        positions=positions_of(chain, probings.readings),
        run=probings.run,
        sequence=probings.sequence,
        time=probings.time,
        day_time=_day_time(campaign),
        run_time=_run_time(probings),
        target=probings.target,
        nominal=_nominal(campaign),
        columns=_columns(campaign, chain),
    )
