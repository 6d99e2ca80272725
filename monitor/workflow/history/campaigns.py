"""Which campaigns of a machine `monitor trend` follows, and which of them cannot both be true: a part of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.exceptions import NotFoundError
from monitor.store import MachineHistory


def chosen_only(history: MachineHistory, campaigns: tuple[str, ...]) -> MachineHistory:
    """The runs of the chosen campaigns (empty: all). Raises NotFoundError for one that the history does not hold."""
    known = list(dict.fromkeys(history.campaign.tolist()))
    for name in campaigns:
        if known and name not in known:
            raise NotFoundError(
                f"the history of machine {history.machine} holds no campaign {name!r}; it holds {', '.join(known)}"
            )
    if not campaigns:
        return history
    kept = np.isin(history.campaign, campaigns)
    return replace(
        history,
        campaign=history.campaign[kept],
        method=history.method[kept],
        run=history.run[kept],
        started_at=tuple(at for at, keep in zip(history.started_at, kept, strict=True) if keep),
        day=history.day[kept],
        warm_up=history.warm_up[kept],
        values=history.values[kept],
        u=history.u[kept],
        conditions={name: values[kept] for name, values in history.conditions.items()},
    )


def same_hours(history: MachineHistory) -> list[str]:
    """A sentence for every group of campaigns that hold runs of the same hours, which one machine cannot have made.

    The runs of a campaign's day stretch from its first start to its last; two campaigns that take turns within a
    day do overlap, two that follow each other on one day do not.
    """
    seconds = history.seconds
    days: dict[tuple[str, int], list[float]] = {}
    for name, day, at in zip(history.campaign.tolist(), history.day.tolist(), seconds.tolist(), strict=True):
        days.setdefault((name, day), []).append(at)
    stretches = sorted((min(at), max(at), name) for (name, _), at in days.items())
    group = {name: {name} for name in history.campaign.tolist()}
    # In the order of their beginnings, a stretch overlaps an earlier one where it begins before the latest end.
    latest, holder = -np.inf, ""
    for begins, ends, name in stretches:
        if begins <= latest and name != holder:
            joined = group[holder] | group[name]
            for one in joined:
                group[one] = joined
        if ends > latest:
            latest, holder = ends, name
    found = {tuple(sorted(names)) for names in group.values() if len(names) > 1}
    return [
        f"campaigns {', '.join(names[:-1])} and {names[-1]} hold runs of the same hours, which one machine cannot "
        f"have made; the numbers here mix them: name the one that counts with --campaign"
        for names in sorted(found)
    ]
