"""What results of several campaigns have in common: the scale of one laser, the length of one calibrated bar.

A quantity that was calibrated once is off by the same in January and in June. So no difference of two results has it,
and no number of results makes it smaller: drifts and changes are judged without it, levels and what is foretold of them
hold all of it, and E_n of two results counts their covariance (JCGM 100:2008, F.1.2.3 and 5.2.2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.sources import CommonQuantity


@dataclass(frozen=True)
class RestsOn:
    """A calibrated ``quantity`` of an instrument or artefact, by its ``certificate`` where one is named, that results
    have in common; ``u`` is the standard uncertainty of each of them by it, in the unit of the parameter."""

    calibrated: str
    quantity: str
    certificate: str | None = field(default=None, metadata=OMITTED)
    u: float | None = field(default=None, metadata=OMITTED)


def rests_on(quantity: CommonQuantity, u: float | None = None) -> RestsOn:
    """State a quantity as answers have it."""
    return RestsOn(quantity.of, quantity.quantity, quantity.certificate or None, u)


def calibrated_alike(common_parts: Mapping[CommonQuantity, Array]) -> dict[CommonQuantity, Array]:
    """What values (n, p) change by for one standard uncertainty of each calibrated quantity, that of the campaign that
    was surest of it: what another one states beyond that is its own."""
    parts: dict[CommonQuantity, Array] = {}
    for quantity in sorted(common_parts, key=lambda each: each.u):
        surest = next((each for each in parts if each.is_calibrated_as(quantity)), quantity)
        part = common_parts[quantity] * (surest.u / quantity.u)
        parts[surest] = parts[surest] + part if surest in parts else part
    return parts
