"""Virtual campaigns as records, from the independent simulator, without files. Loaded by path (``by_path``)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from by_path import simulator

from monitor.records import Artefact, AxisSettings, Ball, Campaign, Machine, Probe, Probings, Run, ScaleBar


def as_campaign(
    plan: Any,
    machine: Any,
    schedule: Any,
    told: dict[str, Any],
    *,
    keep: npt.NDArray[np.bool_] | None = None,
    stated_um: float | None = None,
    with_channels: bool = True,
) -> Campaign:
    """The record of what the simulator told, as a reader makes it; ``stated_um`` is what the probe's file says."""
    turning = {axis.name for axis in machine.chain.rotary}
    probings = Probings(
        told["run"],
        told["sequence"],
        told["time_s"],
        told["target"],
        {name: np.radians(r) if name in turning else r for name, r in told["readings"].items()},
        told["channels"] if with_channels else {},
    )
    bar = plan.bar and ScaleBar(plan.bar, plan.bar_length_mm, plan.bar_uncertainty_mm, "simulated")
    runs = zip(schedule.started_at, schedule.day, schedule.warm_up, schedule.ambient_degC, strict=True)
    stated = plan.probe_uncertainty_um if stated_um is None else stated_um
    return Campaign(
        "virtual",
        "samba",
        Machine(
            "V",
            machine.topology,
            axes={name: AxisSettings(name, int(sign)) for name, sign in machine.signs.items()},
        ),
        Probe("P", "p", stated * 1e-3),
        Artefact(
            "A", tuple(Ball(name, tuple(p), plan.ball_diameter_mm) for name, p in plan.balls.items()), bar
        ),
        tuple(
            Run(number, start, day, warm, {"ambient_degC": float(ambient)} if with_channels else {})
            for number, (start, day, warm, ambient) in enumerate(runs, 1)
        ),
        probings if keep is None else probings.rows(keep),
    )


def virtual(
    seed: int,
    effects: Any = (),
    *,
    noise_um: float = 1.0,
    stated_um: float | None = None,
    days: int = 5,
    runs_per_day: int = 4,
    cold: bool = False,
    runs: int = 44,
    terms: Any = None,
    wander: float = 0.0,
    keep: Any = None,
    with_channels: bool = True,
    **others: Any,
) -> tuple[Campaign, dict[str, Any]]:
    """A campaign of the five-days plan (or the cold-cold one) and what the simulator told.

    ``terms`` replace base terms (numbers or one a run); ``wander`` is their scatter from run to run in parts of
    their value; ``keep`` takes the told arrays and returns a mask of the probings that are kept.
    """
    sim = simulator()
    rng = np.random.default_rng(seed)
    plan = sim.cold_cold_plan() if cold else sim.five_days_plan()
    schedule = (
        sim.around_the_clock(rng, runs=runs)
        if cold
        else sim.working_days(rng, days=days, runs_per_day=runs_per_day)
    )
    base = {**sim.SAMBA_TERMS}
    if wander:
        base = sim.wandering(base, schedule, rng, per_run=wander)
    machine = sim.hu40({**base, **(terms or {})}, effects)
    told = sim.simulate(plan, machine, schedule, rng, noise_um=noise_um, **others)
    mask = None if keep is None else keep(told)
    campaign = as_campaign(
        plan, machine, schedule, told, keep=mask, stated_um=stated_um, with_channels=with_channels
    )
    return campaign, told


#: Machines beside the HU40-T: topology, the axes that are indexed (tilt, turn), where gravity points, the tip.
OTHER_MACHINES = {
    "trunnion": ("w C A b Y X Z (C1) t", ("A", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)),
    "tilting table on X": ("w C A X b Y Z (C1) t", ("A", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)),
    "head and table": ("w C b X Y Z B (C1) t", ("B", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, -200.0)),
    "fork head": ("w X b Y Z C B (C1) t", ("B", "C"), (0.0, 0.0, -1.0), (0.0, 0.0, -200.0)),
    "one rotary table": ("w B X b Z Y (C1) t", ("B", ""), (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
}
_PAIRS = [(-60, -235), (0, -135), (0, 0), (0, 90), (30, 175), (90, 270), (50, 170), (0, 135)]
_PAIRS += [(15, 0), (0, -50), (-45, -90), (-90, -270)]


def on_machine(
    kind: str, seed: int, effects: Any = (), *, noise_um: float = 1.0, stated_um: float | None = None
) -> tuple[Campaign, dict[str, Any]]:
    """A campaign of five days on one of ``OTHER_MACHINES``, indexed as in the five-days plan."""
    sim = simulator()
    topology, (tilt, turn), down, tip = OTHER_MACHINES[kind]
    poses = [{tilt: a, turn: c, "C1": 0} if turn else {tilt: a or c / 2, "C1": 0} for a, c in _PAIRS]
    poses += [{tilt: 0, **({turn: 0} if turn else {}), "C1": c1} for c1 in (90, 180, 270)]
    plan = sim.indexed_plan(kind, poses, bar_after=3, probe_uncertainty_um=1.0)
    schedule = sim.working_days(np.random.default_rng(seed))
    machine = sim.SimulatedMachine(
        topology=topology,
        signs={name.strip("()"): 1.0 for name in topology.split() if name not in "wbt"},
        terms={"EXX:poly1": 18e-6, "EYY:poly1": -12e-6, "EZZ:poly1": 25e-6},
        effects=tuple(effects),
        tip_mm=tip,
        down=down,
    )
    told = sim.simulate(plan, machine, schedule, np.random.default_rng((seed, 5)), noise_um=noise_um)
    return as_campaign(plan, machine, schedule, told, stated_um=stated_um or noise_um), told
