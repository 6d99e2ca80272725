"""Type B sources of uncertainty as a campaign states them: what, how large, by which law, and what shares one value.

Part of the ground: readers make them, the store keeps them, ``uncertainty`` turns them into covariance, reporting
names them. Which quantity takes which unit and keys stands in ``QUANTITIES``, so that reader, documentation and
propagation agree.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from monitor.units import KELVIN, MICROMETRE, MICRORADIAN, ONE, Unit


class Quantity(StrEnum):
    """What is not exactly known; the value is the word of the file."""

    STANDARD_TEMPERATURE = "standard_temperature"
    STANDARD_EXPANSION = "standard_expansion"
    BALL_TEMPERATURE = "ball_temperature"
    BALL_EXPANSION = "ball_expansion"
    BALL_FORM = "ball_form"
    PROBE_LOBING = "probe_lobing"
    STYLUS_BENDING = "stylus_bending"
    DRIFT = "drift"
    TABLE_DEFLECTION = "table_deflection"
    ROTARY_READOUT = "rotary_readout"
    LINEAR_POSITIONING = "linear_positioning"
    LINEAR_STRAIGHTNESS = "linear_straightness"
    EFFECT = "effect"


class Law(StrEnum):
    """The distribution of a source (JCGM 101:2008, 6.4)."""

    NORMAL = "normal"
    RECTANGULAR = "rectangular"
    TRIANGULAR = "triangular"
    ARCSINE = "arcsine"
    STUDENT = "t"


#: Half-width over standard deviation of the laws between two limits (JCGM 101:2008, 6.4.2, 6.4.5, 6.4.6).
HALF_WIDTHS: Mapping[Law, float] = {
    Law.RECTANGULAR: math.sqrt(3.0),
    Law.TRIANGULAR: math.sqrt(6.0),
    Law.ARCSINE: math.sqrt(2.0),
}


class Sharing(StrEnum):
    """What shares one value of the source: a new value is drawn for every other campaign, day, run or probing."""

    ALL_RUNS = "all runs"
    DAY = "a day"
    RUN = "a run"
    PROBING = "a probing"


@dataclass(frozen=True)
class QuantityRule:
    """The unit of a quantity's size by the suffix of its key, and the further keys that it may or must have.

    ``by_probing``: whether it may have another value at every probing.
    """

    suffixes: Mapping[str, Unit]
    largest: float
    required: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    by_probing: bool = False


_UM = {"um": MICROMETRE}
_URAD = {"urad": MICRORADIAN}
#: A quantity, the unit that its key ends in and its further keys. Beyond ``largest`` (in that unit) a unit has slipped.
QUANTITIES: Mapping[Quantity, QuantityRule] = {
    Quantity.STANDARD_TEMPERATURE: QuantityRule(
        {"K": KELVIN}, 100.0, optional=("expansion_coefficient_per_K",)
    ),
    Quantity.STANDARD_EXPANSION: QuantityRule({"per_K": ONE}, 1e-3, optional=("temperature_offset_K",)),
    Quantity.BALL_TEMPERATURE: QuantityRule(
        {"K": KELVIN}, 100.0, required=("expansion_coefficient_per_K",), by_probing=True
    ),
    Quantity.BALL_EXPANSION: QuantityRule({"per_K": ONE}, 1e-3, required=("temperature_offset_K",)),
    Quantity.BALL_FORM: QuantityRule(_UM, 1000.0, by_probing=True),
    Quantity.PROBE_LOBING: QuantityRule(_UM, 1000.0, by_probing=True),
    Quantity.STYLUS_BENDING: QuantityRule(_UM, 1000.0, by_probing=True),
    Quantity.DRIFT: QuantityRule(_UM, 1000.0, optional=("along",)),
    Quantity.TABLE_DEFLECTION: QuantityRule(_URAD, 10_000.0, required=("axis",)),
    Quantity.ROTARY_READOUT: QuantityRule(_URAD, 10_000.0, required=("axis",), by_probing=True),
    Quantity.LINEAR_POSITIONING: QuantityRule(_UM, 1000.0, required=("axis", "node_spacing_mm")),
    Quantity.LINEAR_STRAIGHTNESS: QuantityRule(_UM, 1000.0, required=("axis", "node_spacing_mm")),
    Quantity.EFFECT: QuantityRule({"um": MICROMETRE, "urad": MICRORADIAN}, 10_000.0, required=("effect",)),
}


@dataclass(frozen=True, kw_only=True)
class Source:
    """One row of ``[[sources]]``. ``name`` in the user's words is the line of the budget.

    ``size`` in internal units (mm, rad, K, 1/K) is the standard uncertainty, of a law between two limits the half of
    their distance. ``degrees_of_freedom`` are those of ``size`` (None: known). ``axis`` of the machine, ``along`` a
    direction (X, Y, Z), ``effect`` in the language of effects, ``expansion_coefficient`` in 1/K,
    ``temperature_offset`` in K from the reference temperature, ``node_spacing`` in mm belong to some quantities.
    """

    name: str
    quantity: Quantity
    size: float
    law: Law = Law.NORMAL
    degrees_of_freedom: float | None = None
    shared_by: Sharing = Sharing.ALL_RUNS
    axis: str | None = None
    along: str | None = None
    effect: str | None = None
    expansion_coefficient: float | None = None
    temperature_offset: float | None = None
    node_spacing: tuple[float, float] | None = None

    @property
    def u(self) -> float:
        """The standard uncertainty (JCGM 100:2008, 4.3)."""
        return self.size / HALF_WIDTHS.get(self.law, 1.0)

    @property
    def unit(self) -> Unit:
        """The unit in which people see the size."""
        suffixes = QUANTITIES[self.quantity].suffixes
        if len(suffixes) == 1:
            return next(iter(suffixes.values()))
        turns = self.effect is not None and self.effect[:1] == "E" and self.effect[1:2] in ("A", "B", "C")
        return MICRORADIAN if turns else MICROMETRE


#: The calibrated quantity by which all lengths of an instrument are off in proportion to themselves.
SCALE = "scale"


@dataclass(frozen=True, order=True)
class CommonQuantity:
    """A calibrated quantity that outlasts a campaign: the ``quantity`` (scale, a length) of the instrument or artefact
    ``of`` that name, by its ``certificate`` ("" where none is named), with the stated standard uncertainty ``u`` in mm
    or mm/mm.

    Results of two campaigns that rest on the same one are off by the same (JCGM 100:2008, F.1.2.3).
    """

    of: str
    certificate: str
    quantity: str
    u: float

    def is_calibrated_as(self, other: CommonQuantity) -> bool:
        """Whether both are one quantity with one calibration, however sure each campaign was of it."""
        return (self.of, self.certificate, self.quantity) == (other.of, other.certificate, other.quantity)
