"""The row of an identification's values: written beside parameter_value, and made anew from it by migration and SQL."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import duckdb
import numpy as np
import pytest

from monitor.records import Campaign
from monitor.store import (
    Database,
    StoredIdentification,
    import_campaign,
    migrations,
    save_identification,
    verify_audit,
)
from monitor.store.migrations import available
from monitor.store.past.gathering import gather
from monitor.store.past.identified_values import gather_values, values_of


@pytest.fixture
def filled(
    db: Database,
    make_campaign: Callable[..., Campaign],
    make_identification: Callable[..., StoredIdentification],
) -> Database:
    one = make_campaign("one")
    import_campaign(db, one)
    save_identification(db, make_identification(one))
    return db


def test_the_row_holds_what_parameter_value_holds(filled: Database) -> None:
    found = values_of(filled, [1])[1]
    ((names,),) = filled.rows("SELECT parameters FROM identification WHERE identification_id = 1")
    rows = filled.rows("SELECT run, parameter, value, u FROM parameter_value WHERE identification_id = 1")
    assert found.value.shape == found.u.shape == (len(found.runs), len(names))
    assert len(rows) == found.value.size
    runs = found.runs.tolist()
    for run, name, value, u in rows:
        place = runs.index(run), names.index(name)
        expected = [np.nan if x is None else x for x in (value, u)]
        assert np.array_equal([found.value[place], found.u[place]], expected, equal_nan=True)


def test_made_anew_from_the_rows_it_is_the_same(filled: Database) -> None:
    filled.execute("DELETE FROM identified_values")
    gather_values(filled, portion=1)
    assert verify_audit(filled).ok


def test_the_migrations_make_it_from_the_rows(filled: Database) -> None:
    filled.execute("DROP TABLE identified_values")
    history, by_parameter = (one.sql for one in available() if one.number in (7, 9))
    filled.execute(history[history.index("CREATE TABLE identified_values") :])
    filled.execute(by_parameter)
    assert verify_audit(filled).ok


@pytest.mark.parametrize("portion", [1, 2, 20_000])
def test_a_database_of_before_is_filled_by_portions(monkeypatch: pytest.MonkeyPatch, portion: int) -> None:
    monkeypatch.setattr(migrations.gathering, "gather", partial(gather, portion=portion))
    with duckdb.connect() as connection:
        migrations.migrate(connection, available()[:6])
        connection.execute(
            "INSERT INTO identification SELECT i, i, 'samba', 1, 'samba', ['Z', 'A'], ['µm', 'µm'], [1e-3, 1e-3], 2, "
            "'0', TIMESTAMP '2026-01-01' FROM range(1, 6) AS r(i) WHERE i <> 3"
        )
        # Runs and parameters in another order than theirs; the second parameter of run 7 was refused.
        connection.execute(
            "INSERT INTO parameter_value SELECT i, run, parameter, CASE WHEN run < 7 OR parameter = 'Z' "
            "THEN i + run / 100 + ascii(parameter) END, i / 10, 'µm', 1e-3 "
            "FROM range(1, 6) AS r(i), (VALUES (7), (2)) AS s(run), (VALUES ('A'), ('Z')) AS p(parameter) WHERE i <> 3"
        )
        migrations.migrate(connection, available())
        rows = connection.execute("SELECT * FROM identified_values ORDER BY identification_id").fetchall()
    z, a = ord("Z"), ord("A")
    assert rows == [
        (i, [2, 7], [[i + 0.02 + z, i + 0.07 + z], [i + 0.02 + a, None]], [[i / 10] * 2] * 2)
        for i in (1, 2, 4, 5)
    ]
