"""What more angles of the table are worth: expected uncertainties of a free-form plan, and its best next angle.

The model is linear and its rows do not depend on what will be read, so a plan is weighed before anyone probes. All
candidate angles are put through the chain at once; a plan is then a choice of rows. The best next angle is the one
that leaves the least mean variance of the shape (A-optimality), after the one that leaves the fewest unknowns open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.free_form.assembly import problem_of
from monitor.methods.free_form.problem import FreeFormProblem
from monitor.methods.model import Model
from monitor.records import Array, Campaign, Probings
from monitor.units import DEGREE, Unit

# Eigenvalues of the scaled information below this part of the largest are unseen: those of plans that barely see an
# unknown stay above 1e-7, rounding leaves 1e-15.
UNSEEN = 1e-11


@dataclass(frozen=True)
class Expected:
    """A plan's angles (degrees), its probings, the unseen dimensions, and standard uncertainties by name.

    ``u`` is in internal units, NaN where the plan does not determine the parameter; ``left_out`` counts the points
    that would lie beyond the nodes at these angles.
    """

    angles: tuple[float, ...]
    probings: int
    left_out: int
    nullity: int
    u: dict[str, float]

    @property
    def shape(self) -> Array:
        """The standard uncertainties of the shape, in mm."""
        return np.array([u for name, u in self.u.items() if name.startswith("shape(")])


@dataclass(frozen=True)
class Candidates:
    """Rows (n, p) in standard uncertainties at every angle, ``angle`` (n,) degrees; ``inside`` (n,) the nodes.

    ``always`` (k, p) are the known length and the conditions on the shape; ``own_columns`` the columns of each angle.
    """

    problem: FreeFormProblem
    present: tuple[float, ...]
    rows: Array
    angle: Array
    inside: npt.NDArray[np.bool_]
    always: Array
    own_columns: dict[float, tuple[int, ...]]

    @property
    def table(self) -> str:
        """The name of the axis that turns the workpiece."""
        return self.problem.plane.table.name

    @property
    def conditions(self) -> dict[str, str]:
        """Every boundary condition with what it fixes, the known error last."""
        return self.problem.conditions

    @property
    def units(self) -> dict[str, Unit]:
        """The display unit of every parameter."""
        return self.problem.base_units

    def expected(self, angles: Sequence[float]) -> Expected:
        """What a plan of these angles promises."""
        planned = np.isin(self.angle, angles)
        probed = planned & self.inside
        others = {column for angle, its in self.own_columns.items() if angle not in angles for column in its}
        columns = np.array([c for c in range(self.rows.shape[1]) if c not in others])
        rows = np.concatenate([self.rows[probed][:, columns], self.always[:, columns]])
        scale = np.linalg.norm(rows, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        values, vectors = np.linalg.eigh((rows / scale).T @ (rows / scale))
        free = values > UNSEEN * values[-1]
        spread = np.sqrt((vectors[:, free] ** 2 / values[free]).sum(axis=1)) / scale
        hidden = np.abs(vectors[:, ~free]).max(axis=1, initial=0.0) > 1e-6
        u = np.where(hidden, np.nan, spread)
        names = self.problem.local_names
        reported = set(self.problem.base_names)
        return Expected(
            tuple(angles),
            int(probed.sum()),
            int((planned & ~self.inside).sum()),
            int((~free).sum()),
            {names[c]: float(value) for c, value in zip(columns, u, strict=True) if names[c] in reported},
        )

    def next_angles(self, count: int) -> tuple[list[Expected], tuple[float, ...]]:
        """Every single angle added to the present plan, best first, and the ``count`` angles chosen one by one."""
        single: list[Expected] = []
        best: tuple[float, ...] = ()
        for _ in range(count):
            before = (*self.present, *best)
            remaining = [angle for angle in self.own_columns if angle not in before]
            ranked = sorted((self.expected((*before, angle)) for angle in remaining), key=_merit)
            single = single or ranked
            best = (*best, ranked[0].angles[-1])
        return single, best


def _merit(plan: Expected) -> tuple[int, float]:
    return plan.nullity, float(np.nanmean(plan.shape**2)) if np.any(np.isfinite(plan.shape)) else np.inf


def candidates_of(campaign: Campaign, model: Model, angles: Sequence[float]) -> Candidates:
    """The points of the campaign's first run at its own angles and at ``angles`` (degrees).

    Raises DataError where the campaign is no free-form campaign or has no probings.
    """
    first = campaign.probings.rows(campaign.probings.run == campaign.probings.run[0])
    table = problem_of(campaign, model).plane.table.name
    degrees = np.round(first.readings[table] / DEGREE.factor, 6)
    present = tuple(dict.fromkeys(float(angle) for angle in degrees))
    every = (*present, *(angle for angle in dict.fromkeys(map(float, angles)) if angle not in present))
    if len(every) == len(present):
        raise DataError("there is no angle to choose from beyond those of the plan")
    _, point = np.unique(first.target, return_index=True)
    point = np.sort(point)
    probings = first.rows(np.tile(point, len(every)))
    count = len(probings)
    readings = dict(probings.readings)
    angle = np.repeat(every, len(point))
    readings[table] = angle * DEGREE.factor
    planned = Probings(
        np.ones(count, dtype=np.int64),
        np.arange(1, count + 1),
        np.zeros(count),
        probings.target,
        readings,
        probings.channels,
    )
    problem = problem_of(
        replace(campaign, runs=(replace(campaign.runs[0], run=1),), probings=planned),
        replace(model, added=()),
    )
    design = problem.linearise(problem.start, problem.common_start).local[0]
    positions = problem.nominal.context.positions
    chain = problem.context.chain
    inside = np.ones(count, dtype=bool)
    for joint in (problem.plane.u, problem.plane.v):
        reading = joint.sign * positions[:, chain.index(joint.name)]
        nodes = problem.nodes[joint.name]
        # A nominal place that is typed to a micrometre may pass the last node by as much.
        inside &= (reading >= nodes[0] - 1e-3) & (reading <= nodes[-1] + 1e-3)
    own_columns: dict[float, tuple[int, ...]] = dict.fromkeys(every, ())
    for symbol in problem.plane.table_terms:
        for degree in every:
            name = f"{symbol}({degree:.9g})"
            if name in problem.local_names:
                own_columns[degree] += (problem.local_names.index(name),)
    return Candidates(problem, present, design[:count], angle, inside, design[count:], own_columns)
