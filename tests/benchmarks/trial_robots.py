"""How often the search finds what a robot hides, over many seeds; the results are in ``docs/trials-robots.md``.

    python tests/benchmarks/trial_robots.py --seeds 10

Each trial is a run of 1 000 poses of three reflectors with 20 µm of noise, of a robot with other errors, in another
frame. Nothing, one, two or three effects are hidden, of random kind, joint and size. A hidden effect counts as
found where a finding names it first, and as held where it is among those that a finding does not rule out. What is
found besides is a false finding, unless it names a hidden one among its rivals.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from simulator import measured_robot as measured, robot_campaign as robots
from simulator.robot_fit import known_structure_error

from monitor.discovery import explain, fit, robust_fit
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign

OWN = dict(zip(("J1", "J2", "J3", "J4", "J5", "J6"), "CBBABA", strict=True))
# Sizes that move the tool by some hundredths to tenths of a millimetre.
KINDS = ("compliance", "harmonic", "gear", "lag", "reversal", "drift")


@dataclass
class Tally:
    """Counts over trials with equally many hidden effects."""

    trials: int = 0
    hidden: int = 0
    found: int = 0
    held: int = 0
    false: int = 0
    missed: tuple[str, ...] = ()
    identify_s: tuple[float, ...] = ()
    explain_s: tuple[float, ...] = ()
    held_out_um: tuple[float, ...] = ()


def hide(rng: np.random.Generator, count: int) -> tuple[robots.Hidden, list[str]]:
    """So many different effects, and their names as the product writes them (the beginning of them)."""
    hidden, names = robots.Hidden(), []
    for kind in rng.choice(KINDS, count, replace=False):
        joint = str(rng.choice(["J1", "J2", "J3", "J4", "J5"]))
        term = f"E{OWN[joint]}{joint}"
        if kind == "compliance":
            joint = str(rng.choice(["J2", "J3"]))
            hidden = replace(hidden, compliance={joint: float(rng.uniform(1e-4, 4e-4))})
            names.append(f"E{OWN[joint]}{joint}:compliance@gravity")
        elif kind == "harmonic" and joint not in hidden.harmonic:
            order = int(rng.integers(1, 3))
            one = {joint: (order, rng.uniform(1e-4, 3e-4), rng.uniform(0.0, 6.3))}
            hidden = replace(hidden, harmonic={**hidden.harmonic, **one})
            names.append(f"{term}:harmonic{order}")
        elif kind == "gear" and joint not in hidden.harmonic:
            order = int(rng.integers(40, 200))
            one = {joint: (order, rng.uniform(5e-5, 2e-4), rng.uniform(0.0, 6.3))}
            hidden = replace(hidden, harmonic={**hidden.harmonic, **one})
            names.append(f"{term}:harmonic{order}")
        elif kind == "lag":
            hidden = replace(hidden, lag={joint: float(rng.uniform(5e-5, 2e-4))})
            names.append(f"{term}:lag")
        elif kind == "reversal":
            hidden = replace(hidden, reversal={joint: float(rng.uniform(5e-5, 2e-4))})
            names.append(f"{term}:reversal")
        elif kind == "drift":
            hidden = replace(hidden, drift_mm=tuple(rng.uniform(-0.1, 0.1, 3).tolist()))
            names.append("tracker:shift")
    return hidden, names


def trial(seed: int, count: int, poses: int, tally: Tally, repeatability: float = 0.0) -> None:
    """One robot."""
    rng = np.random.default_rng([seed, count])
    hidden, names = hide(rng, count)
    made = robots.track(rng, hidden, poses=poses, fixed_every=50, repeatability_urad=repeatability)
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(robots.write_tracked(Path(folder) / "robot", made))
    begun = time.process_time()
    tracker.identify(campaign)
    middle = time.process_time()
    told = explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
    tally.identify_s += (middle - begun,)
    tally.explain_s += (time.process_time() - middle,)
    tally.trials += 1
    tally.hidden += len(names)
    groups = [[one.effect, *(rival.effect for rival in one.rivals)] for one in told.missing]
    for name in names:
        tally.found += any(group[0].startswith(name) for group in groups)
        inside = any(one.startswith(name) for group in groups for one in group)
        tally.held += inside
        if not inside:
            tally.missed += (f"seed {seed}: {name}",)
    for group in groups:
        if not any(one.startswith(name) for name in names for one in group):
            tally.false += 1
            tally.missed += (f"seed {seed}: false {group[0]} (hidden: {', '.join(names) or 'nothing'})",)
    if told.missing and told.missing[-1].held_out_after is not None:
        tally.held_out_um += (1e3 * told.missing[-1].held_out_after,)


SOFT = {"J2": 8e-6, "J3": 8e-6, "J4": 10e-6, "J5": 15e-6}
# Poses of which nothing is fitted, behind those of the fit; poses that are 1 mm off.
SCENES = ("nothing drifts", "robot warms", "tracker drifts")
NEW_POSES, OFF = 200, (100, 101, 350)


def scene_of(rng: np.random.Generator, kind: str) -> tuple[measured.Scene, list[str]]:
    """A robot as measured ones are, and the names of what it hides."""
    curves = measured.harmonic_drives(rng)
    scene = measured.Scene(softness=SOFT, curves=curves)
    names = [f"E{OWN[name]}{name}:harmonics" for name in curves]
    names += [f"E{OWN[name]}{name}:compliance" for name in SOFT]
    if kind == "robot warms":
        scene = replace(scene, zeros={"J2": 200e-6, "J3": -150e-6})
        names += ["EB0J2@", "EB0J3@"]
    if kind == "tracker drifts":
        scene = replace(scene, shift_mm=(0.1, -0.08, 0.05))
        names += ["tracker:shift@"]
    return scene, names


def measured_trial(seed: int, kind: str, poses: int, off_poses: tuple[int, ...] = OFF) -> str:
    """One robot as measured ones are, as a line of the table."""
    rng = np.random.default_rng([seed, 17])
    scene, names = scene_of(rng, kind)
    whole = measured.measure(rng, scene, poses=poses + NEW_POSES, fixed_every=20)
    points = whole.tracked.points.copy()
    tool = ~np.isin(whole.tracked.target, list(robots.FIXED))
    off = np.isin(whole.pose, off_poses) & tool
    points[off] += 1.0 / np.sqrt(3.0)
    whole = replace(whole, tracked=replace(whole.tracked, points=points))
    noise = whole.part((whole.pose >= poses) & tool).noise_mm
    with tempfile.TemporaryDirectory() as folder:
        both = read_campaign(measured.write_session(Path(folder) / "both", whole))
        part = whole.part(whole.pose < poses)
        campaign = read_campaign(measured.write_session(Path(folder) / "robot", part))
    begun = time.process_time()
    problem = tracker.problem_of(campaign)
    first = robust_fit(problem)
    told = explain(
        campaign, problem, "tracker", rng=np.random.default_rng(1), first=first.fit, gross=first.points
    )
    seconds = time.process_time() - begun
    effects = tuple(one.effect for one in told.missing)
    groups = [[one.effect, *(rival.effect for rival in one.rivals)] for one in told.missing]
    reached = sum(any(group[0].startswith(name) for group in groups) for name in names)
    false = [group[0] for group in groups if not any(g.startswith(n) for g in group for n in names)]
    dropped = {int(part.pose[row]) for point in told.suspect for row in point.all_rows}
    bad = np.isin(whole.pose, sorted(dropped)) | (whole.pose >= poses)
    after = fit(tracker.problem_of(both, Model("all", added=effects)), bad)
    new = (whole.pose >= poses) & tool
    error = float(np.sqrt(np.mean(after.vectors[new] ** 2)))
    # What drifts is no part of the yardstick.
    known = known_structure_error(whole, scene, poses, off_poses)[1] if kind == "nothing drifts" else np.nan
    cells = [
        kind, seed, len(names), reached, ", ".join(false) or "0",
        f"{len(set(off_poses) & dropped)} of {len(off_poses)}", len(dropped - set(off_poses)),
        f"{1e3 * first.fit.rms:.1f}", f"{1e3 * error:.2f}", f"{1e3 * noise:.2f}",
        f"{1e3 * known:.2f}", f"{error / known:.3f}", f"{seconds:.1f}",
    ]  # fmt: skip
    return "| " + " | ".join(map(str, cells)) + " |"


def measured_table(seeds: range, poses: int, kinds: Sequence[str], off_poses: tuple[int, ...]) -> None:
    """Robots as measured ones are: curves of some 36 lines, four compliances, poses that are off, drifts."""
    print(
        "| scene | seed | hidden | named | false | bad poses left out | good poses left out | "
        "RMS before / µm | new poses / µm | noise / µm | known structure / µm | ratio | explain / s |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for kind in kinds:
        for seed in seeds:
            print(measured_trial(seed, kind, poses, off_poses), flush=True)


def noise_of(rng: np.random.Generator, kind: str, count: int) -> np.ndarray:
    """Noise (count, 3) in µm that no effect causes: neighbours alike (rho 0.6), or a tracker that wanders (some 20 µm
    over a session, a walk from row to row) besides its noise."""
    white = rng.normal(0.0, 20.0, (count, 3))
    if kind == "ar":
        for row in range(1, count):
            white[row] = 0.6 * white[row - 1] + 0.8 * white[row]
    elif kind == "walk":
        white += np.cumsum(rng.normal(0.0, 20.0 / np.sqrt(count), (count, 3)), axis=0)
    return white


def empty_table(seeds: range, poses: int) -> None:
    """Robots that hide nothing, in three kinds of noise: effects that are told all the same; and robots whose base
    drifts by 0.1 mm while the reflectors beside them stand still, which is to be told as such."""
    print("| noise | robots | with false effects | false effects | explain / s |")
    print("| --- | --- | --- | --- | --- |")
    for kind in ("white", "ar", "walk", "base drifts"):
        false: list[str] = []
        wrong, seconds = 0, []
        for seed in seeds:
            rng = np.random.default_rng([seed, 23])
            track = robots.track(rng, poses=poses, fixed_every=20, noise_um=0.0)
            points = track.points + 1e-3 * noise_of(rng, kind, len(track.points))
            if kind == "base drifts":
                tool = ~np.isin(track.target, list(robots.FIXED))
                points += np.outer(tool * np.linspace(0.0, 0.1, len(tool)), np.full(3, 1.0 / np.sqrt(3.0)))
            with tempfile.TemporaryDirectory() as folder:
                campaign = read_campaign(
                    robots.write_tracked(Path(folder) / "robot", replace(track, points=np.round(points, 5)))
                )
            begun = time.process_time()
            told = explain(campaign, tracker.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
            seconds.append(time.process_time() - begun)
            # A tracker that wanders is to be named as that; what only does not rule it out is false.
            names = [one.effect for one in told.missing if kind != "walk" or "tracker:" not in one.effect]
            if kind == "base drifts":
                names = [name for name in names if "0J1@" not in name]
                names += [] if any("0J1@" in one.effect for one in told.missing) else ["no drift of the base"]
            wrong += bool(names)
            false += [f"seed {seed}: {name}" for name in names]
        print(
            f"| {kind} | {len(seeds)} | {wrong} | {'; '.join(false) or '0'} | {np.median(seconds):.1f} |",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--poses", type=int, default=1000)
    parser.add_argument("--repeatability", type=float, default=0.0, help="of every joint, in µrad")
    parser.add_argument("--hidden", type=int, nargs="+", default=[0, 1, 2, 3], help="effects at once")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--measured", action="store_true", help="robots as measured ones are")
    parser.add_argument(
        "--scene", nargs="+", default=list(SCENES), choices=SCENES, help="those of --measured"
    )
    parser.add_argument("--clean", action="store_true", help="--measured without poses that are off")
    parser.add_argument(
        "--empty", action="store_true", help="robots that hide nothing, in three kinds of noise"
    )
    options = parser.parse_args()
    if options.measured:
        seeds = range(options.first, options.first + options.seeds)
        measured_table(seeds, options.poses, options.scene, () if options.clean else OFF)
        return
    if options.empty:
        empty_table(range(options.first, options.first + options.seeds), options.poses)
        return
    print(
        "| hidden | robots | effects | named first | not ruled out | false findings | identify / s | explain / s |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    notes: tuple[str, ...] = ()
    for count in options.hidden:
        tally = Tally()
        for seed in range(options.first, options.first + options.seeds):
            trial(seed, count, options.poses, tally, options.repeatability)
            print(
                f"{count} hidden, seed {seed}: {tally.found} of {tally.hidden} named first, {tally.held} not ruled "
                f"out, {tally.false} false so far; explain {tally.explain_s[-1]:.1f} s",
                file=sys.stderr,
                flush=True,
            )
        notes += tally.missed
        print(
            f"| {count} | {tally.trials} | {tally.hidden} | {tally.found} | {tally.held} | {tally.false} | "
            f"{np.median(tally.identify_s):.2f} (at most {max(tally.identify_s):.2f}) | "
            f"{np.median(tally.explain_s):.2f} (at most {max(tally.explain_s):.2f}) |",
            flush=True,
        )
        if tally.held_out_um:
            print(
                f"  held-out error with all found: median {np.median(tally.held_out_um):.2f} µm",
                file=sys.stderr,
            )
    for note in notes:
        print(note, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
