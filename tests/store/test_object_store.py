"""A lake whose Parquet files lie in an object store: the same answers, the same words when it is away.

What needs a store that answers (moto's, on loopback) runs by ``make object-store``, which installs it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("duckdb_extension_httpfs", reason="the extra [lake] is not installed")
import duckdb

from monitor.exceptions import InputError, StoreError
from monitor.records import Campaign
from monitor.store import Database, StoredIdentification, import_campaign, save_identification
from monitor.store.lake import object_store, publication
from monitor.store.lake.publication import publish
from monitor.store.lake.reading import LakeDatabase

Make = Callable[..., Campaign]
Identify = Callable[..., StoredIdentification]
FILES = "s3://lake/shops"
#: Made by ``make object-store``.
MOTO = Path(__file__).resolve().parents[2] / ".venv-store" / "bin" / "python"
KEYS = {"AWS_ACCESS_KEY_ID": "plant", "AWS_SECRET_ACCESS_KEY": 'it\'s "secret"'}


@pytest.fixture(autouse=True)
def no_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*KEYS, "AWS_SESSION_TOKEN", "AWS_REGION", "AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"):
        monkeypatch.delenv(name, raising=False)


def _set(monkeypatch: pytest.MonkeyPatch, **variables: str) -> None:
    for name, value in (KEYS | variables).items():
        monkeypatch.setenv(name, value)


def _fill(path: Path, campaigns: list[Campaign], identified: Identify) -> None:
    with Database(path) as db:
        for campaign in campaigns:
            import_campaign(db, campaign)
            save_identification(db, identified(campaign))


def test_who_may_enter_is_asked_for_by_name(
    tmp_path: Path, make_campaign: Make, make_identification: Identify, monkeypatch: pytest.MonkeyPatch
) -> None:
    _fill(tmp_path / "Ulm.duckdb", [make_campaign("week 1")], make_identification)
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "plant")
    with (
        Database(tmp_path / "Ulm.duckdb") as db,
        pytest.raises(InputError, match="object store; set AWS_SECRET_ACCESS_KEY in the environment"),
    ):
        publish(db, f"ducklake:{tmp_path}/shops.ducklake", files=FILES)


@pytest.mark.parametrize(
    ("variables", "options"),
    [
        ({}, {"region": "us-east-1"}),
        ({"AWS_REGION": "eu-central-1"}, {"region": "eu-central-1"}),
        (
            {"AWS_ENDPOINT_URL_S3": "http://127.0.0.1:9000/"},
            {"endpoint": "127.0.0.1:9000", "url_style": "path", "use_ssl": "false"},
        ),
        (
            {"AWS_ENDPOINT_URL": "https://store.example.org"},
            {"endpoint": "store.example.org", "use_ssl": "true"},
        ),
    ],
)
def test_the_environment_says_which_store(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], options: dict[str, str]
) -> None:
    _set(monkeypatch, **variables)
    with duckdb.connect(":memory:", config={"autoload_known_extensions": "false"}) as connection:
        object_store.enter(connection)
        (stated,) = connection.execute("SELECT secret_string FROM duckdb_secrets()").fetchone() or ("",)
    fields = dict(field.split("=", 1) for field in stated.split(";"))
    assert {name: fields.get(name) for name in options} == options
    assert "secret=redacted" in stated


def test_an_endpoint_without_a_scheme_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    _set(monkeypatch, AWS_ENDPOINT_URL_S3="store.example.org:9000")
    with pytest.raises(
        InputError, match=r"address of a store without a name and a password, such as https://"
    ):
        object_store.enter(duckdb.connect())


# Its own process, in an environment of its own: what it needs contradicts our pins. It ends with what it reads from.
_SERVER = """
import sys
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(port=0)
server.start()
print("port", server.get_host_and_port()[1], flush=True)
sys.stdin.read()
"""


@pytest.fixture
def store(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of an object store on loopback with an empty bucket ``lake``."""
    if not MOTO.exists():
        pytest.skip("make object-store installs moto")
    with subprocess.Popen(
        [MOTO, "-c", _SERVER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        port = next(line for line in server.stdout if line.startswith("port ")).split()[1]
        address = f"http://127.0.0.1:{port}"
        urllib.request.urlopen(urllib.request.Request(f"{address}/lake", method="PUT")).close()
        _set(monkeypatch, AWS_ENDPOINT_URL_S3=address)
        yield address
        server.stdin.close()


def test_a_lake_in_an_object_store_answers_as_one_file(
    tmp_path: Path, make_campaign: Make, make_identification: Identify, store: str
) -> None:
    lake = f"ducklake:{tmp_path}/shops.ducklake"
    shops = {
        shop: [make_campaign(f"{shop} {n}", f"MILL-{shop}") for n in range(3)] for shop in ("Ulm", "Aalen")
    }
    _fill(tmp_path / "one.duckdb", [*shops["Ulm"], *shops["Aalen"]], make_identification)
    for shop, campaigns in shops.items():
        _fill(tmp_path / f"{shop}.duckdb", campaigns, make_identification)
        with Database(tmp_path / f"{shop}.duckdb") as db:
            assert publish(db, lake, files=FILES).entries > 0
        with Database(tmp_path / f"{shop}.duckdb") as db:
            # The catalogue says where the files lie; nothing is published twice.
            assert publish(db, lake).entries == 0
    assert {path.suffix for path in tmp_path.iterdir()} <= {".duckdb", ".ducklake", ".lock", ".blocks"}
    values = "SELECT campaign, run, parameter, value, u FROM v_parameters ORDER BY ALL"
    with Database(tmp_path / "one.duckdb", read_only=True) as one, LakeDatabase(lake) as many:
        assert many.rows(values) == one.rows(values) != []


def test_a_store_that_is_away_is_said_and_waited_for_by_the_next_call(
    tmp_path: Path,
    make_campaign: Make,
    make_identification: Identify,
    store: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lake, path = f"ducklake:{tmp_path}/shops.ducklake", tmp_path / "Ulm.duckdb"
    _fill(path, [make_campaign("week 1")], make_identification)
    with Database(path) as db:
        publish(db, lake, files=FILES)
    _fill(path, [make_campaign("week 2")], make_identification)
    _set(monkeypatch, AWS_ENDPOINT_URL_S3="http://127.0.0.1:9")
    monkeypatch.setattr(publication, "_TRIES", 1)
    with (
        Database(path) as db,
        pytest.raises(StoreError, match=r"published to ducklake:.* stays, and the next"),
    ):
        publish(db, lake)
    with pytest.raises(StoreError, match="cannot be read"), LakeDatabase(lake) as many:
        many.rows("SELECT campaign FROM v_campaigns")
    _set(monkeypatch, AWS_ENDPOINT_URL_S3=store)
    with Database(path) as db:
        assert publish(db, lake).entries > 0
    with LakeDatabase(lake) as many:
        assert many.rows("SELECT campaign FROM v_campaigns ORDER BY 1") == [("week 1",), ("week 2",)]


def test_a_bucket_that_is_not_there_is_said_at_once(
    tmp_path: Path,
    make_campaign: Make,
    make_identification: Identify,
    store: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _fill(tmp_path / "Ulm.duckdb", [make_campaign("week 1")], make_identification)
    tries: list[float] = []
    monkeypatch.setattr(publication.time, "sleep", tries.append)
    with Database(tmp_path / "Ulm.duckdb") as db, pytest.raises(StoreError, match="404"):
        publish(db, f"ducklake:{tmp_path}/shops.ducklake", files="s3://lakes/shops")
    assert tries == []


@pytest.mark.parametrize("files", ["gs://lake/shops", "s3a://lake/shops", "https://store.example.org/lake"])
def test_an_address_of_another_store_makes_no_folder_of_that_name(files: str) -> None:
    with pytest.raises(InputError, match=r"lie in a folder, or at s3://BUCKET/FOLDER"):
        object_store.address_of_files(files)
    assert object_store.address_of_files("S3://lake/shops") == "s3://lake/shops"


_AS_NOBODY = """
import os, sys
from monitor.exceptions import InputError
from monitor.store.lake.object_store import address_of_files
os.setuid(65534)
try:
    address_of_files(sys.argv[1])
except InputError as refusal:
    print(refusal)
"""


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root acts as somebody else")
def test_a_folder_below_one_that_may_not_be_entered_is_refused_in_words() -> None:
    """It ended in a bare PermissionError of Python."""
    with tempfile.TemporaryDirectory() as outer:
        os.chmod(outer, 0o755)
        closed = Path(outer, "closed")
        (closed / "inner").mkdir(parents=True)
        closed.chmod(0o700)
        said = subprocess.run(
            [sys.executable, "-c", _AS_NOBODY, str(closed / "inner" / "lake")],
            capture_output=True, text=True, check=True, cwd=Path(__file__).resolve().parents[2],
        )  # fmt: skip
        assert said.stdout == f"--files {closed}/inner/lake: nothing can be written to {closed}\n"
