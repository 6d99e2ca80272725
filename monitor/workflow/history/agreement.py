"""Results of one machine that should agree, or should not: two methods, and before against after an event.

A part of `monitor trend`. The latest campaign of each method is compared with that of every other; and the last
campaign before a recorded event with the first after it, of the same method.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.statistics.normalised_error import K, normalised_error, result_of_runs
from monitor.store import Database, MachineHistory, latest_documents

Document = dict[str, Any]


@dataclass(frozen=True)
class Moment:
    """A recorded event: ``at`` in seconds since 1970."""

    at: float
    kind: str
    description: str


@dataclass(frozen=True)
class _Pair:
    """Two campaigns to be compared, with what is said of them; ``before`` and ``after`` (n,) choose their runs."""

    first: str
    second: str
    head: Document
    before: npt.NDArray[np.bool_] | None = None
    after: npt.NDArray[np.bool_] | None = None


def agreement(db: Database, history: MachineHistory, events: Sequence[Moment]) -> list[Document]:
    """The pairs of results of a machine, each with E_n of every parameter that both have.

    The uncertainty of a result is that of its identification or, where it is larger, the one that was evaluated for
    its campaign (the latest `monitor uncertainty`), and the scatter of its runs.
    """
    every = list(_pairs(history, events))
    # Of years of campaigns few are compared: only their results are read.
    compared = {name for one in every for name in (one.first, one.second)}
    history = _with(history, _evaluated(db, history, compared))
    found = [_pair(history, one) for one in every]
    return [one for one in found if one["parameters"]]


def _pairs(history: MachineHistory, events: Sequence[Moment]) -> Iterator[_Pair]:
    latest: dict[str, str] = {}
    for campaign, method in zip(history.campaign.tolist(), history.method.tolist(), strict=True):
        latest[method] = campaign  # runs are in the order of time
    for first, second in combinations(latest, 2):
        yield _Pair(latest[first], latest[second], {"kind": "methods", "methods": [first, second]})
    seconds = history.seconds
    for event in events:
        for method in latest:
            own = history.method == method
            before, after = own & (seconds < event.at), own & (seconds >= event.at)
            if before.any() and after.any():
                head = {
                    "kind": "event",
                    "event": event.kind,
                    "description": event.description,
                    "method": method,
                }
                # A campaign that the event cuts in two is compared with itself: its runs before, its runs after.
                first, second = history.campaign[before][-1], history.campaign[after][0]
                yield _Pair(first, second, head, before, after)


def _evaluated(
    db: Database, history: MachineHistory, campaigns: Collection[str]
) -> Mapping[str, Mapping[str, float]]:
    """Standard uncertainties, in display units, of the latest `monitor uncertainty` of the campaigns that have one."""
    wanted = {number: name for number, name in history.campaigns.items() if name in campaigns}
    found = latest_documents(db, "uncertainty", wanted)
    return {campaign: document["guf"]["u"] for campaign, document in found.items()}


def _with(history: MachineHistory, stated: Mapping[str, Mapping[str, float]]) -> MachineHistory:
    u = history.u.copy()
    for campaign, of in stated.items():
        rows = history.campaign == campaign
        for place, name in enumerate(history.parameters):
            u[rows, place] = np.fmax(u[rows, place], of.get(name, np.nan))
    return replace(history, u=u)


def _pair(history: MachineHistory, pair: _Pair) -> Document:
    parameters: Document = {}
    for place, (name, unit) in enumerate(zip(history.parameters, history.units, strict=True)):
        results = []
        for campaign, side in ((pair.first, pair.before), (pair.second, pair.after)):
            rows = (history.campaign == campaign) & np.isfinite(history.values[:, place])
            rows &= np.isfinite(history.u[:, place])
            if side is not None:
                rows &= side
            if rows.any():
                results.append(result_of_runs(history.values[rows, place], history.u[rows, place]))
        if len(results) < 2 or results[0][1] + results[1][1] == 0.0:
            continue
        (x1, u1), (x2, u2) = results
        one = normalised_error(x1, u1, x2, u2)
        parameters[name] = {
            "unit": unit, "first": x1, "u_first": u1, "second": x2, "u_second": u2,
            "difference": float(one.difference[0]), "expanded": float(one.expanded[0]), "k": K,
            "e_n": float(one.e_n[0]), "agree": bool(one.agree[0]),
        }  # fmt: skip
    return {
        **pair.head,
        "campaigns": [pair.first, pair.second],
        "parameters": parameters,
        "disagree": [name for name, one in parameters.items() if not one["agree"]],
    }


def sentence(pair: Document) -> str:
    """A pair as a line for people."""
    first, second = pair["campaigns"]
    worst = max(pair["parameters"].items(), key=lambda one: abs(one[1]["e_n"]))
    number = f"largest |E_n| {abs(worst[1]['e_n']):.2g} ({worst[0]})"
    if pair["kind"] == "methods":
        what = f"{pair['methods'][0]} ({first}) and {pair['methods'][1]} ({second})"
        if not pair["disagree"]:
            return f"{what} agree within their uncertainties in {', '.join(pair['parameters'])}: {number}"
        return f"{what} disagree in {', '.join(pair['disagree'])}: {number}"
    what = f"before and after the {pair['event']} ({first}, {second}; {pair['method']})"
    moved = ", ".join(
        f"{name} {pair['parameters'][name]['first']:.3g} -> {pair['parameters'][name]['second']:.3g} "
        f"{pair['parameters'][name]['unit']}"
        for name in pair["disagree"]
    )
    return f"{what}: {moved or 'nothing moved beyond the uncertainties'}; {number}"
