"""The simulated campaign: every touch solved exactly, then noise, then the controller's digits.

For each probing the linear readings are found (Newton, numerical Jacobian) at which the machine with all its
errors puts the tip on the ball's centre; white noise is added to those readings and they are rounded as a
controller prints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from .chain import gravity_seen
from .effects import Circumstances, Effect
from .machine import SimulatedMachine
from .plans import Plan, Schedule
from .touch import FIRST_TRAVEL, Errors, scaled, travel_signs

ChannelMaker = Callable[[Schedule, np.ndarray, np.ndarray, np.random.Generator], np.ndarray]


def ramps(schedule: Schedule, run: np.ndarray, fraction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A channel that starts each run near 22 degC and drifts straight, up or down, by a degree or two."""
    start, slope = rng.normal(22.2, 0.8, schedule.runs), rng.normal(0.5, 1.7, schedule.runs)
    return start[run - 1] + slope[run - 1] * fraction


def cooling(
    schedule: Schedule, run: np.ndarray, fraction: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """A channel that cools from 36 degC to ambient in a few hours, with 0.05 degC of its own noise."""
    since = schedule.since_first_run_s()[run - 1] + 1800.0 * fraction
    return 23.0 + 13.6 * np.exp(-since / 7200.0) + 0.05 * rng.standard_normal(len(run))


DEFAULT_CHANNELS: dict[str, ChannelMaker] = {"x_axis_degC": ramps, "y_axis_degC": ramps}


def place_balls(
    plan: Plan, rng: np.random.Generator, spread_mm: float, bar_error_mm: float
) -> dict[str, np.ndarray]:
    """True ball centres: nominal, each coordinate off by up to `spread_mm`; the bar at its true length."""
    balls = {k: np.array(p) + rng.uniform(-spread_mm, spread_mm, 3) for k, p in plan.balls.items()}
    if plan.bar is not None:
        one, two = plan.bar
        middle, along = (balls[one] + balls[two]) / 2, balls[two] - balls[one]
        half = (plan.bar_length_mm + bar_error_mm) / 2 * along / np.linalg.norm(along)
        balls[one], balls[two] = middle - half, middle + half
    return balls


def simulate(
    plan: Plan,
    machine: SimulatedMachine,
    schedule: Schedule,
    rng: np.random.Generator,
    noise_um: float | None = None,
    *,
    spread_mm: float = 0.3,
    balls: Mapping[str, np.ndarray] | None = None,
    tip_mm: np.ndarray | None = None,
    bar_error_mm: float | None = None,
    channels: Mapping[str, ChannelMaker | np.ndarray] | None = None,
    first_travel: str = "reading",
    bad_points: Sequence[tuple[int, int, tuple[float, float, float]]] = (),
    decimals: int | None = 6,
    noise: Callable[[np.random.Generator, np.ndarray], np.ndarray] | None = None,
) -> dict[str, object]:
    """Simulate a campaign; nothing is written.

    noise_um: standard deviation of white noise on every linear reading (default: the plan's probe).
    spread_mm: half-width of the unknown ball positions and tip offsets, unless `balls`, `tip_mm` are given.
    bar_error_mm: true less calibrated length (default: drawn with the bar's standard uncertainty).
    channels: makers or (N,) arrays by column name (default: x_axis_degC and y_axis_degC, straight ramps);
    the schedule's `ambient_degC` is always a channel. first_travel: see `travel_signs`.
    bad_points: (run, sequence, (x, y, z) in µm) added to single probings. decimals: None for no rounding.
    noise: instead of white noise, from a generator and the run (N,) of every probing, (N, 3) in parts of `noise_um`.

    Returns a dict: `run`, `sequence`, `time_s`, `target` (names), `readings` {axis: (N,) mm or deg},
    `columns` {campaign column: (N,)}, `channels`, and the truth: `exact` readings, `balls`, `tip_mm`, `bar_length_mm`,
    `effects` (with coefficients), `travel` {axis: (N,)}.
    """
    if first_travel not in FIRST_TRAVEL:
        raise ValueError(f"first_travel is one of {FIRST_TRAVEL}, not {first_travel!r}")
    chain, size, runs = machine.chain, len(plan.probings), schedule.runs
    run = np.repeat(np.arange(1, runs + 1), size)
    sequence = np.tile(np.arange(1, size + 1), runs)
    time_s = np.round(np.arange(size) * plan.period_s, 1)
    fraction = np.tile(time_s / max(time_s[-1], 1e-9), runs)
    target = np.tile([ball for ball, _ in plan.probings], runs)
    if balls is None:
        error = rng.normal(0, plan.bar_uncertainty_mm) if bar_error_mm is None else bar_error_mm
        balls = place_balls(plan, rng, spread_mm, error)
    if tip_mm is None:
        tip_mm = np.array(machine.tip_mm) + rng.uniform(-spread_mm, spread_mm, 3)
    made: dict[str, np.ndarray] = {}
    for name, maker in (DEFAULT_CHANNELS if channels is None else channels).items():
        made[name] = maker(schedule, run, fraction, rng) if callable(maker) else np.asarray(maker, float)

    readings = {a.name: np.zeros(run.size) for a in chain.axes}
    for axis in chain.rotary:
        degrees = np.array([angles.get(axis.name, 0.0) for _, angles in plan.probings])
        readings[axis.name] = np.tile(np.radians(degrees), runs)
    now = Circumstances(
        run=run,
        sequence=sequence,
        target=target,
        since_first_run_s=schedule.since_first_run_s()[run - 1] + np.tile(time_s, runs),
        run_fraction=fraction,
        channels=made | {"ambient_degC": schedule.ambient_degC[run - 1]},
        gravity=gravity_seen(chain, readings, np.array(machine.down)),
        angles={axis.name: readings[axis.name] for axis in chain.rotary},
    )
    errors = Errors(machine, now, np.array([balls[t] for t in plan_targets(plan)] * runs), np.asarray(tip_mm))
    still = {name: np.zeros(run.size) for name in readings}
    readings = errors.touch(readings, still, ())
    terms = [Effect(name, coefficients=value) for name, value in machine.terms.items()]
    effects = [*terms, *(scaled(e, errors, readings, first_travel) for e in machine.effects)]
    for _ in range(6):  # the sign of a tiny travel may itself hang on the errors: repeat until it settles
        travel = {name: travel_signs(r, run, first_travel) for name, r in readings.items()}
        readings = errors.touch(readings, travel, effects)
        if all(
            (travel_signs(readings[a.name], run, first_travel) == travel[a.name]).all() for a in chain.linear
        ):
            break
        if not any(e.shape == "reversal" for e in effects):
            break

    size_um = plan.probe_uncertainty_um if noise_um is None else noise_um
    coloured = None if noise is None else noise(rng, run)
    seen, exact = {}, {}
    for axis in chain.axes:
        exact[axis.name] = np.degrees(readings[axis.name]) if axis.rotary else readings[axis.name]
    for k, axis in enumerate(chain.linear):
        seen[axis.name] = exact[axis.name] + size_um * 1e-3 * (
            rng.standard_normal(run.size) if coloured is None else coloured[:, k]
        )
        for bad_run, bad_sequence, off in bad_points:
            seen[axis.name][(run == bad_run) & (sequence == bad_sequence)] += off[k] * 1e-3
        if decimals is not None:
            seen[axis.name] = np.round(seen[axis.name], decimals)
    for axis in chain.rotary:
        seen[axis.name] = np.round(exact[axis.name], 9)
    return {
        "run": run,
        "sequence": sequence,
        "time_s": np.tile(time_s, runs),
        "target": target,
        "readings": seen,
        "columns": {a.column: seen[a.name] for a in (*chain.linear, *chain.rotary)},
        "channels": made,
        "exact": exact,
        "balls": dict(balls),
        "tip_mm": np.asarray(tip_mm),
        "bar_length_mm": None
        if plan.bar is None
        else float(np.linalg.norm(balls[plan.bar[0]] - balls[plan.bar[1]])),
        "effects": effects,
        "travel": travel,
    }


def plan_targets(plan: Plan) -> list[str]:
    return [ball for ball, _ in plan.probings]
