"""Simulated campaigns as records. The independent simulator is loaded by path: tests/ is no package."""

from __future__ import annotations

import importlib
import importlib.util
import itertools
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from by_path import TESTS, load

from monitor.readers import read_campaign
from monitor.records import Array, Campaign


@pytest.fixture(scope="session")
def recorded() -> Callable[..., Campaign]:
    """Builds the campaign record of what the simulator told, as a reader would."""
    build: Callable[..., Campaign] = load("virtual_campaigns", TESTS / "discovery" / "virtual.py").as_campaign
    return build


Told = dict[str, Any]


@pytest.fixture
def simulated(
    simulator: ModuleType, recorded: Callable[..., Campaign]
) -> Callable[..., tuple[Told, Campaign]]:
    """What the simulator told of one run of the five-day plan (or what is asked for), and the record of it."""

    def make(
        seed: int,
        *,
        scale: float = 1.0,
        days: int = 1,
        runs: int = 1,
        plan: Any = None,
        effects: tuple[Any, ...] = (),
        **options: Any,
    ) -> tuple[Told, Campaign]:
        rng = np.random.default_rng(seed)
        plan = plan or simulator.five_days_plan()
        schedule = simulator.working_days(rng, days, runs)
        terms = {name: value * scale for name, value in simulator.SAMBA_TERMS.items()}
        machine = simulator.hu40(terms, effects)
        told = simulator.simulate(plan, machine, schedule, rng, **({"noise_um": 1.0} | options))
        return told, recorded(plan, machine, schedule, told)

    return make


@pytest.fixture
def truth(simulator: ModuleType) -> Array:
    return np.array(list(simulator.SAMBA_TERMS.values()))


@pytest.fixture(scope="session")
def distance() -> Callable[[Array, Array], float]:
    """(x - truth)' C^-1 (x - truth), chi-square of as many degrees of freedom where C is right."""

    def of(error: Array, covariance: Array) -> float:
        return float(error @ np.linalg.solve(covariance, error))

    return of


@pytest.fixture(scope="session")
def sim(simulator: ModuleType) -> ModuleType:
    """Layouts and touches of the method free-form."""
    return importlib.import_module("simulator.free_form")


@pytest.fixture
def made(sim: ModuleType, tmp_path: Path) -> Callable[..., tuple[Any, Campaign]]:
    """A simulated campaign, read from its folder, and its truth."""
    folders = itertools.count()

    def make(
        layout: Any,
        angles: Any,
        seed: int = 1,
        noise_um: float = 1.38,
        runs: int = 1,
        topology: str = "w C A b Y X Z (C1) t",
        scale: float = 1.0,
    ) -> tuple[Any, Campaign]:
        rng = np.random.default_rng(seed)
        truth = sim.draw_truth(layout, angles, rng, scale)
        told = [sim.probe(layout, angles, truth, rng, noise_um, topology) for _ in range(runs)]
        folder = tmp_path / str(next(folders))
        sim.write_folder(
            folder, "simulated", layout, told, truth.length * 1e3, (), topology, sim.PROBING_U_UM
        )
        return truth, read_campaign(folder)

    return make
