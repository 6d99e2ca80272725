"""What the uncertainty of a run propagates: its readings, the calibrated quantities, the errors of the linear axes.

The covariance of the readings is pooled by day from the repeated runs where there are enough of them, else all runs
together, else the stated standard uncertainty, uncorrelated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.exceptions import DataError, InputError
from monitor.records import Array, Campaign, LinearAxes
from monitor.uncertainty import Inputs, OutputContribution, overall, pooled_by_day, uncorrelated
from monitor.uncertainty.linear_axes import row_covariances
from monitor.uncertainty.row_problem import repeated_readings
from monitor.uncertainty.run_problem import OneRun, RunProblem
from monitor.uncertainty.sensitivity import Sensitivity

READINGS = "readings"
BAR = "scale bar"
CALIBRATED = "calibrated quantities"
# A covariance from fewer degrees of freedom than this says little about itself; then the next choice is taken.
FEWEST_DEGREES_OF_FREEDOM = 8


@dataclass(frozen=True)
class SelectedReadings:
    """Readings (runs, 3n) in mm of the runs of the stored selection ``name``, and the day of each."""

    name: str
    values: Array
    days: npt.NDArray[np.int64]


def reading_inputs(
    found: Fit, campaign: Campaign, one: OneRun, chosen: SelectedReadings | None
) -> tuple[Inputs, str]:
    """Inputs of the readings of a run, and in words where their covariance is from: all runs, or a stored selection."""
    problem, names = found.problem, one.reading_names
    count = len(names)
    units = ("mm",) * count
    days = {run.run: run.day for run in campaign.runs}
    labels = np.array([days[int(run)] for run in problem.runs])
    if chosen is not None:
        values, labels = chosen.values, chosen.days
        if len(labels) - 1 < FEWEST_DEGREES_OF_FREEDOM:
            raise DataError(
                f"--select {chosen.name}: {len(labels)} runs leave {len(labels) - 1} degrees of freedom for a "
                f"covariance; at least {FEWEST_DEGREES_OF_FREEDOM} are needed"
            )
    else:
        try:
            values = repeated_readings(problem)
        except DataError:
            values = np.zeros((0, count))
    runs = len(labels)
    stated = campaign.probe.standard_uncertainty
    if len(values) and runs - len(np.unique(labels)) >= FEWEST_DEGREES_OF_FREEDOM:
        inputs = pooled_by_day(values, labels, names, units, source=READINGS)
        words = f"repeated runs, pooled by day, {runs - len(np.unique(labels))} degrees of freedom"
    elif len(values) and runs - 1 >= FEWEST_DEGREES_OF_FREEDOM:
        inputs = overall(values, names, units, source=READINGS)
        words = f"all {runs} runs, {runs - 1} degrees of freedom"
    else:
        repeatability = lack_of_fit(found)[1]
        u = max(stated, repeatability or 0.0)
        inputs = uncorrelated(names, units, one.inputs[:count], one.stated * (u / stated), source=READINGS)
        words = f"the probe's stated standard uncertainty of {stated * 1e3:g} µm; too few repeated runs of one plan"
        if u > stated:
            words = f"the repeatability of {u * 1e3:.2g} µm, which exceeds the probe's statement; too few runs for more"
    if chosen is not None:
        words = f"selection {chosen.name}: {words}"
    # The estimate is that of the run itself: its results are stated.
    own = Inputs(
        inputs.names, inputs.units, one.inputs[:count], inputs.covariance, inputs.sources, inputs.dof
    )
    return own, words


def calibrated_inputs(one: OneRun) -> Inputs | None:
    """Inputs of the calibrated quantities of a run; None where it has none."""
    names, unit, u = one.calibrated
    if not names:
        return None
    count = len(one.reading_names)
    source = BAR if isinstance(one, RunProblem) else CALIBRATED
    return uncorrelated(names, (unit,) * len(names), one.inputs[count:], u, source=source)


def with_linear_axes(
    one: OneRun, inputs: Inputs, at: Sensitivity, names: tuple[str, ...], axes: LinearAxes
) -> tuple[Inputs, list[OutputContribution]]:
    """The inputs with what errors of the linear axes do to them, and the same by source as lines of the budget."""
    if isinstance(one, RunProblem):
        raise InputError(
            "--linear-axes is for methods that take the linear axes as known, such as rotary-probing; this method "
            "identifies errors of the linear axes itself"
        )
    count, rows = len(one.reading_names), at.rows(names)[:, : len(one.reading_names)]
    covariance = inputs.covariance.copy()
    lines = []
    for source, of_rows in row_covariances(one, at.unknowns, axes).items():
        covariance[:count, :count] += of_rows
        of_outputs = rows @ of_rows @ rows.T
        lines.append(OutputContribution(source, 0.5 * (of_outputs + of_outputs.T)))
    whole = Inputs(inputs.names, inputs.units, inputs.estimate, covariance, inputs.sources, inputs.dof)
    return whole, lines


def left_out(known: tuple[str, ...], axes_stated: bool) -> str:
    """What a method takes as known and nobody stated the errors of, for people who read u."""
    left = [what for what in known if not (axes_stated and what == "the linear axes")]
    if not left:
        return ""
    return f"; errors of {' and '.join(left)} are no part of u: the method takes them as known"
