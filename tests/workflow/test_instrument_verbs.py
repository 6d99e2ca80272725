"""What every method answers, of a machine that several instruments measured: uncertainty, certificate."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.chain.likeness import Likeness
from monitor.readers import read_campaign
from monitor.records import Campaign, Probings
from monitor.reporting.certificate.completeness import IncompleteCertificateError
from monitor.reporting.covariance_source import CovarianceKind
from monitor.reporting.texts import texts_of
from monitor.store import Database, import_campaign, load_certificate
from monitor.uncertainty import measured_run
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import CertificateRequest
from monitor.workflow.certificate.taken_as_stated import known_scale_sentence, tool_point_sentence
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("verbs") / "shop.duckdb") as db:
        import_campaign(db, read_campaign(EXAMPLES / "r-test"))
        import_campaign(db, read_campaign(EXAMPLES / "four-instruments"))
        import_campaign(db, _twice(read_campaign(EXAMPLES / "four-instruments"), "nest-and-dial"))
        yield db


def _twice(pattern: Campaign, name: str) -> Campaign:
    """Two runs of the readings of the R-test (0.5 µm) and of the dial (1 µm), each with noise of its own."""
    ids = [setup.id for setup in pattern.artefact.setups]
    wanted = [ids.index(setup) + 1.0 for setup in ("r-test", "square")]
    rows = np.flatnonzero(np.isin(pattern.probings.channels["setup"], wanted))
    single = pattern.probings.rows(rows)

    def both(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, values])

    probings = Probings(
        np.repeat([1, 2], len(rows)), both(single.sequence), both(single.time), both(single.target),
        {axis: both(values) for axis, values in single.readings.items()},
        {channel: both(values) for channel, values in single.channels.items()},
    )  # fmt: skip
    first = pattern.runs[0]
    runs = (first, replace(first, run=2))
    campaign = replace(pattern, name=name, runs=runs, probings=probings, files=())
    likeness = Likeness(campaign, campaign_method(campaign))
    return likeness.campaign_with(likeness.solution.local, np.random.default_rng(4))


def test_the_inputs_are_the_numbers_that_were_read() -> None:
    """Rows of a bar have one number, those of an R-test three: nothing else is an input of the uncertainty."""
    campaign = read_campaign(EXAMPLES / "four-instruments")
    problem = campaign_method(campaign).problem_of(campaign)
    run = measured_run(problem, 1)
    vectors = int(np.sum(campaign.probings.channels["setup"] == 7.0))
    assert vectors == 25
    assert len(run.reading_names) == len(campaign.probings) + 2 * vectors
    assert len(run.inputs) == len(run.input_names) == len(run.stated) + len(run.calibrated[0])
    assert np.all(run.stated > 0.0)


def test_each_reading_keeps_what_its_setup_states(db: Database) -> None:
    """Two runs repeat within what is stated, so u is that of the identification (by QR); it was twice as large where
    the repeatability of all readings was held against the best instrument."""
    answer = uncertainty(db, UncertaintyRequest("nest-and-dial", 1, method="guf", model_uncertainty=False))
    source = answer.input_covariance_source
    assert source.kind in (CovarianceKind.STATED_BY_SETUPS, CovarianceKind.REPEATABILITY_OF_SETUPS)
    times = source.times or 1.0
    assert 1.0 <= times < 1.3
    campaign = _twice(read_campaign(EXAMPLES / "four-instruments"), "nest-and-dial")
    method = campaign_method(campaign)
    problem = method.problem_of(campaign)
    run = method.identify(campaign, solve=lambda problem: fit(problem).solution).runs[0]
    by_name = dict(zip(problem.base_names, np.sqrt(np.diag(run.covariance)), strict=True))
    for name, u in answer.guf.u.items():
        assert u == pytest.approx(times * problem.base_units[name].to_display(by_name[name]), rel=1e-3)


def test_both_routes_agree(db: Database) -> None:
    answer = uncertainty(db, UncertaintyRequest("r-test", 1, method="both", model_uncertainty=False))
    assert answer.validation is not None
    assert answer.mcm is not None
    for name, u in answer.guf.u.items():
        assert answer.mcm.u[name] == pytest.approx(u, rel=0.03)


def test_a_certificate_names_every_instrument(
    db: Database, tmp_path: Path, pdf_unread: Callable[[], AbstractContextManager[None]]
) -> None:
    """ISO/IEC 17025:2017, 7.8.4.1 c: the standards that carry the traceability, each with its certificate."""
    stated = tmp_path / "laboratory.toml"
    text = re.sub("\ninstruments = .*", "", LABORATORY.read_text(encoding="utf-8"))
    stated.write_text(text, encoding="utf-8")
    with pytest.raises(
        IncompleteCertificateError, match=r"instrument R-test \(r-test\).*traceability\] instruments"
    ):
        issue(db, CertificateRequest("r-test", laboratory=stated, out=tmp_path, draft=True))
    stated.write_text(text.replace("\nprobe =", '\ninstruments = "R 17"\nprobe ='), encoding="utf-8")
    with pdf_unread():
        answer = issue(db, CertificateRequest("r-test", laboratory=stated, out=tmp_path, draft=True))
    document = load_certificate(db, answer.certificate.number).record
    assert [entry["name"] for entry in document["references"]] == ["instrument R-test (r-test)"]
    assert document["references"][0]["certificate"] == "R 17"
    residuals = document["results"][0]["residuals"]
    assert (residuals["by"], residuals["probe_um"], residuals["labels"]) == ("setup", None, ["r-test"])
    conditions = {entry["name"]: entry["value"] for entry in document["conditions"]}
    assert conditions["plan"] == "25 readings of 1 setups of instruments"
    assert "artefact" not in conditions


@pytest.mark.slow
def test_the_examples_with_lasers_reach_a_certificate(
    tmp_path: Path, pdf_unread: Callable[[], AbstractContextManager[None]]
) -> None:
    """Their scales are stated: no ground speaks against them, and the scale is a line of what is calibrated."""
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, read_campaign(EXAMPLES / "laser"))
        with pdf_unread():
            issued = issue(db, CertificateRequest("laser", laboratory=LABORATORY, out=tmp_path, draft=True))
        u = uncertainty(db, UncertaintyRequest("laser", 1, method="guf")).guf.u
        assert load_certificate(db, issued.certificate.number).record["references"]
    assert u["EXX"] == pytest.approx(np.hypot(0.5, 0.18), rel=0.15)


def test_a_certificate_of_the_campaign_comes_first(
    db: Database, tmp_path: Path, pdf_unread: Callable[[], AbstractContextManager[None]]
) -> None:
    folder = tmp_path / "named"
    folder.mkdir()
    for file in ("campaign.toml", "runs.csv", "probings.csv"):
        text = (EXAMPLES / "r-test" / file).read_text(encoding="utf-8")
        text = text.replace('campaign = "r-test"', 'campaign = "named"')
        (folder / file).write_text(
            text.replace('reading = "vector"', 'reading = "vector"\ncertificate = "4711"'), encoding="utf-8"
        )
    import_campaign(db, read_campaign(folder))
    with pdf_unread():
        answer = issue(db, CertificateRequest("named", laboratory=LABORATORY, out=tmp_path, draft=True))
    document = load_certificate(db, answer.certificate.number).record
    assert document["references"][0]["certificate"] == "4711"


def test_places_that_count_from_a_stated_tool_point_are_told(db: Database) -> None:
    """A sphere that goes round with C tells where C is by the stated tool point; a dial on Z tells nothing of it."""
    campaign = read_campaign(EXAMPLES / "four-instruments")
    # The example states the scale of its laser: the tool point of the R-test alone is taken as stated.
    (stated,) = identify(db, IdentifyRequest("four-instruments")).as_stated or ()
    assert (stated.name, dict(stated.moved)) == ("R-test", {"x": ("EX0C",), "y": ("EY0C",)})
    sentence = tool_point_sentence(campaign, ("EX0C", "EY0C", "EC0X"), texts_of("en"))
    assert sentence is not None
    assert sentence.startswith("EX0C, EY0C count from the tool points as stated (R-test), whose uncertainty")
    known = tuple(replace(setup, tool_point_uncertainty=0.002) for setup in campaign.artefact.setups)
    sure = replace(campaign, artefact=replace(campaign.artefact, setups=known))
    assert tool_point_sentence(sure, ("EX0C", "EY0C", "EC0X"), texts_of("en")) is None
    assert tool_point_sentence(campaign, ("EC0X", "EXX"), texts_of("en")) is None


def test_a_scale_that_nobody_states_is_told() -> None:
    campaign = read_campaign(EXAMPLES / "four-instruments")
    silent = tuple(replace(setup, scale_uncertainty=None) for setup in campaign.artefact.setups)
    campaign = replace(campaign, artefact=replace(campaign.artefact, setups=silent))
    _, scale = campaign_method(campaign).identify(campaign).as_stated
    assert (scale.name, dict(scale.moved)) == ("laser interferometer", {"scale": ("EXX", "EYY", "EZZ")})


def test_a_scale_that_is_stated_as_known_is_printed() -> None:
    campaign = read_campaign(EXAMPLES / "laser")
    assert known_scale_sentence(campaign, texts_of("en")) is None
    setups = tuple(replace(setup, known=("scale",)) for setup in campaign.artefact.setups)
    exact = replace(campaign, artefact=replace(campaign.artefact, setups=setups))
    assert known_scale_sentence(exact, texts_of("en")) == (
        "The scale of laser interferometer is taken as exact, as campaign.toml states it; u holds no part for it"
    )
    german = known_scale_sentence(exact, texts_of("de"))
    assert german is not None
    assert german.startswith("Die Skale von laser interferometer gilt als fehlerfrei")
