"""Who comes in, from where, with what: hosts, origins, forms, tokens, roles, cookies, sizes, zips."""

from __future__ import annotations

import io
import json
import re
import stat
import zipfile
from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import InputError
from monitor.readers import archive
from monitor.readers.archive import UploadedFile, unpack
from monitor.web.gate import DOCUMENT_BYTES
from monitor.web.sessions import Sessions
from monitor.web.settings import ServerSettings
from monitor.web.users import Role, User, add_user, read_users


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory, serve: Any) -> Any:
    return serve(tmp_path_factory.mktemp("guarded") / "monitor.duckdb", True)


def test_a_server_that_others_reach_needs_users_and_an_encrypted_way(tmp_path: Path) -> None:
    users = tmp_path / "users.toml"
    with pytest.raises(InputError, match="name who may come in with --users"):
        ServerSettings(tmp_path / "x", host="0.0.0.0")
    with pytest.raises(InputError, match="name who may come in with --users"):
        ServerSettings(tmp_path / "x", proxy="monitor.example")
    add_user(users, "ada", "viewer")
    with pytest.raises(InputError, match="must not be sent in the clear"):
        ServerSettings(tmp_path / "x", host="192.0.2.1", users=users)
    assert ServerSettings(tmp_path / "x", proxy="monitor.example", users=users).is_encrypted
    assert ServerSettings(tmp_path / "x", host="::1").is_loopback


def test_a_token_is_shown_once_and_its_hash_is_stored(tmp_path: Path) -> None:
    users = tmp_path / "users.toml"
    token = add_user(users, "ada", "engineer")
    assert token not in users.read_text()
    assert stat.S_IMODE(users.stat().st_mode) == 0o600
    assert read_users(users).of_token(token) == User("ada", Role.ENGINEER)
    assert read_users(users).of_token(token[:-1]) is None
    with pytest.raises(InputError, match="has a user ada already"):
        add_user(users, "ada", "viewer")
    with pytest.raises(InputError, match="there are viewer, engineer, approver"):
        add_user(users, "bob", "king")
    users.write_text('[users."ada"]\nrole = "engineer"\nsha256 = "short"\n')
    with pytest.raises(InputError, match="64 hexadecimal digits"):
        read_users(users)


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8765", "127.0.0.1.evil.example", ""])
def test_another_name_of_this_computer_is_refused(local: Any, host: str) -> None:
    """DNS rebinding: a page of evil.example whose name was made to point at 127.0.0.1."""
    answer = local.client.post("/api/v1/campaigns", json={}, headers={"Host": host})
    assert answer.status_code == 421


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "http://127.0.0.1:3000"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_a_page_of_another_site_cannot_send_anything(local: Any, headers: dict[str, str]) -> None:
    for path in ("/api/v1/campaigns", "/model/add", "/import"):
        answer = local.client.post(path, content=b"{}", headers={"Content-Type": "text/plain", **headers})
        assert answer.status_code == 403


def _forms(application: Any) -> list[str]:
    paths = []
    for route in application.routes:
        inner = getattr(route, "original_router", None) or getattr(route, "app", None)
        routes = getattr(inner, "routes", [route])
        for one_route in routes:
            path, methods = getattr(one_route, "path", ""), getattr(one_route, "methods", None) or ()
            if "POST" in methods and not path.startswith("/api/") and path != "/login":
                paths.append(path)
    return paths


def test_no_form_is_taken_without_its_proof(local: Any) -> None:
    paths = _forms(local.client.app._app)
    assert {"/import", "/model/add", "/model/undo", "/machine/event", "/work/cancel", "/logout"} <= set(paths)
    local.client.get("/")
    before = local.db.rows("SELECT count(*) FROM audit")
    for path in paths:
        for data in ({}, {"proof": "0" * 64}, {"proof": "µ"}):
            answer = local.client.post(path, data=data)
            assert answer.status_code == 403, path
            assert "not one of this server" in answer.text
    assert local.db.rows("SELECT count(*) FROM audit") == before


def test_a_proof_belongs_to_its_session() -> None:
    sessions = Sessions(None, User("host", Role.APPROVER))
    first, second = sessions.begin(), sessions.begin()
    assert first is not None
    assert second is not None
    assert sessions.is_proof(first, sessions.proof(first))
    assert not sessions.is_proof(first, sessions.proof(second))
    sessions.end(first)
    assert sessions.user_of(first) is None


def test_a_browser_gets_a_strict_policy_and_a_cookie_that_no_script_reads(local: Any) -> None:
    local.client.cookies.clear()
    answer = local.client.get("/")
    policy = answer.headers["content-security-policy"]
    assert "unsafe" not in policy
    assert policy.startswith("default-src 'none'; script-src 'self'; ")
    assert answer.headers["x-content-type-options"] == "nosniff"
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    for path in ("/static/pages.js", "/api/v1", "/nowhere", "/campaign?name=%3Cscript%3E"):
        assert local.client.get(path).headers["content-security-policy"] == policy


def test_no_page_has_a_script_or_style_of_its_own_in_it(local: Any) -> None:
    for path in (
        "/",
        "/campaigns",
        "/machine?name=HU40-T",
        "/model?campaign=hidden-spindle-growth",
        "/import",
    ):
        text = local.client.get(path).text
        for tag in re.findall(r"<script[^>]*>", text):
            assert "src=" in tag or 'type="application/json"' in tag
        assert not re.search(r"<style|\sstyle=|\son[a-z]+=|javascript:", text)
        assert not re.search(r"(src|href)=\"(https?:)?//", text)


def test_plotly_writes_no_style_that_the_policy_refuses(local: Any) -> None:
    """Every page with a chart had a fault in the browser's console: the style sheet of maps of the earth."""
    script = local.client.get("/static/plotly.min.js").text
    page = local.client.get("/machine?name=HU40-T").text
    guards = re.findall(r'getElementById\("([^"]+)"\)\)\{var \w=document\.createElement\("style"\)', script)
    # The other one is empty, which the policy allows.
    assert (len(guards), script.count('createElement("style")')) == (1, 2)
    assert f'id="{guards[0]}"' in page


def test_text_from_outside_is_text(local: Any) -> None:
    name = "</script><script>alert(1)</script>"
    for path in ("/campaign", "/machine", "/model"):
        answer = local.client.get(path, params={"name": name, "campaign": name})
        assert answer.status_code == 404
        assert "<script>alert" not in answer.text
    local.ask("event", {"machine": "HU40-T", "text": name, "kind": name})
    assert "<script>alert" not in local.client.get("/machine", params={"name": "HU40-T"}).text


def test_without_a_token_nobody_comes_in(guarded: Any) -> None:
    page = guarded.client.get("/campaigns")
    assert page.status_code == 303
    assert page.headers["location"] == "/login?then=/campaigns"
    assert guarded.client.post("/api/v1/campaigns", json={}).status_code == 401
    wrong = guarded.client.post("/api/v1/campaigns", json={}, headers={"Authorization": "Bearer wrong"})
    assert wrong.status_code == 401
    assert guarded.client.post("/login", data={"token": "wrong"}).status_code == 403
    assert guarded.client.get("/static/pages.css").status_code == 200


def test_a_role_may_ask_what_it_may_and_no_more(guarded: Any) -> None:
    assert guarded.ask("campaigns", role="viewer")[0] == 200
    for question in ("event", "add effect", "use model", "identify all"):
        status, answer = guarded.ask(question, role="viewer")
        assert status == 403
        assert "needs the role engineer" in str(answer["error"])
    assert guarded.ask("withdraw campaign", {"campaign": "x", "reason": "y"}, "engineer")[0] == 403
    assert guarded.ask("withdraw campaign", {"campaign": "x", "reason": "y"}, "approver")[0] == 404


def test_every_write_is_in_the_audit_with_the_user(guarded: Any) -> None:
    folder = Path(__file__).resolve().parents[2] / "examples" / "nothing-hidden"
    members = [(f"nothing-hidden/{path.name}", path.read_bytes()) for path in folder.iterdir()]
    answer = guarded.client.post(
        "/api/v1/import", files={"file": ("x.zip", _zip(*members).getvalue())},
        headers={"Authorization": f"Bearer {guarded.tokens['engineer']}"},
    )  # fmt: skip
    assert answer.status_code == 200
    actors = {actor for (actor,) in guarded.db.rows("SELECT DISTINCT actor FROM audit")}
    assert "engineer-1" in actors


def test_read_only_makes_everybody_a_viewer(tmp_path: Path) -> None:
    token = add_user(tmp_path / "users.toml", "ada", "approver")
    assert token is not None
    assert read_users(tmp_path / "users.toml").looking_only().of_token(token) == User("ada", Role.VIEWER)


def test_log_in_and_out(guarded: Any) -> None:
    answer = guarded.client.post("/login", data={"token": guarded.tokens["viewer"], "then": "//evil.example"})
    assert answer.status_code == 303
    assert answer.headers["location"] == "/"
    assert "viewer-1, viewer" in guarded.client.get("/").text
    refused = guarded.client.post(
        "/import", data={"proof": guarded.proof("/")}, files={"file": ("x.zip", b"PK")}
    )
    assert refused.status_code == 403
    assert guarded.client.post("/logout", data={"proof": guarded.proof("/")}).status_code == 303
    assert guarded.client.get("/").status_code == 303


def test_a_form_that_is_too_large_is_answered_by_a_page(local: Any) -> None:
    """A browser was left on bare JSON, without a way on."""
    answer = local.client.post(
        "/import",
        content=iter([b"x" * 2**20] * 65),
        headers={"Content-Type": "multipart/form-data; boundary=x"},
    )
    assert answer.status_code == 413
    assert answer.headers["content-type"].startswith("text/html")
    assert "64 MiB may be sent at a time" in answer.text
    assert 'href="/"' in answer.text


def test_too_much_is_refused_before_it_is_read(local: Any) -> None:
    big = b"x" * (DOCUMENT_BYTES + 1)
    assert local.client.post("/model/add", content=big).status_code == 413
    announced = local.client.post("/import", content=b"x", headers={"Content-Length": str(10**12)})
    assert announced.status_code == 413
    pieces = local.client.post("/model/add", content=iter([big]), headers={"Content-Type": "text/plain"})
    assert pieces.status_code in (403, 413)
    for media_type in ("application/json", "application/zip", "multipart/form-data; boundary=x"):
        pieces = local.client.post(
            "/api/v1/import", content=iter([b"x" * 2**20] * 65), headers={"Content-Type": media_type}
        )
        assert pieces.status_code in (400, 413), media_type
        assert pieces.json()["error"]


def test_a_form_without_its_boundary_is_refused(local: Any) -> None:
    for path in ("/api/v1/import", "/api/v1/verify-certificate"):
        answer = local.client.post(path, content=b"x", headers={"Content-Type": "multipart/form-data"})
        assert answer.status_code == 400
        assert "boundary" in answer.json()["error"]


@pytest.mark.parametrize(
    "content",
    [
        b"", b"PK", b"[]", b"null", b'{"document": []}',
        b'{"document": {"folders": [5]}}', b'{"document": {"folders": "\\u0000"}}',
        b'{"document": {}, "tolerances": {"x": {"EXX": -1}}}', b'{"document": {"folders": ["/etc"]}}',
    ],
)  # fmt: skip
def test_a_parcel_that_is_none_is_refused(local: Any, content: bytes) -> None:
    body = content if content in (b"", b"PK") else _zip(("request.json", content)).getvalue()
    answer = local.client.post("/api/v1/import", content=body, headers={"Content-Type": "application/zip"})
    assert 400 <= answer.status_code < 500
    assert "/served" not in answer.text


@pytest.mark.parametrize("label", ["../../evil", "/etc/passwd", "..", "C:\\evil", "a/../../evil"])
def test_a_label_of_a_parcel_names_no_file_of_the_server(local: Any, label: str) -> None:
    """It reads what came with the parcel under the last part of the label, and writes below its own folder."""
    for question, field in (
        ("verify-certificate", "file"),
        ("export", "folder"),
        ("certificate-template", "out"),
    ):
        document = json.dumps({"document": {field: label}}).encode()
        body = _zip(("request.json", document)).getvalue()
        answer = local.client.post(
            f"/api/v1/{question}", content=body, headers={"Content-Type": "application/zip"}
        )
        assert answer.status_code in (200, 400, 404, 422), answer.text
        if answer.status_code == 200:
            names = zipfile.ZipFile(io.BytesIO(answer.content)).namelist()
            assert all(name == "answer.json" or name.startswith(f"{field}/") for name in names)
        assert b"root:" not in answer.content
    assert not Path("/etc/passwd.part").exists()


def _zip(*members: tuple[str, bytes], link: str = "") -> io.BytesIO:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
        if link:
            info = zipfile.ZipInfo(link)
            info.external_attr = (stat.S_IFLNK | 0o777) << 16
            archive.writestr(info, "/etc/passwd")
    packed.seek(0)
    return packed


@pytest.mark.parametrize(
    "name", ["../evil", "/etc/evil", "a/../../evil", "a\\..\\..\\evil", "C:/evil", "a\nb", "x" * 300]
)
def test_a_zip_stays_in_its_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="names must stay inside their folder"):
        unpack([UploadedFile("x.zip", _zip(("c/campaign.toml", b""), (name, b"evil")))], tmp_path / "in")
    assert not (tmp_path / "evil").exists()
    with pytest.raises(InputError, match="names must stay inside their folder"):
        unpack([UploadedFile(name, io.BytesIO(b"evil"))], tmp_path / "in2")


def test_a_bomb_a_link_and_half_a_zip_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="a link or a device"):
        unpack([UploadedFile("x.zip", _zip(link="c/campaign.toml"))], tmp_path / "link")
    monkeypatch.setattr(archive, "UNPACKED_BYTES", 2**20)
    bomb = _zip(("c/campaign.toml", b"0" * 2**22))
    assert len(bomb.getvalue()) < 2**14
    with pytest.raises(InputError, match="unpacks to more than 1 MiB"):
        unpack([UploadedFile("x.zip", bomb)], tmp_path / "bomb")
    liar = bytearray(bomb.getvalue())
    for place in (m.start() for m in re.finditer(b"PK\x01\x02", bytes(liar))):
        liar[place + 24 : place + 28] = (100).to_bytes(
            4, "little"
        )  # the size that the directory of the zip states
    with pytest.raises(InputError, match=r"cannot be unpacked|more than 1 MiB"):
        unpack([UploadedFile("x.zip", io.BytesIO(bytes(liar)))], tmp_path / "liar")
    monkeypatch.setattr(archive, "MOST_FILES", 3)
    with pytest.raises(InputError, match="more than 3 files"):
        unpack([UploadedFile("x.zip", _zip(*((f"c/{n}", b"") for n in range(4))))], tmp_path / "many")
    half = io.BytesIO(_zip(("c/campaign.toml", b"x" * 1000)).getvalue()[10:])
    with pytest.raises(InputError, match=r"cannot be unpacked|no folder of the upload has a campaign\.toml"):
        unpack([UploadedFile("x.zip", half)], tmp_path / "half")
    with pytest.raises(InputError, match="choose the folder"):
        unpack([], tmp_path / "nothing")
