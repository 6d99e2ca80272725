"""A server of one database, asked without a network: on loopback, or with users who log in."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")
pytest.importorskip("plotly", reason="the extra web is not installed")

from anyio.from_thread import BlockingPortal, start_blocking_portal
from starlette.testclient import TestClient

from monitor.store import Database
from monitor.web.app import application
from monitor.web.opening import opened
from monitor.web.settings import ServerSettings
from monitor.web.users import add_user
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = ("hidden-spindle-growth", "load-cell")


@dataclass(frozen=True)
class Served:
    """A server with its database; ``tokens`` by role where users log in."""

    client: TestClient
    db: Database
    tokens: dict[str, str]

    def ask(self, question: str, document: object = None, role: str = "") -> tuple[int, dict[str, object]]:
        """Status and answer of a question of the interface."""
        headers = {"Authorization": f"Bearer {self.tokens[role]}"} if role else {}
        answer = self.client.post(
            f"/api/v1/{question.replace(' ', '-')}", json=document or {}, headers=headers
        )
        return answer.status_code, answer.json()

    def sent(self, path: str, **form: Any) -> Any:
        """The page that a form which was sent leads to: every form is answered with its address."""
        answer = self.client.post(path, **form)
        assert answer.status_code == 303, answer.text[-2000:]
        return self.client.get(answer.headers["location"])

    def proof(self, page: str = "/import") -> str:
        """The proof that the forms of the client's session carry."""
        match = re.search(r'name="proof" value="([0-9a-f]{64})"', self.client.get(page).text)
        assert match is not None
        return match[1]


@pytest.fixture(scope="module")
def imported(
    tmp_path_factory: pytest.TempPathFactory, made_once: Callable[[str, Callable[[Path], object]], Path]
) -> Path:
    def fill(folder: Path) -> None:
        with Database(folder / "monitor.duckdb", threads=1) as db:
            import_folders(db, ImportRequest([EXAMPLES / name for name in CAMPAIGNS]))

    path = tmp_path_factory.mktemp("web") / "monitor.duckdb"
    return Path(shutil.copy(made_once("imported-for-pages", fill) / "monitor.duckdb", path))


Serve = Callable[[Path, bool], Served]


@pytest.fixture(scope="module")
def event_loop_of_server() -> Iterator[BlockingPortal]:
    """One event loop for all requests of a module, as a server has: one for each took half of their processor time."""
    with start_blocking_portal("asyncio") as portal:
        yield portal


@pytest.fixture(scope="module")
def serve(tmp_path_factory: pytest.TempPathFactory, event_loop_of_server: BlockingPortal) -> Iterator[Serve]:
    closing: list[Callable[[], object]] = []

    def start(path: Path, with_users: bool) -> Served:
        folder = tmp_path_factory.mktemp("served")
        tokens, users = {}, None
        if with_users:
            users = folder / "users.toml"
            tokens = {role: add_user(users, f"{role}-1", role) for role in ("viewer", "engineer", "approver")}
        context = opened(path, folder)
        db = context.__enter__().db
        settings = ServerSettings(database=path, users=users)
        gate = application(db, settings, folder)
        gate._app.state.import_patience_s = 60.0  # type: ignore[attr-defined]
        client = TestClient(
            gate, base_url="http://127.0.0.1:8765", raise_server_exceptions=False, follow_redirects=False
        )
        client.portal = event_loop_of_server
        closing.extend([lambda: context.__exit__(None, None, None), gate.close])
        return Served(client, db, tokens)

    yield start
    for close in reversed(closing):
        close()


@pytest.fixture(scope="module")
def local(imported: Path, serve: Serve) -> Served:
    return serve(imported, False)
