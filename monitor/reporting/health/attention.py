"""Which machines the first page draws: not three times the same finding while another one stays unsaid."""

from __future__ import annotations

from collections.abc import Iterable

from monitor.reporting.health.answers import URGENT, concern
from monitor.reporting.health.records import MachineHealth, is_due

#: Machines that the first page draws: as many as leave room for the table.
DRAWN = 3
#: Machines that are looked at for them, the most urgent first.
LOOKED_AT = 12


def attention(
    machines: Iterable[MachineHealth],
) -> tuple[tuple[MachineHealth, ...], dict[str, tuple[str, ...]]]:
    """Return the machines to draw, and by the name of each those of which the same is found and that are not drawn.

    ``machines`` in the order of urgency. One of every finding comes first, then the next most urgent ones; without any
    that is urgent the first ``DRAWN``.
    """
    looked_at = list(machines)
    alike: dict[tuple[str, ...], list[MachineHealth]] = {}
    for health in looked_at:
        if health.state in URGENT or is_due(health):
            alike.setdefault(_finding(health), []).append(health)
    drawn = [members[0].machine for members in alike.values()][:DRAWN]
    drawn += [health.machine for health in looked_at if health.machine not in drawn][: DRAWN - len(drawn)]
    others = {
        members[0].machine: tuple(health.machine for health in members if health.machine not in drawn)
        for members in alike.values()
    }
    return tuple(health for health in looked_at if health.machine in drawn), {
        name: names for name, names in others.items() if names and name in drawn
    }


def _finding(health: MachineHealth) -> tuple[str, ...]:
    """What is found of a machine: its state, the parameter that makes it, and the effect that its model lacks."""
    parameter = concern(health)
    missing = () if health.model is None else health.model.missing[:1]
    due = "due" if is_due(health) else ""
    return (
        health.state,
        due,
        "" if parameter is None else parameter.name,
        *(effect.effect for effect in missing),
    )
