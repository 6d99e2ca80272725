"""The digital certificate of every example that can have one, in both languages and releases, against PTB's schemas."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest
from by_path import load

import monitor.workflow.certificate.issue as issuing
from monitor.documents import from_document
from monitor.readers import read_campaign
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import CertificateRecord
from monitor.store import Database, import_campaign, load_certificate
from monitor.workflow.certificate.request import CertificateRequest

etree = pytest.importorskip("lxml.etree", reason="lxml validates XML schemas")

TESTS = Path(__file__).resolve().parents[1]
EXAMPLES = TESTS.parent / "examples"
SPACES = {"s": "https://ptb.de/si"}
schema_of = load("dcc_schemas", TESTS / "reporting" / "dcc_schemas.py").schema_of
CAMPAIGNS = (
    "five-days", "tilting-table", "hot-cold", "l-shape", "free-form-pins", "free-form-pocket", "hidden-b-indexing",
    "nothing-hidden", "tracked-robot", "steel-bar",
)  # fmt: skip


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_example_is_valid_and_read_back(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    pdf_unread: Callable[[], AbstractContextManager[None]],
) -> None:
    # Whether a result may be certified is another question than how it is written.
    monkeypatch.setattr(issuing, "accepted_grounds", lambda *_: ())
    text = (EXAMPLES / "laboratory.toml").read_text(encoding="utf-8")
    (tmp_path / "en.toml").write_text(text, encoding="utf-8")
    (tmp_path / "de.toml").write_text(text.replace('language = "en"', 'language = "de"', 1), encoding="utf-8")
    campaign = read_campaign(EXAMPLES / name)
    with Database(tmp_path / "t.duckdb", threads=1) as db, pdf_unread():
        import_campaign(db, campaign)
        for language in ("en", "de"):
            laboratory = tmp_path / f"{language}.toml"
            number = issuing.issue(
                db,
                CertificateRequest(
                    name, campaign.runs[-1].run, laboratory=laboratory, out=tmp_path, draft=True
                ),
            ).certificate.number
            record = from_document(CertificateRecord, load_certificate(db, number).record)
            assert record.language == language
            assert record.results is not None
            for release in ("3.2.1", "3.3.0"):
                tree = etree.fromstring(dcc_xml(dataclasses.replace(record, dcc_version=release)))
                schema_of(release).assertValid(tree)
                vector = tree.xpath("//s:realListXMLList/s:valueXMLList/text()", namespaces=SPACES)[-1]
                assert np.array_equal(np.array(vector.split(), float), record.results[0].estimate)
