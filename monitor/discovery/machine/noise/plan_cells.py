"""The cells of a plan: which readings are of the same touch, of several runs or of one run that came back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy

from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array

# A control that is sent to a pose again reads it back to some thousandths of a degree or mm. Over this much (10 µm,
# 0.01 degrees) even the finest line of a gear, 320 periods a turn, changes by 5 % only.
SAME_MM, SAME_RAD = 10e-3, 1.75e-4
# A plate that was left clamped is where it was, to what touches scatter and the day's warmth; by hand none is laid back
# so. Over 0.1 mm the cycle of a lead of 10 mm changes by 6 %.
SAME_LAY_MM = 0.1


def _posed(problem: ChainProblem) -> list[int]:
    """The joints that stand where the plan says."""
    measured = problem.measured_joints
    return [joint for joint in range(len(problem.context.chain.joints)) if joint not in measured]


def _planned(problem: ChainProblem) -> Array:
    """Where those joints stand (n, k); those that stop at stated places, at all touches of one place where at one.

    What is read of them holds the noise: rows that read alike by chance have noise alike, and no pose of their own.
    """
    positions, stopping = problem.context.positions.copy(), problem.stopping
    rows = np.flatnonzero(stopping.rows)
    if stopping.places is not None and len(rows):
        touched = np.ix_(rows, np.array(stopping.joints, dtype=np.int64))
        of_place = _numbered(stopping.places[rows])
        lay = _linked(np.column_stack([2.0 * of_place, positions[touched] / SAME_LAY_MM]))
        first, of_lay = np.unique(lay, return_index=True, return_inverse=True)[1:]
        positions[touched] = positions[touched][first[of_lay]]
    return positions[:, _posed(problem)]


def _linked(places: Array) -> npt.NDArray[np.int64]:
    """The group (n,) of every row (n, k): from one of it to the next no number differs by more than 1.

    Rows whose numbers have the same whole parts are one group: a ball that is touched ten thousand times has fifty
    million pairs. Of two such cells side by side one row and its nearest in the other tell whether they are linked.
    """
    cells, cell = np.unique(np.floor(places), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    beside = scipy.spatial.cKDTree(cells).query_pairs(1.0, p=np.inf, output_type="ndarray")
    (pair, row), (other_pair, other) = (_rows_of(cell, side) for side in beside.T)
    linked = np.zeros(len(beside), dtype=bool)
    if len(beside):
        nearest = scipy.spatial.cKDTree(np.column_stack([2.0 * other_pair, places[other]])).query(
            np.column_stack([2.0 * pair, places[row]]), p=np.inf, distance_upper_bound=np.nextafter(1.0, 2.0)
        )[0]
        linked[pair[np.isfinite(nearest)]] = True
    first, second = beside[linked].T
    links = scipy.sparse.coo_array((np.ones(len(first)), (first, second)), (len(cells), len(cells)))
    groups = scipy.sparse.csgraph.connected_components(links, directed=False)[1]
    return np.asarray(groups[cell], dtype=np.int64)


def _rows_of(
    cell: npt.NDArray[np.int64], asked: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The rows of every cell that is ``asked`` for (m,), one behind the other, and which of the m each belongs to."""
    count, order = np.bincount(cell), np.argsort(cell, kind="stable")
    of_asked = np.repeat(np.arange(len(asked)), count[asked])
    before = np.cumsum(count[asked]) - count[asked]
    in_cell = np.arange(len(of_asked)) - before[of_asked]
    return of_asked, order[(np.cumsum(count) - count)[asked][of_asked] + in_cell]


def _visits(problem: ChainProblem, planned: Array) -> npt.NDArray[np.int64]:
    """The visit (n,) of every row: from one move of an axis that is not measured to the next."""
    moved = np.any(np.diff(planned, axis=0) != 0.0, axis=1) | (np.diff(problem.context.run) != 0)
    return np.concatenate([[0], np.cumsum(moved)])


def readings_a_visit(problem: ChainProblem) -> float:
    """The mean number of rows that are read between two moves."""
    return len(problem.context) / float(_visits(problem, _planned(problem))[-1] + 1)


def revisited_cells(problem: ChainProblem) -> npt.NDArray[np.int64]:
    """The cell (n,) of every row of a run: the same number for the same target at a pose to which the run came back.

    What is read again without a move in between has a cell of its own: it shows no more than the instrument.
    """
    context, posed, planned = problem.context, _posed(problem), _planned(problem)
    visit = _visits(problem, planned)
    first = np.unique(visit, return_index=True)[1]
    turning = [context.chain.joints[joint].turns for joint in posed]
    places = planned[first] / np.where(turning, SAME_RAD, SAME_MM)
    pose = _linked(places) if posed else np.zeros(len(first), dtype=np.int64)
    occurrences: dict[tuple[str, int], int] = {}
    numbers: dict[tuple[str, int, int], int] = {}
    cells = np.empty(len(context), dtype=np.int64)
    for row, target in enumerate(context.target):
        in_visit = (str(target), int(visit[row]))
        occurrence = occurrences[in_visit] = occurrences.get(in_visit, -1) + 1
        key = (str(target), int(pose[visit[row]]), occurrence)
        cells[row] = numbers.setdefault(key, len(numbers))
    return cells


def plan_cells(problem: ChainProblem) -> npt.NDArray[np.int64]:
    """The cell (n,) of the plan: the same number for the same target at the same pose, touch by touch."""
    context = problem.context
    angles = np.round(_planned(problem), 6) + 0.0
    target = np.unique(context.target, return_inverse=True)[1]
    touch = _numbered(np.column_stack([target, angles]))
    return _numbered(np.column_stack([touch, _occurrences(np.column_stack([context.run, touch]))]))


def _numbered(rows: Array) -> npt.NDArray[np.int64]:
    """The number (n,) of every row (n, k) among the different ones, in the order in which they first occur."""
    _, first, index = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[index.reshape(-1)]


def _occurrences(rows: Array) -> npt.NDArray[np.int64]:
    """How many rows (n,) before each of (n, k) are the same."""
    number = _numbered(rows)
    order = np.argsort(number, kind="stable")
    of_number = np.bincount(number)
    before = np.empty(len(number), dtype=np.int64)
    before[order] = np.arange(len(number)) - np.repeat(np.cumsum(of_number) - of_number, of_number)
    return before
