"""A certificate from a stored result: the same to the last byte as without one, and only from what belongs to it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import numpy as np
import pypdf
import pytest

from monitor.documents import to_document
from monitor.exceptions import StoreError
from monitor.readers import read_campaign, read_linear_axes
from monitor.records import AuditAnchor
from monitor.store import Database, import_campaign, load_analysis, load_campaign, load_certificate
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.models import resolve
from monitor.workflow.uncertainty.evaluation import evaluate, uncertainty
from monitor.workflow.uncertainty.request import Asked, UncertaintyRequest
from monitor.workflow.uncertainty.result import RunUncertainty
from monitor.workflow.uncertainty.stored import StatedUncertainty, restored, stored_uncertainty

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
DAY = date(2026, 3, 12)


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path / "c.duckdb", threads=1) as opened:
        for name in ("five-days", "tilting-table"):
            import_campaign(opened, read_campaign(EXAMPLES / name))
        yield opened


def pages_and_files(file: str) -> tuple[list[bytes], dict[str, bytes]]:
    """The drawn pages and the attached files, of these the parts that name no stored result."""
    reader = pypdf.PdfReader(file)
    pages = [page.get_contents() for page in reader.pages]
    files = {name: content[0] for name, content in reader.attachments.items()}
    whole = json.loads(files["certificate.json"])
    assert whole["inputs"].pop("stored_result", "missing") != "missing"
    files["certificate.json"] = json.dumps(whole).encode()
    return [b"" if page is None else page.get_data() for page in pages], files


@pytest.mark.parametrize(
    "wishes", [pytest.param({}, marks=pytest.mark.slow), {"with_map": True}], ids=["plain", "map"]
)
def test_from_a_stored_result_it_is_the_same_as_evaluated_for_it(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wishes: dict[str, bool]
) -> None:
    # The second one would state a later entry of the audit.
    monkeypatch.setattr(
        "monitor.workflow.certificate.issue.last_anchor", lambda db: AuditAnchor(7, "ab" * 32)
    )
    fresh = issue(
        db,
        CertificateRequest(
            "five-days",
            20,
            laboratory=LABORATORY,
            out=tmp_path / "fresh.pdf",
            number="N-1",
            draft=True,
            issued_on=DAY,
            **wishes,
        ),
    )
    assert load_certificate(db, "N-1").record["inputs"]["stored_result"] is None
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    number = load_analysis(db, "uncertainty", campaign="five-days", run=20).number

    def never(*_: object, **__: object) -> RunUncertainty:
        raise AssertionError("the stored result was not taken")

    monkeypatch.setattr("monitor.workflow.uncertainty.evaluation.evaluate", never)
    stored = issue(
        db,
        CertificateRequest(
            "five-days",
            20,
            laboratory=LABORATORY,
            out=tmp_path / "stored.pdf",
            number="N-1",
            draft=True,
            issued_on=DAY,
            **wishes,
        ),
    )
    assert load_certificate(db, "N-1").record["inputs"]["stored_result"] == number
    assert pages_and_files(stored.file) == pages_and_files(fresh.file)


def test_what_is_stated_is_what_was_evaluated(db: Database) -> None:
    found = evaluate(db, UncertaintyRequest("five-days", 20, method="guf"))
    kept = uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    stated = StatedUncertainty(
        found.campaign, found.model, restored(json.loads(json.dumps(to_document(kept))))
    )
    guf = found.framework
    factor = np.array([unit.factor for unit in found.units])
    assert stated.names == guf.names
    np.testing.assert_allclose(stated.estimate * factor, guf.estimate, rtol=1e-14)
    np.testing.assert_allclose(stated.covariance * np.outer(factor, factor), guf.covariance, rtol=1e-13)
    assert (stated.k_p, stated.k_q, stated.answer.guf.rank, stated.dof) == (
        guf.k_p,
        guf.k_q,
        guf.rank,
        guf.dof,
    )
    assert stated.fewest_dof == float(np.min(guf.dof_by_output))
    assert tuple(stated.answer.guf.budget) == tuple(line.source for line in guf.budget)


def test_a_result_that_was_asked_for_something_else_is_not_taken(db: Database, tmp_path: Path) -> None:
    campaign, model = load_campaign(db, "five-days"), resolve(db, None, "samba")
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf", p=0.9))
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf", model_uncertainty=False))
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf", select="five-days"))
    uncertainty(db, UncertaintyRequest("five-days", 19, method="guf"))
    assert stored_uncertainty(db, campaign, 20, model) is None
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    right = load_analysis(db, "uncertainty", campaign="five-days", run=20).number
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf", p=0.99))
    found = stored_uncertainty(db, campaign, 20, model)
    assert found is not None
    assert (found.number, found.answer.p) == (right, 0.95)
    # Errors of the linear axes belong to the question: others than the stored ones are another question.
    turned, rotary = load_campaign(db, "tilting-table"), resolve(db, None, "rotary-probing")
    axes = read_linear_axes(EXAMPLES / "linear-axes.toml")
    uncertainty(db, UncertaintyRequest("tilting-table", 4, method="guf", linear_axes=axes))
    assert stored_uncertainty(db, turned, 4, rotary) is None
    assert stored_uncertainty(db, turned, 4, rotary, Asked(linear_axes=axes)) is not None


def test_a_result_of_another_version_or_an_altered_one_is_no_source(db: Database, tmp_path: Path) -> None:
    campaign, model = load_campaign(db, "five-days"), resolve(db, None, "samba")
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    document = load_analysis(db, "uncertainty", campaign="five-days", run=20).document
    altered = json.loads(json.dumps(document))
    altered["guf"]["estimate"]["EA0B"] += 1.0
    db.execute("UPDATE analysis SET document = ? WHERE kind = 'uncertainty'", [json.dumps(altered)])
    with pytest.raises(StoreError, match=r"stored result \d+ was altered after it was stored"):
        issue(db, CertificateRequest("five-days", 20, laboratory=LABORATORY, out=tmp_path, issued_on=DAY))
    db.execute("UPDATE analysis SET software_version = '0.0.1' WHERE kind = 'uncertainty'")
    assert stored_uncertainty(db, campaign, 20, model) is None


def test_a_certificate_of_a_stored_result_loads_no_solver_and_no_compiler(
    db: Database, tmp_path: Path
) -> None:
    """What takes a second to load, and would be loaded unseen by one import at the top of a file."""
    uncertainty(db, UncertaintyRequest("five-days", 20, method="guf"))
    path = db.path
    db.close()
    script = (
        "import sys\n"
        "from monitor.cli import main\n"
        f"assert main(['--db', {path!r}, 'certificate', 'issue', 'five-days', '--run', '20', '--draft', "
        f"'--laboratory', {str(LABORATORY)!r}, '--out', {str(tmp_path / 'x.pdf')!r}]) == 0\n"
        "heavy = ('scipy.special', 'scipy.linalg', 'scipy.stats', 'scipy.optimize', 'numba', 'matplotlib', "
        "'statsmodels', 'monitor.discovery', 'monitor.statistics', 'monitor.uncertainty')\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
