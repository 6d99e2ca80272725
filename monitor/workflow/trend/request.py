"""What is asked of the long view of a machine: ``TrendRequest``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from monitor.exceptions import InputError
from monitor.store import Database
from monitor.workflow.moments import at_machine, check_period


@dataclass(frozen=True)
class TrendRequest:
    """Follow the parameters of a machine; moments without an offset from UTC are by the clock of the shop.

    ``parameter`` alone, runs from ``since`` on and before ``until``, of the ``campaigns`` (empty: all), of a ``method``
    (None: every one), those that ``warm_up`` alone or (False) the others alone, under a ``model`` (by default the
    method's own). The control charts compare with a ``reference`` period (by default the first third). ``reliability``
    is the wanted probability of being in tolerance until the ``next_check``; ``volumetric_limit_um`` takes the place of
    the machine file's. ``figures`` are drawn into a folder. ``weekly_looks`` adds what looks at the whole fleet
    every week noticed of the machine.
    """

    machine: str
    parameter: str | None = None
    since: datetime | None = None
    next_check: datetime | None = None
    reference: tuple[datetime, datetime] | None = None
    reliability: float = 0.95
    campaigns: tuple[str, ...] = ()
    model: str | None = None
    volumetric_limit_um: float | None = None
    figures: Path | None = None
    weekly_looks: bool = False
    until: datetime | None = None
    method: str | None = None
    warm_up: bool | None = None

    def __post_init__(self) -> None:
        check_period(self.since, self.until)
        check_period(*(self.reference or (None, None)))
        if not 0.0 < self.reliability < 1.0:
            raise InputError(f"--reliability {self.reliability:g}: a probability lies between 0 and 1")
        limit = self.volumetric_limit_um
        if limit is not None and not 0.0 < limit < float("inf"):
            raise InputError(f"--volumetric-limit {limit:g}: a limit in µm lies above zero")
        if limit is not None and self.parameter is not None:
            raise InputError("--volumetric-limit needs all parameters; leave out --parameter")

    def at_machine(self, db: Database) -> TrendRequest:
        """Return the request with its moments as the clock of the machine's shop had them."""
        reference = None
        if self.reference is not None:
            first, last = self.reference
            reference = at_machine(db, self.machine, first), at_machine(db, self.machine, last)
        return replace(
            self,
            since=at_machine(db, self.machine, self.since),
            until=at_machine(db, self.machine, self.until),
            next_check=at_machine(db, self.machine, self.next_check),
            reference=reference,
        )

    @property
    def is_plain(self) -> bool:
        """Whether nothing but the machine was named: such an answer is stored."""
        return replace(self, figures=None) == TrendRequest(self.machine)
