"""Where none is named, the effect that comes nearest is, with why it is not; a step within a run is said as one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.evidence.refusal import Refusal
from monitor.discovery.machine.explain import Explanation
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.reporting.nearest_words import WHY_REFUSED
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, Y, Z

SETUP = """
[[setups]]
id = "sky"
reading = "direction"
standard_uncertainty_urad = 5.0
tool_direction = [1.0, 0.0, 0.0]
"""
STARS, STEPS_AT = 100, 51


def night(folder: Path, collimation: np.ndarray, azimuth: np.ndarray | None = None) -> Explanation:
    """What is said of a night in which the collimation and the zero of the azimuth are off by so many rad (n,)."""
    zero = np.zeros_like(collimation) if azimuth is None else azimuth
    rng = np.random.default_rng(3)
    mount = SimulatedChain(
        (SimulatedAxis("AZ", "rotary", Z, sign=-1), SimulatedAxis("EL", "rotary", Y, sign=-1))
    )
    rows: list[dict[str, object]] = []
    for number, off in enumerate(collimation):
        at = {
            "AZ": round(float(rng.uniform(0, 360)), 5),
            "EL": round(float(np.rad2deg(np.arcsin(rng.uniform(0.26, 0.98)))), 5),
        }
        at_sky = {**at, "AZ": at["AZ"] + float(np.rad2deg(zero[number]))}
        star = mount.pose(at_sky)[:3, :3] @ np.array([1.0, off, 0.0]) + 5e-6 * rng.standard_normal(3)
        star = star / np.linalg.norm(star)
        time = {"time_s": 60.0 * number, "setup": "sky"}
        rows.append({**time, **at, "direction_x": star[0], "direction_y": star[1], "direction_z": star[2]})
    campaign = read_campaign(mount.write(folder / "night", SETUP, rows))
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def test_every_rule_has_its_words() -> None:
    assert set(WHY_REFUSED) == {rule.value for rule in Refusal}


@pytest.mark.slow
def test_a_collimation_that_steps_within_the_night_is_said_to(tmp_path: Path) -> None:
    found = night(tmp_path, 40e-6 * (np.arange(STARS) >= STEPS_AT - 1))
    assert found.missing == ()
    step = found.stepped
    assert step is not None
    assert step.errors[0] == "ECEL:const"
    assert (step.moment.run, step.moment.sequence) == (1, STEPS_AT)
    assert step.rms_after < 0.5 * step.rms_before
    answer = machine_explanation(found).answer
    assert f"as if ECEL:const stepped within run 1, from sequence {STEPS_AT} on, by " in answer
    assert f"or add ECEL:const@stepped(run 1, sequence {STEPS_AT}) to the model" in answer
    assert "explains more" not in answer


@pytest.mark.slow
def test_a_zero_that_is_lost_is_a_step_and_the_drift_that_takes_it_up_no_finding(tmp_path: Path) -> None:
    found = night(tmp_path, np.zeros(STARS), 60e-6 * (np.arange(STARS) >= STEPS_AT - 1))
    assert found.missing == ()
    step = found.stepped
    assert step is not None
    assert step.effect.text == f"EC0AZ@stepped(run 1, sequence {STEPS_AT})"
    assert abs(step.size) == pytest.approx(60e-6, abs=4.0 * step.u)
    assert step.instead_of == ("EC0AZ@run_time",)
    assert step.effect.text in [effect.text for effect in found.final.problem.added]
    said = machine_explanation(found)
    assert said.nearest is not None
    assert (said.nearest.effect, said.nearest.refusal) == ("EC0AZ@run_time", "stepped")
    assert said.stepped is not None
    assert said.stepped.unit == "µrad"
    assert "EC0AZ@run_time would explain far less" in said.answer


@pytest.mark.slow
def test_a_collimation_that_walks_is_no_step(tmp_path: Path) -> None:
    """What comes nearest to a walk is named with what it would leave, and the noise that it may be."""
    found = night(tmp_path, 4e-6 * np.cumsum(np.random.default_rng(8).standard_normal(STARS)))
    assert found.missing == ()
    assert found.stepped is None
    nearest = machine_explanation(found).nearest
    assert nearest is not None
    assert nearest.refusal == "noise"
    assert nearest.rms_after_um < nearest.rms_before_um
    answer = machine_explanation(found).answer
    assert f"nearest of the catalogue comes {nearest.effect}" in answer
    assert nearest.why in answer


@pytest.mark.slow
def test_more_left_than_noise_is_said_beside_what_was_found(tmp_path: Path) -> None:
    drift = np.linspace(0.0, 300e-6, STARS)
    found = night(tmp_path, drift + 2e-5 * np.random.default_rng(5).standard_normal(STARS))
    assert [effect.effect for effect in found.missing] == ["ECEL:const@run_time"]
    assert found.stepped is None
    said = machine_explanation(found)
    assert said.remaining is not None
    assert said.remaining.beyond_noise
    assert "more is left than noise leaves: add it and ask again" in said.answer
    right = machine_explanation(night(tmp_path / "right", drift))
    assert right.remaining is not None
    assert right.remaining.beyond_noise is None
    assert "ask again" not in right.answer
