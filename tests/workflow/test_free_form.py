"""A free-form campaign goes the whole way: store, both routes of uncertainty, map, plan, figure, model."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.discovery import fit
from monitor.exceptions import InputError
from monitor.methods.free_form.method import METHOD as free_form
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign, load_campaign
from monitor.workflow.explain.shape import shape_figure
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.model.request import ShowModelRequest
from monitor.workflow.model.show import show_model
from monitor.workflow.plan.answer import AnglePlanAnswer
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.stating import map_answer
from monitor.workflow.volumetric.volumetric import map_run

POCKET = Path(__file__).parents[2] / "examples" / "free-form-pocket"


@pytest.fixture(scope="module")
def db(tmp_path_factory):
    with Database(tmp_path_factory.mktemp("free-form") / "pocket.duckdb") as database:
        import_campaign(database, read_campaign(POCKET))
        yield database


def test_what_was_imported_comes_back(db):
    campaign = load_campaign(db, "free-form-pocket")
    assert campaign.artefact == read_campaign(POCKET).artefact
    assert import_campaign(db, read_campaign(POCKET)).state == "unchanged"


def test_identification_and_framework_state_the_same_uncertainty(db):
    """The stated 1.38 µm exceeds the repeatability of four runs or not: the framework takes the larger."""
    run = next(run for run in identify(db, IdentifyRequest("free-form-pocket")).runs if run.run == 2)
    assert run.refused == ()
    assert len(run.parameters) == 149
    framework = uncertainty(db, UncertaintyRequest("free-form-pocket", 2, method="guf")).guf
    ratios = {framework.u[name] / estimate.u for name, estimate in run.parameters.items()}
    assert min(ratios) > 0.99
    assert max(ratios) < 1.1
    for name, estimate in run.parameters.items():
        assert framework.estimate[name] == pytest.approx(estimate.value, abs=1e-6)


@pytest.mark.slow
def test_monte_carlo_agrees_with_the_framework(db):
    found = uncertainty(db, UncertaintyRequest("free-form-pocket", 2, method="mcm", digits=1, seed=3))
    assert found.mcm.not_converged == 0
    for name, u in found.guf.u.items():
        assert found.mcm.u[name] == pytest.approx(u, rel=0.05)


def test_the_map_knows_the_known_length(db):
    """The error at the last node is no result, but an error of the machine."""
    mapped = map_run(db, VolumetricRequest("free-form-pocket", 2))
    document = map_answer(mapped)
    campaign = load_campaign(db, "free-form-pocket")
    place = mapped.errors.names.index("EXX(110)")
    assert mapped.errors.estimate[place] == pytest.approx(campaign.artefact.self_calibration.length.value)
    assert mapped.errors.covariance[place, place] ** 0.5 == pytest.approx(0.5e-3, rel=1e-3)
    # What the map leaves out are places and turns of axes that these readings do not show; the length is none of them.
    assert {each.parameter[2] for each in document.left_out} == {"0"}
    assert not any(name.startswith("shape") for name in mapped.errors.names)


def test_plan_proposes_angles(db):
    answer = plan(db, PlanRequest("free-form-pocket", poses=2))
    assert isinstance(answer, AnglePlanAnswer)
    present, proposed = answer.present, answer.proposed
    assert present.angles_deg == (0.0, 75.0, 130.0, 210.0)
    assert present.probings == 368
    assert len(answer.next_angles_deg) == 2
    assert proposed.shape.median_expanded_shape_um < present.shape.median_expanded_shape_um
    with pytest.raises(InputError, match="a plan of the method free-form is its angles of the table"):
        plan(db, PlanRequest("free-form-pocket", balls=4))
    with pytest.raises(InputError, match="choose 1 to 12 more angles"):
        plan(db, PlanRequest("free-form-pocket", poses=13))


def test_fig_9_raw_beside_identified(db, tmp_path):
    found = fit(free_form.problem_of(load_campaign(db, "free-form-pocket")))
    files = shape_figure("free-form-pocket", found, tmp_path)
    assert [Path(file).suffix for file in files] == [".svg", ".png"]
    assert all(Path(file).stat().st_size > 10_000 for file in files)


def test_model_says_what_is_free(db):
    assert show_model(db, ShowModelRequest("free-form")).base["V300-T"] == (
        "EXX:table", "EYX:table", "EXY:table", "EYY:table", "ECY:table", "EX0C:table", "EY0C:table", "ECC:table",
        "EC0X", "shape",
    )  # fmt: skip
