"""Names with passwords: argon2id in the file, the same time for whoever is not there, patience after wrong ones."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest

from monitor.cli import main
from monitor.exceptions import InputError
from monitor.web import passwords
from monitor.web.passwords import Attempts
from monitor.web.users import Role, User, UserFile, add_user, read_users

argon2 = pytest.importorskip("argon2", reason="the extra web is not installed")
PASSWORD = "correct horse battery staple"


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cheaper parameters; those of the product are looked at in a test of their own."""
    monkeypatch.setattr(passwords, "_hasher", lambda: argon2.PasswordHasher(time_cost=1, memory_cost=64))
    passwords._nobody.cache_clear()


def test_rfc_9106_the_hash_is_argon2id_with_64_mib_and_three_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    passwords._hasher.cache_clear()
    assert passwords.hashed(PASSWORD).startswith("$argon2id$v=19$m=65536,t=3,p=4$")


def test_a_password_is_stored_as_its_hash_and_found_again(tmp_path: Path) -> None:
    users = tmp_path / "users.toml"
    assert add_user(users, "ada", "engineer", PASSWORD) is None
    token = add_user(users, "bob", "viewer")
    assert PASSWORD not in users.read_text()
    read = read_users(users)
    assert read.of_password("ada", PASSWORD) == User("ada", Role.ENGINEER)
    for name, password in (
        ("ada", "wrong"),
        ("bob", PASSWORD),
        ("bob", ""),
        ("nobody", PASSWORD),
        ("ada", "x" * 10**6),
    ):
        assert read.of_password(name, password) is None
    assert token is not None
    assert read.of_token(token) == User("bob", Role.VIEWER)
    assert read.of_token(PASSWORD) is None
    assert read.looking_only().of_password("ada", PASSWORD) == User("ada", Role.VIEWER)


def test_nist_sp_800_63b_a_short_password_is_refused(tmp_path: Path) -> None:
    for password in ("x" * 14, "", "x" * 257):
        with pytest.raises(InputError, match=f"15 to 256 characters, this one {len(password)}"):
            add_user(tmp_path / "users.toml", "ada", "viewer", password)
    (tmp_path / "users.toml").write_text('[users.ada]\nrole = "viewer"\nargon2 = "plain"\n')
    with pytest.raises(InputError, match=r"must begin with \$argon2id\$"):
        read_users(tmp_path / "users.toml")


def test_after_five_wrong_passwords_a_name_waits_longer_each_time() -> None:
    now = [100.0]
    attempts = Attempts(lambda: now[0])
    waits = []
    for _ in range(20):
        attempts.note("ada", right=False)
        waits.append(attempts.wait_s("ada"))
    assert waits[:8] == [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 4.0, 8.0]
    assert waits[-1] == 300.0
    assert attempts.wait_s("bob") == 0.0
    now[0] += 300.0
    assert attempts.wait_s("ada") == 0.0
    attempts.note("ada", right=True)
    attempts.note("ada", right=False)
    assert attempts.wait_s("ada") == 0.0


def test_who_is_taken_out_of_the_file_is_out_at_once(tmp_path: Path) -> None:
    path = tmp_path / "users.toml"
    token = add_user(path, "ada", "engineer")
    assert token is not None
    users = UserFile(path, looking_only=False)
    assert users.users.of_token(token) is not None
    path.write_text(path.read_text().replace("engineer", "viewer"))
    assert users.users.of_token(token) == User("ada", Role.VIEWER)
    path.write_text("broken")
    assert users.users.of_token(token) is None
    path.unlink()
    assert users.users.of_token(token) is None


def test_log_in_with_name_and_password(tmp_path: Path, serve: Any) -> None:
    served = serve(tmp_path / "monitor.duckdb", True)
    users = (
        served.client.app._app.app.state.settings.users if hasattr(served.client.app._app, "app") else None
    )
    users = users or served.client.app._settings.users
    add_user(users, "ada", "engineer", PASSWORD)
    client = served.client
    assert client.post("/login", data={"name": "ada", "token": PASSWORD}).status_code == 303
    assert "ada, engineer" in client.get("/").text
    users.write_text(users.read_text().replace('[users."ada"]', '[users."eve"]'))
    assert client.get("/").status_code == 303  # the session of somebody who is no longer there
    for _ in range(5):
        refused = client.post("/login", data={"name": "eve", "token": "wrong"})
        assert refused.status_code == 403
        assert "Nobody has this name and password" in refused.text
    waiting = client.post("/login", data={"name": "eve", "token": PASSWORD})
    assert waiting.status_code == 429
    assert "too many wrong passwords" in waiting.text
    assert client.post("/login", data={"token": served.tokens["viewer"]}).status_code == 303


def test_the_command_reads_the_password_from_a_pipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{PASSWORD}\n"))
    users = tmp_path / "users.toml"
    command = ["serve", "--users", str(users), "--add-user", "ada", "--role", "approver", "--password"]
    assert main(command) == 0
    assert "ada (approver) was added" in capsys.readouterr().out
    assert read_users(users).of_password("ada", PASSWORD) == User("ada", Role.APPROVER)
