"""A touch that stands elsewhere on its surface than in the other runs, which its own number cannot show.

References: readings put off by hand, and rotations by scipy of a piece that is set up anew.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.discovery import robust_fit
from monitor.methods import campaign_method
from monitor.methods.chain.along_surface import along_surface
from monitor.readers import read_campaign
from monitor.workflow.intake.gross_doubts import gross_doubts

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LINEAR = ("X", "Y", "Z")
#: The pocket's touches have u = 1.4 µm: 10 µm along the surface are not beyond doubt there.
SIZES = {"tilting-table": (0.01, 0.05, 0.5, 5.0, 50.0), "free-form-pocket": (0.05, 0.5, 5.0, 50.0)}


@pytest.fixture(scope="module", params=list(SIZES))
def campaign(request):
    return read_campaign(EXAMPLES / request.param)


@pytest.fixture(scope="module")
def table():
    return read_campaign(EXAMPLES / "tilting-table")


def problem_of(campaign):
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def moved(campaign, **by_axis):
    """The campaign with its readings moved by (n,) mm an axis."""
    readings = dict(campaign.probings.readings)
    for axis, sizes in by_axis.items():
        readings[axis] = readings[axis] + sizes
    return replace(campaign, probings=replace(campaign.probings, readings=readings))


def in_machine(campaign, vectors):
    """Vectors (n, 3) of the table's frame in the machine's, of ``w C A Y b X Z t``: both tables turn against their
    readings."""
    a, c = -campaign.probings.readings["A"], -campaign.probings.readings["C"]
    return (
        Rotation.from_rotvec(np.outer(a, [1, 0, 0])) * Rotation.from_rotvec(np.outer(c, [0, 0, 1]))
    ).apply(vectors)


@pytest.mark.slow
def test_a_reading_off_in_any_axis_is_named_with_its_axis_and_size(campaign, seeds):
    """At positions of run 2 drawn at random, along the surface or across it: no other row, axis or size is told."""
    rows = np.flatnonzero(campaign.probings.run == 2)
    sizes = SIZES[campaign.name]
    rng = np.random.default_rng(2611)
    for trial in seeds(3 * len(rows), 9):
        row, axis = int(rng.choice(rows)), str(rng.choice(LINEAR))
        size = sizes[trial % len(sizes)] * float(rng.choice([-1.0, 1.0]))
        off = np.where(np.arange(len(campaign.probings.run)) == row, size, 0.0)
        (reading,) = robust_fit(problem_of(moved(campaign, **{axis: off}))).gross
        assert (reading.row, reading.axis) == (row, axis.lower()), (row, axis, size)
        # The touches of other runs stand elsewhere by what the machine did between them.
        assert reading.size == pytest.approx(size, rel=0.02, abs=0.02)


def as_programs_differ(table, rng, kind):
    """The campaign as other programs would have run it: no single touch of it is a mistake."""
    run, rows = table.probings.run, len(table.probings.run)
    runs = np.unique(run)
    if kind == "scatter of 5 µm":
        shifts = 5e-3 * rng.normal(size=(rows, 3))
    elif kind == "scatter with heavy tails":
        shifts = 1e-3 * rng.standard_t(4, size=(rows, 3))
    elif kind == "set up anew":
        tips = np.column_stack([table.probings.readings[axis] for axis in LINEAR])
        on_table = _on_table(table, tips)
        shifts = np.zeros((rows, 3))
        for number in runs:
            of_run = run == number
            turned = Rotation.from_rotvec(1e-3 * rng.normal(size=3)).apply(on_table[of_run])
            shifts[of_run] = turned - on_table[of_run] + 2.0 * rng.normal(size=3)
        # The piece itself stands elsewhere: the touches end elsewhere across the surface too.
        return moved(table, **dict(zip(LINEAR, in_machine(table, shifts).T, strict=True)))
    else:
        angles = np.round(table.probings.readings["A"], 6) + 1000.0 * np.round(
            table.probings.readings["C"], 6
        )
        _, pose = np.unique(angles, return_inverse=True)
        shifts = (0.05 * rng.normal(size=(len(runs), pose.max() + 1, 3)))[np.searchsorted(runs, run), pose]
    normals = in_machine(
        table, np.column_stack([table.probings.channels[f"normal_{axis}"] for axis in "xyz"])
    )
    along = shifts - np.sum(shifts * normals, axis=1, keepdims=True) * normals
    return moved(table, **dict(zip(LINEAR, along.T, strict=True)))


def _on_table(table, tips):
    """The tips (n, 3) in the frame of the table: what ``in_machine`` does, backwards."""
    a, c = -table.probings.readings["A"], -table.probings.readings["C"]
    turned = Rotation.from_rotvec(np.outer(a, [1, 0, 0])) * Rotation.from_rotvec(np.outer(c, [0, 0, 1]))
    return turned.inv().apply(tips)


@pytest.mark.parametrize(
    "kind",
    ["scatter of 5 µm", "scatter with heavy tails", "set up anew", "poses that differ from run to run"],
)
@pytest.mark.slow
def test_programs_that_differ_are_no_mistakes(table, seeds, kind):
    rng = np.random.default_rng(2612)
    marked = sum(bool(along_surface(problem_of(as_programs_differ(table, rng, kind)))) for _ in seeds(200, 5))
    count = len(seeds(200, 5))
    # Student's t with 4 degrees has such rows, of 4 x 154 touches one in some 5 000 lies beyond eight scatters: 22 of
    # 100 campaigns. Of poses that each differ by 50 µm 2 campaigns of 300 were marked.
    allowed = {
        "scatter with heavy tails": 3 + 0.3 * count,
        "poses that differ from run to run": 1 + 0.02 * count,
    }
    assert marked <= allowed.get(kind, 0)


def test_a_wrong_row_is_named_in_a_piece_that_is_set_up_anew(table):
    rng = np.random.default_rng(2613)
    anew = as_programs_differ(table, rng, "set up anew")
    row = int(np.flatnonzero(anew.probings.run == 2)[70])
    normal = in_machine(
        table, np.column_stack([table.probings.channels[f"normal_{axis}"] for axis in "xyz"])
    )[row]
    axis = LINEAR[int(np.abs(normal).argmin())]
    off = np.where(np.arange(len(anew.probings.run)) == row, 0.5, 0.0)
    (deviation,) = along_surface(problem_of(moved(anew, **{axis: off})))
    assert deviation.row == row
    assert np.linalg.norm(deviation.vector) == pytest.approx(0.5, abs=0.01)


def with_runs(campaign, count):
    """The first runs alone."""
    keep, probings = campaign.probings.run <= count, campaign.probings
    return replace(
        campaign,
        runs=tuple(run for run in campaign.runs if run.run <= count),
        probings=replace(
            probings,
            run=probings.run[keep],
            sequence=probings.sequence[keep],
            time=probings.time[keep],
            target=probings.target[keep],
            readings={axis: values[keep] for axis, values in probings.readings.items()},
            channels={name: values[keep] for name, values in probings.channels.items()},
        ),
    )


@pytest.mark.parametrize(("runs", "named"), [(3, [200]), (2, [])])
def test_two_runs_cannot_say_which_of_them_is_wrong(table, runs, named):
    few = with_runs(table, runs)
    off = np.where(np.arange(len(few.probings.run)) == 200, 0.5, 0.0)
    assert [deviation.row for deviation in along_surface(problem_of(moved(few, X=off)))] == named


def test_the_import_says_that_the_touch_stands_elsewhere(table):
    row = int(np.flatnonzero(table.probings.run == 2)[0])
    off = np.where(np.arange(len(table.probings.run)) == row, 0.5, 0.0)
    (sentence,) = gross_doubts(moved(table, X=off))
    assert sentence.startswith(
        "run 2: sequence 1, target side1-1 at A=0° C=0°, is off by +0.5 mm in x: the other"
    )
    assert "no number of this run holds" not in sentence
