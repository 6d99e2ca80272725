"""Readings of one run that nothing checks are named: on the machine of plain matrices of ``own_machine``, two touches.

A touch of 20 µm more is put in at every position of the plan, in every axis; nothing is shared with the package.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from by_path import load

from monitor.discovery import fit, robust_fit
from monitor.methods import campaign_method
from monitor.reporting.budget import Unchecked
from monitor.reporting.budget_words import unchecked_sentence
from monitor.reporting.texts import texts_of
from monitor.workflow.uncertainty.unchecked import unchecked_readings

own = load("own_machine", Path(__file__).resolve().parents[1] / "benchmarks" / "own_machine.py")
PLAN = own.plan()
NAMES = ("EB0C", "EXX", "EYY", "EZZ")


def _measured(runs: int, off: tuple[int, int] | None = None):
    """A campaign of ``runs`` of a day, of which the touch and axis ``off`` of the last is 20 µm off, as its problem."""
    readings = own.OwnMachine().touched(PLAN, np.zeros(len(PLAN)))
    readings = readings + 1e-3 * np.random.default_rng(20).standard_normal((runs, *readings.shape))
    if off is not None:
        readings[-1, off[0], off[1]] += 0.02
    campaign = own.recorded(
        PLAN,
        readings,
        np.zeros(runs, dtype=int),
        stated_um=1.0,
        bar_mm=own.BAR_MM,
        ambient=np.full(runs, 20.0),
    )
    return campaign_method(campaign).problem_of(campaign)


def test_what_no_reading_checks_is_what_moves_a_gain_and_is_not_found() -> None:
    """The Y of two touches is EYY alone: 20 µm of it are not seen, and move EYY by ten times its u."""
    calm = fit(_measured(1))
    unchecked = unchecked_readings(calm, NAMES)
    assert isinstance(unchecked, Unchecked)
    assert unchecked.parameters[0] == "EYY"
    assert len(unchecked.sequence) == 2
    gain = calm.problem.base_names.index("EYY")
    u = float(np.sqrt(calm.solution.local_covariance[0, gain, gain]))
    for sequence in unchecked.sequence:
        row = int(np.flatnonzero(calm.problem.context.sequence == sequence)[0])
        moved = robust_fit(_measured(1, (row, 1)))
        assert not moved.gross
        assert abs(moved.fit.solution.local[0, gain] - calm.solution.local[0, gain]) > 5.0 * u
    other = next(
        row for row in range(len(PLAN)) if calm.problem.context.sequence[row] not in unchecked.sequence
    )
    assert len(robust_fit(_measured(1, (other, 1))).gross) == 1
    assert unchecked_sentence(unchecked, texts_of()).startswith(
        f"No other reading checks those of sequence {unchecked.sequence[0]}, {unchecked.sequence[1]} in one direction"
    )


def test_a_second_run_checks_them() -> None:
    assert unchecked_readings(fit(_measured(2)), NAMES) is None
