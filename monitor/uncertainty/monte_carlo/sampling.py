"""Joint distribution of the inputs and the drawing of trials, block by block (JCGM 101:2008 6.4, JCGM 102).

Marginals are joined by a Gaussian or a t copula. A singular correlation is sampled in its rank, found by
eigen-decomposition. Every block of trials has a random stream of its own, spawned from one seed, so the
numbers do not depend on how many workers draw them or in which order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.covariance import Inputs
from monitor.uncertainty.marginals import Marginal, Normal, StudentT
from monitor.uncertainty.roots import CovarianceRoot, covariance_root

Copula = Literal["gaussian", "t"]


@dataclass(frozen=True)
class JointDistribution:
    """Inputs that belong together: ``marginals`` joined by a copula with ``correlation`` (n, n).

    The correlation is the copula's, that of the normal (or t) variables behind the inputs. For normal and t
    inputs it is also the inputs' own; for others the inputs' product-moment correlation is nearer to zero
    (two rectangular inputs: (6/pi) arcsin(rho/2), at most 0.018 less). ``copula_dof`` belongs to the t copula.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    marginals: tuple[Marginal, ...]
    correlation: Array
    copula: Copula = "gaussian"
    copula_dof: float = math.inf

    def __post_init__(self) -> None:
        count = len(self.names)
        if len(self.units) != count or len(self.marginals) != count:
            raise DataError(f"{count} inputs need {count} units and marginals")
        if np.shape(self.correlation) != (count, count):
            raise DataError(f"{count} inputs need a correlation matrix ({count}, {count})")
        if np.max(np.abs(np.diag(self.correlation) - 1.0), initial=0.0) > 1e-9:
            raise DataError("the diagonal of a correlation matrix must be 1")
        if self.copula not in ("gaussian", "t"):
            raise DataError(f"no copula '{self.copula}'; there are gaussian and t")
        if self.copula == "t" and not 0.0 < self.copula_dof < math.inf:
            raise DataError(f"a t copula needs positive, finite copula_dof, but has {self.copula_dof}")
        _ = self.factor

    @cached_property
    def factor(self) -> CovarianceRoot:
        """The root of the correlation, in its rank."""
        return covariance_root(self.correlation)

    @cached_property
    def elliptical(self) -> tuple[Array, Array] | None:
        """Location (n,) and root (n, rank) where the inputs are jointly normal or t, else None."""
        if self.copula == "gaussian" and all(isinstance(marginal, Normal) for marginal in self.marginals):
            scale = np.array([marginal.std for marginal in self.marginals])
        elif self.copula == "t" and all(
            isinstance(marginal, StudentT) and marginal.dof == self.copula_dof for marginal in self.marginals
        ):
            scale = np.array(
                [marginal.scale for marginal in self.marginals if isinstance(marginal, StudentT)]
            )
        else:
            return None
        return np.array([marginal.mean for marginal in self.marginals]), scale[:, None] * self.factor.root

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """``count`` draws of all inputs, shape (n, count), inputs first."""
        normal = rng.standard_normal((self.factor.rank, count))
        if self.elliptical is not None:
            location, root = self.elliptical
            drawn = root @ normal
            if self.copula == "t":
                drawn /= np.sqrt(rng.chisquare(self.copula_dof, count) / self.copula_dof)
            drawn += location[:, None]
            return drawn
        latent = self.factor.root @ normal
        if self.copula == "t":
            latent /= np.sqrt(rng.chisquare(self.copula_dof, count) / self.copula_dof)
            probability = scipy.special.stdtr(self.copula_dof, latent)
        else:
            probability = scipy.special.ndtr(latent)
        # Beyond 8 sigma the probability rounds to 0 or 1, where a quantile would be infinite.
        np.clip(probability, 1e-300, 1.0 - 2.0**-53, out=probability)
        drawn = np.empty_like(probability)
        for row, marginal in enumerate(self.marginals):
            drawn[row] = marginal.quantile(probability[row])
        return drawn


def independent(
    names: Sequence[str], units: Sequence[str], marginals: Sequence[Marginal]
) -> JointDistribution:
    """Inputs that have nothing to do with each other."""
    return JointDistribution(tuple(names), tuple(units), tuple(marginals), np.eye(len(names)))


def normal_inputs(inputs: Inputs) -> tuple[JointDistribution, ...]:
    """All inputs jointly normal with their covariance (JCGM 101 6.4.8)."""
    marginals = tuple(Normal(float(y), float(u)) for y, u in zip(inputs.estimate, inputs.u, strict=True))
    return (JointDistribution(inputs.names, inputs.units, marginals, inputs.correlation),)


def block_generator(seed: int, block: int) -> np.random.Generator:
    """The stream of one block: that of ``SeedSequence(seed).spawn(block + 1)[block]``."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(block,))))


@dataclass(frozen=True)
class BlockSampler:
    """Draws block number b of ``block_size`` trials from independent ``groups`` of inputs, always the same.

    ``draw(b)`` has shape (block_size, n); it is the transpose of an array with the inputs first, so that a
    model working across trials reads contiguous memory.
    """

    groups: tuple[JointDistribution, ...]
    seed: int
    block_size: int = 1000

    def __post_init__(self) -> None:
        if not self.groups:
            raise DataError("a sampler needs at least one group of inputs")
        if self.seed < 0 or self.block_size < 1:
            raise DataError(f"seed must be >= 0 and block_size >= 1, not {self.seed} and {self.block_size}")
        names = self.names
        if len(set(names)) != len(names):
            raise DataError("every input of a sampler needs its own name")

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all inputs in order."""
        return tuple(name for group in self.groups for name in group.names)

    def draw(self, block: int) -> Array:
        """The trials of block number ``block`` (from 0), shape (block_size, n)."""
        rng = block_generator(self.seed, block)
        drawn = [group.draw(rng, self.block_size) for group in self.groups]
        return drawn[0].T if len(drawn) == 1 else np.concatenate(drawn).T
