"""What results of several campaigns have in common: the scale of one laser, the length of one calibrated bar.

A quantity that was calibrated once is off by the same in January and in June. So no difference of two results has it,
and no number of results makes it smaller. Of a mean, a line or what is foretold the runs of each calibration have
their share: its variance by a quantity is the square of the sum of weights times parts (JCGM 100:2008, F.1.2.3 and
5.2.2), all of u where every run rests on it, less where runs of other calibrations stand beside. A slope over two
calibrations has part of what these are apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.sources import SCALE, CommonQuantity
from monitor.store import MachineHistory
from monitor.units import METRE, MICROMETRE

#: What is not told apart of a campaign that an older version identified: its scale and its lengths.
CALIBRATION = "calibration"


@dataclass(frozen=True)
class RestsOn:
    """A calibrated ``quantity`` of an instrument or artefact, by its ``certificate`` where one is named, that results
    have in common.

    Of a history of so many ``of_runs``, ``runs`` of them rest on it; ``u`` is the standard uncertainty of the latest
    mean by it, ``u_line`` that of the line at the last run, from which on is foretold, in the unit of the parameter,
    and ``u_slope_per_year`` that of the slope. ``at_most``: the identification of some of the runs is of an older
    version that did not store it, and their whole u counts as theirs.
    """

    calibrated: str
    quantity: str
    certificate: str | None = field(default=None, metadata=OMITTED)
    u: float | None = field(default=None, metadata=OMITTED)
    runs: int | None = field(default=None, metadata=OMITTED)
    of_runs: int | None = field(default=None, metadata=OMITTED)
    u_line: float | None = field(default=None, metadata=OMITTED)
    u_slope_per_year: float | None = field(default=None, metadata=OMITTED)
    at_most: bool | None = field(default=None, metadata=OMITTED)


def rests_on(quantity: CommonQuantity) -> RestsOn:
    """State a quantity as answers have it."""
    return RestsOn(quantity.of, quantity.quantity, quantity.certificate or None)


def calibrated_alike(common_parts: Mapping[CommonQuantity, Array]) -> dict[CommonQuantity, Array]:
    """What values (n, p) change by for one standard uncertainty of each calibrated quantity, that of the campaign that
    was surest of it: what another one states beyond that is its own."""
    parts: dict[CommonQuantity, Array] = {}
    for quantity in sorted(common_parts, key=lambda each: each.u):
        surest = next((each for each in parts if each.is_calibrated_as(quantity)), quantity)
        part = common_parts[quantity] * (surest.u / quantity.u)
        parts[surest] = parts[surest] + part if surest in parts else part
    return parts


def stated_differently(
    common_parts: Mapping[CommonQuantity, Array],
) -> list[tuple[CommonQuantity, CommonQuantity]]:
    """Return the calibrations that campaigns state with another u each: the surest statement and the least sure."""
    statements: dict[tuple[str, str, str], list[CommonQuantity]] = {}
    for quantity in common_parts:
        statements.setdefault((quantity.of, quantity.certificate, quantity.quantity), []).append(quantity)
    ordered = (sorted(each, key=lambda quantity: quantity.u) for each in statements.values())
    return [(each[0], each[-1]) for each in ordered if each[0].u != each[-1].u]


def calibrated_to(quantity: CommonQuantity) -> str:
    """The stated standard uncertainty in words: µm/m of a scale, µm of a length."""
    # A scale is a length per length.
    per_metre = "/m" if quantity.quantity == SCALE else ""
    u = MICROMETRE.to_display(quantity.u * (METRE.factor if per_metre else 1.0))
    return f"{u:.3g} {MICROMETRE.name}{per_metre}"


def with_unstored(history: MachineHistory) -> tuple[dict[CommonQuantity, Array], npt.NDArray[np.bool_]]:
    """What values (n, p) have of each quantity, and the mask (n,) of the runs of which that is a bound.

    What identifications of older versions do not say is taken as the whole u of their runs, of the first calibration
    that their campaign states which other runs rest on too, else of the first that it states.
    """
    parts = calibrated_alike(history.common_parts)
    bounded = np.isin(history.campaign, list(history.calibrations.unstored))
    for campaign, stated in history.calibrations.unstored.items():
        runs = history.campaign == campaign
        if not runs.any():
            continue
        of_others = [quantity for quantity in parts if (quantity.of, quantity.certificate) in stated]
        quantity = of_others[0] if of_others else CommonQuantity(*stated[0], CALIBRATION, np.inf)
        part = parts.setdefault(quantity, np.zeros(history.u.shape))
        sign = np.where(part.sum(axis=0) < 0.0, -1.0, 1.0)
        parts[quantity] = np.where(runs[:, np.newaxis], sign * np.nan_to_num(history.u), part)
    return parts, bounded
