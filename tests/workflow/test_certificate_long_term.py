"""A certificate with long-term material, from the command to the verification: PAdES B-LT (ETSI EN 319 142-1, 6)."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import pytest

from monitor.cli import main
from monitor.exceptions import InputError
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateRequest, RemakeRequest
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

pytest.importorskip("pyhanko", reason="the extra [sign] is not installed")

from tests.reporting.long_term_authority import Authority

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Authority]:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    authority = Authority(tmp_path_factory.mktemp("authority"))
    yield authority
    authority.close()


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("long-term") / "c.duckdb"
    with Database(path, threads=1) as db:
        import_campaign(db, read_campaign(EXAMPLES / "five-days"))
        uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    return path


def test_verify_says_what_the_file_carries_and_whether_it_suffices(
    database: Path, authority: Authority, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys, out = authority.folder, tmp_path / "certificate.pdf"
    issued = main(
        ["--db", str(database), "certificate", "issue", "five-days", "--run", "20", "--laboratory", str(LABORATORY),
         "--out", str(out), "--number", "L-1", "--sign", str(keys / "laboratory.p12"),
         "--timestamp-url", f"{authority.address}/tsa", "--long-term", str(keys / "root.pem")]
    )  # fmt: skip
    assert issued == 0
    capsys.readouterr()
    verify = ["--db", str(database), "certificate", "verify", str(out)]
    assert main([*verify, "--trust", str(keys / "root.pem")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "long-term material: 3 certificates, 1 revocation lists, 1 answers (OCSP); by these alone" in said
    assert "certificate L-1 is genuine and valid" in said
    # The stamp's certificate is valid for 60 days, the signer's for 30.
    until = re.search(r"can be judged by the file alone until (\S+)", said)
    assert until is not None
    assert 58 <= (date.fromisoformat(until[1]) - date.today()).days <= 61
    assert main([*verify, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["long_term"] == {
        "certificates": 3, "revocation_lists": 1, "answers": 1, "complete": None, "why_not": "",
    }  # fmt: skip
    with Database(database) as db:
        assert remake(db, RemakeRequest("L-1")).identical


def test_the_material_belongs_to_a_signature_with_a_time_stamp(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--long-term belongs to a signature with a time stamp"):
        CertificateRequest("c", 1, laboratory=LABORATORY, long_term=tmp_path / "root.pem")
