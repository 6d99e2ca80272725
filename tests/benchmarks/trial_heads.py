"""What is told of a head of two axes that hides one error, a constant, or both, and of one that hides nothing.

``python tests/benchmarks/trial_heads.py --seeds 20``: machines ``w b X Y Z C B t`` by numpy alone, with no line of the
package or of its simulator; a week of seven runs of an R-test, a sphere on the table that the head turns around, 76
readings of 0.5 um each run. The tool point is stated as it is, without its uncertainty. Every machine has location
errors and gains of its own. A named error counts where it, or one of its rivals, is the hidden error in any
shape of its kind. ``--first``: the first seed; ``--only``: a part of a case's name.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign

TIP = np.array([0.0, 0.0, -200.0])
SPHERE = np.array([120.0, -60.0, 40.0])
NOISE_MM, PEAK_MM, RUNS, SECONDS = 0.5e-3, 8e-3, 7, 30.0

#: By case: what is hidden, and whether what carries the tool stands elsewhere than stated as well.
CASES = {
    f"{error or 'nothing'}{' and a constant' if constant else ''}": (error, constant)
    for error in ("wobble", "index", "reversal", "growth", "")
    for constant in (False, True)
}
#: How each is written, up to its shape.
NAMES = {
    "wobble": ("EAC:harmonic2",),
    "index": ("ECC:harmonic3",),
    "reversal": ("EBB:reversal",),
    # Of what grows along Z nothing but the head's turn tells apart where.
    "growth": ("EZZ", "EZ0Z", "EZC", "EZ0C", "EZ0X", "EZ0Y", "EZX", "EZY", "EZ0B"),
}
#: A shift along the tool is as well a gain of all axes.
CONSTANTS = ("EYB:const", "EY0B")


def turn(about: int, angle: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3)."""
    first, second = (about + 1) % 3, (about + 2) % 3
    matrix = np.tile(np.eye(3), (len(angle), 1, 1))
    matrix[:, first, first] = matrix[:, second, second] = np.cos(angle)
    matrix[:, second, first] = np.sin(angle)
    matrix[:, first, second] = -np.sin(angle)
    return matrix


def frames(six: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n, 3, 3) and shifts (n, 3) of small errors (n, 6)."""
    a, b, c = six[:, 3], six[:, 4], six[:, 5]
    return turn(2, c) @ turn(1, b) @ turn(0, a), six[:, :3]


def angles() -> tuple[np.ndarray, np.ndarray]:
    """The readings of C and B in degrees."""
    around = np.arange(-180.0, 181.0, 30.0)
    tilts = np.arange(-90.0, 91.0, 15.0)
    some = np.arange(-180.0, 181.0, 45.0)
    c = [np.zeros(2 * len(tilts)), around, some, some[::-1], some]
    b = [tilts, tilts[::-1], np.zeros(len(around)), *(np.full(len(some), at) for at in (45.0, -60.0, 90.0))]
    return np.concatenate(c), np.concatenate(b)


def sense(position: np.ndarray) -> np.ndarray:
    """The sense of the last move of an axis, which came from zero."""
    moves = np.sign(np.diff(position, prepend=0.0))
    for index in range(1, len(moves)):
        moves[index] = moves[index] or moves[index - 1]
    return np.asarray(moves)


def week(rng: np.random.Generator, error: str, constant: bool, noise: str) -> list[Mapping[str, float]]:
    """The rows of seven runs."""
    degrees = angles()
    c, b = np.deg2rad(degrees[0]), np.deg2rad(degrees[1])
    n = len(c)
    nominal = SPHERE - np.einsum("nij,j->ni", turn(2, c) @ turn(1, b), TIP)
    location = {axis: rng.normal(0.0, [0.01] * 3 + [3e-5] * 3) for axis in "CB"}
    # The tool point is stated as it is from where C and B meet: zeros of both, and Y of B, are right.
    location["C"][5] = location["B"][1] = location["B"][4] = 0.0
    squareness, gains = rng.normal(0.0, 3e-5, 3), rng.normal(0.0, 2e-5, 3)
    rad = PEAK_MM / abs(TIP[2])
    phase, size = rng.uniform(0.0, 2.0 * np.pi), rng.choice([-1.0, 1.0])
    of_c, of_b = np.zeros((n, 6)), np.zeros((n, 6))
    if error == "wobble":
        of_c[:, 3] = rad * np.cos(2.0 * c + phase)
    elif error == "index":
        of_c[:, 5] = 2.0 * rad * np.cos(3.0 * c + phase)
    elif error == "reversal":
        of_b[:, 4] = 0.5 * size * rad * sense(degrees[1])
    if constant:
        of_b[:, 1] = size * rng.uniform(5e-3, 15e-3)
    rows: list[Mapping[str, float]] = []
    of_days = rng.normal(0.0, 1e-3, (RUNS, 3))
    for run in range(RUNS):
        seconds = SECONDS * np.arange(n)
        linear = nominal * (1.0 + gains)
        linear[:, 0] -= squareness[0] * nominal[:, 1]
        linear[:, 0] += squareness[1] * nominal[:, 2]
        linear[:, 1] -= squareness[2] * nominal[:, 2]
        if error == "growth":
            linear[:, 2] += size * PEAK_MM * (1.0 - np.exp(-seconds / 700.0))
        rotation, shift = np.tile(np.eye(3), (n, 1, 1)), linear
        for axis, angle, about, motion in (("C", c, 2, of_c), ("B", b, 1, of_b)):
            for matrix, moved in (
                frames(np.tile(location[axis], (n, 1))),
                (turn(about, angle), np.zeros((n, 3))),
                frames(motion),
            ):
                shift = shift + np.einsum("nij,nj->ni", rotation, moved)
                rotation = rotation @ matrix
        tip = shift + np.einsum("nij,j->ni", rotation, TIP)
        read = NOISE_MM * rng.standard_normal((n, 3))
        if noise == "correlated":
            for index in range(1, n):
                read[index] = 0.5 * read[index - 1] + np.sqrt(0.75) * read[index]
        if noise == "days":
            read += of_days[run]
        off = 1e3 * (tip - SPHERE + read)
        for index in range(n):
            values = [
                run + 1,
                seconds[index],
                *nominal[index],
                degrees[0][index],
                degrees[1][index],
                *off[index],
            ]
            names = ("run", "time_s", "x_mm", "y_mm", "z_mm", "c_deg", "b_deg", "dx_um", "dy_um", "dz_um")
            rows.append(dict(zip(names, map(float, values), strict=True)))
    return rows


def write(folder: Path, rows: list[Mapping[str, float]]) -> Path:
    """The campaign folder."""
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(
        'format = 1\ncampaign = "head"\nmethod = "instruments"\n\n[machine]\nid = "HEAD"\n'
        'topology = "w b X Y Z C B t"\ngravity = [0.0, 0.0, -1.0]\n\n[[setups]]\nid = "r-test"\nreading = "vector"\n'
        f'instrument = "R-test"\nstandard_uncertainty_um = {1e3 * NOISE_MM}\ntool_point_mm = {TIP.tolist()}\n'
        f"work_point_mm = {SPHERE.tolist()}\n",
        encoding="utf-8",
    )
    runs = [f"{run},2026-03-{run + 1:02d}T08:00:00+00:00,{run},false," for run in range(1, RUNS + 1)]
    (folder / "runs.csv").write_text("run,started_at,day,warm_up,ambient_degC\n" + "\n".join(runs) + "\n")
    names = [name for name in rows[0] if name != "run"]
    lines = [f"run,sequence,setup,{','.join(names)}"]
    for number, row in enumerate(rows):
        cells = ",".join(repr(row[name]) for name in names)
        lines.append(f"{int(row['run'])},{number + 1},r-test,{cells}")
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def told(seed: int, error: str, constant: bool, noise: str = "white") -> list[tuple[str, ...]]:
    """The named effects of a machine, each with its rivals."""
    rng = np.random.default_rng([seed, 41, len(error), constant])
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(write(Path(folder) / "head", week(rng, error, constant, noise)))
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return [(each.effect, *(rival.effect for rival in each.rivals)) for each in answer.missing]


def is_named(names: tuple[str, ...], wanted: tuple[str, ...], error: str) -> bool:
    """Whether an effect or one of its rivals is what is wanted; growth has a driver."""
    for name in names:
        body, _, driver = name.partition("@")
        if bool(driver) == (error == "growth") and (body in wanted or body.partition(":")[0] in wanted):
            return True
    return False


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for case, (error, constant) in CASES.items():
        if options.only not in case:
            continue
        for noise in ("white",) if error else ("white", "correlated", "days"):
            all_named = others = free = 0
            said: Counter[str] = Counter()
            for seed in range(options.first, options.first + options.seeds):
                effects = told(seed, error, constant, noise)
                wanted = [(NAMES[error], error)] if error else []
                wanted += [(CONSTANTS, "")] if constant else []
                hit = [any(is_named(names, *each) for names in effects) for each in wanted]
                all_named += all(hit)
                others += any(not any(is_named(names, *each) for each in wanted) for names in effects)
                free += any(":free" in names[0] for names in effects)
                said[", ".join(sorted(names[0] for names in effects))] += 1
            low, high = scipy.stats.binomtest(all_named, options.seeds).proportion_ci(method="exact")
            wrong = scipy.stats.binomtest(others, options.seeds).proportion_ci(method="exact")
            print(
                f"{case}, {noise}: all named in {all_named} ({100 * low:.1f} to {100 * high:.1f} %), something else in "
                f"{others} ({100 * wrong.low:.1f} to {100 * wrong.high:.1f} %), a free shape in {free}, of "
                f"{options.seeds}; {time.process_time():.0f} s; {dict(said)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
