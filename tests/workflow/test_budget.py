"""For which time an uncertainty holds, and Type B sources all the way: both routes, the answer, the certificate."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pypdf
import pytest

from monitor.discovery import fit
from monitor.exceptions import CampaignError, DataError, InputError
from monitor.methods import campaign_method
from monitor.readers import read_campaign, read_linear_axes, read_sources_file
from monitor.records import LinearAxes, LinearAxisErrors
from monitor.reporting.budget import HoldsFor, LengthKind
from monitor.reporting.budget_words import days_sentences, length_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database, load_campaign, load_certificate
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateRequest, RemakeRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.models import resolve
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.evaluation import evaluate, evaluate_fit
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.result import RunUncertainty
from monitor.workflow.uncertainty.stating import statement

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("five-days", "steel-bar", "tilting-table")
URAD = 1e-6


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    with Database(tmp_path_factory.mktemp("budget") / "budget.duckdb") as opened:
        import_folders(opened, ImportRequest([EXAMPLES / name for name in NAMES]))
        yield opened


def asked(db: Database, campaign: str, **options: object) -> RunUncertainty:
    return evaluate(db, UncertaintyRequest(campaign, method=options.pop("method", "guf"), **options))


def answered(db: Database, campaign: str, **options: object) -> UncertaintyAnswer:
    return statement(asked(db, campaign, **options))


def lines(result: RunUncertainty, name: str) -> dict[str, float]:
    """What each line adds to u of a parameter, in internal units."""
    place = result.framework.names.index(name)
    return {line.source: float(np.sqrt(line.variance[place])) for line in result.framework.budget}


@pytest.fixture(scope="module")
def of_days() -> tuple[np.ndarray, np.ndarray]:
    """EB0C (days, runs of a day) of five-days, identified in the test, and the mean of each day."""
    campaign = read_campaign(EXAMPLES / "five-days")
    identification = campaign_method(campaign).identify(campaign)
    place = identification.parameters.index("EB0C")
    values = np.array([run.estimate[place] for run in identification.runs]).reshape(5, 4)
    return values, values.mean(axis=1)


def test_over_the_campaign_u_has_the_day_component_of_the_closed_form(db, of_days):
    values, means = of_days
    within = values.var(axis=1, ddof=1).mean()
    u_day = np.sqrt(means.var(ddof=1) - within / 4)
    result = asked(db, "five-days", run=20, holds_for="campaign")
    parts = lines(result, "EB0C")
    assert parts["between days"] == pytest.approx(u_day, rel=1e-9)
    assert parts["readings"] == pytest.approx(np.sqrt(within), rel=1e-3)
    assert result.framework.u[4] == pytest.approx(np.hypot(u_day, parts["readings"]), rel=1e-9)
    (line,) = [line for line in result.framework.budget if line.source == "between days"]
    assert line.dof == 4.0
    days = statement(result).day_to_day
    assert days.u_day["EB0C"] == pytest.approx(u_day / URAD)
    assert days.spread["EB0C"] == pytest.approx(np.ptp(means) / URAD)


def test_what_is_said_without_the_option_is_what_was_said_before(db):
    """The numbers of version 0.1.0; beside them for which time they hold."""
    answer = answered(db, "five-days", run=20)
    assert answer.holds_for is HoldsFor.DAY
    assert answer.guf.u["EB0C"] == pytest.approx(1.31, abs=0.005)
    expanded = answer.guf.k_q_with_degrees_of_freedom * answer.guf.u["EB0C"]
    assert answer.guf.expanded["EB0C"] == pytest.approx(expanded)
    assert set(answer.guf.budget) == {"readings", "scale bar"}
    assert answer.sources is None
    assert answer.length.kind is LengthKind.NOT_CORRECTED
    run = answered(db, "five-days", run=20, holds_for="run")
    assert run.holds_for is HoldsFor.RUN
    assert run.guf.u["EB0C"] == pytest.approx(run.day_to_day.within_run["EB0C"], rel=0.2)
    # Twenty repeated runs are not too few: the statement was taken because the run itself was asked for.
    assert run.input_covariance.endswith("of 1 µm: an uncertainty of the run itself was asked for")


def test_lines_add_up_and_stand_in_the_order_of_their_shares(db):
    budget = answered(db, "steel-bar", holds_for="campaign").guf.budget
    shares = [max(line.values()) for line in budget.values()]
    assert shares == sorted(shares, reverse=True)
    for name in ("EA0B", "EXX"):
        assert sum(line[name] for line in budget.values()) == pytest.approx(1.0)


def test_both_routes_have_the_sources_and_the_days(db):
    """Monte Carlo draws each source by its law; the t of 9 degrees of freedom alone is wider than its u."""
    result = asked(db, "steel-bar", holds_for="campaign", method="mcm", digits=1)
    assert result.monte_carlo.u == pytest.approx(result.framework.u, rel=0.03)
    assert result.monte_carlo.correlation == pytest.approx(result.framework.correlation, abs=0.05)


def test_a_bar_that_is_warm_by_1_K_has_its_line_and_is_said_in_the_answer(db):
    result = asked(db, "steel-bar")
    for name in ("EXX", "EYY", "EZZ"):
        assert lines(result, name)["temperature of the bar"] == pytest.approx(11.5e-6 / np.sqrt(3), rel=2e-3)
    answer = statement(result)
    counted = {source.name: source.counted for source in answer.sources}
    assert len(counted) == 11
    assert [name for name, does in counted.items() if not does] == ["temperature of the bar from run to run"]
    assert answer.length.kind is LengthKind.CORRECTED
    # The sources state both, so nothing of the bar is said to be outside of u.
    assert answer.length.not_in_u == ()
    assert "no part of u" not in length_sentence(answer.length, texts_of())
    # At the time of the run nothing repeats: what changes from run to run counts too.
    run = answered(db, "steel-bar", holds_for="run")
    assert all(source.counted for source in run.sources)
    assert "temperature of the bar from run to run" in run.guf.budget


def sources_file(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "sources.toml"
    file.write_text(text)
    return file


#: What u lacks of a bar, and how the text says it.
BAR = {
    "standard_temperature": "How well the temperature of the bar is known is no part of u",
    "standard_expansion": "How well the expansion coefficient of the bar is known is no part of u",
}

BENDING = '[[sources]]\nname = "stylus"\nquantity = "stylus_bending"\nstandard_uncertainty_um = 1.0\n'


def test_a_file_of_sources_counts_beside_those_of_the_campaign_and_none_twice(db, tmp_path):
    further = read_sources_file(sources_file(tmp_path, BENDING))
    with pytest.raises(InputError, match="'stylus' is a source of campaign steel-bar already"):
        asked(db, "steel-bar", sources=further)
    answer = answered(db, "tilting-table", sources=further)
    assert "stylus" in answer.guf.budget
    axes = LinearAxes({"X": LinearAxisErrors(positioning=1e-3)}, (20.0, 50.0))
    straight = BENDING.replace("stylus_bending", "linear_straightness").replace("stylus", "X") + (
        'axis = "X"\nnode_spacing_mm = [20, 50]\n'
    )
    with pytest.raises(InputError, match="errors of X stand in --linear-axes and among the sources"):
        asked(
            db, "tilting-table", sources=read_sources_file(sources_file(tmp_path, straight)), linear_axes=axes
        )
    both = asked(
        db, "tilting-table", sources=further, linear_axes=read_linear_axes(EXAMPLES / "linear-axes.toml")
    )
    assert {"stylus", "squareness Z to Y"} <= set(lines(both, "EX0A"))


@pytest.mark.parametrize(
    ("campaign", "holds_for", "match"),
    [
        ("tilting-table", "campaign", "4 runs of one plan are too few; at least 9 on three days"),
        ("tilting-table", "day", r"leave 3 degrees of freedom within days; at least 8 are needed \(write"),
    ],
)
def test_what_so_few_runs_cannot_say_is_refused(db, campaign, holds_for, match):
    with pytest.raises(DataError, match=match):
        asked(db, campaign, holds_for=holds_for)


def test_one_day_and_two_days_of_many_runs(db):
    whole = load_campaign(db, "five-days")
    for days, word, match in (
        (1, "one day", "1 day of repeated runs say nothing"),
        (2, "two days", "2 days of repeated runs say too little"),
    ):
        # Ten runs of the first days, given out to so many days.
        runs = tuple(replace(run, day=index % days + 1) for index, run in enumerate(whole.runs[:12]))
        rows = np.isin(whole.probings.run, [run.run for run in runs])
        part = replace(whole, runs=runs, probings=whole.probings.rows(rows))
        fitted = fit(campaign_method(part).problem_of(part))
        model = resolve(db, None, "samba")
        answer = statement(evaluate_fit(part, model, fitted, UncertaintyRequest("five-days", method="guf")))
        assert answer.day_to_day.not_known == word
        with pytest.raises(DataError, match=match):
            evaluate_fit(
                part, model, fitted, UncertaintyRequest("five-days", method="guf", holds_for="campaign")
            )


def test_another_word_is_refused():
    with pytest.raises(InputError, match="--holds-for week: choose run, day or campaign"):
        UncertaintyRequest("five-days", holds_for="week")


def test_a_campaign_whose_source_does_not_fit_is_refused_with_its_line(tmp_path):
    folder = tmp_path / "tilting-table"
    shutil.copytree(EXAMPLES / "tilting-table", folder)
    text = (folder / "campaign.toml").read_text()
    wrong = BENDING.replace("stylus_bending", "ball_form")
    (folder / "campaign.toml").write_text(f"{text}\n{wrong}")
    line = len(text.splitlines()) + 2
    with (
        Database(tmp_path / "new.duckdb") as db,
        pytest.raises(
            CampaignError, match=f"line {line}, .*no ball is touched in this campaign; leave it out"
        ),
    ):
        import_folders(db, ImportRequest([folder]))


def test_a_stored_campaign_has_its_sources_again(db):
    assert load_campaign(db, "steel-bar").sources == read_campaign(EXAMPLES / "steel-bar").sources


def pages(db: Database, number: str) -> str:
    reader = pypdf.PdfReader(io.BytesIO(load_certificate(db, number).pdf))
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def issued(db: Database, tmp_path: Path, campaign: str, run: int, laboratory: str, **options: object) -> str:
    """What the pages of a new certificate say."""
    number = f"B-{campaign}"
    issue(
        db,
        CertificateRequest(
            campaign, run, laboratory=EXAMPLES / laboratory, out=tmp_path, number=number,
            issued_on=date(2026, 3, 12), **options,
        ),
    )  # fmt: skip
    return pages(db, number)


def test_the_certificate_says_that_day_means_span_more_than_u(db, tmp_path):
    text = issued(db, tmp_path, "five-days", 20, "laboratory.toml")
    expanded = answered(db, "five-days", run=20).guf.expanded["EB0C"]
    for phrase in (
        "The uncertainty holds within a day",
        f"EB0C (16.4 µrad, U = {expanded:.1f} µrad)",
        "on another day these may lie outside of estimate ± U",
        "Uncertainty budget, as found",
        "they are not referred to 20 °C",
        "between runs of a day, between days",
    ):
        assert phrase in text


def test_it_is_said_in_german_too(db):
    answer, texts = answered(db, "five-days", run=20), texts_of("de")
    said = " ".join(days_sentences(HoldsFor.DAY, answer.day_to_day, answer.guf.expanded, answer.units, texts))
    assert "Die Messunsicherheit gilt innerhalb eines Tages" in said
    expanded = f"{answer.guf.expanded['EB0C']:.1f}".replace(".", ",")
    assert f"EB0C (16,4 µrad, U = {expanded} µrad)" in said
    assert "sie sind nicht auf 20 °C bezogen" in length_sentence(answer.length, texts)


def test_what_no_source_states_of_the_bar_is_said_with_its_size(db):
    """11.5 µm/m a kelvin of steel, and 7 K from 20 °C times 1e-6/K; words alone where nothing was corrected."""
    said = length_sentence(answered(db, "five-days", run=20).length, texts_of())
    assert re.search(r"without a correction for its temperature \(ambient_degC: \d+\.\d+ °C\)", said)
    assert "The temperature of the bar is no part of u, because no source states it" in said
    steel = replace(
        answered(db, "steel-bar").length, temperature=27.0, columns=("bar_degC",), not_in_u=tuple(BAR)
    )
    both = length_sentence(steel, texts_of())
    assert "corrected from 20 °C to 27 °C, recorded as bar_degC, with 11.5" in both
    assert "1 K changes every gain by 11.5 µm/m, 10⁻⁶/K by 7 µm/m" in both
    for quantity, phrase in BAR.items():
        assert phrase in length_sentence(replace(steel, not_in_u=(quantity,)), texts_of())
    cold = replace(steel, temperature=20.0, not_in_u=("standard_expansion",))
    assert "no part of u" not in length_sentence(cold, texts_of())
    assert "10⁻⁶/K um 7 µm/m" in length_sentence(steel, texts_of("de"))
    # Of a certificate of before nothing was recorded, and its sentence stays as it was.
    before = replace(steel, columns=None, not_in_u=None)
    assert "corrected from 20 °C to 27 °C with 11.5" in length_sentence(before, texts_of())
    assert "no part of u" not in length_sentence(before, texts_of())


@pytest.mark.slow
def test_a_german_certificate_over_the_campaign_has_every_source_and_is_made_again(db, tmp_path):
    text = issued(db, tmp_path, "steel-bar", 20, "laboratory-de.toml", holds_for="campaign")
    assert remake(db, RemakeRequest("B-steel-bar")).identical is True
    # Words are hyphenated at the ends of lines.
    text = text.replace("\N{HYPHEN} ", "").replace("- ", "")
    assert "Die Messunsicherheit gilt über die Messreihe" in text
    for source in read_campaign(EXAMPLES / "steel-bar").sources:
        assert source.name in text
    assert "± 1 K, rechteckverteilt, gleich in allen Läufen" in text
    assert "Die Länge des Maßstabs wurde mit 11,5 · 10⁻⁶/K von 20 °C auf 22,27 °C umgerechnet" in text
