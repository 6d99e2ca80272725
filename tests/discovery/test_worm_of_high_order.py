"""The worm of a table is looked for beyond half of its indexations where the positions tell such orders apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.alias_orders import aliases_of_order
from monitor.discovery.machine.shapes.gears import first_repeat, gear_variants
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, Z

TABLE = SimulatedChain((), (SimulatedAxis("C", "rotary", Z, sign=-1),))
AUTOCOLLIMATOR = """
[[setups]]
id = "autocollimator"
reading = "angle"
instrument = "autocollimator"
direction = [0.0, 0.0, 1.0]
standard_uncertainty_urad = 1.0
"""
STEPS, TEETH = 60, 72


def table(folder: Path, scatter: float, worm: float) -> Fit:
    """The fit of a table that is read at 60 positions, which ``scatter`` by so many degrees about a grid of 6, with a
    worm of 72 teeth that errs by ``worm`` urad."""
    rng = np.random.default_rng(11)
    at = np.round(np.arange(STEPS) * 360.0 / STEPS + rng.uniform(-scatter, scatter, STEPS), 3)
    readings = worm * np.cos(TEETH * np.radians(at) + 0.4) + rng.normal(size=STEPS)
    rows: list[dict[str, object]] = [
        {"run": 1, "setup": "autocollimator", "C": angle, "reading_urad": reading}
        for angle, reading in zip(at, readings, strict=True)
    ]
    campaign = read_campaign(TABLE.write(folder / "table", AUTOCOLLIMATOR, rows))
    return fit(campaign_method(campaign).problem_of(campaign))


def gears(fitted: Fit) -> list[str]:
    return [variant.effect.text for variant in gear_variants(scene_of(fitted, []), [], 0.01)]


def test_uneven_positions_tell_high_orders(tmp_path: Path) -> None:
    assert gears(table(tmp_path, 2.0, 12.0))[0] == f"ECC:harmonic{TEETH}"


def test_nothing_stands_out_of_noise_at_uneven_positions(tmp_path: Path) -> None:
    assert gears(table(tmp_path, 2.0, 0.0)) == []


def test_positions_on_a_grid_tell_the_lowest_order_alone(tmp_path: Path) -> None:
    fitted = table(tmp_path, 0.0, 12.0)
    assert gears(fitted) == ["ECC:harmonic12"]
    context = fitted.problem.context
    lowest = parse_effect("ECC:harmonic12", context.chain)
    alike = [variant.effect.text for variant in aliases_of_order(lowest, context)]
    assert alike == [f"ECC:harmonic{order}" for order in (48, TEETH, 108, 132)]


@pytest.mark.parametrize(("scatter", "repeats"), [(0.0, STEPS), (1.0, np.inf)])
def test_the_number_of_waves_that_positions_do_not_see(scatter: float, repeats: float) -> None:
    rng = np.random.default_rng(3)
    at = np.radians(np.arange(STEPS) * 360.0 / STEPS + rng.uniform(-scatter, scatter, STEPS))
    assert first_repeat(at) == pytest.approx(repeats, abs=0.3)
