"""An axis that grows with a temperature, late, where hardly anything shows that it is late: by numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery.machine.explain import Explanation, explain
from monitor.discovery.machine.separation.late import is_at_once
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.reporting.machine_finding import size_if_late
from monitor.workflow.explain.machine_answer import machine_explanation
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

#: µm/m/K.
GROWTH = 11.0


def explained(folder: Path, temperature: np.ndarray, seed: int, late: float) -> Explanation:
    """The explanation of a laser along X, there and back eight times, 1 µm of noise, a reading a minute at such
    temperatures (160,) in °C, which the axis follows ``late`` by so many s."""
    rng = np.random.default_rng(seed)
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    way = np.linspace(50.0, 500.0, 10)
    follows = temperature[0]
    rows: list[dict[str, object]] = []
    for number, x in enumerate(np.tile([*way, *way[::-1]], 8)):
        follows += (temperature[number] - follows) * (-np.expm1(-60.0 / late) if number else 0.0)
        reading = 1e3 * x + GROWTH * 1e-3 * x * (follows - 20.0) + rng.normal(0.0, 1.0)
        rows.append(
            {"run": 1, "setup": "laser", "X": x, "Y": 0.0, "Z": 0.0}
            | {"reading_um": round(reading, 2), "x_axis_degC": round(temperature[number], 3)}
        )
    campaign = read_campaign(chain.write(folder / "grown", laser(), rows))
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "instruments", rng=np.random.default_rng(1))


def test_what_follows_at_once_follows_late_by_the_same_temperature(tmp_path: Path) -> None:
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items()))
    rows = [
        {"run": 1, "setup": "laser", "X": 1.0 * x, "Y": 0, "Z": 0, "reading_um": 1e3 * x} for x in range(9)
    ]
    campaign = read_campaign(chain.write(tmp_path / "names", laser(), rows))
    of = campaign_method(campaign).problem_of(campaign).context.chain
    at_once, late, warm = (
        parse_effect(f"EXX:poly1@{driver}", of) for driver in ("x_axis_degC", "lagged_x_axis_degC", "warmup")
    )
    other = parse_effect("EXX:poly1@lagged_y_axis_degC", of)
    assert is_at_once(at_once, late)
    assert not any(is_at_once(*pair) for pair in ((late, at_once), (at_once, warm), (at_once, other)))


def test_the_sentence_has_the_shortest_and_the_longest_time_constant() -> None:
    sizes = [(10.0, 5.70, 1.404), (20.0, 7.44, 1.84), (160.0, 36.1, 8.99)]
    assert size_if_late("EXX:poly1@x_axis_degC", "µm/m/K", sizes).endswith(
        "then it is 5.7 ± 1.4 µm/m/K with a time constant of 10 min, up to 36.1 ± 9.0 µm/m/K with a time constant of "
        "160 min"
    )
    assert size_if_late("EXX", "µm", sizes[:1]).endswith(
        "then it is 5.7 ± 1.4 µm with a time constant of 10 min"
    )


@pytest.mark.slow
@pytest.mark.parametrize("late", [1.0, 300.0])
def test_a_growth_that_may_be_late_has_its_sizes_and_the_lag_as_its_rival(
    tmp_path: Path, late: float
) -> None:
    """A growth had 4.9 (1.2) of 11 um/m/K; where its best time constant was none, no lag was a rival."""
    found = explained(tmp_path, 20.0 + 0.4 * np.sin(60.0 * np.arange(160.0) / 2500.0), 4, late)
    (growth,) = found.missing
    assert growth.effect == "EXX:poly1@x_axis_degC"
    assert "EXX:poly1@lagged_x_axis_degC" in [rival.effect for rival in growth.rivals]
    assert min(size.time_constant_s for size in growth.if_late) == 600.0
    sizes = [growth.amplitude, *(size.amplitude for size in growth.if_late)]
    assert sizes == sorted(sizes)
    within = 3.0 * growth.u
    assert sizes[0] - within < GROWTH * 1e-6 < sizes[-1] + within
    assert any(
        "do not rule out that it follows late" in said for said in machine_explanation(found).undecided
    )
