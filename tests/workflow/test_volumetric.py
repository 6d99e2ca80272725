"""What the workflow tells the map of a machine: parameters of the run, shared effects, and how both hang together."""

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of
from monitor.methods.samba.virtual import virtual_campaign
from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest
from monitor.workflow.simulation import SimulateRequest, simulate
from monitor.workflow.volumetric.error_map import at_pose
from monitor.workflow.volumetric.known_errors import _of_shared
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.stating import map_answer
from monitor.workflow.volumetric.volumetric import map_run


@pytest.fixture(scope="module")
def shared():
    """A fit of a virtual campaign with two shared effects."""
    campaign = virtual_campaign("v", np.random.default_rng(2), effect="EBB:harmonic2", peak=5e-3)
    return fit(problem_of(campaign, Model("m", added=("EBB:harmonic2", "EYX:poly2"))))


def test_two_ways_covariance_with_shared_effects_is_that_of_all_unknowns_at_once(shared):
    solution, place = shared.solution, 4
    last = solution.last
    runs, rows, local = last.local.shape
    common = last.common.shape[-1]
    # The Jacobian of all runs, dense.
    dense = np.zeros((runs * rows, runs * local + common))
    for run in range(runs):
        own = slice(run * rows, (run + 1) * rows)
        dense[own, run * local : (run + 1) * local] = last.local[run]
        dense[own, runs * local :] = last.common[run]
    scale = np.linalg.norm(dense, axis=0)
    covariance = np.linalg.inv((dense / scale).T @ (dense / scale)) / scale[:, None] / scale
    names = len(shared.problem.base_names)
    chosen = [*(place * local + np.arange(names)), *(runs * local + np.arange(common))]
    whole = covariance[np.ix_(chosen, chosen)]
    alone = np.zeros_like(whole)
    own = last.local[place]
    unit = np.linalg.norm(own, axis=0)
    alone[:names, :names] = (np.linalg.inv((own / unit).T @ (own / unit)) / unit[:, None] / unit)[
        :names, :names
    ]
    added = _of_shared(shared, place, list(range(names)), list(range(common))) / shared.scale**2
    size = np.sqrt(np.diag(whole))
    np.testing.assert_allclose(
        (alone + added) / np.outer(size, size), whole / np.outer(size, size), atol=1e-7
    )


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    """A database with one virtual campaign that hides an indexing error of B."""
    folder = tmp_path_factory.mktemp("volumetric")
    simulate(SimulateRequest(folder / "hidden", "EBB:harmonic2", 8.0, 1.0, 3))
    with Database(folder / "map.duckdb") as db:
        import_folders(db, ImportRequest([folder / "hidden"]))
        add_effect(db, AddEffectRequest("EBB:harmonic2", "samba", "with-b"))
        yield db


def test_a_shared_effect_takes_part_in_the_map(database):
    plain = map_answer(map_run(database, VolumetricRequest("hidden", points=3)))
    mapped = map_run(database, VolumetricRequest("hidden", points=3, model="with-b"))
    found = map_answer(mapped)
    assert "EBB:harmonic2.cos" in found.parameters
    assert "EBB:harmonic2.cos" not in plain.parameters
    place = found.parameters.index("EBB:harmonic2.cos")
    assert mapped.errors.covariance[place, place] > 0.0
    assert np.all(np.linalg.eigvalsh(mapped.errors.covariance) > -1e-18)
    # Without the effect the plain model carries lack of fit, and its map is less certain for it.
    assert found.least_certain.u_um < plain.least_certain.u_um


def test_what_is_determined_of_an_effect_is_in_the_map(database):
    """One step beyond all positions took the other out of the map."""
    answers = []
    for model, places in (("one", "20"), ("beyond", "20,9000")):
        add_effect(database, AddEffectRequest(f"EXX:step({places})", "samba", model))
        answers.append(map_answer(map_run(database, VolumetricRequest("hidden", points=3, model=model))))
    alone, beside = answers
    name, beyond = "EXX:step(20,9000).20mm", "EXX:step(20,9000).9000mm"
    assert name in beside.parameters
    assert beyond not in beside.parameters
    assert beyond in [left.parameter for left in beside.left_out]
    assert name not in [left.parameter for left in beside.left_out]
    assert beside.worst.error_um == pytest.approx(alone.worst.error_um, rel=1e-6)
    assert beside.worst.u_um == pytest.approx(alone.worst.u_um, rel=1e-6)


def test_strokes_of_the_machine_file_bound_the_map(database):
    mapped = map_run(database, VolumetricRequest("hidden", points=2))
    found = map_answer(mapped)
    assert not mapped.from_strokes
    for name, ends in found.region.readings_mm.items():
        readings = mapped.evaluated.campaign.probings.readings[name]
        assert ends == (readings.min(), readings.max())


def test_what_is_drawn_has_axes_and_vectors_in_the_order_of_the_directions_whatever_the_chain(database):
    # The chain is w C B X b Z Y (C1) t: its axes come in the order X, Z, Y.
    mapped = map_run(database, VolumetricRequest("hidden", 20))
    document = map_answer(mapped)
    drawn = at_pose(mapped)
    assert drawn.axes == ("X", "Y", "Z")
    joints = [joint.name for joint in mapped.errors.chain.joints]
    assert joints.index("Z") < joints.index("Y")
    for column, axis in enumerate(drawn.axes):
        place = joints.index(axis)
        sign = mapped.errors.chain.joints[place].sign
        np.testing.assert_array_equal(
            drawn.readings_mm[:, column], sign * mapped.error.positions[:343, place]
        )
    assert [one.across for one in document.slices] == ["Z", "Y", "X"]
    first = document.slices[0]
    corner = int(
        np.flatnonzero(
            (drawn.readings_mm[:, 0] == first.first_mm[0])
            & (drawn.readings_mm[:, 1] == first.second_mm[0])
            & (abs(drawn.readings_mm[:, 2] - first.at_mm) < 1e-6)
        )[0]
    )
    assert first.first_um[0][0] == pytest.approx(drawn.vectors_um[corner, 0], abs=1e-4)
    assert first.second_um[0][0] == pytest.approx(drawn.vectors_um[corner, 1], abs=1e-4)
