"""Trial of `explain` where the error of a linear axis repeats with teeth: sawtooths, and other shapes of one pitch.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_teeth.py --first 500 --campaigns 64

Every campaign draws one error of a linear axis, its shape (``--shape``), pitch and phase; half of them have 8 µm from
the lowest to the highest point, half 3 µm, half of either a further effect of 4 µm, and a quarter fewer than two teeth
over the travel. Prints a line a campaign, then shares with exact intervals; ``--lines`` adds those of earlier parts.
Everything hidden stems from tests/simulator, which shares no code with the package.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict, dataclass
from json import dumps, loads
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery import explain
from monitor.discovery.machine.missing import ChainMissing
from monitor.methods.samba.method import problem_of

ROOT = Path(__file__).resolve().parents[2]
simulator = simulator_of()
virtual_campaigns = load("virtual_campaigns", ROOT / "tests" / "discovery" / "virtual.py")
interval = load("trial_discovery", ROOT / "tests" / "benchmarks" / "trial_discovery.py").interval

ERRORS = ("EXX", "EYX", "EYY", "EXY", "EZZ", "EYZ", "EBX", "EAZ")
FURTHER = ("EYY:reversal", "EZX:poly2", "EYB:harmonic2", "EBC:harmonic1", "EZC1:const@warmup", "EXZ:poly3")
#: Shapes from 0 to 1 of a phase in periods.
SHAPES = {
    "sawtooth": lambda phase: phase % 1.0,
    "rectified": lambda phase: np.abs(np.sin(np.pi * phase)),
    "worn": lambda phase: np.maximum(1.0 - 3.0 * np.abs(phase % 1.0 - 0.5), 0.0),
    "sine": lambda phase: 0.5 + 0.5 * np.sin(2.0 * np.pi * phase),
}


@dataclass(frozen=True)
class Line:
    """What was hidden in a campaign and what was named of it; ``within``: the peak within 2 u, None where it was not
    named."""

    number: int
    error: str
    teeth: float
    peak_um: float
    further: str
    told: tuple[str, ...]
    leads: bool
    found_further: bool
    false: tuple[str, ...]
    within: bool | None
    hidden_told_u: tuple[float, float, float] | None
    seconds: float


def answered(number: int, shape: str) -> Line:
    """Explain campaign ``number``."""
    rng = np.random.default_rng((20261127, number))
    error = str(rng.choice(ERRORS))
    few = number // 4 % 4 == 3
    teeth, phase = float(rng.uniform(1.0, 2.0) if few else rng.uniform(3.0, 8.0)), float(rng.uniform())
    peak_um = (8.0, 3.0)[number % 2]
    last: list[np.ndarray] = []

    def curve(q: np.ndarray, travel: np.ndarray, now: object) -> np.ndarray:
        values = SHAPES[shape](teeth * (q - q.min()) / np.ptp(q) + phase)
        line = np.column_stack([np.ones(len(q)), q])
        last[:] = [values - line @ np.linalg.lstsq(line, values, rcond=None)[0]]
        return values

    hidden = [simulator.Effect(f"{error}:curve", peak_um=peak_um, curve=curve)]
    others = [name for name in FURTHER if name[:3] != error]
    further = str(rng.choice(others)) if number // 2 % 2 else ""
    if further:
        hidden.append(simulator.Effect(further, peak_um=4.0))
    days, each = ((2, 4), (5, 2))[number // 4 % 2]
    campaign, told = virtual_campaigns.virtual(1000 + number, hidden, days=days, runs_per_day=each)
    (coefficient,) = next(each.coefficients for each in told["effects"] if each.name == f"{error}:curve")
    size = float(np.abs(last[0]).max() * abs(coefficient))
    begin = time.process_time()
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(number))
    seconds = time.process_time() - begin
    right = [each for each in answer.missing if each.effect.partition(":")[0] == error]
    of_further = [
        each for each in answer.missing if further in {each.effect, *(rival.effect for rival in each.rivals)}
    ]
    false = tuple(
        each.effect for each in answer.missing if not any(each is known for known in (*right, *of_further))
    )
    within = sizes = None
    if right:
        told_peak, u = peak_of_error(right[0])
        within = abs(told_peak - size) <= 2.0 * u
        sizes = tuple(round(1e3 * value, 3) for value in (size, told_peak, u))
    return Line(
        number, error, round(teeth, 2), peak_um, further, tuple(each.effect for each in answer.missing),
        bool(right) and answer.missing[0] is right[0], bool(of_further), false, within, sizes, round(seconds, 1),
    )  # fmt: skip


def peak_of_error(effect: ChainMissing) -> tuple[float, float]:
    """The largest value of an effect's curve with its standard uncertainty; of teeth the amplitude is their step."""
    if effect.curve is None:
        return abs(effect.amplitude), effect.u
    largest = int(np.abs(effect.curve.size).argmax())
    return abs(float(effect.curve.size[largest])), float(effect.curve.u[largest])


def table(lines: list[Line]) -> None:
    """Print the shares of lines."""
    print(
        "| campaigns | right error first | named | with a false effect | false effects | further effect "
        "| peak within 2 u | seconds |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    kinds = {
        f"{'fewer than 2' if few else '3 to 8'} teeth, {peak:g} µm": [
            line for line in lines if (line.teeth < 2.0) == few and line.peak_um == peak
        ]
        for few in (False, True)
        for peak in (8.0, 3.0)
    }
    for name, some in {**kinds, "all": lines}.items():
        if not some:
            continue
        known, beside = (
            [line for line in some if line.within is not None],
            [line for line in some if line.further],
        )
        cells = [
            interval(sum(line.leads for line in some), len(some)),
            str(len(known)),
            interval(sum(bool(line.false) for line in some), len(some)),
            str(sum(len(line.false) for line in some)),
            f"{sum(line.found_further for line in beside)} of {len(beside)}",
            f"{sum(bool(line.within) for line in known)} of {len(known)}",
            f"{np.median([line.seconds for line in some]):.1f} (at most {max(line.seconds for line in some):.1f})",
        ]
        print(f"| {name} | {' | '.join(cells)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--first", type=int, default=500)
    parser.add_argument("--campaigns", type=int, default=64)
    parser.add_argument("--shape", default="sawtooth", choices=list(SHAPES))
    parser.add_argument("--lines", type=Path, nargs="*", default=(), help="lines that were printed before")
    options = parser.parse_args()
    lines = [
        Line(**loads(text))
        for path in options.lines
        for text in path.read_text("utf-8").splitlines()
        if text[:1] == "{"
    ]
    for number in range(options.first, options.first + options.campaigns):
        lines.append(answered(number, options.shape))
        print(dumps(asdict(lines[-1]), ensure_ascii=False), flush=True)
    table(lines)


if __name__ == "__main__":
    main()
