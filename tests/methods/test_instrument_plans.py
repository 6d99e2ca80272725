"""Plans of instruments: what is promised of a test is what the identification says once it is made."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from monitor.cli.verbs.plan_instruments import tables
from monitor.exceptions import InputError
from monitor.methods import InstrumentPlan, campaign_method
from monitor.methods.instruments.candidates import CandidateTest, Workspace, usual_instruments
from monitor.methods.instruments.forecast import InstrumentForecast
from monitor.methods.method import ExpectedTest
from monitor.methods.model import chain_of
from monitor.readers import read_campaign
from monitor.records import AxisSettings, Campaign, Probings, Setup
from monitor.store import Database, import_campaign
from monitor.workflow.plan.answer import InstrumentPlanAnswer
from monitor.workflow.plan.instruments import _in_turn
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest
from tests.simulator import four_instruments as shop

EXAMPLES = Path(__file__).parents[2] / "examples"
LIMITS = {"X": (-100.0, 500.0), "Y": (-400.0, 100.0), "Z": (0.0, 600.0), "C": (0.0, 2.0 * np.pi)}


@cache
def _forecast(name: str) -> InstrumentForecast:
    campaign = read_campaign(EXAMPLES / name)
    method = campaign_method(campaign)
    assert isinstance(method.plan, InstrumentPlan)
    forecast = method.plan.forecast(campaign, method.own_model, 1, LIMITS)
    assert isinstance(forecast, InstrumentForecast)
    return forecast


def _identified(campaign: Campaign) -> dict[str, float]:
    fitted = campaign_method(campaign).identify(campaign)
    u = np.sqrt(np.diag(fitted.runs[0].covariance))
    return {name: float(value) for name, value in zip(fitted.parameters, u, strict=True)}


def _measured(test: CandidateTest, campaign: Campaign) -> Campaign:
    """The campaign with a test read from the machine of the simulator, without noise: u does not depend on it."""
    chain, setup = shop.machine(pitch=0.0), test.setup
    joints = chain_of(campaign.machine).joints
    readings = {joint.name: joint.sign * test.positions[:, index] for index, joint in enumerate(joints)}
    vectors = []
    for row in range(len(test.positions)):
        shown = {
            name: float(np.rad2deg(values[row]) if name == "C" else values[row])
            for name, values in readings.items()
        }
        frame = chain.seen(shown)
        vectors.append(frame[:3, :3] @ np.array(setup.tool_point) + frame[:3, 3] - setup.work_point)
    r = np.array(vectors)
    count, old = len(r), campaign.probings
    shown_um = {
        "distance": lambda: {"reading_um": 1e3 * (np.linalg.norm(r, axis=1) - (setup.length or 0.0))},
        "vector": lambda: dict(zip(("dx_um", "dy_um", "dz_um"), 1e3 * r.T, strict=True)),
        "displacement": lambda: {"reading_um": 1e3 * (r - r[0]) @ np.array(setup.direction)},
    }[setup.reading]()
    number = len(campaign.artefact.setups) + 1.0
    names = dict.fromkeys([*old.channels, *shown_um])
    empty = np.full(count, np.nan)
    new = {name: shown_um.get(name, empty) for name in names} | {"setup": np.full(count, number)}
    before = {name: old.channels.get(name, np.full(len(old), np.nan)) for name in names}
    probings = Probings(
        np.append(old.run, np.ones(count, dtype=np.int64)),
        np.append(old.sequence, old.sequence.max() + 1 + np.arange(count)),
        np.append(old.time, old.time.max() + 60.0 * (1 + np.arange(count))),
        np.append(old.target, np.full(count, "planned")),
        {name: np.append(old.readings[name], readings[name]) for name in old.readings},
        {name: np.append(before[name], new[name]) for name in names},
    )
    setups = (*campaign.artefact.setups, replace(setup, id="planned"))
    return replace(campaign, artefact=replace(campaign.artefact, setups=setups), probings=probings)


@pytest.mark.parametrize("name", ["r-test", "laser", "ball-bar"])
def test_without_a_test_u_is_that_of_the_identification(name: str) -> None:
    """The information of the rows and the QR of the identification are two routes."""
    identified = _identified(read_campaign(EXAMPLES / name))
    present = _forecast(name).present()
    assert set(present) == set(identified)
    for parameter, u in present.items():
        if np.isfinite(identified[parameter]):
            assert u == pytest.approx(identified[parameter], rel=2e-3), parameter
        else:
            assert np.isnan(u), parameter


@pytest.mark.parametrize("reading", ["distance", "vector", "displacement"])
def test_a_promised_u_is_that_of_the_campaign_with_the_test(reading: str) -> None:
    """The test is made on the simulator of the tests, another program, and identified."""
    campaign, forecast = read_campaign(EXAMPLES / "r-test"), _forecast("r-test")
    tests = [test for test in forecast.expected() if test.test.setup.reading == reading]
    for expected in (tests[0], tests[-1]):
        assert isinstance(expected.test, CandidateTest)
        identified = _identified(_measured(expected.test, campaign))
        assert set(identified) == set(expected.u)
        for parameter, u in expected.u.items():
            if np.isfinite(identified[parameter]):
                assert u == pytest.approx(identified[parameter], rel=0.02), parameter
            else:
                assert np.isnan(u), parameter


def test_no_test_leaves_the_strokes() -> None:
    chain = chain_of(read_campaign(EXAMPLES / "r-test").machine)
    limits = np.array([LIMITS[joint.name] for joint in chain.joints])
    tests = list(Workspace(chain, LIMITS).tests(usual_instruments((0.0, 0.0, -120.0)), available=False))
    assert {test.setup.reading for test in tests} >= {"distance", "vector", "displacement", "level", "angle"}
    for test in tests:
        assert np.all(test.positions >= limits[:, 0] - 1e-6)
        assert np.all(test.positions <= limits[:, 1] + 1e-6)


def _plan(tmp_path: Path, *, strokes: bool = False, **asked: object) -> InstrumentPlanAnswer:
    campaign = read_campaign(EXAMPLES / "r-test")
    if strokes:
        axes = {name: AxisSettings(name, stroke=LIMITS[name]) for name in "XYZ"}
        campaign = replace(campaign, machine=replace(campaign.machine, axes=axes))
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, campaign)
        answer = plan(db, PlanRequest("r-test", **asked))  # type: ignore[arg-type]
    assert isinstance(answer, InstrumentPlanAnswer)
    return answer


def test_a_plan_names_the_measurement_that_would_see_what_has_no_number(tmp_path: Path) -> None:
    """An R-test at one height takes the position of C for the tilt of Z; at another height, or with a square, not."""
    answer = _plan(tmp_path, strokes=True, parameters=("EX0C",))
    assert answer.standing == ()
    assert answer.present["EX0C"] is None
    best = answer.tests[0]
    assert best.u["EX0C"] is not None
    ranked = [test.u["EX0C"] for test in answer.tests]
    seen = [u for u in ranked if u is not None]
    assert ranked == [*sorted(seen), *([None] * (len(ranked) - len(seen)))]
    unseen = {parameter.parameter: parameter for parameter in answer.unseen}
    assert {"EX0C", "EY0C", "EZZ"} <= set(unseen)
    assert all(parameter.test.u[name] == parameter.u for name, parameter in unseen.items())


def test_a_planned_test_says_where_the_axes_stand_at_each_pose(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The simulator of the tests, another program, moves a machine without errors there: a bar keeps its length, and
    an R-test's sphere its place."""
    answer = _plan(tmp_path, strokes=True, poses=2)
    chain = shop.machine(pitch=0.0, truth=dict.fromkeys(shop.TRUTH, 0.0))
    for test in (*answer.tests, *answer.proposed):
        assert test.axes_by_pose is not None
        assert len(test.axes_by_pose) == test.poses
        for column, ends in test.axes.items():
            readings = [pose[column] for pose in test.axes_by_pose]
            assert (min(readings), max(readings)) == pytest.approx(ends, abs=1e-3)
        if test.work_point_mm is not None:
            poses = [
                {key.split("_")[0].upper(): at for key, at in pose.items()} for pose in test.axes_by_pose
            ]
            apart = [float(np.linalg.norm(shop.seen(chain, pose) - test.work_point_mm)) for pose in poses]
            length = 0.0 if test.reading == "vector" else np.mean(apart)
            assert apart == pytest.approx([length] * test.poses, abs=2e-3)
            assert (length > 0.0) == (test.reading == "distance")
    assert {"vector", "distance"} <= {test.reading for test in answer.tests}
    assert all(parameter.test.axes_by_pose is None for parameter in answer.unseen)
    tables(answer)
    assert "--json has every pose of these tests (axes_by_pose)" in capsys.readouterr().out


def test_an_axis_of_unknown_stroke_that_stood_still_is_named(tmp_path: Path) -> None:
    answer = _plan(tmp_path)
    assert answer.standing == ("Z",)
    assert all(test.axes["z_mm"][0] == test.axes["z_mm"][1] for test in answer.tests)


def test_a_parameter_that_no_single_test_gives_a_number_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = _plan(tmp_path)
    without = tuple(replace(test, u={**test.u, "EX0C": None}) for test in answer.tests)
    tables(replace(answer, asked=("EX0C",), present={**answer.present, "EX0C": None}, tests=without))
    assert "no single test gives EX0C a number" in capsys.readouterr().out
    tables(replace(answer, asked=("EA0C",)))
    assert "no single test" not in capsys.readouterr().out


def test_wanted_uncertainties_are_reached_by_tests_in_turn(tmp_path: Path) -> None:
    answer = _plan(tmp_path, wanted={"EA0C": 1.2})
    assert (answer.present["EA0C"] or 0.0) > 1.2
    assert [test.u["EA0C"] <= 1.2 for test in answer.proposed if test.u["EA0C"] is not None] == [
        *([False] * (len(answer.proposed) - 1)),
        True,
    ]


def test_an_instrument_that_is_not_there_is_proposed_where_none_of_the_own_gives_a_number() -> None:
    """Was: nothing, or "no 12 tests reach": the own laser alone was sought for what it never sees."""

    class Forecast:
        """Of a laser, which is there and gives no number, and an R-test, which is not."""

        def present(self) -> dict[str, float]:
            return {"EB0C": np.nan}

        def together(self, tests: list[CandidateTest]) -> ExpectedTest:
            sees = any(test.setup.id == "r-test" for test in tests)
            return ExpectedTest(tests[-1], {"EB0C": 2e-6 if sees else np.nan})

    forecast = Forecast()
    tests = [
        CandidateTest(Setup(name, "vector", 1e-3), np.zeros((1, 1)), available=name == "laser")
        for name in ("laser", "r-test")
    ]
    expected = [forecast.together([test]) for test in tests]
    proposed = _in_turn(forecast, expected, ["EB0C"], 1, {"EB0C": 3e-6})  # type: ignore[arg-type]
    assert [test.test.setup.id for test in proposed] == ["r-test"]


@pytest.mark.parametrize(
    ("asked", "match"),
    [
        ({"parameters": ("EX0K",)}, "there is no parameter 'EX0K'; did you mean"),
        ({"balls": 3}, "a plan of instruments is tests"),
        ({"poses": 40}, "--poses 40: choose 1 to 12 tests"),
        ({"wanted": {"EA0C": 1e-6}}, "no 12 tests reach EA0C=1e-06"),
    ],
)
def test_what_such_a_plan_does_not_have_is_refused(
    tmp_path: Path, asked: dict[str, object], match: str
) -> None:
    with pytest.raises(InputError, match=match):
        _plan(tmp_path, **asked)


@pytest.mark.parametrize(
    ("example", "keys", "u"), [("laser", {"scale_uncertainty": 1e-6}, 1e-6), ("ball-bar", {}, 3e-6)]
)
def test_what_an_instrument_shares_is_not_better_known_by_measuring_again(
    example: str, keys: dict[str, float], u: float
) -> None:
    """The scale of a laser, 0.3 um of a bar of 100 mm: until 26 November 2026 each test was read by another bar."""
    campaign = read_campaign(EXAMPLES / example)
    setups = tuple(replace(setup, **keys) for setup in campaign.artefact.setups)
    campaign = replace(campaign, artefact=replace(campaign.artefact, setups=setups))
    method = campaign_method(campaign)
    assert isinstance(method.plan, InstrumentPlan)
    forecast = method.plan.forecast(campaign, method.own_model, 1, LIMITS)
    present = forecast.present()
    assert not any("scale" in name or "length" in name for name in present)
    assert present["EXX"] == pytest.approx(u, rel=0.05)
    same = [test for test in forecast.tests if test.available][:4]
    for test in same:
        promised = forecast.together([test]).u["EXX"]
        assert 0.98 * u < promised <= 1.0001 * present["EXX"]
    least, limiting = forecast.limit(same, "EXX")
    assert least == pytest.approx(u, rel=0.03)
    assert limiting == ("the scale of laser interferometer",) * bool(keys) + ("the length of ball bar",) * (
        not keys
    )


def test_a_wish_below_what_a_bar_is_calibrated_to_is_refused_with_what_limits_it(tmp_path: Path) -> None:
    """0.3 um of a bar of 100 mm are 3 um/m, which no repetition lowers."""
    with Database(tmp_path / "shop.duckdb") as db:
        import_campaign(db, read_campaign(EXAMPLES / "ball-bar"))
        with pytest.raises(
            InputError, match=r"EXX cannot become better than \S+ µm/m: .*the length of ball bar limit"
        ):
            plan(db, PlanRequest("ball-bar", wanted={"EXX": 0.05}))
