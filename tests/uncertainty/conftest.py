"""Outside references of the uncertainty tests."""

import json
from pathlib import Path

import numpy as np
import pytest

from monitor.effects import Context, parse_effect
from monitor.machine import parse_topology, touching_positions
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.chain.touch import Distance, TouchProblem
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign
from monitor.uncertainty import measured_run

REFERENCES = Path(__file__).parents[1] / "references"


@pytest.fixture(scope="session")
def gum():
    """A function that reads one file of the GUM references."""
    return lambda name: json.loads((REFERENCES / "gum" / f"{name}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def references():
    """The folder of outside references."""
    return REFERENCES


@pytest.fixture(scope="session")
def make_run():
    """A function that makes a run of any topology, with made-up errors, noise and a bar of two targets."""

    def make(topology, added=(), *, spindle=True, poses=12, noise=1e-3, size=1e-5, seed=1):
        rng = np.random.default_rng(seed)
        chain = parse_topology(topology) if isinstance(topology, str) else topology
        base = tuple(parse_effect(text, chain) for text in base_effects(chain))
        more = tuple(parse_effect(text, chain) for text in added)
        places = np.array([[100.0, 10, 150], [-5, 120, 160], [-110, -10, 100], [10, -115, 80], [0, 30, 20]])
        count = poses * len(places)
        turning = np.array([joint.turns for joint in chain.joints])
        angles = np.round(rng.uniform(-1.2, 1.2, (poses, len(chain.joints))), 2)
        spins = np.array([joint.kind == "spindle" for joint in chain.joints])
        angles[:, spins] = (np.arange(poses)[:, None] % 4) * np.pi / 2 if spindle else 0.0
        positions = np.repeat(angles * turning, len(places), axis=0)
        target = np.tile(places, (poses, 1))
        names = np.tile([f"b{i}" for i in range(len(places))], poses)
        tip = np.array([0.02, -0.03, -150.0])

        def context(where):
            return Context(
                chain=chain,
                positions=where,
                run=np.ones(count, dtype=np.int64),
                sequence=np.arange(1, count + 1),
                time=np.arange(float(count)),
                day_time=np.arange(float(count)),
                run_time=np.linspace(0.0, 1.0, count),
                target=names,
                nominal=target,
                columns={},
            )

        none = np.zeros((count, len(chain.joints), 2, 6))
        positions = touching_positions(chain, positions, none, target, tip)
        held = rng.standard_normal(99) * size * 0.1
        for turn in range(3):
            errors = np.zeros((count, len(chain.joints), 2, 6))
            here = context(positions)
            place = 0
            for number, effect in enumerate((*base, *more)):
                basis = effect.basis(here)
                k = basis.columns.shape[1]
                rate = (1.0 if basis.term.is_rotation else 1e3) / max(1.0, np.max(np.abs(basis.columns)))
                value = np.full(k, size * (1 + number % 3)) if number < len(base) else held[place : place + k]
                if number >= len(base):
                    held[place : place + k] = value = value * (rate if turn == 0 else 1.0)
                    place += k
                lever = 1.0 if basis.term.is_rotation or effect.is_gain else 100.0
                basis.apply(value * lever if number < len(base) else value, errors, target)
            positions = touching_positions(chain, positions, errors, target, tip)
        positions[:, ~turning] += noise * rng.standard_normal((count, 3))
        length = float(np.linalg.norm(places[0] - places[3]))
        problem = TouchProblem(
            context=context(positions),
            base=base,
            added=more,
            sigma=np.full((count, 3), 1e-3),
            distances=(Distance(("b0", "b3"), np.array([length]), 1.2e-3),),
            tip=tuple(tip),
        )
        return measured_run(problem, 1, held[:place])

    return make


@pytest.fixture(scope="session")
def campaign():
    """A function that reads an example campaign and gives its problem."""
    folder = Path(__file__).parents[2] / "examples"
    return lambda name: problem_of(read_campaign(folder / name))
