"""The result of an identification: the geometric errors of every run, and what the plan cannot separate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from monitor.documents import OMITTED
from monitor.methods.chain.gross import GrossReading
from monitor.methods.chain.measured import Displaced
from monitor.methods.chain.shared_effects import FollowedEffects
from monitor.records import Array
from monitor.refusal import Refusal
from monitor.sources import CommonQuantity
from monitor.units import Unit


@dataclass(frozen=True)
class RunIdentification:
    """One run. ``estimate`` (k,) and ``covariance`` (k, k) are in internal units, NaN where refused.

    ``unknowns`` maps every other unknown of the run (ball coordinates, stylus tip) to its value in mm.
    ``residuals`` (m, 3) mm from target to tip in the frame of the last work axis, one row a probing.
    ``chi_square`` is the sum of the squared weighted residuals, ``degrees_of_freedom`` its expectation. ``displaced``
    are stated points that the readings put elsewhere. ``common_parts`` are changes (k,) of the estimate for one
    standard uncertainty of each calibrated quantity that other campaigns may rest on too.
    """

    run: int
    estimate: Array
    covariance: Array
    unknowns: Mapping[str, float]
    refused: tuple[Refusal, ...]
    residuals: Array
    rms: float
    chi_square: float
    degrees_of_freedom: int
    displaced: tuple[Displaced, ...] = ()
    common_parts: Mapping[CommonQuantity, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class TakenUp:
    """An error that has no number of its own, whatever the plan: the free ones, or unknown frames and places, ``by``
    which it is taken up; none where the readings see nothing of it. ``why`` says so of an instrument that measured
    nothing here."""

    parameter: str
    by: tuple[str, ...]
    why: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class AsStated:
    """A tool point or scale that is taken as stated, of an instrument or of setups, ``name``: ``moved`` has, by its
    coordinates x, y and z, the errors that move with it and that no reading tells from it, and by ``scale`` those that
    its scale moves."""

    name: str
    setups: tuple[str, ...]
    moved: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Identification:
    """All runs of a campaign under one model.

    ``parameters`` names the k base parameters, ``units`` their display units. ``added`` names the parameters
    common to all runs, with ``added_estimate`` (c,) and ``added_covariance`` (c, c) in internal units. ``gross``
    readings are wrong beyond doubt, and so are the numbers of their runs: they have weight here like all others; of
    the runs ``unsearched`` some rows were not looked at for them.
    ``followed`` are the added effects as every run alone determines them. ``taken_up`` are errors without a number of
    their own, where the method says them, ``as_stated`` the stated places that its numbers count from.
    """

    campaign: str
    method: str
    model: str
    parameters: tuple[str, ...]
    units: tuple[Unit, ...]
    runs: tuple[RunIdentification, ...]
    added: tuple[str, ...]
    added_units: tuple[Unit, ...]
    added_estimate: Array
    added_covariance: Array
    added_refused: tuple[Refusal, ...]
    iterations: int
    gross: tuple[GrossReading, ...]
    followed: FollowedEffects
    unsearched: tuple[int, ...] = ()
    taken_up: tuple[TakenUp, ...] = ()
    as_stated: tuple[AsStated, ...] = ()


@dataclass(frozen=True)
class StepwiseCoefficient:
    """A coefficient identified step by step and at once, in internal units; ``unit`` is that for people.

    ``stepwise`` and ``at_once`` with their standard uncertainties; ``by_method`` is the part of the difference that
    remains without noise (the method's own), ``u_noise`` the standard uncertainty of the rest. ``at_once`` is NaN for
    what that fit does not have or refused; ``why`` names the reason of the difference.
    """

    parameter: str
    unit: Unit
    stepwise: float
    u_stepwise: float
    at_once: float
    u_at_once: float
    by_method: float
    u_noise: float
    why: str

    @property
    def agrees(self) -> bool:
        """Whether what the method does not explain lies within twice its standard uncertainty."""
        unexplained = self.stepwise - self.at_once - self.by_method
        return not np.isfinite(unexplained) or abs(unexplained) <= 2.0 * self.u_noise
