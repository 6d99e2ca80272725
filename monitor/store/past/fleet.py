"""Sums over the whole fleet: for every machine and parameter what Bartlett, ANOVA and a drift need.

The values never leave the database. Those of a group, the runs of a campaign or of one of its days, stand in one list
of ``identified_values``: its mean and variance cost a look at each value and no search for the group that it belongs
to, which is most of the time of a GROUP BY over ``parameter_value``. They are taken about an origin of their own
machine and parameter (a value of its first campaign): a sum of squares about zero would lose the digits that all
values share. The groups are then summed by machine and parameter. Use ``fleet_sums`` for many machines; for one
machine ``machine_history`` reads its rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import NotFoundError
from monitor.group_sums import GroupSums
from monitor.records import Array
from monitor.store.connection import Database
from monitor.store.past import fleet_choice as choice, fleet_queries as queries
from monitor.store.past.history import FEWEST_STEADY


@dataclass(frozen=True)
class BlockCut:
    """How histories are cut into blocks of equal time: a group each up to ``whole`` groups, then so many blocks, or one
    for ``each`` so many groups, ``most`` at most."""

    whole: int
    each: int
    most: int


@dataclass(frozen=True)
class RepeatedSums:
    """Sums over the groups of two runs and more of c cells, all (c,): runs, values and squares as in ``FleetSums``.

    Of the variances s² of groups of n runs: ``s2`` and ``s2_runs`` are sums of s² and n s², ``s4`` and ``s4_runs``
    those
    of s⁴ and n s⁴, and ``s4_dof`` those of s⁴, n s⁴ and n² s⁴ by n - 1.
    """

    runs: Array
    offset: Array
    squares: Array
    s2: Array
    s2_runs: Array
    s4: Array
    s4_runs: Array
    s4_dof: tuple[Array, Array, Array]


@dataclass(frozen=True)
class FleetBlocks:
    """Blocks of the history of c cells, all (c, b): groups (0: none), mean days since ``epoch_d``, mean value less
    origin, mean temperature less 20 °C (of use where all groups have one)."""

    groups: Array
    t: Array
    m: Array
    degrees: Array


@dataclass(frozen=True)
class CommonSums:
    """What the groups of cells have of calibrated quantities that outlast a campaign, a row each cell, quantity and
    block that has any, all (m,): the numbers of ``cell``, ``quantity`` and ``block``, the sums ``p`` of what values are
    off by for one standard uncertainty, and ``tp`` of its products with t as in ``FleetSums``."""

    cell: npt.NDArray[np.intp]
    quantity: npt.NDArray[np.intp]
    block: npt.NDArray[np.intp]
    p: Array
    tp: Array


@dataclass(frozen=True)
class TemperatureSums:
    """Sums over those groups of c cells whose runs all have a temperature, in °C less 20, all (c,).

    ``groups`` is their number, ``span`` from their lowest to their highest; ``sum_gg``, ``sum_gt`` and ``sum_gm`` are
    sums of its square and of its products with t and m as in ``FleetSums``; ``thermometer`` is its name ("": none).
    """

    thermometer: npt.NDArray[np.str_]
    groups: Array
    span: Array
    sum_g: Array
    sum_gg: Array
    sum_gt: Array
    sum_gm: Array


@dataclass(frozen=True)
class GroupHours:
    """A group of runs of a machine, from its first start to its last, in days since 1970."""

    machine: str
    campaign: str
    began_d: float
    ended_d: float


@dataclass(frozen=True)
class FleetSums(GroupSums):
    """Sufficient statistics of c cells, one a machine and parameter; every array is (c,), in display units.

    Groups are campaigns, or the days of a campaign with several; ``origin`` is what the sums are about. ``sum_t``
    to ``sum_tm`` are sums over the groups of t, t², m, m² and t m, with t in days since ``epoch_d`` and m the mean
    of the group less the origin. ``last_d`` is when the machine's last day began (days since 1970), ``latest`` the
    mean of that day less the origin, ``latest_runs`` its runs; NaN, NaN and 0 where the parameter was refused
    there. Groups of other campaigns that overlap that day are part of it: ``latest_groups`` counts them all,
    ``latest_m`` and ``latest_mm`` are the sums of their m and m². ``same_hours`` are the groups of machines of which
    some overlap. ``since_d`` is the last recorded event before the last run (days since 1970, NaN: none); runs before
    it are left out. ``first_d`` is when the first group began (days since 1970), ``beyond_d`` the first of the runs
    without a break beyond the limit, in the whole history (NaN: the mean of the last day, or its last run, is within
    it). ``last_value`` and ``last_u`` are of the last run of the machine (NaN where the parameter was refused there),
    ``check_d`` is when it is measured next, as far after its last run as its campaigns lie apart (days since 1970).
    """

    machine: npt.NDArray[np.str_]
    parameter: npt.NDArray[np.str_]
    unit: npt.NDArray[np.str_]
    origin: Array
    epoch_d: float
    sum_t: Array
    sum_tt: Array
    sum_m: Array
    sum_mm: Array
    sum_tm: Array
    last_d: Array
    latest: Array
    latest_runs: Array
    latest_groups: Array
    latest_m: Array
    latest_mm: Array
    since_d: Array
    first_d: Array
    beyond_d: Array
    last_value: Array
    last_u: Array
    check_d: Array
    repeated_sums: RepeatedSums
    temperatures: TemperatureSums
    blocks: FleetBlocks
    common: CommonSums
    same_hours: tuple[GroupHours, ...]


def fleet_sums(
    db: Database,
    model: str | None = None,
    version: int | None = None,
    *,
    cut: BlockCut,
    limits: Mapping[tuple[str, str], float] = MappingProxyType({}),
    apart_d: float = 30.0,
) -> FleetSums:
    """Sums of all machines and parameters, of the latest identification of every campaign under one model.

    Of each machine since its last recorded event, where runs followed it (of a day that it divides these runs).
    Without ``model`` that which each machine is followed by, the method's own where none was chosen. A parameter that
    a machine refused both in its first campaign and on its last day has zero for its origin and loses
    2 lg(mean / scatter) of 16 digits. Sums of several threads differ in the last bits from one time to the next.
    ``cut`` says how the history of a machine is cut into blocks, ``limits`` of the absolute value by machine and
    parameter are in display units, ``apart_d`` is when a machine of one campaign is measured next. Raises
    NotFoundError where nothing was identified.
    """
    with db.reading():
        epoch_d, columns, of_blocks, of_common, same_hours = _summed(
            db, (model, version), cut, limits, apart_d
        )
    return _sums(columns, _blocks(of_blocks, columns), _common(of_common, columns), epoch_d, same_hours)


def _summed(
    db: Database,
    of: tuple[str | None, int | None],
    cut: BlockCut,
    limits: Mapping[tuple[str, str], float],
    apart_d: float,
) -> tuple[float, dict[str, Any], dict[str, Any], dict[str, Any], tuple[GroupHours, ...]]:
    """Return first day, columns of all cells, of their blocks and of what these have in common, and the groups of
    machines of which some overlap.

    The tables on the way live as long as the connection.

    ``of`` are a model and its version.
    """
    for statement in (choice.MACHINES, choice.HEADINGS, choice.MODELS, choice.OWN):
        db.execute(statement)
    model, version = of
    db.set_variables({"model": model, "version": version, "steady": FEWEST_STEADY})
    db.execute(choice.CHOSEN)
    ((epoch_d,),) = db.rows("SELECT min(began_d) FROM fleet_chosen")
    if epoch_d is None:
        under = "" if model is None else f" with model {model}"
        raise NotFoundError(f"no campaign was identified{under} yet; type `monitor identify`")
    for statement in (
        queries.RUN_TEMPERATURES,
        queries.TOUCH_TEMPERATURES,
        queries.THERMOMETERS,
        queries.TEMPERATURES,
        queries.CAMPAIGN_TEMPERATURES,
    ):
        db.execute(statement)
    for statement in (
        queries.GROUPS,
        queries.SINCE,
        queries.DIVIDED,
        queries.ENDED,
        queries.LATEST,
        queries.ORIGINS,
    ):
        db.execute(statement)
    db.set_variables({"apart": apart_d})
    for statement in (queries.LAST_RUN, queries.CHECKS, queries.SHOWN, queries.LIMITS):
        db.execute(statement)
    if limits:
        names = {"machines": [machine for machine, _ in limits], "parameters": [name for _, name in limits]}
        db.execute(queries.LIMITED, {**names, "limits": list(limits.values())})
    db.execute(queries.BEYOND)
    db.set_variables({"whole": cut.whole, "each": cut.each, "most": cut.most, "epoch_d": epoch_d})
    db.execute(queries.BLOCKS)
    db.execute(queries.PARTS)
    columns, of_blocks, of_common = (
        {name: np.ma.getdata(column) for name, column in db.arrays(query).items()}
        for query in (queries.TOGETHER, queries.OF_BLOCKS, queries.OF_COMMON)
    )
    same_hours = tuple(GroupHours(*row) for row in db.rows(queries.SAME_HOURS))
    for name in queries.TABLES:
        db.execute(f"DROP TABLE IF EXISTS fleet_{name}")
    return epoch_d, columns, of_blocks, of_common, same_hours


def _blocks(
    columns: Mapping[str, npt.NDArray[np.generic]], cells: Mapping[str, npt.NDArray[np.generic]]
) -> FleetBlocks:
    """A row of blocks for each cell, in the order of ``cells``, in display units."""
    order = np.argsort(cells["cell"])
    rows = order[np.searchsorted(cells["cell"], columns["cell"], sorter=order)]
    block = columns["block"].astype(np.intp)
    shape = (len(order), int(block.max()) + 1)
    groups, t, m, degrees = (np.zeros(shape) for _ in range(4))
    for array, name in ((groups, "k"), (t, "t"), (m, "m"), (degrees, "g")):
        array[rows, block] = columns[name]
    return FleetBlocks(groups, t, m / np.asarray(cells["factor"], dtype=np.float64)[:, np.newaxis], degrees)


def _common(
    columns: Mapping[str, npt.NDArray[np.generic]], cells: Mapping[str, npt.NDArray[np.generic]]
) -> CommonSums:
    """What blocks have of calibrated quantities, in display units, by the places of their cells among ``cells``."""
    order = np.argsort(cells["cell"])
    in_cells = np.isin(columns["cell"], cells["cell"])
    rows = order[np.searchsorted(cells["cell"], columns["cell"][in_cells], sorter=order)]
    factor = np.asarray(cells["factor"], dtype=np.float64)[rows]
    p, tp = (np.asarray(columns[name], dtype=np.float64)[in_cells] / factor for name in ("p", "tp"))
    quantity, block = (columns[name][in_cells].astype(np.intp) for name in ("quantity_no", "block"))
    return CommonSums(rows, quantity, block, p, tp)


def _sums(
    columns: Mapping[str, npt.NDArray[np.generic]],
    blocks: FleetBlocks,
    common: CommonSums,
    epoch_d: float,
    same_hours: tuple[GroupHours, ...],
) -> FleetSums:
    number = {
        name: np.asarray(column, dtype=np.float64)
        for name, column in columns.items()
        if name not in ("machine", "parameter", "unit", "thermometer")
    }
    f = number["factor"]
    # ln s² of the groups becomes that of the display unit; their degrees of freedom are runs less groups.
    shift = 2.0 * np.log(f) * (number["n"] - number["k"])
    return FleetSums(
        machine=columns["machine"].astype(np.str_),
        parameter=columns["parameter"].astype(np.str_),
        unit=columns["unit"].astype(np.str_),
        origin=number["origin"] / f,
        groups=number["k"],
        runs=number["n"],
        offset=number["s"] / f,
        squares=number["q"] / f**2,
        within=number["ss"] / f**2,
        repeated=number["repeated"],
        least_variance=number["least"] / f**2,
        log_variances=number["logs"] - shift,
        inverse_dof=number["inverse"],
        epoch_d=epoch_d,
        sum_t=number["t"],
        sum_tt=number["tt"],
        sum_m=number["m"] / f,
        sum_mm=number["mm"] / f**2,
        sum_tm=number["tm"] / f,
        last_d=number["last_d"],
        latest=number["latest"] / f,
        latest_runs=number["latest_n"],
        latest_groups=number["latest_k"],
        latest_m=number["latest_m"] / f,
        latest_mm=number["latest_mm"] / f**2,
        since_d=number["since_d"],
        first_d=epoch_d + number["t_first"],
        beyond_d=number["beyond_d"],
        last_value=number["last_value"] / f,
        last_u=number["last_u"] / f,
        check_d=number["check_d"],
        repeated_sums=RepeatedSums(
            runs=number["runs_rep"],
            offset=number["offset_rep"] / f,
            squares=number["squares_rep"] / f**2,
            s2=number["s2"] / f**2,
            s2_runs=number["s2_runs"] / f**2,
            s4=number["s4"] / f**4,
            s4_runs=number["s4_runs"] / f**4,
            s4_dof=(
                number["s4_dof"] / f**4, number["s4_dof_runs"] / f**4, number["s4_dof_runs_squared"] / f**4
            ),
        ),
        temperatures=TemperatureSums(
            thermometer=columns["thermometer"].astype(np.str_),
            groups=number["g_k"],
            span=number["g_range"],
            sum_g=number["g"],
            sum_gg=number["gg"],
            sum_gt=number["gt"],
            sum_gm=number["gm"] / f,
        ),
        blocks=blocks,
        common=common,
        same_hours=same_hours,
    )  # fmt: skip
