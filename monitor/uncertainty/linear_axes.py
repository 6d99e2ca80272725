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
from monitor.uncertainty.measured_run import MeasuredRun

#: The spacing of the nodes is averaged over so many values: the covariance then is known to some 1e-3 of itself.
_SPACINGS = 31
_SHIFTS = "XYZ"


def row_covariances(one: MeasuredRun, unknowns: Array, axes: LinearAxes) -> dict[str, Array]:
    """Covariance (N, N) in mm² of the readings of a run at ``unknowns`` (p,), by source; one a kind of error and axis.

    Raises InputError for an axis that the machine does not have.
    """
    problem = one.problem
    chain = problem.context.chain
    seen = problem.evaluated(unknowns[None], one.common, jacobian=True)
    assert seen.by_error is not None
    found: dict[str, Array] = {}

    def add(source: str, columns: Array) -> None:
        square = columns @ columns.T
        found[source] = found.get(source, 0.0) + 0.5 * (square + square.T)

    for name, errors in axes.axes.items():
        joint = _linear(chain, name)
        place = chain.index(name)
        position = problem.context.positions[:, place]
        told = problem.observe(seen.by_error[:, :, place, MOTION, :3])  # (n, d, 3)
        own = int(np.abs(joint.direction).argmax())
        per_row = np.repeat(position, told.shape[1])
        rows = told.reshape(-1, 3)
        symbol = f"E{_SHIFTS[own]}{name}"
        if errors.proportional:
            add(f"{symbol}, proportional", errors.proportional * (rows[:, own] * per_row)[:, None])
        for component in range(3):
            size = errors.positioning if component == own else errors.straightness
            if size:
                root = _interpolated(per_row, axes.node_spacing)
                add(f"E{COMPONENTS[component]}{name}", size * rows[:, component, None] * root)
        for other, size in errors.squareness.items():
            across = int(np.abs(_linear(chain, other).direction).argmax())
            if size and across != own:
                add(f"squareness {name} to {other}", size * (rows[:, across] * per_row)[:, None])
    return found


def _linear(chain: Chain, name: str) -> Joint:
    known = chain.of_kind("linear")
    for joint in known:
        if joint.name == name:
            return joint
    raise InputError(
        f"'{chain.topology}' has no linear axis {name}; it has {', '.join(joint.name for joint in known)}"
    )


def _interpolated(position: Array, spacing: tuple[float, float]) -> Array:
    """Root (n, m) of the covariance of a unit random function at positions (n,), over the spacings of its nodes."""
    parts = []
    for pitch in np.linspace(*spacing, _SPACINGS):
        lowest = np.floor(position.min() / pitch)
        place = position / pitch - lowest
        left = np.floor(place).astype(np.int64)
        weights = np.zeros((len(position), int(left.max()) + 2))
        rows = np.arange(len(position))
        weights[rows, left] = 1.0 - (place - left)
        weights[rows, left + 1] += place - left
        parts.append(weights / np.sqrt(_SPACINGS))
    return np.concatenate(parts, axis=1)
