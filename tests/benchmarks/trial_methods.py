"""How often the search is right on rotary-probing, free-form and l-shape; results in ``docs/trials-methods.md``.

    python tests/benchmarks/trial_methods.py --campaigns 100

The campaigns are solved exactly by ``tests/simulator``, which shares no code with the package. Where nothing is hidden,
nothing must be told; a hidden effect counts as found where a finding is it or names it among those not ruled out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "methods"))

from rotary_campaigns import PAPER, TRUTH, location, touched
from simulator import free_form as free_forms, l_shape as l_shapes, rotary_probing as touches
from simulator.chain import read_topology

from monitor.discovery import Explanation, explain
from monitor.methods.free_form.method import METHOD as free_form
from monitor.methods.l_shape.method import METHOD as l_shape
from monitor.methods.rotary_probing.method import METHOD as rotary_probing
from monitor.readers import read_campaign
from monitor.records import Campaign

PEAK_MM = 8e-3
#: Angles of a table that is indexed every 30 degrees; the source's plan has C at four.
EVERY_30 = [{"A": a, "C": c} for a in (0.0, -45.0, -90.0) for c in range(0, 360, 30)]


def piece(rng: np.random.Generator) -> touches.Piece:
    """A block that stands within half a millimetre, with form errors of 10 µm."""
    form = {one.target: float(rng.normal(0.0, 0.01)) for one in touches.block()}
    return touches.Piece(shift=tuple(rng.normal(0.0, 0.5, 3).tolist()), form=form)


def location_of(rng: np.random.Generator, drift: float = 0.1) -> dict[str, np.ndarray]:
    """An ordinary machine's location errors, that vary by a tenth from run to run."""
    return location({name: value * (1.0 + drift * rng.standard_normal()) for name, value in TRUTH.items()})


@dataclass(frozen=True)
class Hidden:
    """An effect of ``PEAK_MM``: its name, error motions (n, 6) of rotary axes by their angle (rad), and the
    shift (n, 3) of the tip by the readings of the linear axes."""

    name: str
    motion: dict[str, Callable[[np.ndarray], np.ndarray]] = field(default_factory=dict)
    linear: Callable[[np.ndarray], np.ndarray] | None = None


def _six(
    place: int, size: float, wave: Callable[[np.ndarray], np.ndarray]
) -> Callable[[np.ndarray], np.ndarray]:
    return lambda angle: np.eye(6)[place] * size * wave(angle)[:, None]


#: Lever of an angle error, so that it moves the touched point by PEAK_MM: the block stands some 250 mm from A and
#: reaches 60 mm from its own middle.
LEVER_MM = {"A": 250.0, "C": 60.0}


def turning(axis: str, letter: str, order: int) -> Hidden:
    """An error motion of a rotary axis, ``order`` periods a turn."""
    place = "XYZABC".index(letter)
    size = PEAK_MM / (LEVER_MM[axis] if place > 2 else 1.0)
    return Hidden(f"E{letter}{axis}:harmonic{order}", {axis: _six(place, size, lambda q: np.cos(order * q))})


def bent(name: str, along: int, by: int, wave: Callable[[np.ndarray], np.ndarray]) -> Hidden:
    """An error of a linear axis: the tip is shifted along one axis by what another reads."""
    return Hidden(name, linear=lambda xyz: np.eye(3)[along] * PEAK_MM * wave(xyz[:, by])[:, None])


ROTARY = (
    turning("A", "A", 1), turning("A", "X", 1), turning("A", "Y", 1), turning("A", "Z", 2),
    turning("C", "C", 1), turning("C", "C", 2), turning("C", "X", 1), turning("C", "Z", 1), turning("C", "A", 2),
    bent("EYZ:poly1", 1, 2, lambda q: q / 250.0),
    bent("EZZ:poly2", 2, 2, lambda q: (q / 250.0) ** 2),
    bent("EXX:poly2", 0, 0, lambda q: (q / 60.0) ** 2),
    bent("EYY:cyclic40mm", 1, 1, lambda q: np.cos(2.0 * np.pi * q / 40.0)),
)  # fmt: skip


def lobed(lobes: int, peak: float, phase: float) -> Callable[[np.ndarray], np.ndarray]:
    """Pre-travel (n,) mm of a probe along Z by the directions (n, 3) in which it touches."""
    return lambda seen: (
        peak * np.hypot(seen[:, 0], seen[:, 1]) * np.cos(lobes * np.arctan2(seen[:, 1], seen[:, 0]) + phase)
    )


#: Spheres on the table that are touched on the equator, at 45 degrees and on top.
SPHERES = [
    feature
    for name, centre in {
        "S1": (90.0, -180.0, 60.0),
        "S2": (-30.0, -280.0, 100.0),
        "S3": (-40.0, -110.0, 40.0),
    }.items()
    for feature in touches.sphere(name, centre)
]


PLANS: dict[str, Callable[[], list[tuple[touches.Feature, dict[str, float]]]]] = {
    "source": touches.paper_plan,
    "every 30 degrees": lambda: touches.every_pose(touches.block(), EVERY_30),
    "spheres": lambda: touches.paper_plan(SPHERES),
}


#: Errors that lobes could be taken for, or hide.
BESIDE_LOBES = ("ECC:harmonic1", "EXC:harmonic1", "EYY:cyclic40mm")


def rotary(
    rng: np.random.Generator,
    runs: int,
    hidden: Hidden | None = None,
    plan: str = "source",
    perfect: bool = False,
    walk: float = 0.0,
    pre_travel: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Campaign:
    """Runs of 154 touches (the source's plan), of three spheres at the same poses or of 28 points at 36 poses, with
    0.7 µm of noise, as printed (0.1 µm).

    A ``perfect`` piece stands where it should on a steady machine: only noise tells one touch of a face from another.
    From touch to touch the tool goes astray along each axis by ``walk`` times that noise.
    """
    poses = PLANS[plan]()
    chain, stands = read_topology(PAPER), touches.Piece() if perfect else piece(rng)
    signs = {axis.name: axis.sign for axis in chain.axes}
    motion = {
        axis: six(np.radians([signs[axis] * at[axis] for _, at in poses]))
        for axis, six in (hidden.motion if hidden else {}).items()
    }
    seen = []
    for _ in range(runs):
        errors = location(TRUTH) if perfect else location_of(rng)
        told = touches.touch(
            chain, poses, errors, rng, piece=stands, noise_mm=0.7e-3,
            linear=hidden.linear if hidden else None, motion=motion, pre_travel=pre_travel,
        )  # fmt: skip
        if walk:
            for axis in chain.linear:
                told[axis.name] = told[axis.name] + walk * 0.7e-3 * np.cumsum(rng.standard_normal(len(poses)))
        seen.append({axis: np.round(values, 4) for axis, values in told.items()})
    return touched(PAPER, poses, seen)


def pocket(rng: np.random.Generator, runs: int) -> Campaign:
    """A cross-shaped pocket at four angles, with the probe's noise only."""
    layout = free_forms.cross_pocket()
    truth = free_forms.draw_truth(layout, free_forms.CASE_1_ANGLES, rng)
    made = [free_forms.probe(layout, free_forms.CASE_1_ANGLES, truth, rng) for _ in range(runs)]
    with tempfile.TemporaryDirectory() as folder:
        where = Path(folder) / "pocket"
        return read_campaign(
            free_forms.write_folder(where, "pocket", layout, made, length_um=1e3 * truth.length)
        )


def arms(rng: np.random.Generator, runs: int) -> Campaign:
    """The L-shaped piece in three planes, there and back, with the sensor's noise only."""
    machine, standard = l_shapes.random_machine(rng), l_shapes.straight_arms()
    setups = l_shapes.random_setups(rng)
    calibrated = l_shapes.calibrated(standard, rng, 0.1, 0.2)
    made = [l_shapes.rows_of(machine, calibrated, setups, rng) for _ in range(runs)]
    with tempfile.TemporaryDirectory() as folder:
        return read_campaign(l_shapes.write_folder(Path(folder) / "l", "l", made, standard, setups))


def explained(campaign: Campaign) -> Explanation:
    """What the search says of a campaign under the method's base model."""
    method = {method.name: method for method in (rotary_probing, free_form, l_shape)}[campaign.method]
    return explain(campaign, method.problem_of(campaign), campaign.method, rng=np.random.default_rng(1))


def groups(told: Explanation) -> list[list[str]]:
    """For every finding its effect, then those that the data do not rule out."""
    return [[one.effect, *(rival.effect for rival in one.rivals)] for one in told.missing]


NOTHING: dict[str, Callable[[np.random.Generator, int], Campaign]] = {
    "rotary-probing": rotary,
    "rotary-probing, perfect piece": lambda rng, runs: rotary(rng, runs, perfect=True),
    "rotary-probing, 36 poses": lambda rng, runs: rotary(rng, runs, plan="every 30 degrees"),
    "rotary-probing, walks": lambda rng, runs: rotary(rng, runs, walk=0.25),
    "free-form": pocket,
    "l-shape": arms,
}


def nothing_hidden(campaigns: int, scenes: Sequence[str], first: int, numbers: Sequence[int]) -> None:
    """The share of campaigns without a hidden effect in which one is told."""
    print("| method | runs | campaigns | nothing is missing | told all the same |")
    print("| --- | --- | --- | --- | --- |")
    for scene in scenes:
        for runs in numbers:
            false: list[str] = []
            for seed in range(first, first + campaigns):
                told = groups(explained(NOTHING[scene](np.random.default_rng([seed, runs]), runs)))
                false += [f"{seed}: " + " and ".join(group[0] for group in told)] if told else []
            print(
                f"| {scene} | {runs} | {campaigns} | {campaigns - len(false)} | {'; '.join(false)} |",
                flush=True,
            )


def one_hidden(campaigns: int, first: int, plans: Sequence[str]) -> None:
    """How often each effect of 8 µm is found."""
    print("| plan | hidden | campaigns | named first | named | also told | blind for it |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for plan in plans:
        for hidden in ROTARY:
            leads = named = more = blind = 0
            for seed in range(first, first + campaigns):
                told = explained(rotary(np.random.default_rng([seed, 7]), 4, hidden, plan))
                found = groups(told)
                leads += any(group[0] == hidden.name for group in found)
                inside = [group for group in found if hidden.name in group]
                named += bool(inside)
                more += len(found) > len(inside)
                blind += hidden.name in told.blind
                if not inside:
                    print(
                        f"{plan} {hidden.name} seed {seed}: {[g[:3] for g in found]}",
                        file=sys.stderr,
                        flush=True,
                    )
            print(
                f"| {plan} | {hidden.name} | {campaigns} | {leads} | {named} | {more} | {blind} |", flush=True
            )


def with_lobes(campaigns: int, first: int, plans: Sequence[str]) -> None:
    """How often a probe's lobes of 2 to 4 µm are told, alone and beside an error of 8 µm."""
    print("| plan | lobes | beside | campaigns | lobes first | lobes named | error first | also told |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    besides = (None, *(hidden for hidden in ROTARY if hidden.name in BESIDE_LOBES))
    for plan, lobes, hidden in product(plans, (2, 3), besides):
        right = among = error = more = 0
        for seed in range(first, first + campaigns):
            rng = np.random.default_rng([seed, lobes, 11])
            probe = lobed(lobes, rng.uniform(2e-3, 4e-3), rng.uniform(0.0, 2.0 * np.pi))
            found = groups(explained(rotary(rng, 4, hidden, plan, pre_travel=probe)))
            expected = {f"probe:lobing{lobes}", *([hidden.name] if hidden else [])}
            right += any(group[0] == f"probe:lobing{lobes}" for group in found)
            among += any(f"probe:lobing{lobes}" in group for group in found)
            error += hidden is not None and any(group[0] == hidden.name for group in found)
            more += any(not expected & set(group) for group in found)
            if {group[0] for group in found} != expected:
                print(
                    f"{plan} lobes {lobes} beside {hidden} seed {seed}: {found}", file=sys.stderr, flush=True
                )
        name = hidden.name if hidden else "nothing"
        print(
            f"| {plan} | {lobes} | {name} | {campaigns} | {right} | {among} | {error} | {more} |", flush=True
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--hidden", type=int, default=10, help="campaigns with each hidden effect")
    parser.add_argument("--lobes", type=int, default=5, help="campaigns with each lobing")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--runs", type=int, nargs="+", default=[4, 10])
    parser.add_argument("--only", choices=NOTHING, nargs="*", default=list(NOTHING))
    options = parser.parse_args()
    if options.campaigns:
        nothing_hidden(options.campaigns, options.only, options.first, options.runs)
    if options.hidden:
        print()
        one_hidden(options.hidden, options.first, ("source", "every 30 degrees"))
    if options.lobes:
        print()
        with_lobes(options.lobes, options.first, ("source", "spheres"))


if __name__ == "__main__":
    main()
