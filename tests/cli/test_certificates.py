"""Certificates as a user types them: issued, shown, verified; what is missing is told."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path
from typing import Any

import pypdf
import pytest
from by_path import simulator

from monitor.store import Database

THIRTEEN = list(simulator().SAMBA_PARAMETERS)
# ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1: what only a laboratory can say.
STATED_BY_THE_LABORATORY = (
    "7.8.2.1 a", "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 e", "7.8.2.1 f", "7.8.2.1 g", "7.8.2.1 h", "7.8.2.1 k", "7.8.2.1 l",
    "7.8.2.1 n", "7.8.2.1 o", "7.8.2.1 p", "7.8.2.1 note", "7.8.4.1 c", "7.8.4.1 d", "7.8.4.1 e", "7.8.4.1 f",
)  # fmt: skip


def text_of(file: Path) -> str:
    return "\n".join(page.extract_text() for page in pypdf.PdfReader(file).pages)


def test_three_pages_with_the_thirteen_parameters_and_their_uncertainties(issued_once: Any) -> None:
    file = issued_once.file("2026-0001")
    assert len(pypdf.PdfReader(file).pages) == 3
    text = text_of(file)
    assert "No. 2026-0001, issued on 2026-03-10" in text
    for name in THIRTEEN:
        assert re.search(
            rf"^{name} .* −?\d+(\.\d+)? \d+(\.\d+)? \d+(\.\d+)? µ(m|rad|m/m)$", text, re.MULTILINE
        ), name
    assert "13 intervals estimate ± U hold all at once" in text
    assert "No result for" not in text


def test_cold_cold_shows_eleven_and_names_the_two_refused_without_numbers(issued_once: Any) -> None:
    file = issued_once.file("2026-0003")
    assert len(pypdf.PdfReader(file).pages) == 3
    text = text_of(file)
    for name in THIRTEEN:
        row = re.search(rf"^{name} .* µ(m|rad|m/m)$", text, re.MULTILINE)
        if name.endswith("C1"):
            assert row is None
            assert re.search(rf"No result for {name}: with this plan {name} cannot be told apart", text)
        else:
            assert row is not None
    assert "11 intervals estimate ± U hold all at once" in text


def test_show_one_and_all(typed: Any, issued_once: Any) -> None:
    found = typed("certificate", "show", "--json", db=issued_once.db).document["certificates"]
    assert [(one["number"], one["state"], one["campaign"], one["runs"]) for one in found] == [
        ("2026-0001", "issued", "five-days", [20]),
        ("2026-0002", "issued", "five-days", [19]),
        ("2026-0003", "issued", "cold-cold", [3]),
    ]
    one = typed("certificate", "show", "2026-0001", "--json", db=issued_once.db).document
    assert one["record"]["number"] == "2026-0001"
    assert {"sha256", "software_version", "reason", "replaced_by"} <= set(one)
    table = typed("certificate", "show", db=issued_once.db).out.splitlines()
    assert len(table) == 4
    assert "record" not in typed("certificate", "show", "2026-0001", db=issued_once.db).out


def test_a_certificate_that_nobody_signed_is_not_called_genuine(
    typed: Any, issued_once: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    renamed = tmp_path / "it's renamed [1].pdf"
    shutil.copyfile(issued_once.file("2026-0001"), renamed)
    answer = typed("certificate", "verify", renamed, "--json", db=issued_once.db)
    assert answer.status == 0
    assert answer.document["number"] == "2026-0001"
    assert answer.document["ok"] is True
    assert set(answer.document["checks"]) == {"hash", "chain", "signature", "database"}
    # Nobody signed it: that the record matches says nothing against somebody who may write the database.
    assert answer.document["verdict"] == "not signed"
    said = typed("certificate", "verify", renamed, db=issued_once.db).out
    assert said.endswith("certificate 2026-0001 matches this database's record and is in force; not signed\n")
    assert "genuine" not in said
    # Who names trusted signers asks for a signature: leaving it out is no way around.
    Path("signers.txt").write_text("ab" * 32 + "\n")
    Path("trusting.toml").write_text('trusted_signers = "signers.txt"\n')
    monkeypatch.setenv("MONITOR_CONFIG", "trusting.toml")
    asked = typed("certificate", "verify", renamed, db=issued_once.db)
    assert asked.status == 1
    assert "the file is not signed, and who names trusted signers asks for a signature" in asked.out
    assert asked.out.endswith("certificate 2026-0001 is NOT confirmed\n")
    Path("signers.txt").write_text("somebody\n")
    refused = typed("verify", "--recompute", 0, db=issued_once.db)
    assert refused.status == 2  # a file that names nobody is no answer to who is trusted
    assert "signers.txt holds no certificates" in refused.err


def test_one_altered_byte_anywhere_is_found(typed: Any, issued_once: Any, tmp_path: Path) -> None:
    genuine = issued_once.file("2026-0001").read_bytes()
    rng = random.Random(20260310)
    for place in [0, len(genuine) - 1, *(rng.randrange(len(genuine)) for _ in range(8))]:
        altered = bytearray(genuine)
        altered[place] ^= 1 << rng.randrange(8)
        file = tmp_path / "altered.pdf"
        file.write_bytes(altered)
        answer = typed("certificate", "verify", file, "--json", db=issued_once.db)
        assert answer.status == 1
        assert (answer.document["ok"], answer.document["number"]) == (False, None)
        assert answer.document["checks"]["hash"] is False
    said = typed("certificate", "verify", tmp_path / "altered.pdf", db=issued_once.db)
    assert said.status == 1
    assert "no certificate of this database has the content of altered.pdf" in said.out
    assert said.out.endswith("altered.pdf is NOT confirmed\n")


@pytest.mark.parametrize("content", [b"", b"%PDF-1.7\n", bytes(100000)], ids=["empty", "head", "zeros"])
def test_what_never_was_a_certificate(typed: Any, issued_once: Any, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.pdf").write_bytes(content)
    assert typed("certificate", "verify", tmp_path / "x.pdf", db=issued_once.db).status == 1


def test_a_certificate_of_another_database(typed: Any, issued_once: Any, filled: Path) -> None:
    assert typed("certificate", "verify", issued_once.file("2026-0001"), db=filled).status == 1


def test_an_altered_database_confirms_nothing(typed: Any, issued: Any) -> None:
    with Database(issued.db) as opened:
        opened.execute("UPDATE certificate SET state = 'withdrawn' WHERE number = '2026-0002'")
    found = typed("certificate", "verify", issued.file("2026-0001"), "--json", db=issued.db)
    assert found.status == 1
    assert found.document["checks"]["chain"] is False
    assert typed("verify", db=issued.db).status == 1


def test_iso_17025_7_8_everything_that_a_laboratory_leaves_open_is_told_at_once(typed: Any, db: Path) -> None:
    Path("empty.toml").touch()
    answer = typed("certificate", "issue", "cold-cold", "--run", 3, "--laboratory", "empty.toml", db=db)
    assert (answer.status, answer.out) == (2, "")
    items = re.findall(r"^  .*\(ISO/IEC 17025:2017, (.*)\)$", answer.err, re.MULTILINE)
    assert set(items) == set(STATED_BY_THE_LABORATORY)
    assert f"{len(items)} items are missing" in answer.err
    assert typed("certificate", "show", db=db).out == "no certificate was made yet\n"


def test_an_unknown_key_of_the_laboratory_is_refused(typed: Any, db: Path, laboratory: Path) -> None:
    text = laboratory.read_text()
    for broken, words in (
        (text + "\n[extra]\nx = 1\n", "there is no section [extra]"),
        ("[laboratory]\nname = 3\n", "laboratory"),
        (text.encode("utf-16").decode("latin-1"), "x.toml"),
    ):
        Path("x.toml").write_text(broken, encoding="utf-8")
        answer = typed("certificate", "issue", "cold-cold", "--run", 3, "--laboratory", "x.toml", db=db)
        assert (answer.status, answer.out) == (2, "")
        assert words in answer.err
    Path("x.toml").write_bytes(b"\xff\xfe\x00")
    assert typed("certificate", "issue", "cold-cold", "--run", 3, "--laboratory", "x.toml", db=db).status == 2


@pytest.mark.parametrize("content", [None, ""])
def test_signers_that_cannot_be_read_are_refused_though_nothing_is_signed(
    typed: Any, db: Path, content: str | None
) -> None:
    if content is not None:
        Path("signers.pem").write_text(content, encoding="utf-8")
    answer = typed("verify", "--recompute", 0, "--trust", "signers.pem", db=db)
    assert answer.status == 2
    assert "signers.pem cannot be read" in answer.err or "signers.pem holds no certificates" in answer.err
