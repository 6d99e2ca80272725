"""How often u of a robot's parameters holds where its readings depend on each other; results in docs/trials-robots.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_robot_parameters.py --seeds 40

One run of 144 poses of three reflectors, random or along an ordered grid. Besides white noise of 20 µm the joints come
to rest within 40 µrad, every pose anew or as the pose before by 0.8, or alike in poses that lie near each other; or the
air follows the reading before. Simulated by ``tests/simulator/robot_campaign.py``, which shares no code with the
package. The true parameters are those of the same robot without noise.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from monitor.discovery import fit
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from monitor.store.models import StoredModel
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.request import UncertaintyRequest
from tests.simulator import robot_campaign as robots

POSES, NOISE_UM, REST_RAD = 144, 20.0, 40e-6
MODEL = StoredModel("own", 1, None, (), (), (), "", None)
KINDS = ("white", "rest", "rest follows", "rest by place", "air follows")


def grid(rng: np.random.Generator) -> np.ndarray:
    """Poses (n, 6) in degrees, to and fro over J1, J2 and J3, four places of the wrist at each."""
    low, high = np.array([limits for *_, limits in robots.ELBOW]).T
    wrist = ((0.15, 0.2, 0.3), (0.4, 0.8, 0.6), (0.6, 0.35, 0.9), (0.85, 0.7, 0.1))
    parts = [
        (first, (0.2, 0.5, 0.8)[second if turn % 2 == 0 else 2 - second],
         (0.2, 0.5, 0.8)[third if (3 * turn + second) % 2 == 0 else 2 - third], *of_wrist)
        for turn, first in enumerate(np.linspace(0.1, 0.9, 4))
        for second in range(3) for third in range(3) for of_wrist in wrist
    ]  # fmt: skip
    return low + np.array(parts) * (high - low) + rng.uniform(-3.0, 3.0, (POSES, 6))


def following(rng: np.random.Generator, count: int, columns: int, memory: float) -> np.ndarray:
    """Numbers (count, columns) of unit variance that follow the one before by ``memory``."""
    numbers = rng.standard_normal((count, columns))
    for row in range(1, count):
        numbers[row] = memory * numbers[row - 1] + np.sqrt(1.0 - memory**2) * numbers[row]
    return numbers


def rests(rng: np.random.Generator, kind: str, degrees: np.ndarray) -> np.ndarray:
    """By how much the joints (poses, 6) come to rest beside their readings, rad."""
    if kind == "rest":
        return REST_RAD * rng.standard_normal(degrees.shape)
    if kind == "rest follows":
        return REST_RAD * following(rng, *degrees.shape, 0.8)
    if kind == "rest by place":
        squares = np.sum((degrees[:, None] - degrees[None]) ** 2, axis=2)
        root = np.linalg.cholesky(np.exp(-0.5 * squares / 40.0**2) + 1e-9 * np.eye(len(degrees)))
        return REST_RAD * root @ rng.standard_normal(degrees.shape)
    return np.zeros(degrees.shape)


def measured(rng: np.random.Generator, kind: str, degrees: np.ndarray, location: dict, noise_um: float):
    """One run of a robot of these location errors, as its campaign."""
    readings = {joint["name"]: np.deg2rad(of) for joint, of in zip(robots.JOINTS, degrees.T, strict=True)}
    turns = rests(rng, kind, degrees)
    motion = {
        joint["name"]: np.concatenate([np.zeros((POSES, 3)), turn[:, None] * np.array(joint["axis"])], axis=1)
        for joint, turn in zip(robots.JOINTS, turns.T, strict=True)
    }
    tool = robots.frames(robots.JOINTS, readings, location, motion)[-1]
    points = np.stack([robots.point(tool, np.array(place)) for place in robots.REFLECTORS.values()], axis=1)
    points = points.reshape(-1, 3) - np.array([2000.0, -1800.0, 900.0])
    air = following(rng, *points.shape, 0.8) if kind == "air follows" else rng.standard_normal(points.shape)
    rows = np.repeat(np.arange(POSES), len(robots.REFLECTORS))
    tracked = robots.Tracked(
        list(robots.REFLECTORS) * POSES, degrees[rows], points + 1e-3 * noise_um * air, location
    )
    with tempfile.TemporaryDirectory() as folder:
        return read_campaign(robots.write_tracked(Path(folder) / "robot", tracked))


def evaluated(campaign) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, bool]:
    """Names, estimates and covariance of the parameters as `uncertainty` states them, and whether readings resemble."""
    result = evaluate_fit(
        campaign, MODEL, fit(METHOD.problem_of(campaign)), UncertaintyRequest(campaign.name, method="guf")
    )
    stated = result.framework
    return stated.names, stated.estimate, stated.covariance, result.covariance_source.neighbours is not None


def main() -> None:
    """Print a line for every kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--random", action="store_true", help="random poses in place of a grid")
    options = parser.parse_args()
    print("| noise | robots | told | within 2 u, % | ellipsoid (chi-square), % | mean square distance |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind in KINDS:
        rows = []
        for seed in range(options.first, options.first + options.seeds):
            rng = np.random.default_rng([seed, 41])
            location = robots.errors_of_robot(rng)
            degrees = np.round(grid(rng), 4)
            if options.random:
                low, high = np.array([limits for *_, limits in robots.ELBOW]).T
                degrees = np.round(rng.uniform(low, high, degrees.shape), 4)
            names, true, _, _ = evaluated(measured(rng, "none", degrees, location, 0.01))
            of, estimate, covariance, told = evaluated(measured(rng, kind, degrees, location, NOISE_UM))
            assert of == names
            off, u = estimate - true, np.sqrt(np.diag(covariance))
            square = float(off @ np.linalg.solve(covariance, off))
            within = np.mean(np.abs(off) <= 2.0 * u)
            rows.append((told, within, square <= stats.chi2.ppf(0.95, len(off)), square / len(off)))
        told, within, inside, distance = np.array(rows, dtype=float).T
        low, high = stats.binomtest(int(inside.sum()), len(rows)).proportion_ci(method="exact")
        print(
            f"| {kind} | {len(rows)} | {int(told.sum())} | {100 * within.mean():.1f} | {100 * inside.mean():.1f} "
            f"({100 * low:.1f} to {100 * high:.1f}) | {distance.mean():.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
