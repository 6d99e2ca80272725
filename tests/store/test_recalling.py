"""What is read again without reading: the same as reading anew, until anybody writes."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from monitor.store import Database, Recalled, machine_history
from monitor.store.recalling import MOST
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_a_history_is_read_once_until_somebody_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        import_folders(db, ImportRequest([EXAMPLES / "five-days"]))
        identify(db, IdentifyRequest("five-days"))
        anew = machine_history(db, "HU40-T"), machine_history(db, "HU40-T", parameter="EB0C")
        db.recalled = Recalled()
        machine_history(db, "HU40-T")
        session = db.session("ada")
        with monkeypatch.context() as patched:
            patched.setattr(
                "monitor.store.past.history.values_of", lambda *_: pytest.fail("it was read again")
            )
            again = machine_history(session, "HU40-T"), machine_history(session, "HU40-T", parameter="EB0C")
        for before, after in zip(anew, again, strict=True):
            assert before.parameters == after.parameters
            assert before.units == after.units
            assert np.array_equal(before.values, after.values, equal_nan=True)
            assert np.array_equal(before.u, after.u, equal_nan=True)
            assert before.started_at == after.started_at
        assert machine_history(db, "HU40-T", parameter="nothing").parameters == ()
        # Nobody changes what others are given.
        again[0].values[:] = 0.0
        assert np.array_equal(machine_history(db, "HU40-T").values, anew[0].values, equal_nan=True)
        import_folders(session, ImportRequest([EXAMPLES / "hidden-spindle-growth"]))
        assert machine_history(db, "HU40-T").unidentified == ("hidden-spindle-growth",)
        session.close()


def test_what_was_read_while_somebody_wrote_is_not_held() -> None:
    recalled, begun, written = Recalled(), threading.Event(), threading.Event()

    def slowly() -> str:
        begun.set()
        assert written.wait(60.0)
        return "old"

    answers: list[str] = []
    reader = threading.Thread(target=lambda: answers.append(recalled.answer("key", slowly)))
    reader.start()
    assert begun.wait(60.0)
    recalled.forget()
    assert recalled.answer("key", lambda: "new") == "new"
    written.set()
    reader.join(60.0)
    assert answers == ["old"]
    assert recalled.answer("key", lambda: "newer") == "new"


def test_the_oldest_is_forgotten_first() -> None:
    recalled = Recalled()
    for number in range(MOST + 8):
        assert recalled.answer(number, lambda number=number: number) == number
    assert recalled.answer(MOST + 7, lambda: -1) == MOST + 7
    assert recalled.answer(0, lambda: -1) == -1
