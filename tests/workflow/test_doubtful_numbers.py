"""Numbers that must not be signed: another machine's readings, and a model that does not fit a single run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError, InputError
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import GroundKind
from monitor.store import Database, import_campaign
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.model.change import add_effect, version_with
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"


def first_runs(name: str, count: int) -> Campaign:
    campaign = read_campaign(EXAMPLES / name)
    kept = tuple(run for run in campaign.runs if run.run <= count)
    return replace(campaign, runs=kept, probings=campaign.probings.rows(campaign.probings.run <= count))


def test_swapped_columns_are_refused_by_every_step_and_get_no_certificate(tmp_path: Path) -> None:
    campaign = first_runs("five-days", 3)
    readings = dict(campaign.probings.readings)
    readings["X"], readings["Y"] = readings["Y"], readings["X"]
    swapped = replace(campaign, probings=replace(campaign.probings, readings=readings))
    with Database(tmp_path / "x.duckdb") as db:
        import_campaign(db, swapped)
        with pytest.raises(DataError, match=r"no error of a machine|did not converge"):
            evaluate(db, UncertaintyRequest("five-days", 1, method="guf"))
        with pytest.raises(DataError, match=r"no error of a machine|did not converge"):
            compare(db, CompareRequest("five-days"))
        with pytest.raises(DataError, match=r"no error of a machine|did not converge"):
            issue(db, CertificateRequest("five-days", 1, laboratory=LABORATORY, out=tmp_path))
    assert list(tmp_path.glob("*.pdf")) == []


def test_a_single_run_with_a_hidden_effect_counts_it_in_the_uncertainty(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb") as db:
        import_campaign(db, first_runs("hidden-reversal-x", 1))
        plain = evaluate(
            db, UncertaintyRequest("hidden-reversal-x", 1, method="guf", model_uncertainty=False)
        )
        counted = evaluate(db, UncertaintyRequest("hidden-reversal-x", 1, method="guf"))
        add_effect(db, AddEffectRequest("EXX:reversal", "samba", "with-reversal"))
        right = evaluate(db, UncertaintyRequest("hidden-reversal-x", 1, method="guf", model="with-reversal"))
    assert "lack of fit of the model" in {line.source for line in counted.framework.budget}
    assert right.framework.names == (*counted.framework.names, "EXX:reversal")
    apart = np.abs(counted.framework.estimate - right.framework.estimate[:-1])
    assert np.max(apart / plain.framework.u) > 5.0
    assert np.max(apart / counted.framework.u) < 3.0


def test_a_certificate_says_how_the_model_fits(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb") as db:
        import_campaign(db, first_runs("hidden-reversal-x", 1))
        why = {GroundKind.LACK_OF_FIT: "play of X known to the customer"}
        request = CertificateRequest("hidden-reversal-x", 1, laboratory=LABORATORY, out=tmp_path, accept=why)
        found = issue(db, request)
    text = "".join((page.extract_text() or "") for page in _pages(Path(found.file)))
    assert "the model leaves 1.57" in " ".join(text.split())
    # The sentence goes on over the end of the page.
    assert "refuted at 5 %, and what its lack of fit may do to the parameters is part of u" in " ".join(
        text.split()
    )
    assert "Accepted by the laboratory: play of X known to the customer" in " ".join(text.split())


def _pages(path: Path) -> list[object]:
    from pypdf import PdfReader

    return list(PdfReader(path).pages)


def test_a_name_in_use_is_no_name_for_a_model_with_another_parent(tmp_path: Path) -> None:
    with Database(tmp_path / "x.duckdb") as db:
        import_campaign(db, first_runs("five-days", 1))
        version_with(db, AddEffectRequest("EXX:reversal", "samba", "mine"))
        with pytest.raises(InputError, match="there is a model mine already: add to it with --to mine"):
            version_with(db, AddEffectRequest("EYY:reversal", "samba", "mine"))
        version = version_with(db, AddEffectRequest("EYY:reversal", "mine"))
        assert version.effects == ("EXX:reversal", "EYY:reversal")
