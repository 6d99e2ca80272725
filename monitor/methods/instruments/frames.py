"""First guesses of the instruments' frames, one a run."""

from __future__ import annotations

import numpy as np

from monitor.machine import evaluate
from monitor.methods.chain.first_frame import best_frame
from monitor.methods.chain.size_of_points import refuse_other_size
from monitor.methods.instruments.reading import Rows
from monitor.records import Array


def first_frame(rows: Rows, places: Array, *, held: bool) -> tuple[Array, Array]:
    """Frames of all rows (m, 12): rotation and shift from the instrument's frame to that of the last work axis, one a
    run, and places (T, 3) of the targets on the tool.

    ``places`` (T, 3) are the stated ones, ``held`` where they are known. ``rows.measured`` has two columns or three.
    """
    at = np.unique(rows.target, return_inverse=True)[1].reshape(-1)
    count = len(rows)
    none = np.zeros((count, len(rows.chain.joints), 2, 6))
    pose = evaluate(rows.chain, rows.positions, none, np.zeros((count, 3)), np.zeros(3))
    guesses = np.zeros((count, 12))
    sums, times = np.zeros_like(places), np.zeros(len(places))
    for run in np.unique(rows.run):
        mine = np.flatnonzero(rows.run == run)
        complete = mine[~np.isnan(rows.measured[mine]).any(axis=1)]
        turn, shift, improved = best_frame(
            pose.by_tip[complete],
            pose.residual[complete],
            rows.measured[complete],
            at[complete],
            places,
            held,
        )
        guesses[mine] = np.concatenate([turn.reshape(9), shift])
        of_run = np.unique(at[complete])
        sums[of_run] += improved[of_run]
        times[of_run] += 1.0
    mean = sums / np.maximum(times, 1.0)[:, None]
    return guesses, places if held else np.where(times[:, None] > 0.0, mean, places)


def refuse_other_sizes(rows: Rows, places: Array, setup: str) -> None:
    """DataError where the points of a run are of another size than the chain, or not of its poses; ``places`` (T, 3)
    mm and ``rows.guess`` are the first guess."""
    count, measured = len(rows), rows.measured[:, :3]
    none = np.zeros((count, len(rows.chain.joints), 2, 6))
    pose = evaluate(rows.chain, rows.positions, none, np.zeros((count, 3)), np.zeros(3))
    off = seen_points(rows, rows.guess[:, :12], places) - measured
    is_whole = np.isfinite(measured).all(axis=1)
    columns = f"point_x_mm, point_y_mm and point_z_mm of setup {setup}"
    for run in np.unique(rows.run[is_whole]):
        whole = np.flatnonzero((rows.run == run) & is_whole)
        at = np.unique(rows.target[whole], return_inverse=True)[1].reshape(-1)
        rms = float(np.sqrt(np.mean(off[whole] ** 2)))
        refuse_other_size(pose.by_tip[whole], pose.residual[whole], measured[whole], at, rms, columns)


def seen_points(rows: Rows, frames: Array, places: Array) -> Array:
    """The points (m, 3) of targets at ``places`` (T, 3) in the instrument's frame, by frames (m, 12) and a chain
    without errors."""
    at = np.unique(rows.target, return_inverse=True)[1].reshape(-1)
    none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
    points = evaluate(rows.chain, rows.positions, none, np.zeros((len(rows), 3)), places[at]).residual
    turn = frames[:, :9].reshape(-1, 3, 3)
    return np.asarray(np.einsum("nji,nj->ni", turn, points - frames[:, 9:]))
