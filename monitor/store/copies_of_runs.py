"""Runs whose readings equal those of runs of other campaigns: as data for certificates, in sentences for people.

Of two such runs one was not measured as it is stated. On one machine the one that came in first is taken for the
measured one; of two machines nobody can tell from the readings which of them was measured, and both are told.

Campaigns of versions before the hashes of runs are hashed here when they are asked for, until the next import does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from monitor.store.connection import Database
from monitor.store.import_notes import stored_fingerprints

#: A folder imported again and again under new names: so many campaigns, and runs of each, are named.
MOST_CAMPAIGNS, MOST_PAIRS = 5, 5
#: So many campaigns without hashes are hashed for one question, those with the most like number of probings first.
MOST_HASHED = 20
_OTHERS = """
SELECT DISTINCT m.run, o.campaign, o.machine, g.run, o.campaign_id < ? AS is_earlier, t.started_at = s.started_at,
       o.campaign_id
FROM (SELECT unnest(?::BIGINT[]) AS run, unnest(?::VARCHAR[]) AS readings_sha256) AS m
JOIN {hashes} AS g USING (readings_sha256)
JOIN campaign AS o ON o.campaign_id = g.campaign_id
JOIN run AS s ON s.campaign_id = g.campaign_id AND s.run = g.run
JOIN run AS t ON t.campaign_id = ? AND t.run = m.run
WHERE g.campaign_id <> ? AND (o.machine <> ? OR o.campaign_id < ?)
ORDER BY o.campaign_id, m.run, g.run
"""
#: Each run beside the first campaign that holds its readings: linear in the runs, however often they came in.
_AMONG = """
WITH held AS (
    SELECT f.campaign_id, f.run, f.readings_sha256, c.campaign, c.machine
    FROM run_fingerprint AS f JOIN campaign AS c USING (campaign_id) WHERE f.readings_sha256 <> '' {of_those}
), first_held AS (
    SELECT readings_sha256, min(campaign_id) AS campaign_id FROM held
    GROUP BY readings_sha256 HAVING count(DISTINCT campaign_id) > 1
)
SELECT h.campaign, h.machine, count(DISTINCT h.run) AS runs, o.campaign AS same_as_campaign,
       o.machine AS same_as_machine
FROM held AS h JOIN first_held AS e ON e.readings_sha256 = h.readings_sha256 AND e.campaign_id < h.campaign_id
JOIN campaign AS o ON o.campaign_id = e.campaign_id {among}
GROUP BY h.campaign_id, h.campaign, h.machine, o.campaign_id, o.campaign, o.machine
ORDER BY h.campaign_id, o.campaign_id
"""


@dataclass(frozen=True)
class CopiedRun:
    """A ``run`` whose readings all equal those of ``other_run`` of another ``campaign``, of ``machine``: of the same
    machine where not ``is_of_another``, in the database earlier where ``is_earlier``, begun ``at_the_same_moment``."""

    run: int
    campaign: str
    machine: str
    other_run: int
    is_of_another: bool
    is_earlier: bool
    at_the_same_moment: bool


@dataclass(frozen=True)
class CopiedCampaign:
    """A ``campaign`` of which so many ``runs`` equal runs of an earlier one in every reading."""

    campaign: str
    machine: str
    runs: int
    same_as_campaign: str
    same_as_machine: str

    def __str__(self) -> str:
        of = "" if self.machine == self.same_as_machine else f" of machine {self.same_as_machine}"
        return (
            f"{self.runs} run{'s' * (self.runs > 1)} of {self.campaign} equal{'s' * (self.runs == 1)} those of "
            f"{self.same_as_campaign}{of} in every reading, which two measurements never do: withdraw the copy "
            "(monitor withdraw)"
        )


def copied_campaigns(db: Database, numbers: Sequence[int] | None = None) -> tuple[CopiedCampaign, ...]:
    """The campaigns that hold runs of earlier ones, each beside the first that holds them, in the order of import: of
    all, or where one of both is among some ``numbers``. Of versions before the hashes only what imports since hashed.
    """
    if numbers is None:
        return db.records(CopiedCampaign, _AMONG.format(of_those="", among=""))
    listed = ", ".join(str(int(number)) for number in numbers)
    if not listed:
        return ()
    among = f"WHERE h.campaign_id IN ({listed}) OR o.campaign_id IN ({listed})"
    of_those = f"AND f.readings_sha256 IN (SELECT readings_sha256 FROM run_fingerprint WHERE campaign_id IN ({listed}))"
    return db.records(CopiedCampaign, _AMONG.format(of_those=of_those, among=among))


def campaign_numbers(db: Database, names: Sequence[str]) -> tuple[int, ...]:
    """The numbers of campaigns by their ``names``; of names that no campaign has none."""
    rows = db.rows(
        "SELECT campaign_id FROM campaign WHERE campaign IN (SELECT unnest(?::VARCHAR[])) ORDER BY campaign_id",
        [list(names)],
    )
    return tuple(int(number) for (number,) in rows)


def noted_campaigns(db: Database, numbers: Sequence[int]) -> dict[str, int]:
    """How many notes the import of campaigns of some ``numbers`` left, by name, of those with any."""
    rows = db.rows(
        "SELECT c.campaign, count(*) FROM import_note AS n JOIN campaign AS c USING (campaign_id) "
        "WHERE n.campaign_id IN (SELECT unnest(?::INTEGER[])) GROUP BY c.campaign_id, c.campaign "
        "ORDER BY c.campaign_id",
        [list(numbers)],
    )
    return {str(name): int(count) for name, count in rows}


def copied_runs(db: Database, campaign: str) -> tuple[CopiedRun, ...]:
    """The runs of a campaign that equal runs of an earlier one, or of any of another machine, by that campaign; none of
    a curve and of a campaign that there is not."""
    rows = db.rows(
        "SELECT campaign_id, machine FROM campaign WHERE campaign = ? AND method <> 'curve'", [campaign]
    )
    if not rows:
        return ()
    ((number, machine),) = rows
    unhashed = _hashes_of_before(db, number)
    prints = unhashed.pop(number, None)
    if prints is None:
        prints = _stored(db, number)
    if not prints:
        return ()
    added = [(each, run, text) for each, of_runs in unhashed.items() for run, text in of_runs]
    columns = [list(column) for column in zip(*added, strict=True)] or [[], [], []]
    hashes = (
        "(SELECT campaign_id, run, readings_sha256 FROM run_fingerprint UNION ALL "
        "SELECT unnest(?::BIGINT[]), unnest(?::BIGINT[]), unnest(?::VARCHAR[]))"
        if added
        else "run_fingerprint"
    )
    runs, texts = ([pair[k] for pair in prints] for k in (0, 1))
    rows_of_others = db.rows(
        _OTHERS.format(hashes=hashes),
        [number, runs, texts, *(columns if added else []), number, number, machine, number],
    )
    return tuple(
        CopiedRun(run, other, its_machine, other_run, its_machine != machine, is_earlier, same_moment)
        for run, other, its_machine, other_run, is_earlier, same_moment, _ in rows_of_others
    )


def _stored(db: Database, campaign_id: int) -> list[tuple[int, str]]:
    return [
        (run, text)
        for run, text in db.rows(
            "SELECT run, readings_sha256 FROM run_fingerprint WHERE campaign_id = ? AND readings_sha256 <> ''",
            [campaign_id],
        )
    ]


def _hashes_of_before(db: Database, campaign_id: int) -> dict[int, list[tuple[int, str]]]:
    """The hashes of runs by campaign of those that the database holds none of: of ``campaign_id`` where it is one, and
    of those most like it in size. Nothing is written."""
    counts = dict(
        db.rows(
            "SELECT campaign_id, count(*) FROM probing WHERE campaign_id IN (SELECT campaign_id FROM campaign "
            "ANTI JOIN run_fingerprint USING (campaign_id) WHERE method <> 'curve') GROUP BY campaign_id"
        )
    )
    if not counts:
        return {}
    size = counts.get(campaign_id)
    if size is None:
        ((size,),) = db.rows("SELECT count(*) FROM probing WHERE campaign_id = ?", [campaign_id])
    nearest = sorted(counts, key=lambda each: (each != campaign_id, abs(counts[each] - size), each))
    return {each: list(stored_fingerprints(db, each).items()) for each in nearest[:MOST_HASHED]}


def campaign_notes(db: Database, campaign: str) -> tuple[str, ...]:
    """Return the notes of a campaign's import, and a sentence on runs that equal others' in every digit."""
    notes = db.rows("SELECT note FROM v_import_notes WHERE campaign = ? ORDER BY position", [campaign])
    return (*(str(note) for (note,) in notes), *copy_notes(db, campaign))


def copy_notes(db: Database, campaign: str) -> tuple[str, ...]:
    """The sentence on the runs of a campaign that equal others' in every digit, however often they came in; none where
    there are none."""
    runs = copied_runs(db, campaign)
    if not runs:
        return ()
    copies = [(key, list(of_other)) for key, of_other in groupby(runs, key=_other)]
    count = len({copied.run for copied in runs})
    head = f"{count} run{'s' * (count > 1)} of {campaign} equal{'s' * (count == 1)}"
    never = "in every reading, which two measurements never do"
    named = [(key, _pairs(of_other)) for key, of_other in copies[:MOST_CAMPAIGNS]]
    if len(copies) == 1:
        ((other, pairs),) = named
        return (
            f"{head} those of campaign {other} {never}: run {pairs}; withdraw the copy (monitor withdraw)",
        )
    more = len(copies) - len(named)
    each = "; ".join(f"{other}, run {pairs}" for other, pairs in named) + f"; and {more} more" * (more > 0)
    return (
        f"{head} those of {len(copies)} campaigns {never}: {each}. Withdraw the copies (monitor withdraw)",
    )


def _other(copied: CopiedRun) -> str:
    """The other campaign with its machine, where that is another."""
    return f"{copied.campaign}{f' of machine {copied.machine}' if copied.is_of_another else ''}"


def _pairs(runs: Sequence[CopiedRun]) -> str:
    shown = ", ".join(f"{copied.run} (there {copied.other_run})" for copied in runs[:MOST_PAIRS])
    return shown + ", ..." * (len(runs) > MOST_PAIRS)
