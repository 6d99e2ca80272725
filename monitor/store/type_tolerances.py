"""Tolerances of a machine type, for machines whose campaign states none of its own.

They are of the place, not of the database: whoever opens it hands them over, nothing is stored, and what a campaign
states is never mixed with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from monitor.store.connection import Database

#: The type that stands for every machine that no other names.
ANY_TYPE = "*"

_STATED = """
SELECT machine, machine_description ->> 'model', coalesce(len(json_keys(machine_description, '$.tolerances')), 0)
FROM imported_campaign WHERE campaign_id IN ({campaigns}) AND method <> 'curve'
"""


@dataclass(frozen=True)
class ToleranceType:
    """A type as the configuration names it, and its limits of absolute values in display units."""

    name: str
    limits: Mapping[str, float]


def types_in_use(
    db: Database, campaigns: str, parameters: Sequence[int | str] = ()
) -> dict[str, ToleranceType]:
    """The type by machine, of those of ``campaigns`` (a query of numbers) that state no tolerances and have one."""
    if not db.type_tolerances:
        return {}
    types = {
        name.strip().casefold(): ToleranceType(name, limits) for name, limits in db.type_tolerances.items()
    }
    in_use = {}
    for machine, model, stated in db.rows(_STATED.format(campaigns=campaigns), parameters):
        of_type = types.get(str(model or "").strip().casefold(), types.get(ANY_TYPE))
        if not stated and of_type is not None:
            in_use[str(machine)] = of_type
    return in_use


def type_in_use(db: Database, campaign: str) -> ToleranceType | None:
    """The type whose tolerances hold for a campaign; None where it states its own or there is none."""
    types = types_in_use(db, "SELECT campaign_id FROM campaign WHERE campaign = ?", [campaign])
    return next(iter(types.values()), None)
