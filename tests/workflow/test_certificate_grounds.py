"""A certificate is refused on grounds that nobody answers for; those that are accepted are printed with the reason."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from datetime import date
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pypdf
import pytest

from monitor.cli import main
from monitor.documents import from_document, to_document
from monitor.exceptions import DataError, InputError, RefusedResultError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import doubts, read_campaign
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import Ground, GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database, StoredModel, import_campaign, load_campaign, load_certificate
from monitor.uncertainty.coverage_regions.coverage import ellipsoid_factor
from monitor.workflow.certificate.grounds import accepted_grounds, grounds_against
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.remaking import remake
from monitor.workflow.certificate.request import CertificateRequest, RemakeRequest
from monitor.workflow.certificate.results import _lacking
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.likeness import LikeRequest, simulate_like
from monitor.workflow.models import resolve
from monitor.workflow.simulation import SimulateRequest, simulate
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.grounds import LARGEST_GAIN, MOST_TIMES, _units
from monitor.workflow.uncertainty.lack_in_budget import lack_in_budget
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stored import stored_uncertainty

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
DAY = date(2026, 3, 12)
WHY = "Kugelstab nachgemessen & in Ordnung"


@pytest.fixture(scope="module")
def five_days() -> Campaign:
    campaign = read_campaign(EXAMPLES / "five-days")
    assert isinstance(campaign, Campaign)
    return campaign


@cache
def plain_model(method: str) -> StoredModel:
    """The model that a method has of itself; every database has it."""
    with Database(":memory:") as db:
        return resolve(db, None, method)


def grounds(campaign: Campaign, run: int = 20):
    return grounds_against(campaign, plain_model(campaign.method), {run: None})


def with_bar(campaign: Campaign, more_mm: float) -> Campaign:
    bar = campaign.artefact.scale_bar
    longer = replace(bar, length=bar.length + more_mm)
    return replace(campaign, artefact=replace(campaign.artefact, scale_bar=longer))


@pytest.mark.parametrize(
    "example",
    ["five-days", "nothing-hidden", "cold-cold", "hot-cold", "free-form-pins", "l-shape",
     "tracked-robot", "hidden-b-indexing", "hidden-loose-ball", "hidden-reversal-x", "hidden-spindle-growth"],
)  # fmt: skip
def test_no_example_is_refused(example: str) -> None:
    campaign = read_campaign(EXAMPLES / example)
    assert grounds(campaign, campaign.runs[-1].run) == ()


def test_readings_that_fit_far_better_than_they_are_stated_may_be_in_inches() -> None:
    exact = read_campaign(EXAMPLES / "tilting-table")
    rng = np.random.default_rng(5)
    sigma = 0.0007  # standard_uncertainty_um of its file
    probings = exact.probings
    noise = {
        name: rng.normal(0.0, sigma, len(probings))
        * (np.abs(probings.channels[f"normal_{name.lower()}"]) > 0.5)
        for name in ("X", "Y", "Z")
    }
    noisy = {name: x + noise.get(name, 0.0) for name, x in probings.readings.items()}
    inches = {name: x / 25.4 if name in noise else x for name, x in noisy.items()}

    def grounds_with(readings: dict[str, np.ndarray]) -> tuple[Ground, ...]:
        return grounds(replace(exact, probings=replace(probings, readings=readings)), 2)

    assert grounds_with(noisy) == ()
    for (ground,) in (grounds_with(inches), grounds(exact, 2)):
        assert (ground.kind, ground.run, ground.subject) == (GroundKind.UNITS, 2, "")
        assert 0.025 < ground.size < 0.05  # 1/25.4 where the statement is right
        assert "in another unit, such as inches" in ground_sentence(ground, texts_of("en"))


def test_a_bar_typed_one_millimetre_wrong(five_days: Campaign) -> None:
    wrong = with_bar(five_days, 1.0)
    found = {ground.kind: ground for ground in grounds(wrong)}
    assert set(found) == {GroundKind.SCALE_BAR, GroundKind.IMPLAUSIBLE}
    # All lengths of the run grow with the bar: 1 mm on its length, in µm/m, on the gain of the genuine bar.
    genuine = campaign_method(five_days).identify(five_days).runs[-1]
    gain = dict(zip(campaign_method(five_days).identify(five_days).parameters, genuine.estimate, strict=True))
    worst = max(
        (ground for ground in grounds(wrong) if ground.kind is GroundKind.IMPLAUSIBLE),
        key=lambda each: each.size,
    )
    length = five_days.artefact.scale_bar.length
    expected = 1e6 * ((1.0 + gain[worst.subject]) * (length + 1.0) / length - 1.0)
    assert abs(worst.size) == pytest.approx(abs(expected), rel=0.02)
    assert worst.limit == pytest.approx(1e6 * LARGEST_GAIN)
    assert found[GroundKind.SCALE_BAR].size == pytest.approx(1.0, abs=1e-5)
    (note,) = [sentence for sentence in doubts(wrong) if "scale bar" in sentence]
    assert note.endswith("are declared 304.9892 mm apart: check length_mm and nominal_mm")
    # What a declaration in whole millimetres leaves is no ground.
    assert GroundKind.SCALE_BAR not in {ground.kind for ground in grounds(with_bar(five_days, 0.45))}


def test_residuals_far_beyond_the_statements(five_days: Campaign) -> None:
    sharper = replace(five_days, probe=replace(five_days.probe, standard_uncertainty=1e-3 / 36.0))
    (ground,) = [each for each in grounds(sharper) if each.kind is GroundKind.LACK_OF_FIT]
    # The independent computation: squares of the residuals of the run over their expectation.
    problem = campaign_method(sharper).problem_of(sharper)
    solution = solve_problem(problem)
    rows = problem.context.run == 20
    squares = np.sum(problem.vectors(solution.local, solution.common)[rows] ** 2) * (36.0 / 1e-3) ** 2
    unknowns = np.linalg.matrix_rank(np.linalg.qr(solution.last.local[-1])[1], tol=1e-6)
    freedom = 3 * int(rows.sum()) + 1 - unknowns
    assert ground.size == pytest.approx(np.sqrt(squares / freedom), rel=1e-3)
    assert ground.size > ground.limit == MOST_TIMES


@pytest.mark.slow
def test_lack_of_fit_by_a_hidden_reversal_is_a_ground_or_within_what_is_certified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The simulator hid a reversal of X. A model that has it says what the parameters are; the model without it, which
    a certificate may rest on at 1.8 times the statements, has to hold them within its U by its line for lack of fit."""
    hidden = read_campaign(EXAMPLES / "hidden-reversal-x")
    assert isinstance(hidden, Campaign)
    # The ground: with a probe that is stated three and a half times as sharp the same residuals are too many.
    sharper = replace(hidden, probe=replace(hidden.probe, standard_uncertainty=1e-3 / 3.5))
    assert [each.kind for each in grounds(sharper)] == [GroundKind.LACK_OF_FIT]
    asked = ["--db", str(tmp_path / "m.duckdb")]
    assert main([*asked, "import", str(EXAMPLES / "hidden-reversal-x")]) == 0
    assert main([*asked, "model", "add", "EXX:reversal", "--to", "samba", "--as", "right"]) == 0

    def stated(*options: str) -> dict[str, dict[str, float]]:
        capsys.readouterr()
        evaluate = ["uncertainty", "hidden-reversal-x", "--run", "20", "--method", "guf", "--json", *options]
        assert main([*asked, *evaluate]) == 0
        return json.loads(capsys.readouterr().out)["guf"]

    right, certified, bare = stated("--model", "right"), stated(), stated("--no-model-uncertainty")
    # What lacks decides parameters: a ground, whose size is what the line adds to u over the rest of the budget.
    evaluate = ["uncertainty", "hidden-reversal-x", "--run", "20", "--method", "guf"]
    assert main([*asked, *evaluate, "--json"]) == 0
    (ground,) = json.loads(capsys.readouterr().out)["grounds"]
    times = {
        name: float(np.sqrt((certified["u"][name] / bare["u"][name]) ** 2 - 1.0)) for name in certified["u"]
    }
    assert ground["kind"] == "lack-of-fit"
    assert ground["subject"] == max(times, key=times.__getitem__)
    assert ground["size"] == pytest.approx(times[ground["subject"]], rel=1e-6)
    assert ground["size"] > 10.0
    issue_it = ["certificate", "issue", "hidden-reversal-x", "--run", "20"]
    issue_it += ["--laboratory", str(EXAMPLES / "laboratory.toml"), "--out", str(tmp_path)]
    assert main([*asked, *issue_it]) == 2
    refusal = capsys.readouterr().err
    assert (
        "lack-of-fit: run 20: the readings refute the model, and what it lacks may move EC0Y by 12" in refusal
    )
    assert "--accept lack-of-fit=REASON" in refusal
    # The model that has the effect is certified.
    assert main([*asked, *evaluate, "--model", "right", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["grounds"] == []
    assert right["estimate"].keys() - certified["estimate"].keys() == {"EXX:reversal"}
    away = {name: abs(value - right["estimate"][name]) for name, value in certified["estimate"].items()}
    assert len(away) == 13
    assert max(away[name] / certified["expanded"][name] for name in away) < 1.0
    assert max(away[name] / bare["expanded"][name] for name in away) > 3.0


@pytest.mark.parametrize(
    ("example", "refused"), [("hidden-b-indexing", True), ("hidden-spindle-growth", False)]
)
def test_a_refuted_model_is_refused_where_what_it_lacks_is_most_of_a_budget(
    example: str, refused: bool
) -> None:
    """F is 22 and 2.3, both beyond any doubt; the growing spindle pulls no parameter by more than a tenth of its u."""
    campaign = read_campaign(EXAMPLES / example)
    with Database(":memory:") as db:
        import_campaign(db, campaign)
        answer = uncertainty(db, UncertaintyRequest(example, 20, method="guf"))
    assert answer.residuals.something_is_missing
    shares = answer.guf.budget["lack of fit of the model"]
    assert (max(shares.values()) > 0.5) is refused
    assert [ground.kind for ground in answer.grounds] == [GroundKind.LACK_OF_FIT] * refused
    # A campaign whose readings do not refute the model beyond noise of neighbours has the line, and no ground.
    noisy = replace(answer, residuals=replace(answer.residuals, lack_of_fit_p=0.002))
    assert lack_in_budget(noisy) == ()


def test_lack_of_fit_in_a_budget_in_both_languages() -> None:
    ground = Ground(GroundKind.LACK_OF_FIT, 20, "EC0Y", 12.19, 1.0)
    assert "may move EC0Y by 12.19 times what everything else in its budget does" in ground_sentence(
        ground, texts_of()
    )
    assert "kann EC0Y um das 12,19-Fache" in ground_sentence(ground, texts_of("de"))


def test_a_gross_reading_of_any_run(five_days: Campaign) -> None:
    readings = dict(five_days.probings.readings)
    row = int(np.flatnonzero(five_days.probings.run == 2)[7])
    readings["Z"] = readings["Z"].copy()
    readings["Z"][row] -= 0.5
    wrong = replace(five_days, probings=replace(five_days.probings, readings=readings))
    (ground,) = grounds(wrong)
    assert (ground.kind, ground.run) == (GroundKind.GROSS_READINGS, 2)
    assert ground.subject == f"8 ({five_days.probings.target[row]})"
    assert ground.size == pytest.approx(500.0, abs=5.0)


def test_the_grounds_of_a_stored_evaluation_are_read_and_not_determined_again(
    five_days: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    readings = dict(five_days.probings.readings)
    readings["Z"] = readings["Z"].copy()
    readings["Z"][int(np.flatnonzero(five_days.probings.run == 2)[7])] -= 0.5
    wrong = with_bar(replace(five_days, probings=replace(five_days.probings, readings=readings)), 1.0)
    with Database(":memory:") as db:
        import_campaign(db, wrong)
        model = resolve(db, None, wrong.method)
        for run in (19, 20):
            uncertainty(db, UncertaintyRequest("five-days", run, method="guf"))
        stored = {run: stored_uncertainty(db, wrong, run, model) for run in (19, 20)}
        before_that = {
            run: replace(each, answer=replace(each.answer, grounds=None)) for run, each in stored.items()
        }
        determined = grounds_against(wrong, model, before_that)
        monkeypatch.delattr("monitor.discovery.robust_fit")
        assert grounds_against(wrong, model, stored) == determined
    # The gross reading of run 2 speaks against both, once; the rest is of each run.
    assert [ground.run for ground in determined if ground.kind is GroundKind.GROSS_READINGS] == [2]
    assert {ground.run for ground in determined if ground.kind is GroundKind.SCALE_BAR} == {19, 20}


@pytest.mark.parametrize("more_mm", [-0.25, -0.13, 0.13, 0.25])
def test_gains_that_are_off_together_are_of_a_bar_of_another_length(
    five_days: Campaign, more_mm: float
) -> None:
    """A quarter of a millimetre of 305 is 820 µm/m of every gain: below the limit of one, and of `scale-bar`."""
    (ground,) = grounds(with_bar(five_days, more_mm))
    assert (ground.kind, ground.subject) == (GroundKind.IMPLAUSIBLE, "EXX, EYY, EZZ")
    assert ground.size == pytest.approx(1e6 * more_mm / 305.0, abs=40.0)
    assert "are off together, by " in ground_sentence(ground, texts_of())
    assert "weichen gemeinsam ab" in ground_sentence(ground, texts_of("de"))


@pytest.mark.parametrize("more_mm", [-0.09, 0.09])
def test_scales_30_K_warmer_than_the_bar_are_no_ground(five_days: Campaign, more_mm: float) -> None:
    assert grounds(with_bar(five_days, more_mm)) == ()


def test_no_temperature_where_a_bar_gives_the_length(five_days: Campaign) -> None:
    runs = tuple(
        replace(run, conditions={name: x for name, x in run.conditions.items() if not name.endswith("degC")})
        for run in five_days.runs
    )
    cold = replace(five_days, runs=runs)
    assert [ground.kind for ground in grounds(cold)] == [GroundKind.TEMPERATURE]
    tilting = read_campaign(EXAMPLES / "tilting-table")
    bare = replace(tilting, runs=tuple(replace(run, conditions={}) for run in tilting.runs))
    assert {ground.kind for ground in grounds(bare, 1)} == {GroundKind.UNITS}  # simulated without noise


@pytest.mark.parametrize(("degrees", "limit"), [(294.15, 60.0), (68.0, 60.0), (-60.0, -40.0)])
def test_a_temperature_in_kelvin_or_fahrenheit(five_days: Campaign, degrees: float, limit: float) -> None:
    kelvin = replace(
        five_days, runs=tuple(replace(run, conditions={"ambient_degC": degrees}) for run in five_days.runs)
    )
    (ground,) = grounds(kelvin)
    assert (ground.kind, ground.size, ground.limit) == (GroundKind.TEMPERATURE, degrees, limit)
    assert re.search(r"ambient_degC is \S+ °C, at which nobody measures", ground_sentence(ground, texts_of()))
    (doubt,) = (each for each in doubts(kelvin) if "degC" in each)
    assert "20 of 20 runs lie outside -40 to 60 °C): is the unit °C?" in doubt


def test_every_ground_is_accepted_by_its_name_and_none_that_is_absent(five_days: Campaign) -> None:
    found = grounds(with_bar(five_days, 1.0))
    with pytest.raises(RefusedResultError, match="--accept scale-bar=REASON") as refused:
        accepted_grounds(found, {GroundKind.IMPLAUSIBLE: "measured twice"})
    assert "implausible" not in str(refused.value)
    with pytest.raises(InputError, match="--accept lack-of-fit: there is nothing to accept"):
        accepted_grounds(found, dict.fromkeys(GroundKind, "all"))


@pytest.mark.slow
def test_the_reason_is_printed_stored_and_made_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "bar"
    shutil.copytree(EXAMPLES / "five-days", folder)
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    length = float(re.search(r"length_mm = ([\d.]+)", text)[1])
    text = text.replace(f"length_mm = {length}", f"length_mm = {length + 1.0}")
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    german, path = EXAMPLES / "laboratory-de.toml", tmp_path / "db.duckdb"
    words = [
        "--db",
        str(path),
        "certificate",
        "issue",
        "five-days",
        "--run",
        "20",
        "--laboratory",
        str(german),
    ]
    with Database(path) as db:
        import_campaign(db, read_campaign(folder))
        db.close()
    assert main([*words, "--out", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert "the certificate is refused:" in message
    assert (
        "scale-bar: run 20: the calibrated length of the scale bar S1-S2 differs from the declared" in message
    )
    assert "--accept implausible=REASON" in message
    with Database(path) as db:
        request = CertificateRequest(
            "five-days", 20, laboratory=german, out=tmp_path, issued_on=DAY,
            accept={GroundKind.SCALE_BAR: WHY, GroundKind.IMPLAUSIBLE: "bekannt"},
        )  # fmt: skip
        answer = issue(db, request)
        printed = " ".join(pypdf.PdfReader(answer.file).pages[0].extract_text().split())
        assert "Überschrittene Grenzen und warum anerkannt" in printed
        assert f"Vom Laboratorium anerkannt: {WHY}" in printed
        assert "um 1 mm (Grenze 0,5 mm)" in printed
        stored = load_certificate(db, answer.certificate.number).record
        assert [entry["reason"] for entry in stored["accepted"]] == ["bekannt", WHY]
        assert remake(db, RemakeRequest(answer.certificate.number)).identical


def test_a_run_in_inches_speaks_against_every_certificate_by_its_unit_and_by_no_reading_of_it(
    five_days: Campaign,
) -> None:
    rows = five_days.probings.run == 2
    readings = {
        axis: np.where(rows, values / 25.4, values) if axis in "XYZ" else values
        for axis, values in five_days.probings.readings.items()
    }
    probings = replace(five_days.probings, readings=readings)
    (ground,) = _units(replace(five_days, probings=probings), 7)
    assert (ground.kind, ground.run, ground.unit) == (GroundKind.UNITS, 2, "inch")
    assert ground.size == pytest.approx(1.0 / 25.4, rel=1e-3)
    german = ground_sentence(ground, texts_of("de"))
    assert "als wäre ihre Einheit inch statt mm" in german


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        (
            {"repeatability": 12.0, "bar": None},
            ", at least 14, and have 12: 2 more runs on days of repeated runs would do",
        ),
        ({"repeatability": 13.0}, ", at least 14, and have 13: 1 more run on days of repeated runs would do"),
        ({"bar": None}, ""),
    ],
)
def test_a_joint_region_that_is_refused_says_how_many_runs_would_do(degrees: dict, words: str) -> None:
    framework = SimpleNamespace(budget_degrees_of_freedom=degrees)
    evaluated = SimpleNamespace(names=("E",) * 13, answer=SimpleNamespace(guf=framework))
    assert _lacking(evaluated) == words
    # One more than the parameters is what an ellipsoid needs, as the factor itself says.
    assert np.isinf(ellipsoid_factor(13, 0.95, 12.0))
    assert np.isfinite(ellipsoid_factor(13, 0.95, 14.0))


def moved(campaign: Campaign, change) -> Campaign:
    """The campaign with other positions of its axes."""
    probings = campaign.probings
    return replace(campaign, probings=replace(probings, readings=change(dict(probings.readings))))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        # The sphere of the file stands at (80, 0, 60). Read with the other sign, or with X and Y exchanged, it goes
        # around twice, and stays where it is only with that undone.
        (lambda read: {**read, "X": -read["X"]}, "the sign of X were the other way round"),
        # C the other way round does the same, and a sphere without y stays at its place with both.
        (lambda read: {**read, "Y": -read["Y"]}, "the sign of Y were .* or the sign of C were .*"),
        (
            lambda read: {**read, "X": read["Y"], "Y": read["X"]},
            "the columns x_mm and y_mm were exchanged",
        ),
    ],
)
@pytest.mark.slow
def test_a_sphere_that_wanders_is_refused_with_the_sign_or_the_columns(change, said: str) -> None:
    campaign = read_campaign(EXAMPLES / "r-test")
    assert grounds(campaign, 1) == ()
    for setup in (campaign.artefact.setups[0], replace(campaign.artefact.setups[0], work_point=(82, -1, 61))):
        stated = replace(moved(campaign, change), artefact=replace(campaign.artefact, setups=(setup,)))
        with Database(":memory:") as db:
            import_campaign(db, stated)
            with pytest.raises(DataError, match=f"wanders by .* mm about the work point.* if {said}$"):
                identify(db, IdentifyRequest("r-test"))


def test_a_work_point_that_the_readings_put_elsewhere() -> None:
    campaign = read_campaign(EXAMPLES / "r-test")
    (setup,) = campaign.artefact.setups

    def stated_at(*point: float) -> Campaign:
        setups = (replace(setup, work_point=point),)
        return replace(campaign, artefact=replace(campaign.artefact, setups=setups))

    elsewhere = stated_at(80.0, 35.0, 60.0)
    (ground,) = grounds(elsewhere, 1)
    assert (ground.kind, ground.subject, ground.limit) == (GroundKind.WORK_POINT, "r-test", 5.0)
    assert ground.size == pytest.approx(35.0, abs=2.0)
    assert "werkstückseitige Punkt der Aufstellung r-test" in ground_sentence(ground, texts_of("de"))
    with Database(":memory:") as db:
        import_campaign(db, elsewhere)
        answers = (
            identify(db, IdentifyRequest("r-test")),
            compare(db, CompareRequest("r-test")),
            explain(db, ExplainRequest("r-test")).explanation,
        )
    for answer in answers:
        # Stored answers and those of a server are read back, with the sentence as text.
        said_again = from_document(type(answer), to_document(answer)).work_points_elsewhere
        assert str(said_again) == str(answer.work_points_elsewhere)
        said = f"that of setup r-test by {ground.size:.3g} mm. Check the signs, units and columns of the axes"
        assert said in str(answer.work_points_elsewhere)
    _, comparison, explanation = answers
    assert comparison.comparison.verdict == explanation.comparison.verdict == "something is missing"
    assert explanation.answer.startswith("The work points come out elsewhere than work_point_mm says")
    # One that is stated nowhere may stand anywhere, and some millimetres are how people state one.
    for point in ((0.0, 0.0, 0.0), (82.0, -2.0, 61.0)):
        with Database(":memory:") as db:
            import_campaign(db, stated_at(*point))
            assert identify(db, IdentifyRequest("r-test")).work_points_elsewhere is None
            assert compare(db, CompareRequest("r-test")).work_points_elsewhere is None
        assert GroundKind.WORK_POINT not in {ground.kind for ground in grounds(stated_at(*point), 1)}


@pytest.mark.parametrize(("axes", "said"), [("XYZ", "x_mm, y_mm and z_mm were"), ("Z", "z_mm was")])
def test_positions_in_inches_are_refused_by_the_work_point(axes: str, said: str) -> None:
    campaign = read_campaign(EXAMPLES / "r-test")
    inches = moved(campaign, lambda read: {name: x / 25.4 if name in axes else x for name, x in read.items()})
    with Database(":memory:") as db:
        import_campaign(db, inches)
        with pytest.raises(DataError, match=f"if {said} in inches; positions are in mm$"):
            identify(db, IdentifyRequest("r-test"))


def test_what_was_simulated_is_a_ground_also_behind_the_database(tmp_path: Path, five_days: Campaign) -> None:
    """A certificate of a rehearsal was issued without a word."""
    made = simulate(SimulateRequest(tmp_path / "rehearsal"))
    assert "virtual = true" in (tmp_path / "rehearsal/campaign.toml").read_text("utf-8")
    like = simulate_like(
        LikeRequest(tmp_path / "shop", str(EXAMPLES / "tilting-table"), ("M1",), DAY, months=1)
    )
    for folder in (made.folder, *like.folders):
        campaign = read_campaign(Path(folder))
        assert campaign.machine.virtual
        with Database(":memory:") as db:
            import_campaign(db, campaign)
            assert load_campaign(db, campaign.name).machine == campaign.machine
    assert not five_days.machine.virtual
    virtual = replace(five_days, machine=replace(five_days.machine, virtual=True))
    (ground,) = grounds(virtual)
    assert ground == Ground(GroundKind.SIMULATED, 20, "HU40-T")
    assert "machine HU40-T was not measured" in ground_sentence(ground, texts_of())
    assert "Maschine HU40-T wurde nicht gemessen" in ground_sentence(ground, texts_of("de"))
    with pytest.raises(RefusedResultError, match="simulated: the readings were simulated"):
        accepted_grounds((ground,), {})
