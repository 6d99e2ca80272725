"""The errors of a machine as one run determined them, and the errors of every joint at any commanded position.

Nothing here is a vector at the tool: see ``volumetric`` for that. What depends on the direction of travel is taken for
an approach towards growing readings of every axis, what depends on a temperature or a time at the run's mean.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from monitor.effects import ChainEffect, Context
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import Table
from monitor.exceptions import DataError
from monitor.machine import Chain
from monitor.records import Array

#: Before each point the reading of every axis is this much less, mm or rad: what depends on the direction of travel
#: (reversal) is taken for an approach towards growing readings, the positive direction of ISO 230-2.
APPROACH = 1.0


@dataclass(frozen=True)
class GeometricErrors:
    """The errors of a machine as one run found them.

    ``effects`` with their coefficients ``estimate`` (k,), named ``names``, with ``covariance`` (k, k), in internal
    units, and its degrees of freedom. ``context`` is the campaign's, ``run`` the run whose mean temperatures and
    time stand for the effects that are driven by them. ``tip`` (3,) mm is the tool, the same with and without
    errors.
    """

    effects: tuple[ChainEffect, ...]
    names: tuple[str, ...]
    estimate: Array
    covariance: Array
    context: Context
    run: int
    tip: Array
    degrees_of_freedom: float = float("inf")

    def __post_init__(self) -> None:
        count = sum(len(effect.parameters(self.context)) for effect in self.effects)
        if len(self.names) != count or self.estimate.shape != (count,):
            raise DataError(
                f"{len(self.effects)} effects have {count} coefficients, but {len(self.names)} are named and "
                f"{self.estimate.shape} estimated"
            )
        if self.covariance.shape != (count, count):
            raise DataError(
                f"{count} coefficients need a covariance of ({count}, {count}), not {self.covariance.shape}"
            )
        if self.run not in self.context.run:
            raise DataError(
                f"no run {self.run}; there are runs {', '.join(map(str, np.unique(self.context.run)))}"
            )

    @property
    def chain(self) -> Chain:
        """The chain."""
        return self.context.chain


def joint_errors(
    geometric: GeometricErrors, positions: Array, values: Array
) -> tuple[Array, tuple[ChainBasis, ...]]:
    """Return the errors (n, J, 2, 6) of all joints at commanded ``positions`` (n, J), and each effect at the points.

    ``values`` (k,) are the coefficients, in internal units. The columns of the effects, side by side, belong to the
    parameters in their order.
    """
    count = len(positions)
    free = _commanded(geometric, positions, inside=False)
    held = _commanded(geometric, positions, inside=True)
    errors = np.zeros((count, len(geometric.chain.joints), 2, 6))
    target = np.zeros((count, 3))
    bases = []
    first = 0
    for effect in geometric.effects:
        basis = effect.basis(held if isinstance(effect.shape, Table) else free)
        # The points are the last of every pair behind the campaign's own rows.
        basis = replace(basis, columns=basis.columns[-2 * count + 1 :: 2])
        basis.apply(values[first : first + basis.size], errors, target)
        bases.append(basis)
        first += basis.size
    return errors, tuple(bases)


def _commanded(geometric: GeometricErrors, positions: Array, inside: bool) -> Context:
    """The campaign's context with, behind its rows, each point and before it the place that it is reached from.

    ``inside`` keeps positions within what the campaign visited, for tables, which end there with a constant.
    """
    old, chain = geometric.context, geometric.chain
    if inside:
        positions = np.clip(positions, old.positions.min(axis=0), old.positions.max(axis=0))
    of_run = old.run == geometric.run
    pairs = np.repeat(positions, 2, axis=0)
    if not inside:
        # Towards growing readings, which a joint of sign -1 meets with a falling displacement.
        pairs[::2] -= APPROACH * np.array([joint.sign for joint in chain.joints])
    count = len(pairs)

    def joined(rows: Array, value: float) -> Array:
        return np.concatenate([rows, np.full(count, value)])

    columns = {}
    for name, values in old.columns.items():
        good = np.isfinite(values)
        thermal = name.endswith("_degC")
        recorded = values[of_run & good] if thermal and np.any(of_run & good) else values[good]
        columns[name] = joined(values, float(np.mean(recorded)) if len(recorded) else float("nan"))
    for index, joint in enumerate(chain.joints):
        name = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
        if name in columns:
            readings = joint.sign * pairs[:, index]
            columns[name] = np.concatenate(
                [old.columns[name], np.rad2deg(readings) if joint.turns else readings]
            )
    return replace(
        old,
        positions=np.concatenate([old.positions, pairs]),
        expected=None if old.expected is None else np.concatenate([old.expected, pairs]),
        run=np.concatenate([old.run, np.full(count, geometric.run)]),
        sequence=np.concatenate([old.sequence, np.arange(count) + int(old.sequence.max()) + 1]),
        time=joined(old.time, float(np.mean(old.time[of_run]))),
        day_time=joined(old.day_time, float(np.mean(old.day_time[of_run]))),
        run_time=joined(old.run_time, float(np.mean(old.run_time[of_run]))),
        target=np.concatenate([old.target, np.repeat(old.target[:1], count)]),
        nominal=np.concatenate([old.nominal, np.zeros((count, 3))]),
        columns=columns,
        set_up=(
            None
            if old.set_up is None
            else np.concatenate([old.set_up, np.full(count, old.set_up[of_run][-1])])
        ),
        approach=None if old.approach is None else np.concatenate([old.approach, np.zeros(pairs.shape, int)]),
        # Shapes and drivers are scaled by what was measured, as they were when their coefficients were estimated.
        measured=old.scaling,
    )
