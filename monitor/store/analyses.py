"""Results that are kept as one JSON document: uncertainties, comparisons, explanations, statistics, trends.

Nothing is replaced: the latest of its kind is what ``load_analysis`` gives.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby
from operator import itemgetter
from typing import Any, TypedDict, Unpack

from monitor import __version__
from monitor.exceptions import DataError, InputError, NotFoundError, StoreError
from monitor.store import audit
from monitor.store.catalogue import campaign_number, check_machine
from monitor.store.connection import Database, utc_now

#: Results that are read together: one at a time, each costs a millisecond and a half of asking.
_AT_ONCE = 64


@dataclass(frozen=True)
class StoredAnalysis:
    """A result as it was stored; ``seed`` is None where no random numbers were drawn."""

    number: int
    kind: str
    machine: str | None
    campaign: str | None
    run: int | None
    model: str | None
    model_version: int | None
    method: str
    seed: int | None
    document: Mapping[str, Any]
    software_version: str
    computed_at: datetime


class Subject(TypedDict, total=False):
    """What a result is of; None or left out where it is of no campaign, machine, run or model."""

    campaign: str | None
    machine: str | None
    run: int | None
    model: str | None
    model_version: int | None


class Which(Subject, total=False):
    """What narrows the choice of results; what is left out or None does not."""

    method: str | None


@dataclass(frozen=True)
class LatestText:
    """The latest result of a kind, method and subject as it is stored: ``number`` is its own, ``text`` its document."""

    number: int
    text: str
    software_version: str
    seed: str | None


def save_analysis(
    db: Database,
    kind: str,
    document: Mapping[str, Any],
    *,
    method: str,
    seed: int | None = None,
    action: str = "save",
    repeated: bool = True,
    latest: LatestText | None = None,
    **subject: Unpack[Subject],
) -> int:
    """Store a result; its number, below zero where the database keeps none (a lake, a file that may not be written).

    ``kind`` is a word: uncertainty, comparison, explanation, statistics, trend. ``action`` stands in the audit.
    Not ``repeated``: a result that is the latest of its kind and subject already, to the last letter, is not stored
    again, and a question that is asked twice writes nothing (0.06 s of processor time, and no turn to write). A
    ``latest`` that was read by ``latest_text`` before the result was computed is not read again: a file that was let
    go of meanwhile is not opened for it (0.02 s).

    Raises DataError for a document that is not JSON (NaN and infinities included), NotFoundError for a
    campaign or machine that is not there.
    """
    if not kind.strip():
        raise InputError("a result needs a kind, for example 'uncertainty'")
    try:
        text = json.dumps(document, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as fault:
        raise DataError(f"the {kind} result cannot be kept as JSON: {fault}") from fault
    if not repeated and not db.is_lake:
        stored = latest or latest_text(db, kind, method=method, **subject)
        if stored is not None and (stored.text, stored.software_version, stored.seed) == (
            text, __version__, None if seed is None else str(seed)
        ):  # fmt: skip
            return stored.number
    if not db.keeps_answers:
        return db.remember(text)
    campaign, machine = subject.get("campaign"), subject.get("machine")
    with db.transaction():
        campaign_id = None if campaign is None else campaign_number(db, campaign)
        if machine is not None:
            check_machine(db, machine)
        number = db.next_number("analysis", "analysis_id")
        db.execute(
            "INSERT INTO analysis VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                number,
                kind,
                machine,
                campaign_id,
                subject.get("run"),
                subject.get("model"),
                subject.get("model_version"),
                method,
                None if seed is None else str(seed),
                text,
                __version__,
                utc_now(),
            ],
        )
        audit.record(db, action, "analysis", str(number), analysis_content(db, number))
    return number


def latest_text(db: Database, kind: str, *, method: str, **subject: Unpack[Subject]) -> LatestText | None:
    """The latest result of a kind, a method and exactly this subject; None where there is none."""
    rows = db.rows(
        """
        SELECT a.analysis_id, a.document, a.software_version, a.seed
        FROM analysis AS a LEFT JOIN campaign AS c USING (campaign_id)
        WHERE a.kind = $kind AND a.method = $method AND c.campaign IS NOT DISTINCT FROM $campaign
          AND a.machine IS NOT DISTINCT FROM $machine AND a.run IS NOT DISTINCT FROM $run
          AND a.model IS NOT DISTINCT FROM $model AND a.model_version IS NOT DISTINCT FROM $version
        ORDER BY a.analysis_id DESC LIMIT 1
        """,
        {
            "kind": kind,
            "method": method,
            "campaign": subject.get("campaign"),
            "machine": subject.get("machine"),
            "run": subject.get("run"),
            "model": subject.get("model"),
            "version": subject.get("model_version"),
        },
    )
    return LatestText(*rows[0]) if rows else None


def latest_documents(db: Database, kind: str, campaigns: Mapping[int, str]) -> dict[str, Mapping[str, Any]]:
    """The document of the latest result of a kind of each of the ``campaigns`` (number to name) that has one."""
    numbers = list(campaigns)
    if not numbers:
        return {}
    marks = ", ".join("?" * len(numbers))
    rows = db.rows(
        "SELECT campaign_id, arg_max(document, analysis_id) FROM analysis "
        f"WHERE kind = ? AND campaign_id IN ({marks}) GROUP BY campaign_id",
        [kind, *numbers],
    )
    return dict(sorted((campaigns[number], json.loads(document)) for number, document in rows))


def load_analysis(db: Database, kind: str, **which: Unpack[Which]) -> StoredAnalysis:
    """The latest result of a kind; what is named narrows the choice. Raises NotFoundError."""
    latest = stored_analyses(db, kind, most=1, **which)
    if not latest:
        run = which.get("run")
        named = [
            which.get("campaign"), which.get("machine"), None if run is None else f"run {run}", which.get("model"),
            which.get("method"),
        ]  # fmt: skip
        about = ", ".join(name for name in named if name is not None)
        raise NotFoundError(f"there is no stored {kind} result{' of ' + about if about else ''} yet")
    return latest[0]


def stored_analyses(
    db: Database, kind: str, *, most: int = 20, **which: Unpack[Which]
) -> tuple[StoredAnalysis, ...]:
    """The latest results of a kind, the latest first, at ``most`` so many; what is named narrows the choice."""
    rows = db.rows(
        """
        SELECT a.analysis_id, a.kind, a.machine, c.campaign, a.run, a.model, a.model_version, a.method, a.seed,
               a.document, a.software_version, a.computed_at
        FROM analysis AS a LEFT JOIN campaign AS c USING (campaign_id)
        WHERE a.kind = $kind AND (a.campaign_id IS NULL OR c.campaign IS NOT NULL)
          AND ($campaign IS NULL OR c.campaign = $campaign)
          AND ($machine IS NULL OR coalesce(a.machine, c.machine) = $machine)
          AND ($run IS NULL OR a.run = $run) AND ($model IS NULL OR a.model = $model)
          AND ($version IS NULL OR a.model_version = $version) AND ($method IS NULL OR a.method = $method)
        ORDER BY a.analysis_id DESC LIMIT $most
        """,
        {
            "kind": kind,
            "campaign": which.get("campaign"),
            "machine": which.get("machine"),
            "run": which.get("run"),
            "model": which.get("model"),
            "version": which.get("model_version"),
            "method": which.get("method"),
            "most": most,
        },
    )
    return tuple(_stored(row) for row in rows)


@dataclass(frozen=True)
class MappedRun:
    """A run of which a map is stored: when it began (UTC), its ``worst_um`` volumetric error, that one's standard
    uncertainty and its degrees of freedom (None: not stored, and infinitely many)."""

    started_at: datetime
    worst_um: float
    u_um: float | None = None
    degrees_of_freedom: float | None = None


def latest_maps(db: Database, machine: str | None = None) -> dict[str, float]:
    """By machine, the worst volumetric error in µm of the map of its latest mapped run, partial maps among them; of one
    ``machine`` alone where it is named."""
    return {name: runs[-1].worst_um for name, runs in mapped_runs(db, machine).items()}


def mapped_runs(db: Database, machine: str | None = None) -> dict[str, list[MappedRun]]:
    """By machine, its runs of which a map is stored, partial maps among them, in the order of measuring.

    Of several maps of a run the one stored last counts. Of one ``machine`` alone where it is named."""
    rows = db.rows(
        """
        SELECT c.machine, r.started_at, CAST((a.document ->> '$.worst.error_um') AS DOUBLE),
               CAST((a.document ->> '$.worst.u_um') AS DOUBLE), CAST((a.document ->> '$.degrees_of_freedom') AS DOUBLE)
        FROM analysis AS a JOIN campaign AS c USING (campaign_id) JOIN run AS r USING (campaign_id, run)
        WHERE a.kind IN ('volumetric map', 'partial volumetric map') AND c.campaign IS NOT NULL
              AND ($machine IS NULL OR c.machine = $machine)
        QUALIFY row_number() OVER (PARTITION BY campaign_id, run ORDER BY a.analysis_id DESC) = 1
        ORDER BY r.started_at, a.analysis_id
        """,
        {"machine": machine},
    )
    mapped: dict[str, list[MappedRun]] = {}
    for name, started_at, worst, u, freedom in rows:
        run = MappedRun(started_at.replace(tzinfo=UTC), float(worst), u, freedom)
        mapped.setdefault(name, []).append(run)
    return mapped


def _stored(row: tuple[Any, ...]) -> StoredAnalysis:
    number, kind, machine, campaign, run, model, version, method, seed, document, software, computed_at = row
    return StoredAnalysis(
        number=number,
        kind=kind,
        machine=machine,
        campaign=campaign,
        run=run,
        model=model,
        model_version=version,
        method=method,
        seed=None if seed is None else int(seed),
        document=json.loads(document),
        software_version=software,
        computed_at=computed_at,
    )


def analysis_content(db: Database, number: int) -> str:
    """The hash of all that is stored of a result."""
    return audit.digest(*db.rows("SELECT * FROM analysis WHERE analysis_id = ?", [number]))


def analysis_contents(db: Database) -> Iterator[tuple[int, str]]:
    """Yield the number of each stored result and the hash of all that is stored of it, in the order of the numbers."""
    numbers = [number for (number,) in db.rows("SELECT DISTINCT analysis_id FROM analysis ORDER BY ALL")]
    for start in range(0, len(numbers), _AT_ONCE):
        some = numbers[start : start + _AT_ONCE]
        rows = db.rows(
            "SELECT * FROM analysis WHERE analysis_id BETWEEN ? AND ? ORDER BY analysis_id",
            [some[0], some[-1]],
        )
        for number, same in groupby(rows, key=itemgetter(0)):
            yield int(number), audit.digest(*same)


def check_analysis(db: Database, number: int) -> None:
    """Raise StoreError where a stored result is not what the audit says was stored."""
    entries = db.rows(
        "SELECT content_sha256 FROM audit WHERE subject = 'analysis' AND key = ? ORDER BY entry",
        [str(number)],
    )
    if not entries or entries[-1][0] != analysis_content(db, number):
        raise StoreError(
            f"the stored result {number} was altered after it was stored; `monitor verify` tells what else was"
        )


def analysis_text(db: Database, number: int) -> str:
    """The document of a stored result as it was written: the text that JSON is."""
    if number < 0:
        return db.remembered(number)
    ((text,),) = db.rows("SELECT document FROM v_analyses WHERE analysis_id = ?", [number])
    return str(text)
