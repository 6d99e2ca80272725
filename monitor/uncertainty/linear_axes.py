"""What errors of the linear axes do to results of a method that takes those axes as known.

Each error shifts the tool against the work along X, Y or Z as a function of one axis's position: in proportion to it
(positioning, squareness), or by random values at nodes an unknown distance apart with straight lines between (Ibaraki,
Iritani, Matsushita 2012, Eqs. (22) and (23)). The distance is averaged over, so what comes out is the covariance of
the numbers that the rows tell. Errors of the axes' angles are neglected, as there.
"""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.machine import COMPONENTS, MOTION, Chain, Joint
from monitor.records import Array, LinearAxes
from monitor.uncertainty.runs.measured_run import MeasuredRun

#: The spacing of the nodes is averaged over so many values: the covariance then is known to some 1e-3 of itself.
_SPACINGS = 31
_SHIFTS = "XYZ"


def row_covariances(run: MeasuredRun, unknowns: Array, axes: LinearAxes) -> dict[str, Array]:
    """Covariance (N, N) in mm² of the readings of a run at ``unknowns`` (p,), by source; one a kind of error and axis.

    Raises InputError for an axis that the machine does not have.
    """
    problem = run.problem
    chain = problem.context.chain
    pose = problem.evaluated(unknowns[None], run.common, jacobian=True)
    assert pose.by_error is not None
    covariances: dict[str, Array] = {}

    is_number = problem.is_number.ravel()

    def add(source: str, columns: Array) -> None:
        columns = columns[is_number]
        square = columns @ columns.T
        covariances[source] = covariances.get(source, 0.0) + 0.5 * (square + square.T)

    for name, errors in axes.axes.items():
        joint = _linear(chain, name)
        index = chain.index(name)
        position = problem.context.positions[:, index]
        observed = problem.observe(pose.by_error[:, :, index, MOTION, :3])  # (n, d, 3)
        along = int(np.abs(joint.direction).argmax())
        per_row = np.repeat(position, observed.shape[1])
        rows = observed.reshape(-1, 3)
        symbol = f"E{_SHIFTS[along]}{name}"
        if errors.proportional:
            add(f"{symbol}, proportional", errors.proportional * (rows[:, along] * per_row)[:, None])
        for component in range(3):
            size = errors.positioning if component == along else errors.straightness
            if size:
                root = interpolated(per_row, axes.node_spacing)
                add(f"E{COMPONENTS[component]}{name}", size * rows[:, component, None] * root)
        for other, size in errors.squareness.items():
            across = int(np.abs(_linear(chain, other).direction).argmax())
            if size and across != along:
                add(f"squareness {name} to {other}", size * (rows[:, across] * per_row)[:, None])
    return covariances


def _linear(chain: Chain, name: str) -> Joint:
    linear = chain.of_kind("linear")
    for joint in linear:
        if joint.name == name:
            return joint
    raise InputError(
        f"'{chain.topology}' has no linear axis {name}; it has {', '.join(joint.name for joint in linear)}"
    )


def interpolated(position: Array, spacing: tuple[float, float]) -> Array:
    """Root (n, m) of the covariance of a unit random function at positions (n,), over the spacings of its nodes."""
    parts = []
    for pitch in np.linspace(*spacing, _SPACINGS):
        lowest = np.floor(position.min() / pitch)
        nodes = position / pitch - lowest
        lower = np.floor(nodes).astype(np.int64)
        weights = np.zeros((len(position), int(lower.max()) + 2))
        rows = np.arange(len(position))
        weights[rows, lower] = 1.0 - (nodes - lower)
        weights[rows, lower + 1] += nodes - lower
        parts.append(weights / np.sqrt(_SPACINGS))
    return np.concatenate(parts, axis=1)


def node_names(position: Array, spacing: tuple[float, float]) -> tuple[tuple[int, int], ...]:
    """Number of the spacing and of the node on the axis, of every column of ``interpolated``."""
    names = []
    for number, pitch in enumerate(np.linspace(*spacing, _SPACINGS)):
        lowest = int(np.floor(position.min() / pitch))
        count = int(np.floor(position / pitch - lowest).max()) + 2
        names += [(number, lowest + node) for node in range(count)]
    return tuple(names)
