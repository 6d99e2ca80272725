"""Which machines the first page draws: not three times the same finding while another one stays unsaid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from monitor.reporting.health.answers import URGENT
from monitor.reporting.health.concern import concern
from monitor.reporting.health.records import MachineHealth, is_due

#: Machines that the first page draws: as many as leave room for the table.
DRAWN = 3


@dataclass(frozen=True)
class Looked:
    """A machine and what is found of it: its state, the parameter that makes it, and the effect that its model lacks;
    empty where nothing is urgent."""

    machine: str
    finding: tuple[str, ...]


def look_at(health: MachineHealth) -> Looked:
    """Return what is found of a machine."""
    if health.state not in URGENT and not is_due(health):
        return Looked(health.machine, ())
    parameter = concern(health)
    missing = () if health.model is None else health.model.missing[:1]
    finding = (
        health.state,
        "due" if is_due(health) else "",
        "" if parameter is None else parameter.name,
        *(effect.effect for effect in missing),
    )
    return Looked(health.machine, finding)


def attention(machines: Sequence[Looked]) -> tuple[tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Return the machines to draw, and by the name of each those of which the same is found and that are not drawn.

    ``machines`` are all of the report, in the order of urgency. One of every finding comes first, then the next most
    urgent ones; without any that is urgent the first ``DRAWN``.
    """
    alike: dict[tuple[str, ...], list[str]] = {}
    for looked in machines:
        if looked.finding:
            alike.setdefault(looked.finding, []).append(looked.machine)
    with_card = [names[0] for names in alike.values()][:DRAWN]
    with_card += [looked.machine for looked in machines if looked.machine not in with_card][
        : DRAWN - len(with_card)
    ]
    others = {
        names[0]: tuple(name for name in names if name not in with_card)
        for names in alike.values()
        if names[0] in with_card
    }
    drawn = tuple(looked.machine for looked in machines if looked.machine in with_card)
    return drawn, {name: names for name, names in others.items() if names}
