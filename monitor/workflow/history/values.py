"""The values of a machine's parameters run by run, with the conditions of the runs: what a picture of a trend shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime

import numpy as np

from monitor.documents import OMITTED
from monitor.exceptions import NotFoundError
from monitor.store import Database, machine_history, machine_topology, numbered_by, older_numbers
from monitor.workflow.models import resolve
from monitor.workflow.moments import at_machine, check_period


@dataclass(frozen=True)
class ValuesRequest:
    """The runs of a machine under a ``model`` (None: those that its numbers come from); one ``parameter``, or all.

    ``since`` belongs to the period, ``until`` does not; without an offset from UTC by the clock of the shop.
    """

    machine: str
    parameter: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    model: str | None = None

    def __post_init__(self) -> None:
        check_period(self.since, self.until)


@dataclass(frozen=True)
class ParameterValues:
    """Values of a parameter with their standard uncertainties, a number a run, None where a run has none.

    ``tolerance`` is the limit of the absolute value by the machine's latest campaign.
    """

    unit: str
    values: tuple[float | None, ...]
    u: tuple[float | None, ...]
    tolerance: float | None


@dataclass(frozen=True)
class ValuesAnswer:
    """The n runs of a machine in the order of time, with n values of each parameter and each condition.

    ``topology`` is its chain, by which plain names say to what an orientation is an angle. ``newer_versions`` are those
    (``NAME@VERSION``) by which nobody identified the machine yet: the values are then of the version before.
    """

    machine: str
    topology: str
    started_at: tuple[datetime, ...]
    campaign: tuple[str, ...]
    method: tuple[str, ...]
    run: tuple[int, ...]
    day: tuple[int, ...]
    warm_up: tuple[bool, ...]
    parameters: Mapping[str, ParameterValues]
    conditions: Mapping[str, tuple[float | None, ...]]
    newer_versions: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


def values_of_machine(db: Database, request: ValuesRequest) -> ValuesAnswer:
    """List the values of a machine's parameters in display units. Raises NotFoundError; nothing is stored."""
    request = replace(
        request,
        since=at_machine(db, request.machine, request.since),
        until=at_machine(db, request.machine, request.until),
    )
    name, version = None, None
    if request.model is not None:
        stored = resolve(db, request.model)
        name, version = stored.name, stored.version
    history = machine_history(
        db, request.machine, model=name, version=version,
        parameter=request.parameter, since=request.since, followed_by=numbered_by(db, request.machine),
    )  # fmt: skip
    if request.until is not None:
        history = history.part(np.array([at < request.until for at in history.started_at], dtype=np.bool_))
    if request.parameter is not None and len(history.run) and request.parameter not in history.parameters:
        raise NotFoundError(
            f"machine {request.machine} has no parameter {request.parameter!r} in any run of this period"
        )
    older = older_numbers(db, request.machine) if request.model is None else ()
    return ValuesAnswer(
        machine=request.machine,
        topology=machine_topology(db, request.machine),
        started_at=history.started_at,
        campaign=tuple(history.campaign.tolist()),
        method=tuple(history.method.tolist()),
        run=tuple(history.run.tolist()),
        day=tuple(history.day.tolist()),
        warm_up=tuple(history.warm_up.tolist()),
        parameters={
            name: ParameterValues(
                history.units[column],
                _numbers(history.values[:, column].tolist()),
                _numbers(history.u[:, column].tolist()),
                history.tolerances.get(name),
            )
            for column, name in enumerate(history.parameters)
        },
        conditions={name: _numbers(values.tolist()) for name, values in history.true_conditions.items()},
        newer_versions=tuple(f"{row.model}@{row.newest}" for row in older) or None,
    )


def _numbers(values: list[float]) -> tuple[float | None, ...]:
    return tuple(value if math.isfinite(value) else None for value in values)
