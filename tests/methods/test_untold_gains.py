"""A machine with one rotary axis tells no length across it but by the bar: gains that no reading tells apart stay
small, and where they cannot, the file is wrong. The readings are of a machine of plain matrices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_mistakes
from monitor.discovery.machine.mistakes.column_mistakes import column_mistakes
from monitor.discovery.machine.mistakes.cures import cured_rms
from monitor.exceptions import DataError
from monitor.methods.chain.problem import solve_problem
from monitor.methods.samba.method import METHOD, problem_of
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.refusal import Advice, AdviceKind
from monitor.store import StoredModel
from monitor.workflow.explain.explain import explained, explanation_of, first_fit
from monitor.workflow.identify.identify import compute
from monitor.workflow.identify.mistaken_columns import refusal_of

BALLS = {
    "1": (160.0, 60.0, 0.0), "2": (-40.0, 180.0, 120.0), "3": (-150.0, 90.0, -60.0), "4": (30.0, 240.0, -140.0),
    "S1": (-180.0, 40.0, 150.0), "S2": (-20.0, 280.0, 60.0),
}  # fmt: skip
ALONG = {**BALLS, "S2": (-180.0, 340.0, 150.0)}
ACROSS = {**BALLS, "S2": (-20.0, 40.0, 60.0)}
ANGLES = (0, 30, 75, 120, 165, -150, -100, -60, -20, 0, 90)
GAINS = np.array([8e-6, -6e-6, 5e-6])
TILT = 30e-6


def campaign(
    folder: Path, balls=BALLS, *, sign_of_b=1.0, columns="xyz", bar=None, longer=0.0, runs=2, seed=1
):
    """A campaign `w B Z b X Y t`: a table of B on Z, a spindle on X and Y; EA0B of 30 µrad, gains of a few µm/m.

    ``longer`` mm is the stylus in the last run; what is typed wrong is the sign of B, two columns or the bar's length.
    """
    rng = np.random.default_rng(seed)
    length = float(np.linalg.norm(np.subtract(balls["S1"], balls["S2"])))
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -TILT], [0.0, TILT, 1.0]])
    rows = ["run,sequence,time_s,target,x_mm,y_mm,z_mm,b_deg"]
    for run in range(1, runs + 1):
        tip = np.array([0.02, -0.03, -179.95 - (longer if run == runs else 0.0)])
        for touch, (angle, name) in enumerate((angle, name) for angle in ANGLES for name in balls):
            c, s = np.cos(np.radians(-angle)), np.sin(np.radians(-angle))
            turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
            x, y, z = (tilt @ turn @ np.array(balls[name]) - tip) / (1.0 + GAINS) + rng.normal(0.0, 1e-3, 3)
            read = dict(zip(columns, (x, y, z), strict=True))
            rows.append(
                f"{run},{touch + 1},{25.0 * touch},{name},{read['x']:.6f},{read['y']:.6f},{read['z']:.6f},"
                f"{sign_of_b * angle}"
            )
    folder.mkdir()
    (folder / "probings.csv").write_text("\n".join(rows) + "\n")
    days = "\n".join(f"{run},2026-03-{run:02}T08:00:00+01:00,{run},false,20.0" for run in range(1, runs + 1))
    (folder / "runs.csv").write_text(f"run,started_at,day,warm_up,ambient_degC\n{days}\n")
    placed = "".join(
        f'[[artefact.balls]]\nid = "{name}"\nnominal_mm = {list(place)}\ndiameter_mm = 25.4\n'
        for name, place in balls.items()
    )
    (folder / "campaign.toml").write_text(
        'format = 1\ncampaign = "four"\nmethod = "samba"\n[machine]\nid = "four"\ntopology = "w B Z b X Y t"\n'
        '[probe]\nid = "p"\nmodel = "p"\nstandard_uncertainty_um = 1.0\ntip_mm = [0.0, 0.0, -180.0]\n'
        f'[artefact]\nid = "balls"\n{placed}[artefact.scale_bar]\nballs = ["S1", "S2"]\n'
        f"length_mm = {bar or length}\nstandard_uncertainty_mm = 0.0005\n"
        'certificate = "1"\n'
    )
    return read_campaign(folder)


def mirrored(folder: Path, column: int) -> Campaign:
    """The campaign with the other sign of a column of its readings."""
    campaign(folder, runs=1)
    table = folder / "probings.csv"
    head, *rows = (line.split(",") for line in table.read_text().splitlines())
    for row in rows:
        row[column] = repr(-float(row[column]))
    table.write_text("\n".join(map(",".join, [head, *rows])) + "\n")
    return read_campaign(folder)


def gains(problem, solution):
    return solution.local[:, [problem.base_names.index(name) for name in ("EXX", "EYY", "EZZ")]]


@pytest.mark.parametrize("balls", [BALLS, ALONG])
def test_gains_that_no_reading_tells_apart_stay_small(tmp_path: Path, balls) -> None:
    problem = problem_of(campaign(tmp_path / "c", balls))
    solution = solve_problem(problem)
    assert not solution.local_free[:, problem.base_names.index("EXX")].any()
    # The bar of 300 mm by 0.5 µm: what it says of the scales is all that they move by, a few µm/m.
    assert np.abs(gains(problem, solution)).max() < 2e-5
    angle = solution.local[:, problem.base_names.index("EA0B")]
    u = np.sqrt(
        solution.local_covariance[:, problem.base_names.index("EA0B"), problem.base_names.index("EA0B")]
    )
    assert np.all(np.abs(np.abs(angle) - TILT) < 4.0 * u)


@pytest.mark.parametrize(
    ("balls", "none"), [(BALLS, {"EXX", "EYY", "EZZ"}), (ALONG, {"EXX", "EZZ"}), (ACROSS, {"EYY"})]
)
def test_the_advice_is_a_bar_that_lies_otherwise(tmp_path: Path, balls, none) -> None:
    """Which gains a bar gives is what the fit gives with it."""
    found = METHOD.identify(campaign(tmp_path / "c", balls, runs=1))
    (refused,) = found.runs[0].refused
    assert set(refused.parameters) == none
    assert refused.reason.advice == Advice(AdviceKind.BAR_DIRECTION, ("B", "EYY", "EXX", "EZZ"))


def test_a_longer_stylus_moves_the_tip_and_no_ball(tmp_path: Path) -> None:
    problem = problem_of(campaign(tmp_path / "c", longer=50.0))
    solution = solve_problem(problem)
    own = problem.own_of(solution.local)
    np.testing.assert_allclose(own[1] - own[0], [*np.zeros(own.shape[1] - 1), -50.0], atol=0.02)
    assert np.abs(gains(problem, solution)).max() < 2e-4


WRONG = [
    ({"sign_of_b": -1.0}, "the sign of B were the other way round"),
    ({"sign_of_b": -1.0, "balls": ALONG}, "the sign of B were the other way round"),
    ({"columns": "zyx"}, "the columns z_mm and x_mm were exchanged"),
    (
        {"bar": 30.0},
        "the length of the scale bar was ten times too small (length_mm = 30; its balls S1 and S2 ",
    ),
    (
        {"bar": 28.0, "balls": ALONG},
        "the scale bar were of another length than 28 mm (`length_mm`; its balls S1 ",
    ),
    # A gain that the bar tells; it was taken up to a tenth.
    ({"bar": 304.5, "balls": ALONG}, "the scale bar were of another length than 304.5 mm (`length_mm`; its "),
    (
        {"bar": 201.471, "balls": ACROSS},
        "the scale bar were of another length than 201.471 mm (`length_mm`; ",
    ),
    # A hundredth and a half; declared and stated lengths were compared from two hundredths on.
    ({"bar": 306.69}, "the scale bar were of another length than 306.69 mm (`length_mm`; its balls S1 "),
]


@pytest.mark.parametrize(("wrong", "said"), WRONG)
def test_a_mirrored_or_shrunken_world_is_refused(tmp_path: Path, wrong, said) -> None:
    found = campaign(tmp_path / "c", runs=1, **wrong)
    with pytest.raises(DataError, match="the readings contradict the machine file"):
        solve_problem(problem_of(found))
    # Undone, what is left is the noise that was read, not that of a world of half the size.
    (undo,) = (undo for what, undo in column_mistakes(found) if what.startswith(said))
    assert cured_rms(undo(found), problem_of, np.inf) == pytest.approx(0.93e-3, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "said"), WRONG)
def test_the_mistake_is_named(tmp_path: Path, wrong, said) -> None:
    found = campaign(tmp_path / "c", **wrong)
    mistakes = find_mistakes(found, problem_of, None)
    assert any(mistake.what.startswith(said) for mistake in mistakes)
    assert all(mistake.rms_undone == pytest.approx(0.93e-3, rel=0.1) for mistake in mistakes)
    # Exchanged columns that the steps between balls show are said first.
    message = str(refusal_of(DataError("no"), found, problem_of))
    by_steps = "only with x_mm and z_mm exchanged" in message
    assert by_steps == (wrong.get("columns") == "zyx")
    assert by_steps or ("It looks as if" in message and said in message)


def test_what_the_readings_cannot_tell_is_said_at_the_result(tmp_path: Path) -> None:
    """Y mirrored along B fits, with EA0B of -30 in place of 30 µrad; only the import said so."""
    found = mirrored(tmp_path / "c", 5)
    model = StoredModel("samba", 1, None, (), (), (), "", None)
    answer = compute(found, model).answer
    (doubt,) = answer.file_doubts
    assert "are the declared ones only with the other sign of y_mm" in doubt
    said = explained(explanation_of(found, model, first_fit(found, model)), found, model).answer
    assert f"Look at the file first: {doubt}." in said
    assert compute(campaign(tmp_path / "right", runs=1), model).answer.file_doubts is None
