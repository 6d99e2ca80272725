"""One client for every question: what a server answers is what the database itself answers, files and refusals too."""

from __future__ import annotations

import shutil
import stat
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import pytest
import uvicorn

from monitor.cli import main
from monitor.documents import to_document
from monitor.exceptions import CampaignError, InputError, MonitorError, NotFoundError
from monitor.store import Database
from monitor.web.access import FILES, NOT_OFFERED, STAYING, path_fields
from monitor.web.app import application
from monitor.web.client import Server, address_of_server
from monitor.web.note import Note, note_path, posted, read_note
from monitor.web.opening import host_user_name, opened
from monitor.web.settings import ServerSettings
from monitor.workflow.contract import QUESTIONS
from monitor.workflow.history.periods import Period

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
EXPORTS = EXAMPLES / "files-as-they-come"
CAMPAIGN, CURVE, MACHINE = "hidden-spindle-growth", "load-cell", "HU40-T"
#: Differ from one time of asking to the next: moments, times of computing, and hashes over them.
VOLATILE = {
    "at", "seconds", "sha256", "last_sha256", "recorded_at", "withdrawn_at", "created_at", "imported_at", "made_at",
    "issued_at",
    "previous_sha256", "applied_at", "time",
}  # fmt: skip
#: Every question of the contract in an order in which each has what it asks for: the fields of its request.
ASKED: list[tuple[str, Callable[[Path], dict[str, Any]]]] = [
    ("import", lambda out: {"folders": [EXAMPLES / "nothing-hidden", Path("no-such-folder")]}),
    ("import", lambda out: {
        "folders": sorted(path for path in EXPORTS.iterdir() if path.suffix not in (".md", ".toml")),
        "mapping": EXPORTS / "mapping.toml", "campaign": "week-12", "dry_run": True}),
    ("campaigns", lambda out: {}),
    ("machines", lambda out: {}),
    ("runs", lambda out: {"campaign": CAMPAIGN}),
    ("readings", lambda out: {"campaign": CAMPAIGN}),
    ("sql", lambda out: {"query": "SELECT campaign, run, started_at, warm_up, 0.1::DOUBLE x, NULL y FROM v_runs"}),
    ("identify", lambda out: {"campaign": CAMPAIGN}),
    ("identify all", lambda out: {}),
    ("values", lambda out: {"machine": MACHINE}),
    ("statistics", lambda out: {"campaign": CAMPAIGN, "matrices": out / "matrices"}),
    ("select", lambda out: {"campaign": CAMPAIGN, "name": "late", "where": "run > 10"}),
    ("selections", lambda out: {"campaign": CAMPAIGN}),
    ("selections side by side", lambda out: {"names": ("late", "nowhere")}),
    ("compare", lambda out: {"campaign": CURVE, "figures": out / "figures"}),
    ("residuals", lambda out: {"campaign": CAMPAIGN}),
    ("explain", lambda out: {"campaign": CURVE}),
    ("predict", lambda out: {"campaign": CURVE}),
    ("effects", lambda out: {"topology": "w C B X b Z Y (C1) t", "text": "backlash"}),
    ("effects of campaign", lambda out: {"campaign": CURVE}),
    ("affected by effect", lambda out: {"effect": "load_N:poly2", "to": "curve", "campaign": CURVE}),
    ("add effect", lambda out: {"effect": "load_N:poly2", "to": "curve", "new_name": "bent", "campaign": CURVE}),
    ("models", lambda out: {}),
    ("model", lambda out: {"name": "bent"}),
    ("model history", lambda out: {"model": "bent", "campaign": CURVE, "figures": out / "figures"}),
    ("remove effect", lambda out: {"effect": "load_N:poly2", "model": "bent", "new_name": "straight"}),
    ("use model", lambda out: {"model": "samba", "machine": MACHINE, "reason": "as before"}),
    ("event", lambda out: {
        "machine": MACHINE, "text": "belt changed", "at": datetime(2026, 3, 1, 7, tzinfo=UTC), "kind": "repair"}),
    ("events", lambda out: {"machine": MACHINE}),
    ("withdraw event", lambda out: {"machine": MACHINE, "number": 1, "reason": "of another machine"}),
    ("trend", lambda out: {"machine": MACHINE, "parameter": "EB0C"}),
    ("periods", lambda out: {
        "machine": MACHINE, "earlier": Period(datetime(2026, 3, 2, tzinfo=UTC), datetime(2026, 3, 5, tzinfo=UTC)),
        "later": Period(datetime(2026, 3, 5, tzinfo=UTC), datetime(2026, 3, 11, tzinfo=UTC))}),
    ("fleet", lambda out: {}),
    ("map", lambda out: {
        "campaign": CAMPAIGN, "points": 3, "compensation": "positioning-csv", "out": out / "tables"}),
    ("map over the stroke", lambda out: {"campaign": CAMPAIGN, "run": 20, "points": 3}),
    ("plan", lambda out: {"campaign": CAMPAIGN}),
    ("monte carlo cloud", lambda out: {"campaign": CAMPAIGN, "first": "EXX", "second": "EB0C", "trials": 1000}),
    ("residuals by driver", lambda out: {"campaign": CAMPAIGN}),
    ("contributions", lambda out: {"campaign": CAMPAIGN}),
    ("standards", lambda out: {"campaign": CAMPAIGN, "figures": out / "figures"}),
    ("poses", lambda out: {
        "topology": "w C B X b Z Y (C1) t", "readings": {"X": [0.0, 1.0]}, "errors": {"EXX:poly1": (1.0,)}}),
    ("uncertainty", lambda out: {"campaign": CAMPAIGN, "method": "guf"}),
    ("certificate template", lambda out: {"out": out / "laboratory.toml"}),
    (
        "issue certificate",
        lambda out: {
            "campaign": "nothing-hidden", "run": 20, "laboratory": EXAMPLES / "laboratory.toml",
            "out": out / "first.pdf",
            "issued_on": date(2026, 4, 1),
        },
    ),
    (
        "amend certificate",
        lambda out: {
            "replaces": "2026-0001", "reason": "customer", "laboratory": EXAMPLES / "laboratory.toml", "out": out,
            "issued_on": date(2026, 4, 2),
        },
    ),
    ("certificates", lambda out: {}),
    ("show certificate", lambda out: {"number": "2026-0001"}),
    ("issued certificate", lambda out: {"number": "2026-0001", "path": out / "again.pdf"}),
    ("digital certificate", lambda out: {"number": "2026-0001", "path": out / "one.xml"}),
    ("digital certificate page", lambda out: {"number": "2026-0001", "path": out / "one.html"}),
    ("remake certificate", lambda out: {"number": "2026-0001", "path": out / "remade.pdf"}),
    ("verify certificate", lambda out: {"file": out / "first.pdf"}),
    ("withdraw certificate", lambda out: {"number": "2026-0002", "reason": "wrong bar"}),
    ("report", lambda out: {"week": "2026-W10", "machine": MACHINE, "out": out / "reports", "workers": 1}),
    ("export", lambda out: {"folder": out / "tables.d", "format": "csv", "tables": ("v_runs", "v_machines")}),
    ("backup", lambda out: {"target": out / "copy.duckdb"}),
    ("simulate like a campaign", lambda out: {
        "out": out / "shop", "like": CAMPAIGN, "machines": ("M1",), "start": date(2026, 1, 12), "months": 1}),
    ("audit", lambda out: {"last": 50, "check": True}),
    ("verify", lambda out: {"recompute": 0}),
    ("withdraw campaign", lambda out: {"campaign": CAMPAIGN, "reason": "a rehearsal"}),
    ("identify stepwise", lambda out: {"campaign": "nothing-hidden"}),
]  # fmt: skip


#: Take seconds: asked in ``make slow`` alone.
LONG = {
    "amend certificate", "compare", "identify all", "issue certificate", "map", "map over the stroke", "model history",
    "monte carlo cloud", "report", "residuals by driver", "statistics",
    "selections side by side", "uncertainty",
}  # fmt: skip
#: Have no answer here, and the same words for it on both sides.
REFUSED = {"contributions", "identify stepwise", "predict", "selections side by side", "standards"}


@dataclass(frozen=True)
class Sides:
    """The same database twice: asked directly, and asked of a server at an address; ``served`` is its file."""

    db: Database
    server: Server
    served: Path
    secret: str


@pytest.fixture
def sides(imported: Path, tmp_path: Path) -> Iterator[Sides]:
    folder = tmp_path / "sides"
    room = folder / "room"
    room.mkdir(parents=True)
    shutil.copyfile(imported, folder / "here.duckdb")
    shutil.copyfile(imported, folder / "there.duckdb")
    here = Database(folder / "here.duckdb", threads=1, actor=host_user_name())
    with opened(folder / "there.duckdb", room) as served, here as db:
        gate = application(served.db, ServerSettings(folder / "there.duckdb"), room)
        running = uvicorn.Server(uvicorn.Config(gate, port=0, log_level="warning", lifespan="off"))
        thread = threading.Thread(target=running.run)
        thread.start()
        while not running.started:
            time.sleep(0.01)
        port = running.servers[0].sockets[0].getsockname()[1]
        server = Server(address_of_server(f"http://127.0.0.1:{port}"))
        yield Sides(db, server, folder / "there.duckdb", gate.sessions.owner_secret)
        running.should_exit = True
        thread.join()
        gate.close()


def _lasting(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _lasting(element) for key, element in value.items() if key not in VOLATILE}
    return [_lasting(element) for element in value] if isinstance(value, list) else value


def _files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def _check_answers(
    sides: Sides, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, left_out: set[str]
) -> set[str]:
    """Ask both sides in one order, because the questions write; the names of those that both refused."""
    refused = set()
    out = Path("out")  # relative, as people type it: the same words in both answers
    for name, fields in ASKED:
        if name in left_out:
            continue
        question = QUESTIONS[name]
        answers: list[Any] = []
        files = []
        for side in ("here", "there"):
            (tmp_path / side).mkdir(exist_ok=True)
            monkeypatch.chdir(tmp_path / side)
            arguments = [] if question.request is None else [question.request(**fields(out))]
            try:
                if side == "there":
                    answers.append(sides.server.answer(name, *arguments))
                else:
                    answers.append(
                        question.load()(*([sides.db] if question.needs_database else []), *arguments)
                    )
            except MonitorError as error:
                answers.append(str(error))
            files.append(_files(tmp_path / side))
        here, there = answers
        assert type(there) is type(here), (name, here, there)
        assert files[1] == files[0], name
        if isinstance(here, str):
            refused.add(name)
            assert there == here, name
            continue
        assert _lasting(to_document(there)) == _lasting(to_document(here)), name
    return refused


def test_a_server_answers_as_the_database_does(
    sides: Sides, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _check_answers(sides, tmp_path, monkeypatch, LONG)


@pytest.mark.slow
def test_every_question_of_the_contract_has_the_same_answer_of_a_server(
    sides: Sides, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Typed answers, texts of refusals, and names of files."""
    assert {name for name, _ in ASKED} | set(NOT_OFFERED) == set(QUESTIONS)
    assert _check_answers(sides, tmp_path, monkeypatch, set()) == REFUSED
    matrices = [(tmp_path / side / "out" / "matrices") for side in ("here", "there")]
    assert len(list(matrices[0].iterdir())) > 3
    for path in matrices[0].iterdir():
        assert path.read_bytes() == (matrices[1] / path.name).read_bytes()


def test_a_command_asks_the_server_that_has_the_file(
    sides: Sides, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same words as of the file itself, writes included; what cannot be asked is said at once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MONITOR_SERVER", raising=False)

    def printed(database: Path | str, *words: str, status: int = 0) -> str:
        assert main(["--db", str(database), "--wait", "0", *words]) == status
        out, err = capsys.readouterr()
        return out if status == 0 else err

    sides.db.close()
    here = Path(sides.db.path)
    note = Note(str(sides.server.address), sides.secret, 1)
    assert "is open in this process" in printed(sides.served, "event", MACHINE, status=2)
    with posted(sides.served, note) as is_posted:
        assert is_posted
        for words in (
            ["campaigns"],
            ["runs", CAMPAIGN],
            ["runs", CAMPAIGN, "--json"],
            ["trend", MACHINE],
            ["fleet"],
        ):
            assert printed(sides.served, *words) == printed(here, *words)
        event = ["event", MACHINE, "belt changed", "--at", "2026-03-01T07:00:00+00:00", "--kind", "repair"]
        assert printed(sides.served, *event).split()[:5] == printed(here, *event).split()[:5]
        link = tmp_path / "link.duckdb"
        link.symlink_to(sides.served)
        assert "belt changed" in printed(link, "event", MACHINE)
        assert "is served at" in printed(sides.served, "watch", ".", "--once", status=2)
        secrets = tmp_path / "token"
        secrets.write_text(f"{sides.secret}\n")
        address = ["--server", str(sides.server.address), "--server-token", str(secrets)]
        assert main([*address, "campaigns"]) == 0
        monkeypatch.setenv("MONITOR_SERVER", str(sides.server.address))
        assert main(["campaigns"]) == 0
        assert printed(here, "campaigns") != ""  # what is typed stands above the environment
        assert main([*address, "--db", str(here), "campaigns"]) == 2
        assert main([*address, "restore", "x"]) == 2
    assert not list(tmp_path.glob("sides/*.server"))


def test_a_note_is_believed_where_its_server_lives_and_nobody_else_can_have_written_it(
    tmp_path: Path,
) -> None:
    database = tmp_path / "monitor.duckdb"
    path = note_path(database)
    assert read_note(database) is None
    with posted(database, Note("http://127.0.0.1:1", "secret", 1)):
        assert read_note(database) == Note("http://127.0.0.1:1", "secret", 1)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        path.chmod(0o644)
        assert read_note(database) is None
        path.chmod(0o600)
        left_behind = path.read_bytes()
        elsewhere = tmp_path / "elsewhere"
        path.rename(elsewhere)
        path.symlink_to(elsewhere)
        assert read_note(database) is None
    path.write_bytes(left_behind)
    path.chmod(0o600)
    assert read_note(database) is None  # its server is gone
    with posted(tmp_path / "no" / "such" / "folder", Note("http://127.0.0.1:1", "secret", 1)) as is_posted:
        assert not is_posted


def test_every_path_of_a_question_travels_or_is_said_to_stay() -> None:
    for name, question in QUESTIONS.items():
        if name not in NOT_OFFERED:
            fields = FILES.get(name)
            travelling = set() if fields is None else {*fields.incoming, *fields.outgoing}
            assert path_fields(question.request) - travelling <= set(STAYING), name
            assert travelling <= path_fields(question.request), name


def test_what_a_server_refuses_is_refused_in_the_same_words(sides: Sides, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(EXAMPLES / "nothing-hidden", broken)
    (broken / "runs.csv").write_text("run,started_at\n1,yesterday\n2,today\n")
    request = QUESTIONS["import"].request(folders=[broken])
    with pytest.raises(CampaignError, match="yesterday") as here:
        QUESTIONS["import"].load()(sides.db, request)
    with pytest.raises(InputError, match="yesterday") as there:
        sides.server.answer("import", request)
    assert str(there.value) == str(here.value)
    with pytest.raises(NotFoundError, match="nowhere"):
        sides.server.answer("runs", QUESTIONS["runs"].request(campaign="nowhere"))
    for name, why in NOT_OFFERED.items():
        with pytest.raises(InputError, match="cannot be asked this: ") as refused:
            sides.server.answer(name)
        assert why in str(refused.value)
    with pytest.raises(InputError, match="the server computes on its own computer"):
        sides.server.answer(
            "uncertainty", QUESTIONS["uncertainty"].request(campaign=CAMPAIGN, cluster="tcp://x:1")
        )


def test_no_file_is_written_over_or_outside(sides: Sides, tmp_path: Path) -> None:
    target = tmp_path / "copy.duckdb"
    target.write_text("mine")
    with pytest.raises(InputError, match="is there already and is not written over"):
        sides.server.answer("backup", QUESTIONS["backup"].request(target))
    assert target.read_text() == "mine"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("http://ada:secret@127.0.0.1", "put the token into a file"),
        ("ftp://127.0.0.1", "write the address of a server"),
        ("127.0.0.1:8765", "write the address of a server"),
        ("http://127.0.0.1:99999", "write for example"),
        ("http://127.0.0.1/other", "write the address of a server"),
    ],
)
def test_an_address_that_cannot_be_one_is_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        address_of_server(text)


def test_a_token_is_not_sent_in_the_clear_nor_when_it_is_none() -> None:
    with pytest.raises(InputError, match="must not be sent in the clear"):
        Server(address_of_server("http://192.0.2.1"), "token")
    assert str(address_of_server("https://monitor.example")) == "https://monitor.example:443"
    with pytest.raises(InputError, match="one line of letters"):
        Server(address_of_server("http://127.0.0.1"), "a\r\nX-Other: b")
    with pytest.raises(InputError, match="cannot be reached"):
        Server(address_of_server("http://127.0.0.1:1")).answer("campaigns")


def test_a_server_whose_database_was_replaced_is_no_fault_of_the_software() -> None:
    refusal = Server("http://127.0.0.1:9", None)._refusal(
        503, "application/json", b'{"error": "it was replaced"}'
    )
    assert isinstance(refusal, InputError)
    assert "it was replaced" in str(refusal)
