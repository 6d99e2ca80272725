"""Write the challenge: campaigns with hidden effects, as folders that any program can read, and their sealed truth.

``python tests/challenge/generate.py OUT [--campaigns N] [--first K] [--seed S]``. ``OUT/campaigns/0001`` and so on are
campaign folders (docs/campaign-format.md); ``OUT/truth.json`` is the truth, ``OUT/truth.sha256`` its hash, which may be
published before anyone answers. Nothing here stems from the product: the simulator of the tests makes every reading.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import simulator as simulator_of

SEED, CAMPAIGNS = 20261122, 1000
#: Topology, the rotary axes that are indexed, where gravity points, and the stylus.
MACHINES: dict[str, tuple[str, tuple[str, ...], tuple[float, float, float], tuple[float, float, float]]] = {
    "two tables": ("w C B X b Z Y (C1) t", ("B", "C"), (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
    "trunnion": ("w C A Y X b Z (C1) t", ("A", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, -150.0)),
    "table on a bridge": ("w C A b X Y Z (C1) t", ("A", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, -150.0)),
    "fork head": ("w X b Y Z C B (C1) t", ("B", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, -150.0)),
}
TILTS = (-60, 0, 0, 0, 30, 90, 50, 0, 15, 0, -45, -90)
TURNS = (-235, -135, 0, 90, 175, 270, 170, 135, 0, -50, -90, -270)
NOISES = ("white", "white", "correlated by 0.3", "correlated by 0.6", "Student, 4", "days that differ")
#: Kinds of effects, and how often each is drawn.
KINDS = {
    "straightness": 3, "play": 3, "turn": 3, "pitch": 1, "heat": 3, "warm-up": 2, "shape outside": 2,
}  # fmt: skip
PEAKS_UM = (1.5, 10.0)
#: Shapes outside of the catalogue, of a displacement in parts of its stroke from -1 to 1.
OUTSIDE = {
    "bump": lambda x: np.exp(-(((x - 0.3) / 0.2) ** 2)),
    "dead zone": lambda x: np.sign(x) * np.maximum(np.abs(x) - 0.4, 0.0),
    "step in a scale": lambda x: (x > 0.15).astype(float),
    "sawtooth": lambda x: (2.5 * x) % 1.0,
    "fifth wave": lambda x: np.sin(5.0 * np.pi * x),
}


@dataclass(frozen=True)
class Hidden:
    """An effect of the truth; ``effect`` is its name, without a shape where the catalogue has none."""

    effect: str
    kind: str
    peak_um: float


def _draw(rng: np.random.Generator, linear: list[str], rotary: list[str]) -> tuple[str, str, str]:
    """Name, kind and curve (empty: none) of an effect."""
    names, shares = list(KINDS), np.array(list(KINDS.values()), dtype=float)
    kind = str(rng.choice(names, p=shares / shares.sum()))
    of, table, one = str(rng.choice(linear)), str(rng.choice(rotary)), str(rng.choice(list("XYZ")))
    six = str(rng.choice(list("XYZABC")))
    if kind == "straightness":
        return f"E{six}{of}:poly{rng.integers(2, 4)}", kind, ""
    if kind == "play":
        return f"E{of if rng.random() < 0.7 else six}{of}:reversal", kind, ""
    if kind == "turn":
        return f"E{six}{table}:harmonic{rng.integers(1, 4)}", kind, ""
    if kind == "pitch":
        return f"E{of}{of}:cyclic{rng.choice([5, 10, 20])}mm", kind, ""
    if kind == "heat":
        return f"E{one}C1:const@x_axis_degC", kind, ""
    if kind == "warm-up":
        return f"E{one}C1:const@warmup", kind, ""
    return f"E{six}{of if rng.random() < 0.6 else table}:curve", kind, str(rng.choice(list(OUTSIDE)))


def _noise(kind: str):
    """Noise (N, 3) of unit variance from a generator and the run (N,) of every probing; None: white."""

    def made(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        x = rng.standard_normal((len(run), 3))
        if kind.startswith("Student"):
            return rng.standard_t(4.0, x.shape) / np.sqrt(2.0)
        if kind.startswith("days"):
            level = rng.standard_normal((int(run.max()) // 4 + 1, 3))
            return (x + 0.7 * level[(run - 1) // 4]) / np.sqrt(1.49)
        correlation = float(kind.rpartition(" ")[2])
        for row in range(1, len(run)):
            if run[row] == run[row - 1]:
                x[row] = correlation * x[row - 1] + np.sqrt(1.0 - correlation**2) * x[row]
        return x

    return None if kind == "white" else made


def _curve(name: str):
    shape = OUTSIDE[name]
    return lambda q, travel, now: shape(q / max(float(np.abs(q).max()), 1e-9))


def campaign(number: int, seed: int, sim: ModuleType) -> tuple[dict[str, Any], tuple[Any, ...]]:
    """The truth of a campaign, and its plan, machine, schedule and readings; each has a seed of its own."""
    rng = np.random.default_rng([seed, number])
    kind = str(rng.choice(list(MACHINES)))
    topology, rotary, down, tip = MACHINES[kind]
    linear = [name for name in "XYZ" if name in topology]
    count = int(rng.choice(5, p=[0.25, 0.3, 0.2, 0.15, 0.1]))
    drawn: dict[str, tuple[str, str]] = {}
    while len(drawn) < count:
        name, of_kind, curve = _draw(rng, linear, list(rotary))
        # No two of one term: which of them an answer means could not be said.
        if name.partition(":")[0] not in {other.partition(":")[0] for other in drawn}:
            drawn[name] = (of_kind, curve)
    peaks = np.exp(rng.uniform(*np.log(PEAKS_UM), count)).round(2)
    effects = []
    for (name, (_, curve)), peak in zip(drawn.items(), peaks, strict=True):
        # A wave has two coefficients: their ratio is drawn.
        waves = "harmonic" in name or "cyclic" in name
        direction = tuple(rng.normal(size=2).round(3)) if waves else None
        tau_s, values = float(rng.uniform(900.0, 5400.0)), _curve(curve) if curve else None
        effects.append(sim.Effect(name, peak_um=float(peak), direction=direction, tau_s=tau_s, curve=values))
    schedule = sim.working_days(rng, days=5, runs_per_day=int(rng.choice([2, 4])))
    indexed = [dict(zip((*rotary, "C1"), (a, c, 0), strict=True)) for a, c in zip(TILTS, TURNS, strict=True)]
    indexed += [{rotary[0]: 0, rotary[1]: 0, "C1": angle} for angle in (90, 180, 270)]
    plan = sim.indexed_plan(kind, indexed, bar_after=3, probe_uncertainty_um=1.0)
    terms = {"EXX:poly1": 18e-6, "EYY:poly1": -12e-6, "EZZ:poly1": 25e-6}
    wander, step = bool(rng.random() < 0.4), bool(rng.random() < 0.2)
    of_runs: dict[str, Any] = sim.wandering(terms, schedule, rng, per_run=0.3) if wander else dict(terms)
    if step:
        of_runs["EXX:poly1"] = of_runs["EXX:poly1"] + 15e-6 * (np.array(schedule.day) > 3)
    noise = str(rng.choice(NOISES))
    machine = sim.SimulatedMachine(
        topology=topology, signs={name.strip("()"): 1.0 for name in topology.split() if name not in "wbt"},
        terms=of_runs, effects=tuple(effects), tip_mm=tip, down=down,
    )  # fmt: skip
    told = sim.simulate(plan, machine, schedule, rng, noise_um=1.0, noise=_noise(noise))
    made = {effect.name: effect for effect in told["effects"]}
    hidden = [
        {
            "effect": name.partition(":")[0] if curve else name,
            "shape_outside": curve or None,
            "kind": of_kind,
            "peak_um": float(peak),
            "coefficients": None
            if curve
            else [float(f"{c:.4g}") for c in np.atleast_1d(made[name].coefficients)],
        }
        for (name, (of_kind, curve)), peak in zip(drawn.items(), peaks, strict=True)
    ]
    truth = {
        "campaign": f"{number:04d}", "machine": kind, "noise": noise, "wandering": wander, "step": step,
        "runs": schedule.runs, "effects": hidden,
    }  # fmt: skip
    return truth, (plan, machine, schedule, told)


def write(out: Path, first: int, campaigns: int, seed: int) -> str:
    """Write campaigns ``first`` and so on, and their truth; return its hash."""
    sim = simulator_of()
    every = []
    for number in range(first, first + campaigns):
        truth, (plan, machine, schedule, told) = campaign(number, seed, sim)
        plan = replace(plan, name=truth["campaign"])
        name = truth["campaign"]
        sim.write_campaign(
            out / "campaigns" / name, f"challenge-{name}", plan, machine, schedule, told, f"machine-{name}"
        )
        every.append(truth)
    text = json.dumps({"seed": seed, "campaigns": every}, indent=1, ensure_ascii=False)
    sealed = hashlib.sha256(text.encode()).hexdigest()
    (out / "truth.json").write_text(text, encoding="utf-8")
    (out / "truth.sha256").write_text(f"{sealed}  truth.json\n", encoding="utf-8")
    return sealed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--campaigns", type=int, default=CAMPAIGNS)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    sealed = write(options.out, options.first, options.campaigns, options.seed)
    print(f"{options.campaigns} campaigns in {options.out / 'campaigns'}; truth.json has sha256 {sealed}")


if __name__ == "__main__":
    main()
