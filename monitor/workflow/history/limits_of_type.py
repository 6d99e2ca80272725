"""Limits of a machine type that hold for no parameter of a machine: misspelt, or of another machine."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from monitor.exceptions import did_you_mean
from monitor.records import VOLUMETRIC
from monitor.reporting import messages
from monitor.store import Database, tolerance_types
from monitor.store.type_tolerances import ANY_TYPE


def limits_without_parameter(
    machine_type: str, limits: Collection[str], parameters: Collection[str]
) -> tuple[str, ...]:
    """Return what is said of the ``limits`` of a type of which a machine with these ``parameters`` has none.

    Where some hold, only those of an axis that the machine has not are named, and only beside a parameter that may be
    meant: a type limits what its other machines have.
    """
    if {VOLUMETRIC, *parameters}.isdisjoint(limits):
        hint = next(filter(None, (did_you_mean(limit, parameters) for limit in limits)), "")
        return (messages.limits_of_others(machine_type, tuple(limits), hint),)
    if machine_type == ANY_TYPE:
        return ()
    # Loaded here: most places state no tolerances by type, and have no need of the readers.
    from monitor.readers.campaign.machine_file import TERM

    axes = {term[3] for parameter in parameters if (term := TERM.fullmatch(parameter))}
    astray = [limit for limit in limits if (term := TERM.fullmatch(limit)) and term[3] not in axes]
    return tuple(
        messages.limit_of_no_axis(machine_type, limit, hint)
        for limit in astray
        if (hint := did_you_mean(limit, parameters))
    )


def limits_without_parameter_by_machine(
    db: Database, parameters: Mapping[str, Collection[str]]
) -> dict[str, tuple[str, ...]]:
    """Return by machine what ``limits_without_parameter`` says of those judged by their type."""
    said: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    by_machine = {}
    for machine, machine_type in tolerance_types(db).items():
        key = machine_type, frozenset(parameters.get(machine, ()))
        if not key[1]:
            continue
        if key not in said:
            said[key] = limits_without_parameter(
                machine_type, db.type_tolerances[machine_type], sorted(key[1])
            )
        if said[key]:
            by_machine[machine] = said[key]
    return by_machine
