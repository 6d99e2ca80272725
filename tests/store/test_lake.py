"""A lake answers as one file with the same campaigns; publication adds nothing twice, whatever broke before."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

pytest.importorskip("duckdb_extension_ducklake", reason="the extra [lake] is not installed")
import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import (
    Database,
    SharedDatabase,
    StoredIdentification,
    import_campaign,
    last_entries,
    record_event,
    save_analysis,
    save_identification,
    save_model,
    withdraw_campaign,
)
from monitor.store.entries import OTHERWISE, SOURCES
from monitor.store.lake import publication
from monitor.store.lake.publication import Published, publish
from monitor.store.lake.reading import LakeDatabase
from monitor.store.lake.schema import OWN_BITS
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.keeping import VerifyRequest, verify
from monitor.workflow.publishing import PublishRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

Make = Callable[..., Campaign]
Identify = Callable[..., StoredIdentification]


def fill(db: Database, campaign: Campaign, identified: StoredIdentification) -> None:
    """What a plant stores of a campaign: import, model, identification, an answer."""
    import_campaign(db, campaign)
    save_model(db, "samba", ())
    save_identification(db, identified)
    save_analysis(db, "statistics", {"mean": 0.1}, method="by day", campaign=campaign.name)


def campaigns(make: Make, plant: str) -> list[Campaign]:
    """Three campaigns of two machines of a plant."""
    return [
        make(f"{plant} {number}", f"MILL-{plant}-{number % 2}", files=(("campaign.toml", f"{plant}{number}".encode()),))
        for number in range(3)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lake")


@pytest.fixture
def plants(tmp_path: Path, make_campaign: Make, make_identification: Identify) -> dict[str, Path]:
    """Two plants and one file with the campaigns of both."""
    with Database(tmp_path / "one.duckdb") as one:
        for plant in ("Ulm", "Aalen"):
            with Database(tmp_path / f"{plant}.duckdb") as db:
                for number, campaign in enumerate(campaigns(make_campaign, plant)):
                    identified = make_identification(campaign, shift=1e-3 / 3 * number)
                    fill(db, campaign, identified)
                    fill(one, campaign, identified)
                    if number == 1:
                        for of in (db, one):
                            withdraw_campaign(of, campaign.name, "wrong balls")
                            import_campaign(of, campaign)
                            save_identification(of, identified)
    return {name: tmp_path / f"{name}.duckdb" for name in ("Ulm", "Aalen", "one")}


@pytest.fixture
def lake(tmp_path: Path) -> str:
    return f"ducklake:{tmp_path}/shops.ducklake"


def published(path: Path, lake: str, **options: str) -> Published:
    with SharedDatabase(path) as db:
        return publish(db, lake, files=path.parent / "files", **options)


def contents(db: Database, table: str) -> list[tuple[object, ...]]:
    """The rows of a table with numbers counted from 1 in their order, as text to the last bit."""
    columns = [name for (name,) in db.rows(f"SELECT column_name FROM (DESCRIBE {table})")]
    times = ("imported_at", "withdrawn_at", "computed_at", "created_at", "registered_at", "made_at")
    numbers = ("_id", "entry", "registration")
    shown = ", ".join(
        f"dense_rank() OVER (ORDER BY {name})" if name.endswith(numbers) else f"CAST({name} AS VARCHAR)"
        for name in columns
        if name not in times
    )  # fmt: skip
    return sorted(db.rows(f"SELECT {shown} FROM {table}"), key=str)


def test_every_table_of_a_plant_is_published_or_said_not_to_be() -> None:
    with Database(":memory:") as db:
        tables = {name for (name,) in db.rows("SELECT table_name FROM duckdb_tables()")}
    assert tables == set(SOURCES) | set(OTHERWISE)
    assert not tables & {"plant", "plant_name", "publication", "registering"}  # those of a lake alone


def test_while_the_lake_is_away_the_plant_can_write_and_who_waits_is_told(
    tmp_path: Path, make_campaign: Make, make_identification: Identify, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, campaign = tmp_path / "Ulm.duckdb", make_campaign("week 1")
    with Database(path) as db:
        fill(db, campaign, make_identification(campaign))
    asked = publication._Publisher._last_published
    faults = ["Connection refused by the store", "Connection refused by the store again"]
    words = ["--at", "2026-03-05 07:00", "--quiet", "--wait", "0"]

    def away(self: publication._Publisher, plant_no: int) -> tuple[int, str] | None:
        if faults:
            raise duckdb.IOException(faults.pop(0))
        return asked(self, plant_no)

    def write(pause: float) -> None:
        event = ["event", campaign.machine.id, f"moved {len(wrote)} times", *words]
        command = [sys.executable, "-m", "monitor", *event, "--db", str(path)]
        wrote.append(subprocess.run(command, capture_output=True, text=True))

    wrote: list[subprocess.CompletedProcess[str]] = []
    told: list[str] = []
    monkeypatch.setattr(publication._Publisher, "_last_published", away)
    monkeypatch.setattr(publication.time, "sleep", write)
    monkeypatch.setattr(publication, "_SAID_S", 0.0)
    with Database(path) as db:
        done = publish(db, f"ducklake:{tmp_path}/lake.ducklake", files=tmp_path / "files", away=told.append)
    assert [(process.returncode, process.stderr) for process in wrote] == [(0, ""), (0, "")]
    # Once, and what was written meanwhile is published with the rest.
    assert told == ["Connection refused by the store"]
    with Database(path, read_only=True) as db:
        assert done.last_entry == last_entries(db, 1)[0].entry == done.entries


@pytest.mark.slow
def test_a_lake_answers_as_one_file_with_the_same_campaigns(plants: dict[str, Path], lake: str) -> None:
    for plant in ("Ulm", "Aalen"):
        done = published(plants[plant], lake, plant=plant)
        assert (done.plant, done.entries) == (plant, done.last_entry)
        # Nothing twice.
        again = published(plants[plant], lake)
        assert (again.entries, again.rows, again.last_entry) == (0, 0, done.last_entry)
    with Database(plants["one"], read_only=True) as one, LakeDatabase(lake) as many:
        for table in sorted({*SOURCES, *OTHERWISE} - {"audit", "schema_migration"}):
            assert contents(many, table) == contents(one, table), table
        for view in (
            "v_parameters",
            "v_campaigns",
            "v_runs",
            "v_probings",
            "v_residuals",
            "v_withdrawn_campaigns",
        ):
            ours, theirs = ([row[:9] for row in contents(db, view)] for db in (many, one))
            assert ours == theirs != []
        assert many.rows("SELECT count(*) FROM audit") == [
            (sum(len(last_entries(Database(plants[plant], read_only=True), 1000)) for plant in ("Ulm", "Aalen")),)
        ]  # fmt: skip
        assert trend(many, TrendRequest("MILL-Ulm-0")) == trend(one, TrendRequest("MILL-Ulm-0"))
        ours, theirs = (fleet(db, FleetRequest(None, 0, False)) for db in (many, one))
        assert (ours.machines, ours.values, ours.rows) == (theirs.machines, theirs.values, theirs.rows)
        # Sums of doubles in another order: all but the last digits.
        for our, their in zip(ours.table, theirs.table, strict=True):
            assert (our.machine, our.parameter, our.attention) == (
                their.machine,
                their.parameter,
                their.attention,
            )
            assert our.mean == pytest.approx(their.mean, rel=1e-12)
        # Numbers say which plant they are of.
        assert many.rows(
            f"SELECT DISTINCT plant FROM campaign JOIN plant ON plant_no = campaign_id >> {OWN_BITS} "
            "WHERE machine LIKE 'MILL-Aalen%'"
        ) == [("Aalen",)]
        with pytest.raises(
            StoreError, match="is a lake, which plants publish to and everybody reads: store it in"
        ):
            save_model(many, "mine", ("EXX:reversal",), parent=("samba", 1))
        with pytest.raises(InputError, match="is a lake of many plants, which is not verified"):
            verify(many, VerifyRequest())


@pytest.mark.slow
def test_the_machines_of_two_plants_may_bear_one_name(
    tmp_path: Path, lake: str, make_campaign: Make, make_identification: Identify
) -> None:
    for plant, topology in (("Ulm", "w C B X b Z Y (C1) t"), ("Aalen", "w B C X b Z Y (C1) t")):
        with Database(tmp_path / f"{plant}.duckdb") as db:
            campaign = make_campaign("weekly", "MILL-1", topology)
            fill(db, campaign, make_identification(campaign))
            record_event(db, "MILL-1", campaign.runs[0].started_at, "crash", plant)
        published(tmp_path / f"{plant}.duckdb", lake, plant=plant)
    with LakeDatabase(lake) as many:
        assert many.rows("SELECT campaign, machine FROM v_campaigns ORDER BY ALL") == [
            ("weekly", "MILL-1"),
            ("weekly@Aalen", "MILL-1@Aalen"),
        ]
        assert many.rows("SELECT machine, topology FROM machine ORDER BY ALL") == [
            ("MILL-1", "w C B X b Z Y (C1) t"),
            ("MILL-1@Aalen", "w B C X b Z Y (C1) t"),
        ]
        assert many.rows("SELECT machine, description FROM v_events ORDER BY ALL") == [
            ("MILL-1", "Ulm"),
            ("MILL-1@Aalen", "Aalen"),
        ]
        assert many.rows(
            "SELECT DISTINCT machine_description ->> 'id' FROM imported_campaign ORDER BY ALL"
        ) == [
            ("MILL-1",),
            ("MILL-1@Aalen",),
        ]
        assert trend(many, TrendRequest("MILL-1@Aalen")).machine == "MILL-1@Aalen"
        # A method's own model is the same everywhere.
        assert many.rows("SELECT count(*) FROM model") == [(1,)]


class Broken(Exception):
    """The network goes away."""


@pytest.mark.slow
def test_a_publication_that_broke_is_resumed_and_nothing_is_there_twice(
    plants: dict[str, Path], lake: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(publication, "PORTION", 4)
    original = publication.statements
    for breaks_at in (1, 3, 9):
        calls = 0

        def breaking(*arguments: object, at: int = breaks_at) -> Iterator[str]:
            nonlocal calls
            for statement in original(*arguments):  # type: ignore[arg-type]
                calls += 1
                if calls == at:
                    raise Broken("the network went away")
                yield statement

        monkeypatch.setattr(publication, "statements", breaking)
        with pytest.raises(Broken, match="the network went away"):
            published(plants["Ulm"], lake, plant="Ulm")
    monkeypatch.setattr(publication, "statements", original)
    # A transaction that ends in a conflict is begun anew.
    conflicts = iter([duckdb.TransactionException("Failed to commit: Transaction conflict")] * 2)

    def conflicting(*arguments: object) -> Iterator[str]:
        for fault in conflicts:
            raise fault
        return original(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(publication, "statements", conflicting)
    monkeypatch.setattr(publication, "_FIRST_PAUSE_S", 0.001)
    done = published(plants["Ulm"], lake, plant="Ulm")
    assert done.entries == done.last_entry
    with Database(plants["Ulm"], read_only=True) as one, LakeDatabase(lake) as many:
        for table in sorted({*SOURCES, *OTHERWISE} - {"schema_migration", "audit"}):
            assert contents(many, table) == contents(one, table), table
        spans = many.rows("SELECT first_entry, last_entry FROM publication ORDER BY ALL")
        assert spans[0][0] == 1
        assert all(end + 1 == begin for (_, end), (begin, _) in pairwise(spans))


@pytest.mark.slow
def test_a_file_with_another_past_than_it_published_is_refused(
    plants: dict[str, Path], lake: str, tmp_path: Path, make_campaign: Make
) -> None:
    earlier = tmp_path / "earlier.duckdb"
    shutil.copyfile(plants["Ulm"], earlier)
    with Database(plants["Ulm"]) as db:
        import_campaign(db, make_campaign("later", "MILL-9"))
    published(plants["Ulm"], lake, plant="Ulm")
    with pytest.raises(
        StoreError, match=r"has another past than it published: entry .* put back to an earlier state"
    ):
        published(earlier, lake)
    with Database(earlier) as db:
        import_campaign(db, make_campaign("other", "MILL-8"))
    with pytest.raises(StoreError, match="has another past than it published"):
        published(earlier, lake)
    with pytest.raises(InputError, match="the lake has a plant 'Ulm' already, which is another database"):
        published(plants["Aalen"], lake, plant="Ulm")


def test_addresses_that_cannot_be() -> None:
    for address in ("shops.duckdb", "ducklake:", "postgres:dbname=x"):
        with pytest.raises(
            InputError, match="is no address of a lake; write 'ducklake:postgres:dbname=lake host="
        ):
            PublishRequest(address)
    with pytest.raises(
        InputError, match="the address of a lake holds a password, which the list of processes shows"
    ):
        PublishRequest("ducklake:postgres:dbname=x password=secret")
    with pytest.raises(InputError, match="the address of a lake holds a password"):
        PublishRequest("ducklake:postgres:dbname=x PASSWORD = secret")
    with pytest.raises(InputError, match="--plant 'a@b': a name without @"):
        PublishRequest("ducklake:x", plant="a@b")


def test_no_lake_is_made_inside_a_database_of_something_else(
    tmp_path: Path, make_campaign: Callable[..., Campaign]
) -> None:
    """Else the tables of the lake would stand in the database of a plant, which then verifies no more."""
    path = tmp_path / "plant.duckdb"
    with Database(path) as db:
        import_campaign(db, make_campaign("one"))
    before = path.read_bytes()
    with Database(tmp_path / "other.duckdb") as db:
        import_campaign(db, make_campaign("one"))
        with pytest.raises(InputError, match="is a database of something else"):
            publish(db, f"ducklake:{path}", files=tmp_path / "files")
    assert path.read_bytes() == before


@pytest.mark.slow
def test_a_lake_that_is_not_there(tmp_path: Path, plants: dict[str, Path]) -> None:
    with pytest.raises(
        StoreError, match=r"there is no lake at ducklake:.*; `monitor publish --to .* --files FOLDER`"
    ):
        LakeDatabase(f"ducklake:{tmp_path}/none.ducklake")
    with SharedDatabase(plants["Ulm"]) as db, pytest.raises(StoreError, match="there is no lake at"):
        publish(db, f"ducklake:{tmp_path}/none.ducklake")
    with Database(":memory:") as db, pytest.raises(StoreError, match="is no database file of a plant"):
        publish(db, "ducklake:x")


@pytest.mark.slow
def test_ducklake_1_5_5_keeps_doubles_in_lists_as_text_that_is_not_exact(tmp_path: Path) -> None:
    # Why nothing is inlined. Where this fails, the fault is gone, and small tables may lie in the catalogue.
    value = 1.0 / 3.0 + 2.0**-54
    results = []
    for limit in (10, 0):
        with publication.connection_with_extensions() as connection:
            connection.execute(
                f"ATTACH 'ducklake:{tmp_path}/{limit}' AS lake "
                f"(DATA_PATH '{tmp_path}/d{limit}', DATA_INLINING_ROW_LIMIT {limit})"
            )
            connection.execute("CREATE TABLE lake.x (numbers DOUBLE[])")
            values = [value * 1.1**power for power in range(100)]
            connection.execute("INSERT INTO lake.x VALUES (?)", [values])
            results.append(connection.execute("SELECT numbers FROM lake.x").fetchone() == (values,))
    assert results == [False, True]
