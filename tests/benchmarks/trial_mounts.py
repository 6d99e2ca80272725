"""How often the search finds what a mount hides, over many seeds; the results are in ``docs/trials-mounts.md``.

    python tests/benchmarks/trial_mounts.py --seeds 40

Each trial is a night of 80 to 450 stars of a mount (alt-azimuth, equatorial, alt-alt) with errors of some 100
arcseconds, simulated by ``tests/simulator/instruments.py``. Hidden are nothing, flexure of the tube, or flexure and a
lift by 1/tan(elevation); the noise is white, correlated from star to star (``--rho``), or has heavy tails. What is
found besides, or in another order, is false.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from simulator.instruments import SimulatedAxis, SimulatedChain

from monitor.discovery import explain
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.readers import read_campaign

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
MOUNTS = {
    "alt-azimuth": ((("AZ", Z, -1), ("EL", Y, -1)), 90.0, X, ((0.0, 360.0), (15.0, 88.0))),
    "equatorial": ((("HA", Z, -1), ("DEC", Y, -1)), None, X, ((-80.0, 80.0), (-25.0, 80.0))),
    "alt-alt": ((("U", X, 1), ("V", Y, 1)), 90.0, Z, ((-60.0, 60.0), (-60.0, 60.0))),
}
FLEXURE, REFRACTION = "flexure:tool@gravity", "sight:up:formula(1/tan(elevation))"
SETUP = '\n[[setups]]\nid = "sky"\nreading = "direction"\nstandard_uncertainty_urad = 5.0\ntool_direction = {along}\n'
NOISE = 5e-6


def noise(rng: np.random.Generator, count: int, rho: float, heavy: bool) -> np.ndarray:
    """Noise (count, 3): of first order with correlation ``rho``, or Student's t with three degrees of freedom."""
    white = rng.standard_t(3.0, (count, 3)) / np.sqrt(3.0) if heavy else rng.standard_normal((count, 3))
    for row in range(1, count):
        white[row] = rho * white[row - 1] + np.sqrt(1.0 - rho**2) * white[row]
    return NOISE * white


def trial(mount: str, seed: int, hidden: int, rho: float, heavy: bool) -> tuple[list[str], float]:
    """The effects that are found, and the seconds of processor time."""
    axes, latitude, along, limits = MOUNTS[mount]
    rng = np.random.default_rng((seed, hidden, list(MOUNTS).index(mount)))
    height = np.deg2rad(rng.uniform(20.0, 60.0) if latitude is None else latitude)
    gravity = (-np.cos(height), 0.0, -np.sin(height))
    down, tool = np.array(gravity), np.array(along)
    chain_axes = tuple(
        SimulatedAxis(name, "rotary", about, sign=sign, errors=(0, 0, 0, *rng.normal(0.0, 3e-4, 3)))
        for name, about, sign in axes
    )
    constant = rng.normal(0.0, 2e-4, 3)
    sag = float(rng.uniform(5e-5, 5e-4)) if hidden else 0.0
    lift = float(rng.uniform(1e-5, 5e-5)) if hidden > 1 else 0.0

    def motions(readings: dict[str, float], nominal: np.ndarray) -> tuple[float, ...]:
        pull = nominal.T @ down
        level = np.cross(tool, -pull)
        turn = constant + sag * np.cross(tool, pull) + lift * level / float(-pull @ tool)
        return (0.0, 0.0, 0.0, *turn)

    chain = SimulatedChain(chain_axes, gravity=gravity, motions=motions)
    stars = int(rng.integers(80, 451))
    noises = noise(rng, stars, rho, heavy)
    rows: list[dict[str, object]] = []
    while len(rows) < stars:
        at = {
            a.name: round(float(rng.uniform(*limit)), 5) for a, limit in zip(chain_axes, limits, strict=True)
        }
        star = chain.pose(at)[:3, :3] @ tool
        if -star @ down < np.sin(np.deg2rad(12.0)):
            continue
        off = noises[len(rows)]
        star = star + off - star * (star @ off)
        star = star / np.linalg.norm(star)
        rows.append(
            {"setup": "sky", **at, "direction_x": star[0], "direction_y": star[1], "direction_z": star[2]}
        )
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(chain.write(Path(folder) / "night", SETUP.format(along=list(along)), rows))
    begin = time.process_time()
    problem = campaign_method(campaign).problem_of(campaign)
    try:
        answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(seed))
    except MonitorError as error:
        return [f"refused: {error}"], time.process_time() - begin
    return [effect.effect for effect in answer.missing], time.process_time() - begin


def main() -> None:
    """Print a line for every mount and number of hidden effects."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--rho", type=float, default=0.0)
    parser.add_argument("--heavy", action="store_true")
    options = parser.parse_args()
    print(
        "| mount | hidden | nights | right and nothing else | right ones first | false effects | explain / s |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for mount in MOUNTS:
        for hidden in (0, 1, 2):
            wanted = [FLEXURE, REFRACTION][:hidden]
            seeds = range(options.first, options.first + options.seeds)
            results = [trial(mount, seed, hidden, options.rho, options.heavy) for seed in seeds]
            exact = sum(found == wanted for found, _ in results)
            first = sum(found[:hidden] == wanted for found, _ in results)
            false = sum(len([effect for effect in found if effect not in wanted]) for found, _ in results)
            seconds = [elapsed for _, elapsed in results]
            print(
                f"| {mount} | {hidden} | {len(results)} | {exact} | {first} | {false} | "
                f"{np.mean(seconds):.2f} (at most {max(seconds):.2f}) |"
            )
            for seed, (found, _) in zip(seeds, results, strict=True):
                if found != wanted:
                    print(f"  seed {seed}: {', '.join(found) or 'nothing'}", file=sys.stderr)


if __name__ == "__main__":
    main()
