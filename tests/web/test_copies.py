"""Copies of a file that is served and not written: one that is asked stays; its answers are not taken as new."""

from __future__ import annotations

import os
import threading
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign
from monitor.web.asking import Asker
from monitor.web.desk import Desk
from monitor.web.opening import Copies
from monitor.web.users import Role, User

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _example(name: str) -> Campaign:
    campaign = read_campaign(EXAMPLES / name)
    assert isinstance(campaign, Campaign)
    return campaign


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    path = tmp_path / "shop.duckdb"
    with Database(path) as db:
        import_campaign(db, _example("hot-cold"))
    return path


def _touched(shop: Path) -> None:
    status = os.stat(shop)
    os.utime(shop, ns=(status.st_atime_ns, status.st_mtime_ns + 1_000_000))


def test_a_copy_stays_until_its_last_question_is_answered(shop: Path, tmp_path: Path) -> None:
    """The third copy closed the first one, whoever asked it."""
    with closing(Copies(str(shop), tmp_path)) as copies, ExitStack() as first, ExitStack() as second:
        paths = []
        for asked in (first, second):
            db = asked.enter_context(copies.asked())
            paths.append(Path(db.path))
            session = asked.enter_context(closing(db.session("a")))
        for _ in range(3):
            _touched(shop)
            copies.follow(lambda: None)
            with copies.asked() as db:
                paths.append(Path(db.path))
        assert paths[0] == paths[1]
        # Those in between were asked by nobody when the next one came.
        assert [path.exists() for path in paths] == [True, True, False, False, True]
        first.close()
        assert session.rows("SELECT count(*) FROM campaign") == [(1,)]
        second.close()
        assert [path.exists() for path in paths] == [False, False, False, False, True]
    assert not paths[-1].exists()


def test_nobody_is_answered_from_a_newer_copy_before_older_answers_are_void(
    shop: Path, tmp_path: Path
) -> None:
    """The copy was exchanged outside of any lock: of two that found the file written, the older one could stay."""
    asked: list[str] = []

    def ask() -> None:
        with copies.asked() as db:
            asked.append(db.path)

    def note() -> None:
        asking.start()
        asking.join(0.2)
        asked.append("noted")

    with closing(Copies(str(shop), tmp_path)) as copies:
        asking = threading.Thread(target=ask)
        before = copies.db.path
        _touched(shop)
        copies.follow(note)
        asking.join()
        assert asked == ["noted", copies.db.path]
        assert copies.db.path != before


def test_what_was_remembered_holds_until_somebody_wrote(shop: Path, tmp_path: Path) -> None:
    user = User("a", Role.VIEWER)
    with closing(Copies(str(shop), tmp_path)) as copies:
        asker = Asker(copies.db, copies=copies)
        desk = Desk(asker)
        first = asker(user, "campaigns")
        ticket = desk.ask(user, "fleet", {})
        assert asker(user, "campaigns") is first
        assert desk.ask(user, "fleet", {}) is ticket
        with Database(shop) as db:
            import_campaign(db, _example("cold-cold"))
        # The page of the desk is the first to look.
        assert desk.ask(user, "fleet", {}) is not ticket
        second = asker(user, "campaigns")
        desk.close()
    assert (len(first.campaigns), len(second.campaigns)) == (1, 2)
