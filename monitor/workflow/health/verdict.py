"""What the fleet table says of a machine: its state, since when, how likely it is out, and when to look again."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from monitor.reporting.health.records import (
    ALARMS,
    Change,
    DataQuality,
    ParameterHealth,
    RefusedImport,
    State,
)
from monitor.uncertainty.conformity import conformity
from monitor.workflow.health.weeks import Week
from monitor.workflow.history.health_series import DriftFound

Document = dict[str, Any]


@dataclass(frozen=True)
class Judged:
    """Probability of each parameter and of any of them to be out; None where no tolerance is stated."""

    single: dict[str, float]
    any: float | None
    every_has_one: bool


def judged_by(evaluated: Document | None, limits: dict[str, float]) -> Judged:
    if evaluated is None:
        return Judged({}, None, False)
    guf = evaluated["guf"]
    names = list(evaluated["parameters"])
    if not any(name in limits for name in names):
        return Judged({}, None, False)
    u = np.array([guf["u"][name] for name in names])
    covariance = np.array(guf["correlation"]) * np.outer(u, u)
    limit = np.array([limits.get(name, np.inf) for name in names])
    dof = guf["degrees_of_freedom"]
    found = conformity(
        [guf["estimate"][name] for name in names], covariance, -limit, limit, dof=np.inf if dof is None else dof
    )  # fmt: skip
    single = {name: float(1.0 - p) for name, p in zip(names, found.single, strict=True) if name in limits}
    return Judged(single, float(1.0 - found.joint), all(name in limits for name in names))


def changed_in_words(noted: list[Change], explained: Document | None, quality: DataQuality) -> str:
    """What is new this week: changes, then events, what the model lacks, and data that never came in."""
    own = [one.what for kind in ("change", "event") for one in noted if one.this_week and one.kind == kind]
    own += refusals_in_words(quality.refused_imports)
    own = own[:3] + ([f"and {len(own) - 3} more"] if len(own) > 3 else [])
    own += [f"the model lacks {one['effect']}" for one in (explained or {}).get("missing", [])[:1]]
    return "; ".join(own) or "nothing this week"


def refusals_in_words(refused: tuple[RefusedImport, ...]) -> list[str]:
    """One sentence for the imports that were refused and did not come in since."""
    still = [one for one in refused if one.imported_at is None]
    if not still:
        return []
    if len(still) == 1:
        return [f"an import was refused on {still[0].at:%Y-%m-%d}"]
    return [f"{len(still)} imports were refused, the last on {still[-1].at:%Y-%m-%d}"]


def since_when(
    state: State, parameters: list[ParameterHealth], noted: list[Change], compared: datetime
) -> datetime | None:
    """Since when the machine is in this state: beyond a tolerance, another one than before, or not explained by the
    model, which then is so from the first run ``compared`` with it."""
    beyond = [one.out_since for one in parameters if one.out_since is not None]
    if state == "out of tolerance" and beyond:
        return min(beyond)
    if state == "model fails":
        return compared
    changed = [one.at for one in noted if one.kind == "change"]
    if state == "changed":
        changed = [one.at for one in noted if one.kind == "change" and one.this_week]
        return min(changed)
    return max(changed, default=None)


def state_of(
    judged: Judged, noted: list[Change], explained: Document | None, quality: DataQuality, risk: float
) -> State:
    if judged.any is not None and max(judged.single.values()) > 0.5:
        return "out of tolerance"
    if judged.any is not None and judged.any > risk:
        return "may be out of tolerance"
    if any(one.kind == "change" and one.this_week for one in noted):
        return "changed"
    if explained is not None and explained["verdict"] == "something is missing":
        return "model fails"
    if quality.suspect:
        return "suspect data"
    return "in tolerance" if judged.every_has_one else "no change seen"


def next_check(
    state: State, drifts: dict[str, DriftFound | None], limits: dict[str, float], last: datetime, week: Week
) -> str:
    """When to measure again, and why: the machine is likely to be in tolerance until then."""
    known = {
        name: one.good_for for name, one in drifts.items() if one is not None and one.good_for is not None
    }
    if state in ALARMS:
        return "now"
    if not limits:
        return "no forecast: the campaign states no tolerances"
    if not known:
        return "no forecast: fewer than three days since the last change"
    name = min(known, key=lambda one: known[one])
    found = drifts[name]
    assert found is not None
    day = (last + timedelta(days=known[name])).date()
    if known[name] >= found.horizon and day <= week.last:
        return f"next week: {found.horizon:.0f} days of history allow no longer forecast"
    if day <= week.last:
        return f"now: {name} stayed in tolerance with 95 % until {day} only"
    if known[name] >= found.horizon:
        return f"by {day}: in tolerance as far ahead as the history is long"
    return f"by {day}: {name} stays in tolerance with 95 % until then"


def factor_in_words(evaluated: Document | None) -> str:
    if evaluated is None:
        return "no uncertainty"
    guf = evaluated["guf"]
    k_q, dof = guf["k_q_with_degrees_of_freedom"], guf["degrees_of_freedom"]
    freedom = "" if dof is None else f", {dof:.0f} degrees of freedom"
    count, percent = len(evaluated["parameters"]), evaluated["p"] * 100
    return f"U = {k_q:.2f} u: all {count} intervals hold at once with {percent:g} %{freedom}"
