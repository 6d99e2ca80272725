"""What geometric errors mean at the tool tip: the volumetric error at any commanded point, and its covariance.

The error at a point is the vector from where the tip should be to where it is, relative to the workpiece: the
exact chain with its errors less the chain without them, for the same commanded positions and the same tool. The
covariance is that of the parameters taken through the exact Jacobian at the estimate (JCGM 102:2011 6.2); what
is left out is of second order, products of errors: 1e-4 of the error for angles of 100 µrad.

A workpiece is set up on a machine that has errors. With a ``datum``, the point at which its zero is set, the
error there is taken off in the workpiece's own frame; without one the workpiece stays where the chain's frame
says, and offsets such as EX0C1 appear whole. The frame of the workpiece is that of the last work axis: turned
and shifted as a whole by what no parameter of the model describes, it has no further error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from monitor.exceptions import DataError
from monitor.machine import Chain, evaluate
from monitor.records import Array
from monitor.uncertainty.coverage_regions.coverage import single_factor
from monitor.uncertainty.geometric_errors import GeometricErrors, joint_errors


@dataclass(frozen=True)
class VolumetricError:
    """The error at n commanded points along the axes of the machine.

    ``positions`` (n, J) mm and rad; ``vectors`` (n, 3) mm; ``sensitivity`` (n, 3, k) mm per unit of each of the
    parameters ``names``, which are ``coefficients`` (k,) with ``parameter_covariance`` (k, k). ``datum`` (J,) is where
    the workpiece was set to zero.
    """

    positions: Array
    vectors: Array
    sensitivity: Array
    names: tuple[str, ...]
    coefficients: Array
    parameter_covariance: Array
    degrees_of_freedom: float
    datum: Array | None

    @cached_property
    def covariance(self) -> Array:
        """Covariance (n, 3, 3) of each vector, mm²."""
        s = self.sensitivity
        return np.asarray(s @ self.parameter_covariance @ np.swapaxes(s, -1, -2))

    @cached_property
    def lengths(self) -> Array:
        """Lengths (n,) of the vectors, mm."""
        return np.asarray(np.linalg.norm(self.vectors, axis=1))

    @cached_property
    def _directions(self) -> Array:
        return self.vectors / np.where(self.lengths > 0.0, self.lengths, 1.0)[:, None]

    @cached_property
    def u_lengths(self) -> Array:
        """Standard uncertainties (n,) of the lengths, mm, along the vectors.

        First order: a length that is no larger than its uncertainty is estimated too large by about that much.
        """
        d = self._directions
        return np.asarray(np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", d, self.covariance, d), 0.0)))

    def _u(self, weights: Array) -> float:
        """Standard uncertainty of the sum of the vectors times ``weights`` (n, 3), correlations included."""
        gradient = np.einsum("ni,nik->k", weights, self.sensitivity)
        return float(np.sqrt(max(0.0, gradient @ self.parameter_covariance @ gradient)))

    @property
    def mean(self) -> tuple[float, float]:
        """Mean length and its standard uncertainty, mm."""
        return float(np.mean(self.lengths)), self._u(self._directions / len(self.lengths))

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square length and its standard uncertainty, mm."""
        rms = float(np.sqrt(np.mean(self.lengths**2)))
        weights = self.vectors / (len(self.lengths) * rms) if rms > 0.0 else np.zeros_like(self.vectors)
        return rms, self._u(weights)

    @property
    def worst(self) -> int:
        """The point with the longest vector."""
        return int(np.argmax(self.lengths))

    @property
    def least_certain(self) -> int:
        """The point whose length has the largest uncertainty."""
        return int(np.argmax(self.u_lengths))

    def factor(self, p: float = 0.95) -> float:
        """Return k of one length or one component, with the degrees of freedom of the parameters."""
        return single_factor(p, self.degrees_of_freedom)

    def budget(self, point: int) -> dict[str, float]:
        """What each parameter adds to the length at a point, mm: signed, along the vector.

        To first order; they add up to the length but for products of errors.
        """
        along = self._directions[point] @ self.sensitivity[point] * self.coefficients
        return dict(zip(self.names, map(float, along), strict=True))


def grid(
    chain: Chain, ranges: Mapping[str, tuple[float, float]], points: int, turned: Array | None = None
) -> Array:
    """Commanded positions (n, J): ``points`` along every linear axis, at every pose of ``turned`` (P, J).

    ``ranges`` are the readings from and to, mm, of every linear axis; without ``turned`` all other axes stand at
    zero. Raises DataError for an axis without a range or fewer than two points.
    """
    linear = [index for index, joint in enumerate(chain.joints) if not joint.turns]
    if not linear:
        raise DataError("a map runs over the strokes of linear axes, and this machine has none")
    if points < 2:
        raise DataError(f"a map needs at least 2 points along every axis, not {points}")
    lacking = [chain.joints[index].name for index in linear if chain.joints[index].name not in ranges]
    if lacking:
        raise DataError(f"the map needs the stroke of axis {', '.join(lacking)}")
    steps = [
        chain.joints[index].sign * np.linspace(*ranges[chain.joints[index].name], points) for index in linear
    ]
    poses = np.zeros((1, len(chain.joints))) if turned is None else turned
    corners = np.array(list(product(*steps))).reshape(-1, len(linear))
    positions = np.repeat(poses, len(corners), axis=0)
    positions[:, linear] = np.tile(corners, (len(poses), 1))
    return positions


def middle(chain: Chain, ranges: Mapping[str, tuple[float, float]]) -> Array:
    """The position (J,) with every linear axis in the middle of its range and all others at zero."""
    return np.asarray(np.mean(grid(chain, ranges, 2), axis=0))


def _in_work_frame(geometric: GeometricErrors, positions: Array, values: Array) -> tuple[Array, Array, Array]:
    """Error (n, 3) and its derivatives (n, 3, k) in the workpiece's frame, and the turn (n, 3, 3) to the machine's."""
    chain, origin = geometric.chain, np.zeros((len(positions), 3))
    errors, bases = joint_errors(geometric, positions, values)
    perfect = evaluate(chain, positions, np.zeros_like(errors), origin, geometric.tip)
    real = evaluate(chain, positions, errors, origin, geometric.tip, jacobian=True)
    assert real.by_error is not None
    slopes = [basis.displacement(real.by_error) for basis in bases]
    return (
        real.residual - perfect.residual,
        np.concatenate([np.zeros((len(positions), 3, 0)), *slopes], axis=-1),
        perfect.work_rotation,
    )


def volumetric_error(
    geometric: GeometricErrors,
    positions: Array,
    datum: Array | None = None,
    coefficients: Array | None = None,
) -> VolumetricError:
    """The error at commanded ``positions`` (n, J), physical displacements in mm and rad.

    ``datum`` (J,) is where the workpiece's zero is set; ``coefficients`` (k,) take the place of the estimate, for
    Monte Carlo. Raises DataError for positions of another chain.
    """
    joints = len(geometric.chain.joints)
    positions = np.asarray(positions, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != joints or not np.all(np.isfinite(positions)):
        raise DataError(
            f"positions must be finite numbers of shape (points, {joints}), one column each for "
            f"{', '.join(joint.name for joint in geometric.chain.joints)}; their shape is {positions.shape}"
        )
    values = geometric.estimate if coefficients is None else np.asarray(coefficients, dtype=np.float64)
    asked = positions if datum is None else np.concatenate([positions, np.asarray(datum)[None]])
    vectors, slopes, turns = _in_work_frame(geometric, asked, values)
    if datum is not None:
        vectors, slopes, turns = vectors[:-1] - vectors[-1], slopes[:-1] - slopes[-1], turns[:-1]
    return VolumetricError(
        positions=positions,
        vectors=np.einsum("nij,nj->ni", turns, vectors),
        sensitivity=turns @ slopes,
        names=geometric.names,
        coefficients=values,
        parameter_covariance=geometric.covariance,
        degrees_of_freedom=geometric.degrees_of_freedom,
        datum=None if datum is None else np.asarray(datum, dtype=np.float64),
    )
