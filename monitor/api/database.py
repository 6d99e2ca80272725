"""An open database with its machines and campaigns."""

from __future__ import annotations

import getpass
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, overload

from monitor import store
from monitor.api.arguments import argument, checked
from monitor.api.asking import Ask, answered, drawn, options_as_arguments, request_of
from monitor.api.campaign import Campaign
from monitor.api.tables import main_table, table_of
from monitor.exceptions import InputError, NotFoundError, did_you_mean

if TYPE_CHECKING:
    import pandas as pd

    from monitor.api.answers import (
        AnyAnswer,
        TypedFleetAnswer,
        TypedImportAnswer,
        TypedLikeAnswer,
        TypedModelsAnswer,
        TypedReportAnswer,
        TypedSimulateAnswer,
        TypedSimulateMachineAnswer,
        TypedTrendAnswer,
    )


class Database:
    """An open database, which holds its file only while it reads or writes. Close it, or use a ``with`` statement."""

    def __init__(self, path: Path, *, read_only: bool = False, wait_s: float = 300.0) -> None:
        actor = ""
        with suppress(OSError, KeyError):  # a container may run under a number that has no name
            actor = getpass.getuser()
        self._store = store.SharedDatabase(
            path, read_only=read_only, threads=1, actor=actor, patience=store.Patience(wait_s), unstored=_warn
        )
        self._ask = Ask(self._store)
        self.path = Path(path)

    def __enter__(self) -> Database:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; other processes can open it then. Nothing more is answered."""
        self._ask.is_closed = True
        self._store.close()

    @checked
    def add(
        self, *folders: str | Path, mapping: str | Path | None = None, **options: Any
    ) -> TypedImportAnswer:
        """Import campaign folders, all or nothing each; with a ``mapping`` files of instruments, as one campaign.

        ``campaign="week-12"`` names it; ``dry_run=True`` says what was understood and stores nothing.

        Raises CampaignError with every fault of a folder; of several InputError with all that were refused, once the
        others are imported.
        """
        # A list of folders in place of several arguments means the same.
        named: tuple[Any, ...] = folders
        if len(named) == 1 and isinstance(named[0], (list, tuple)):
            named = tuple(named[0])
        if not named:
            raise InputError("name a campaign folder or more")
        answer = self._ask(
            "import",
            folders=named,
            mapping=mapping,
            **options,
        )
        if answer.refused:
            whys = "\n".join(refused.why for refused in answer.refused)
            imported = ", ".join(folder.campaign for folder in answer.imported) or "none"
            raise InputError(f"{whys}\nImported or unchanged: {imported}")
        return answered(answer)

    @checked
    def machines(self) -> pd.DataFrame:
        """Return the machines, a row each: topology, manufacturer, number of campaigns, moment of the latest run."""
        return table_of(self._ask("machines"))

    @checked
    def campaigns(self) -> pd.DataFrame:
        """Return the campaigns, a row each, in the order of import: machine, method, number of runs."""
        return main_table(self._ask("campaigns"))

    @checked
    def campaign(self, name: str) -> Campaign:
        """Return one campaign. Raises NotFoundError with the nearest name, or those that there are."""
        name = argument("name", name, str)
        rows = {row.campaign: row for row in self._ask("campaigns").campaigns}
        if name not in rows:
            raise NotFoundError(_no_campaign(name, list(rows)))
        return Campaign(self._ask, name, rows[name].machine, rows[name].method)

    @checked
    def models(self) -> TypedModelsAnswer:
        """List the models and their versions."""
        return answered(self._ask("models"))

    @checked
    def trend(self, machine: str, **options: Any) -> TypedTrendAnswer:
        """Follow the parameters of a machine: drift, changes, alarms, forecast (``TrendRequest``).

        ``parameters`` has a record a parameter, values in its ``unit`` (µm, µrad, µm/m), slopes in that unit a year.
        What each number means, with its source: docs/statistics.md. Raises NotFoundError for an unknown machine.
        """
        return drawn(self._ask, "trend", machine=machine, **options)

    @checked
    def fleet(self, **options: Any) -> TypedFleetAnswer:
        """List every machine and parameter, a row each, the most urgent first; values in the ``unit`` of the row
        (``FleetRequest``)."""
        return answered(self._ask("fleet", **options))

    @checked
    def report(self, week: str | None = None, *, out: str | Path = ".", **options: Any) -> TypedReportAnswer:
        """Write the weekly health report as HTML and PDF into ``out`` (``ReportRequest``).

        ``week`` is an ISO 8601 week such as ``"2026-W10"``, without it the last one that has ended. Raises InputError
        for a week to come, NotFoundError for a machine or campaign that does not exist.
        """
        return answered(self._ask("report", week=week, out=out, **options))

    @checked
    def sql(self, query: str, limit: int | None = None) -> pd.DataFrame:
        """Return the rows of a query that only reads, ``limit`` at most; ``attrs["units"]`` has the unit of each column
        whose name ends in one. Raises InputError for any other query."""
        return table_of(self._ask("sql", query=query, limit=limit))

    @checked
    def ask(self, question: str, /, **options: Any) -> AnyAnswer:
        """Ask any question of the contract by its name, such as ``ask("plan", campaign="five-days")``.

        Raises InputError for a question that there is not.
        """
        from monitor.workflow.contract import QUESTIONS

        question = argument("question", question, str)
        if question not in QUESTIONS:
            hint = did_you_mean(question, QUESTIONS)
            raise InputError(f"there is no question '{question}'; {hint}there are {', '.join(QUESTIONS)}")
        return answered(self._ask(question, **options))

    def __repr__(self) -> str:
        return f"Database('{self.path}')"

    def _repr_html_(self) -> str:
        """Return the campaigns, as a notebook shows them."""
        return f"<p>{self.path}</p>{self.campaigns()._repr_html_()}"  # type: ignore[operator]


def _warn(why: str) -> None:
    warnings.warn(why, stacklevel=2)


def _no_campaign(name: str, names: Sequence[str]) -> str:
    listed = ", ".join(names) if names else "none yet: add(FOLDER) imports one"
    return f"there is no campaign '{name}'; {did_you_mean(name, names)}there are {listed}"


@checked
def open(path: str | Path, *, new: bool = False, read_only: bool = False, wait_s: float = 300.0) -> Database:
    """Open a database file; ``new`` makes one where there is none; another process that has it is waited for.

    ``read_only``: what is stored can be read, and questions that store their answer are refused.

    Raises NotFoundError for a file that is not there, StoreError for one that is no database or is in use for longer
    than ``wait_s``.
    """
    file = argument("path", path, Path)
    if not argument("new", new, bool) and not file.exists():
        raise NotFoundError(f"there is no database {file}; open('{file}', new=True) makes one")
    return Database(
        file, read_only=argument("read_only", read_only, bool), wait_s=argument("wait_s", wait_s, float)
    )


@overload
def simulate(
    out: str | Path, topology: None = None, *, like: str | Path, **options: Any
) -> TypedLikeAnswer: ...
@overload
def simulate(
    out: str | Path,
    topology: str,
    *,
    errors: Mapping[str, float | Sequence[float]] | None = None,
    like: None = None,
    **options: Any,
) -> TypedSimulateMachineAnswer: ...
@overload
def simulate(
    out: str | Path, topology: None = None, *, like: None = None, **options: Any
) -> TypedSimulateAnswer: ...
@checked
def simulate(
    out: str | Path,
    topology: str | None = None,
    *,
    errors: Mapping[str, float | Sequence[float]] | None = None,
    like: str | Path | None = None,
    **options: Any,
) -> TypedSimulateAnswer | TypedSimulateMachineAnswer | TypedLikeAnswer:
    """Write a virtual campaign folder: of a machine of a ``topology`` with chosen ``errors``, or of one of ours.

    With a ``topology``, such as ``"w C B X b Z Y (C1) t"``: ``errors`` in µm, µrad and µm/m by effect, such as
    ``{"EC0B": 20, "EXX:poly1": 15}``, and ``method`` (its own plan), ``days``, ``noise_um`` and ``seed``. Without:
    ``effect`` is hidden in the virtual machine of the project, with ``peak_um``; ``noise_um``, ``seed``, ``robot``.
    ``like`` a campaign folder of yours: a campaign a month, of ``machines`` (names), from ``start`` ("2026-01-12") on
    for ``months``, with ``drifts`` such as ``[("EY0A", 0.3)]`` (a month, in the unit shown; a third entry names one
    machine), ``events`` such as ``[("2026-05-01", "EB0C", 9.0, "M3")]``, ``effect``, ``peak_um``, ``steady``, ``seed``.
    Raises InputError for another option or a value that cannot be, TopologyError, EffectError, and DataError for a
    machine on which the plan cannot be measured.
    """
    from monitor.workflow import simulation

    if like is not None:
        if topology is not None or errors is not None:
            raise InputError(
                "like has the topology and the errors of its campaign; leave out topology and errors"
            )
        return _simulated_like(out, like, options)
    if topology is None:
        if errors is not None:
            raise InputError("errors needs topology, the machine that has them; without it there is effect")
        with options_as_arguments(simulation.SimulateRequest):
            wanted = {**options, "out": out}
            return answered(simulation.simulate(request_of(simulation.SimulateRequest, wanted)))
    wanted = {**options, "out": out, "topology": topology, "errors": {} if errors is None else errors}
    with options_as_arguments(simulation.SimulateMachineRequest):
        return answered(simulation.simulate_machine(request_of(simulation.SimulateMachineRequest, wanted)))


def _simulated_like(out: str | Path, like: str | Path, options: dict[str, Any]) -> TypedLikeAnswer:
    """Write campaigns like that of a folder."""
    from monitor.workflow import likeness

    for name, example in (("machines", '("M1", "M2")'), ("start", '"2026-01-12"')):
        if name not in options:
            raise InputError(f"like needs {name}, such as {name}={example}")
    values = {**options, "out": out, "like": str(argument("like", like, Path))}
    with options_as_arguments(likeness.LikeRequest):
        return answered(likeness.simulate_like(request_of(likeness.LikeRequest, values)))
