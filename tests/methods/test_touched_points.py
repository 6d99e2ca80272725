"""Ball plates that a CMM without errors touches, laid anew in every run: simulated here with numpy alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.fit import fit
from monitor.discovery.machine.noise.plan_cells import plan_cells, revisited_cells
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.alias_pitches import aliases_of, as_it_appears
from monitor.discovery.machine.shapes.cycles import best_cycle
from monitor.discovery.machine.shapes.shown_cycles import is_shown
from monitor.discovery.machine.shapes.variants import (
    cycles_of_unknown_pitch,
    resolvable,
)
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shapes import Cyclic
from monitor.methods import campaign_method
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.readers import read_campaign

HEAD = 'format = 1\ncampaign = "plates"\nmethod = "instruments"\n\n[machine]\nid = "cmm"\n'
AXIS = '\n[[machine.tool_chain]]\nname = "{name}"\nkind = "linear"\nalong = "{name}"\n'
SETUP = """
[[setups]]
id = "{name}"
reading = "point"
instrument = "ball plate"
standard_uncertainty_um = 0.8
tool_point_mm = [0.0, 250.0, 0.0]
known = ["targets", "scale"]
"""
# Name, corner, the two directions of the rows and how many balls a row has. X of the last lies on steps of 14 mm.
PLATES = (
    ("xy", (-150.0, 200.0, 100.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 6),
    ("xz", (-150.0, 420.0, 60.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 6),
    ("yz", (40.0, 210.0, 60.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 6),
    ("turned", (-120.0, 230.0, 420.0), (0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), 5),
)


def plates(
    folder: Path,
    seed: int,
    *,
    cycle: float = 0.0,
    pitch: float = 35.0,
    commanded: bool = False,
    once: bool = False,
    clamped: bool = False,
    digits: int = 6,
) -> tuple[InstrumentProblem, np.ndarray]:
    """The problem of balls 70 mm apart, touched forth and back in two runs; the noise (n, 3) mm of X, Z, Y.

    Each plate lies anew within 2 mm in each run, unless it stays ``clamped``; ``cycle`` mm repeat every ``pitch``
    mm along X.
    Axes that are ``commanded`` stand at the same positions in both runs, or at each ``once`` only, and the noise is
    that of the points. The display of the axes has ``digits``.
    """
    rng = np.random.default_rng(seed)
    lines = ["run,sequence,time_s,setup,target,x_mm,z_mm,y_mm,point_x_mm,point_y_mm,point_z_mm"]
    noises = []
    for run in (1, 2):
        sequence = 0
        for name, corner, u, v, count in PLATES:
            row, column = np.divmod(np.arange(count**2), count)
            place = np.array(corner) + 70.0 * np.outer(column, u) + 70.0 * np.outer(row, v)
            place = place if once else np.concatenate([place, place[::-1]])
            lay = np.zeros(3) if commanded or clamped else rng.uniform(-1.0, 1.0, 3)
            lay += 3.0 * run if once else 0.0
            noise = rng.normal(0.0, 0.8e-3, place.shape)
            axes = place + lay - [0.0, 250.0, 0.0]
            point = place - place.mean(axis=0)
            axes[:, 0] -= cycle * np.cos(2.0 * np.pi * axes[:, 0] / pitch - 1.0)
            if commanded:
                point = point + noise
            else:
                axes = axes + noise
            noises.append(noise)
            for (x, y, z), seen in zip(axes, point, strict=True):
                sequence += 1
                numbers = ",".join(f"{number:.{digits}f}" for number in (x, z, y))
                numbers += "".join(f",{number:.6f}" for number in seen)
                lines.append(f"{run},{sequence},{30.0 * sequence},{name},tip,{numbers}")
    axes_text = "".join(AXIS.format(name=name) for name in "XZY")
    setups = "".join(SETUP.format(name=plate[0]) for plate in PLATES)
    (folder / "campaign.toml").write_text(HEAD + axes_text + setups, encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2025-02-01T08:00:00+00:00,1,false,20.0\n"
        "2,2025-02-01T11:00:00+00:00,1,false,20.4\n",
        encoding="utf-8",
    )
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    assert isinstance(problem, InstrumentProblem)
    return problem, np.concatenate(noises)[:, [0, 2, 1]]


def test_effects_look_at_where_a_ball_is_and_not_at_what_was_read(tmp_path: Path) -> None:
    """Was: a cycle whose every position lies where its sine passes through zero took the noise for itself."""
    problem, noise = plates(tmp_path, 0)
    context = problem.for_search().context
    taken = context.positions - context.places
    assert np.all(np.std(taken - noise, axis=0) < 0.25 * np.std(noise, axis=0))


def test_a_model_with_a_reversal_looks_where_its_search_did(tmp_path: Path) -> None:
    """Was: `compare` and `model history` saw the direction in what was read, from 10 µm on, `explain` at the balls,
    from 0.1 mm on: of one model and campaign one said 0.80 µm and explained, the other 0.99 µm and two bad points."""
    searched = plates(tmp_path, 0)[0].for_search().context
    campaign = read_campaign(tmp_path)
    method = campaign_method(campaign)
    problem = method.problem_of(campaign, replace(method.own_model, added=("EXX:reversal",)))
    assert problem.for_search() is problem
    np.testing.assert_array_equal(problem.context.places, searched.places)
    np.testing.assert_array_equal(problem.context.travel, searched.travel)
    assert problem.context.stops_are_stated


@pytest.mark.parametrize("once", [False, True])
def test_axes_that_are_told_where_to_go_stand_there(once: bool, tmp_path: Path) -> None:
    """Was: where each position was read once, the axes were taken as brought to balls, and reversals as noise."""
    problem, _ = plates(tmp_path, 0, commanded=True, once=once)
    assert problem.for_search() is problem


def test_points_that_a_coarse_display_makes_equal_are_no_stated_places(tmp_path: Path) -> None:
    """A tracker prints 0.01 mm and repeats within 3 µm; the scales of axes that were told read a micrometre beside."""
    rng = np.random.default_rng(1)
    grid = 70.0 * np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3)
    told = np.concatenate([grid, grid[::-1], grid])
    axes, points = told + rng.normal(0.0, 1e-3, told.shape), told + rng.normal(0.0, 3e-3, told.shape)
    lines = ["run,sequence,time_s,setup,target,x_mm,z_mm,y_mm,point_x_mm,point_y_mm,point_z_mm"]
    for row, ((x, y, z), seen) in enumerate(zip(axes, points, strict=True), start=1):
        read = "".join(f",{number:.2f}" for number in seen)
        lines.append(f"1,{row},{30 * row},xy,tip,{x:.6f},{z:.6f},{y:.6f}{read}")
    plates(tmp_path, 0)
    toml = (tmp_path / "campaign.toml").read_text(encoding="utf-8").split("[[setups]]")
    head = "[[setups]]".join(toml[:2]).replace("uncertainty_um = 0.8", "uncertainty_um = 3.0")
    (tmp_path / "campaign.toml").write_text(head, encoding="utf-8")
    (tmp_path / "runs.csv").write_text(
        "run,started_at,day,warm_up\n1,2025-02-01T08:00:00+00:00,1,false\n", encoding="utf-8"
    )
    (tmp_path / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert not campaign_method(campaign).problem_of(campaign).stopping.rows.any()


def test_a_row_that_stands_twice_does_not_hide_that_axes_stop_at_balls(tmp_path: Path) -> None:
    plates(tmp_path, 0)
    file = tmp_path / "probings.csv"
    text = file.read_text(encoding="utf-8")
    last = text.splitlines()[-1]
    run, sequence, rest = last.split(",", 2)
    file.write_text(f"{text}{run},{int(sequence) + 1},{rest}\n", encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert campaign_method(campaign).problem_of(campaign).stopping.rows.all()


@pytest.mark.parametrize("digits", [3, 6])
def test_rows_of_a_plate_that_stays_clamped_are_of_one_cell_whatever_the_display(
    digits: int, tmp_path: Path
) -> None:
    """Was: of a display of 1 µm rows were of one cell whose noise agrees: repeatability 0.17 µm in place of 0.8."""
    problem, _ = plates(tmp_path, 0, clamped=True, digits=digits)
    once = len(problem.context) // 2
    assert len(np.unique(plan_cells(problem))) == once
    assert np.array_equal(plan_cells(problem)[:once], plan_cells(problem)[once:])
    # A row of a run may be turned round at: its second touch shows the probe alone.
    assert len(np.unique(revisited_cells(problem))) == once // 2 + len(PLATES)


def test_a_plate_that_is_laid_anew_has_other_cells(tmp_path: Path) -> None:
    problem, _ = plates(tmp_path, 0, digits=3)
    assert len(np.unique(plan_cells(problem))) == len(problem.context)


def test_a_plate_that_is_laid_anew_is_a_grid_in_each_run(tmp_path: Path) -> None:
    """X of all balls together lies anyhow; those of the turned plate are 14 mm apart."""
    context = plates(tmp_path, 0)[0].context
    pitches = [
        effect.shape.pitch
        for variant in resolvable(cycles_of_unknown_pitch(context), context)
        if isinstance(effect := variant.effect, ChainEffect) and isinstance(effect.shape, Cyclic)
        if effect.joint.name == "X"
    ]
    assert min(pitches) > 27.9
    assert max(pitches) > 100.0


def test_a_lead_is_told_with_the_pitch_that_the_grid_takes_it_for(tmp_path: Path) -> None:
    """On steps of 14 mm a cycle of 10 mm is one of 35 mm: 1/10 = 1/14 + 1/35."""
    context = plates(tmp_path, 0)[0].context
    (longer,) = as_it_appears(parse_effect("EXX:cyclic10mm", context.chain), context)
    assert isinstance(longer.effect, ChainEffect)
    assert isinstance(longer.effect.shape, Cyclic)
    assert abs(longer.effect.shape.pitch - 35.0) < 0.05
    assert not as_it_appears(longer.effect, context)
    # 1/14 - 1/35 is 1/23.33.
    pitches = [alias.effect.text.removeprefix("EXX:cyclic") for alias in aliases_of(longer.effect, context)]
    assert pitches == ["23.3333mm", "10mm"]


@pytest.mark.parametrize(
    ("pitch", "cycle", "shown"),
    [("6.99607", 0.0, False), ("35", 3e-3, True), ("35", 40e-3, True), ("35", 0.7, False)],
)
def test_a_cycle_has_to_show_and_be_no_steeper_than_a_machine(
    tmp_path: Path, pitch: str, cycle: float, shown: bool
) -> None:
    """6.996 mm is a 10th of 70 and half of 14: of 0.4 mm a micrometre is left at the balls. 0.7 mm every 35 mm rise by
    0.13."""
    problem, _ = plates(tmp_path, 0, cycle=cycle)
    text = f"EXX:cyclic{pitch}mm"
    fitted = fit(problem)
    scene = scene_of(fitted, [Variant(text, parse_effect(text, problem.context.chain))])
    sizes = amplitudes(scene, scene.candidates).estimate
    (evidence,) = weigh_beside(scene, scene.candidates, [])
    removed = evidence.explained * fitted.sigma**2
    assert is_shown(scene.candidates[0], sizes, removed) == shown


@pytest.mark.parametrize(("pitch", "told"), [(140.0, [140.0]), (280.0, [280.0])])
def test_a_cycle_has_one_and_a_half_periods_in_the_travel(
    tmp_path: Path, pitch: float, told: list[float]
) -> None:
    """Was: a dead zone as a cycle of 312 mm of an axis that travelled 462 mm, for which to enter a compensation. From
    the grid, that ended at half of the travel, the best pitch was looked for beyond."""
    problem, _ = plates(tmp_path, 0, cycle=8e-3, pitch=pitch)
    shape = parse_effect("EXX:free(3)", problem.context.chain)
    scene = scene_of(fit(problem), [Variant("EXX:free", shape)])
    travel = float(np.ptp(problem.context.positions[:, problem.context.chain.index("X")]))
    assert 1.5 * 280.0 < travel < 2.0 * 280.0
    pitches = [
        cycle.effect.shape.pitch
        for cycle in best_cycle(scene, scene.candidates[0], [])
        if isinstance(cycle.effect, ChainEffect) and isinstance(cycle.effect.shape, Cyclic)
    ]
    np.testing.assert_allclose(pitches, told, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_plates_of_a_machine_without_errors_show_no_cycle(seed: int, tmp_path: Path) -> None:
    """Was: EXX:cyclic6.996mm of some 0.4 mm, in most."""
    problem, _ = plates(tmp_path, seed)
    answer = explain(read_campaign(tmp_path), problem, "instruments", rng=np.random.default_rng(1))
    assert not [missing.effect for missing in answer.missing if "cyclic" in missing.effect]
