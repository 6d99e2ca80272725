"""Trial of power: does `explain` find what an independent simulator hid, and nothing where nothing was hidden?

Run from the checkout, with the package installed (half an hour on two cores):

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_discovery.py --seeds 10 --empties 500 --processes 2

Prints the tables and, with ``--write``, keeps them in docs/trials-discovery.md. Nothing of the simulator stems
from the package. Every effect of the catalogue is hidden at peaks of 2, 4 and 8 µm (norm of the tip-to-ball
displacement) in 20 runs of the five-days plan with 1 µm noise, if what the plain model cannot take up of it has
an RMS of at least 0.25 µm over all coordinates; then come scenes with several effects, bad points, balls that
moved, steps, other plans and other noise.
"""

from __future__ import annotations

import argparse
import gzip
import json
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery import ChainMissing, Explanation, explain, fit
from monitor.effects.catalogue import catalogue, drivers_of
from monitor.methods.samba.method import problem_of
from monitor.records import Campaign

ROOT = Path(__file__).resolve().parents[2]
PEAKS_UM = (2.0, 4.0, 8.0)
VISIBLE_UM = 0.25

simulator = simulator_of()
virtual_campaigns = load("virtual_campaigns", ROOT / "tests" / "discovery" / "virtual.py")


@dataclass(frozen=True)
class Case:
    """One campaign of the trial: what is hidden (names of effects), at which peak, in which scene."""

    scene: str
    seed: int
    hidden: tuple[str, ...] = ()
    peak: float = 0.0


@dataclass
class Record:
    """What came of a case. ``right`` says that the hidden effects lead (or stand in the group that leads)."""

    scene: str
    seed: int
    hidden: tuple[str, ...]
    peak: float
    visible: float = 0.0
    skipped: bool = False
    right: bool = False
    led: bool = False
    found: list[str] = field(default_factory=list)
    groups: list[list[str]] = field(default_factory=list)
    held_out: float | None = None
    floor: float | None = None
    covered: list[bool] = field(default_factory=list)
    verdict: str = ""
    suspects: int = 0
    moves: list[str] = field(default_factory=list)
    steps: list[str] = field(default_factory=list)
    seconds: float = 0.0
    note: str = ""


def known_effects() -> list[str]:
    """Every effect of the catalogue for the five-days plan."""
    campaign, _ = virtual_campaigns.virtual(1)
    problem = problem_of(campaign)
    base = [effect.text for effect in problem.base]
    return [
        effect.text
        for effect in catalogue(problem.context.chain, base, drivers_of(problem.context))
        if effect.text != "stem:gravity"  # all stems alike bend unseen: see the scene of one soft stem
    ]


def _hide(name: str, peak: float, rng: np.random.Generator) -> Any:
    """An effect of the simulator: phases and directions at random, time constants from 10 min to 3 h."""
    width = 2 if ("harmonic" in name or "cyclic" in name) else 3 if name.endswith("@gravity") else 1
    direction = rng.standard_normal(width) if width > 1 else np.array([rng.choice([-1.0, 1.0])])
    tau = float(np.exp(rng.uniform(np.log(600.0), np.log(10800.0))))
    return simulator.Effect(name, peak_um=peak, direction=direction, tau_s=tau)


def _names(one: ChainMissing) -> set[str]:
    return {one.effect, *(rival.effect for rival in one.rivals)}


def _covered(one: ChainMissing, truth: Any) -> bool | None:
    """Whether the true size lies in the 95 % interval; None where the sizes are not comparable."""
    given = np.atleast_1d(np.asarray(truth.coefficients, float))
    if one.effect != truth.name or given.shape != one.coefficients.shape:
        return None
    u = np.sqrt(np.diag(one.covariance))
    if not np.all(u > 0.0):
        return None
    values, vectors = np.linalg.eigh(one.covariance / np.outer(u, u))
    if values.min() <= 1e-6:
        return None
    scaled = (one.coefficients - given) / u
    distance = float(np.sum((vectors.T @ scaled) ** 2 / values))
    return distance <= float(stats.chi2.ppf(0.95, len(given)))


def _record(case: Case, campaign: Campaign, told: dict[str, Any]) -> tuple[Record, Explanation]:
    begin = time.perf_counter()
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(case.seed))
    record = Record(case.scene, case.seed, case.hidden, case.peak, seconds=time.perf_counter() - begin)
    record.found = [one.effect for one in answer.missing]
    record.groups = [sorted(_names(one)) for one in answer.missing]
    record.verdict = answer.comparison.verdict
    record.suspects = len(answer.suspect)
    record.moves = [f"{move.target}@{move.run}:{move.sequence}" for move in answer.moves]
    record.steps = [f"{step.parameter or step.target}@{step.run}" for step in answer.steps]
    wanted = list(case.hidden)
    leading = [_names(one) for one in answer.missing[: len(wanted)]]
    record.right = len(leading) == len(wanted) and all(
        any(name in group for group in leading) for name in wanted
    )
    record.led = set(record.found[: len(wanted)]) == set(wanted)
    hidden = {effect.name: effect for effect in told["effects"] if effect.peak_um is None}
    for one in answer.missing:
        if one.effect in hidden and one.effect in wanted:
            covered = _covered(one, hidden[one.effect])
            if covered is not None:
                record.covered.append(covered)
    if answer.missing:
        record.held_out = answer.missing[-1].held_out_after
    return record, answer


def _visible(seed: int, effects: list[Any], **others: Any) -> float:
    """RMS in µm of what a fit of the plain model leaves of the effects, without noise."""
    campaign, _ = virtual_campaigns.virtual(seed, effects, **{**others, "noise_um": 0.0})
    return fit(problem_of(campaign)).rms * 1e3


def single(case: Case) -> Record:
    """One hidden effect."""
    effects = [_hide(case.hidden[0], case.peak, np.random.default_rng((case.seed, 7)))]
    return _hidden(case, effects)


def _hidden(case: Case, effects: list[Any], **others: Any) -> Record:
    try:
        visible = _visible(case.seed, effects, **others)
    except ValueError:  # moves nothing in this plan
        return Record(case.scene, case.seed, case.hidden, case.peak, skipped=True)
    if visible < VISIBLE_UM:
        return Record(case.scene, case.seed, case.hidden, case.peak, visible, skipped=True)
    campaign, told = virtual_campaigns.virtual(case.seed, effects, **others)
    record, _ = _record(case, campaign, told)
    record.visible = visible
    # The same noise without the effect: what it leaves per degree of freedom is this campaign's noise floor.
    bare, _ = virtual_campaigns.virtual(case.seed, **others)
    plain = fit(problem_of(bare))
    record.floor = plain.scale * plain.sigma
    return record


# A variety of kinds: used where several effects are hidden together or beside something else.
VARIED = (
    "EYX:poly2", "EAX:poly1", "EXX:poly2", "EYY:poly2", "EAZ:poly1", "EXX:reversal", "EYC:reversal",
    "EXX:cyclic20mm", "EZZ:cyclic10mm", "EBB:harmonic2", "EAB:harmonic2", "EXC:harmonic2", "EZC:harmonic1",
    "ECC:harmonic3", "EZC1:const@warmup", "EB0C@run_time", "EXX:poly1@run_time", "EZC1:const@x_axis_degC",
    "artefact:expansion@run_time",
)  # fmt: skip


def _some(case: Case, count: int) -> list[Any]:
    rng = np.random.default_rng((case.seed, 11))
    names = rng.choice(VARIED, size=count, replace=False)
    return [_hide(str(name), float(rng.uniform(4.0, 8.0)), rng) for name in names]


def several(case: Case) -> Record:
    """Two or three effects together, each of them visible."""
    effects = _some(case, int(case.scene.split()[0]))
    case = Case(case.scene, case.seed, tuple(effect.name for effect in effects))
    return _hidden(case, effects)


def _clean(record: Record) -> Record:
    record.right = not (record.found or record.suspects or record.moves or record.steps)
    record.right = record.right and record.verdict == "explained"
    return record


EMPTY_SCENES: dict[str, dict[str, Any]] = {
    "empty": {},
    "empty, parameters wander": {"wander": 0.1},
    "empty, noise 0.5 of stated": {"noise_um": 0.5, "stated_um": 1.0},
    "empty, stated 20 % too low": {"stated_um": 1 / 1.2},
    "empty, stated 20 % too high": {"stated_um": 1.2},
    "empty, 1 run": {"days": 1, "runs_per_day": 1},
    "empty, 2 runs": {"days": 1, "runs_per_day": 2},
    "empty, 3 runs": {"days": 3, "runs_per_day": 1},
    "empty, one day": {"days": 1, "runs_per_day": 8},
    "empty, 44 runs cold": {"cold": True, "noise_um": 0.7},
    "empty, plans differ": {"keep": lambda told: _partly(told)},
    "empty, nothing recorded": {"with_channels": False},
}


def _partly(told: dict[str, Any]) -> Any:
    """Every second run without its last fifteen probings, every third without its seventh to tenth."""
    run, sequence = told["run"], told["sequence"]
    return ~((run % 2 == 0) & (sequence > 47)) & ~((run % 3 == 0) & (sequence > 6) & (sequence < 11))


def empty(case: Case) -> Record:
    """Nothing hidden."""
    return _clean(_record(case, *virtual_campaigns.virtual(case.seed, **EMPTY_SCENES[case.scene]))[0])


def beside(case: Case) -> Record:
    """One effect in another kind of campaign."""
    options = {**EMPTY_SCENES["empty, " + case.scene.partition("effect, ")[2]]}
    return _hidden(case, [_hide(case.hidden[0], case.peak, np.random.default_rng((case.seed, 7)))], **options)


def points(case: Case) -> Record:
    """One to five bad points of 5 to 100 µm, with or without an effect: all of them told, nothing else."""
    rng = np.random.default_rng((case.seed, 13))
    count = int(rng.integers(1, 6))
    chosen = rng.choice(20 * 60, size=count, replace=False)
    # Not on the bar's balls, which a run touches once: nothing could show it.
    where = [(int(one) // 60 + 1, int(one) % 60 + 1) for one in chosen]
    where = [(run, sequence if sequence <= 12 else sequence + 2) for run, sequence in where]
    sizes = np.exp(rng.uniform(np.log(8.0), np.log(100.0), count)) * rng.choice([-1.0, 1.0], count)
    off = [np.eye(3)[rng.integers(3)] * size for size in sizes]
    bad = [(run, sequence, tuple(one)) for (run, sequence), one in zip(where, off, strict=True)]
    effects = [_hide(case.hidden[0], case.peak, rng)] if case.hidden else []
    campaign, told = virtual_campaigns.virtual(case.seed, effects, bad_points=bad)
    record, answer = _record(case, campaign, told)
    seen = {(point.run, point.sequence) for point in answer.suspect}
    if not case.hidden:
        record.right = not record.found
    record.note = f"missed {len(set(where) - seen)} of {count}, invented {len(seen - set(where))}"
    record.right = record.right and seen == set(where) and not record.moves and not record.steps
    return record


def ball_within(case: Case) -> Record:
    """A ball that came loose in a run, by 6 to 15 µm, in some direction."""
    rng = np.random.default_rng((case.seed, 17))
    shift = rng.standard_normal(3)
    shift *= rng.uniform(6.0, 15.0) / np.linalg.norm(shift) * 1e-3
    run, ball, sequence = int(rng.integers(2, 20)), str(rng.integers(1, 5)), int(rng.integers(16, 47))
    loose = simulator.Effect(f"ball:{ball}:moved", coefficients=shift, at=(run, sequence))
    effects = [loose] + ([_hide(case.hidden[0], case.peak, rng)] if case.hidden else [])
    campaign, told = virtual_campaigns.virtual(case.seed, effects)
    record, answer = _record(case, campaign, told)
    hit = [move for move in answer.moves if (move.target, move.run) == (ball, run)]
    if not case.hidden:
        record.right = not record.found
    record.note = f"{ball}@{run}:{sequence} " + "; ".join(
        f"off by {np.linalg.norm(np.array(move.shift) - shift) * 1e3:.1f} um, {move.sequence - sequence} late"
        for move in hit
    )
    close = [np.linalg.norm(np.array(move.shift) - shift) < 4e-3 for move in hit]
    record.right = record.right and len(answer.moves) == 1 and all(close) and len(hit) == 1
    record.right = record.right and not record.suspects
    return record


def ball_between(case: Case) -> Record:
    """A ball that stands elsewhere from a run on."""
    rng = np.random.default_rng((case.seed, 19))
    shift = rng.standard_normal(3)
    shift *= rng.uniform(6.0, 15.0) / np.linalg.norm(shift) * 1e-3
    run, ball = int(rng.integers(4, 17)), str(rng.integers(1, 5))
    loose = simulator.Effect(f"ball:{ball}:moved", coefficients=shift, at=(run, 1))
    campaign, told = virtual_campaigns.virtual(case.seed, [loose])
    record, _ = _record(case, campaign, told)
    record.note = f"{ball}@{run}"
    record.right = not record.found and record.steps == [f"{ball}@{run}"]
    record.right = record.right and not record.moves and not record.suspects
    return record


def step(case: Case) -> Record:
    """A location error that steps between two runs."""
    rng = np.random.default_rng((case.seed, 23))
    name = str(rng.choice(["EA0B", "EC0B", "EX0C", "EA0C", "EB0C", "EB0Z", "EC0Y", "EXX:poly1", "EZZ:poly1"]))
    size = 0.003 if name == "EX0C" else 40e-6 if "poly" in name else 15e-6
    run = int(rng.integers(4, 17))
    values = simulator.SAMBA_TERMS[name] + size * (np.arange(1, 21) >= run)
    campaign, told = virtual_campaigns.virtual(case.seed, terms={name: values})
    record, _ = _record(case, campaign, told)
    record.note = f"{name}@{run}"
    record.right = not record.found and record.steps == [f"{name.partition(':')[0]}@{run}"]
    return record


def varying(case: Case) -> Record:
    """An effect of another size in every run, which nothing recorded follows."""
    rng = np.random.default_rng((case.seed, 29))
    sizes = rng.standard_normal(20)
    probe = simulator.Effect(case.hidden[0], peak_um=case.peak)
    _, told = virtual_campaigns.virtual(case.seed, [probe], noise_um=0.0)
    one = float(np.atleast_1d(told["effects"][-1].coefficients)[0])
    wanted = case.hidden[0] + "@each_run"
    effect = simulator.Effect(case.hidden[0], coefficients=one * sizes)
    case = Case(case.scene, case.seed, (wanted,), case.peak)
    campaign, told = virtual_campaigns.virtual(case.seed, [effect])
    record, answer = _record(case, campaign, told)
    record.right = any(wanted in _names(found) and found.varies for found in answer.missing)
    record.note = f"verdict {record.verdict}"
    return record


def pitch(case: Case) -> Record:
    """A cyclic error of a pitch that nobody knows, from 4.5 to 100 mm."""
    rng = np.random.default_rng((case.seed, 31))
    term = str(rng.choice(["EXX", "EYY", "EZZ"]))
    true = float(np.exp(rng.uniform(np.log(4.5), np.log(60.0))))
    effect = simulator.Effect(
        f"{term}:cyclic{true:.4f}mm", peak_um=case.peak, direction=rng.standard_normal(2)
    )
    campaign, told = virtual_campaigns.virtual(case.seed, [effect])
    case = Case(case.scene, case.seed, (effect.name,), case.peak)
    record, answer = _record(case, campaign, told)
    first = answer.missing[0] if answer.missing else None
    record.note = f"{effect.name} "
    record.right = False
    if first is not None and first.searched is not None and first.effect.startswith(f"{term}:cyclic"):
        record.note += f"found {first.searched.value:.4f} u {first.searched.u:.4f}"
        record.right = abs(first.searched.value - true) < 4 * first.searched.u
    return record


def stem(case: Case) -> Record:
    """One soft stem of four."""
    ball = str(np.random.default_rng((case.seed, 37)).integers(1, 5))
    effect = simulator.Effect("stem:gravity", peak_um=case.peak, targets=[ball])
    return _hidden(Case(case.scene, case.seed, ("stem:gravity",), case.peak), [effect])


SCENES: dict[str, Callable[[Case], Record]] = {
    "one effect": single,
    "2 effects": several,
    "3 effects": several,
    **dict.fromkeys(EMPTY_SCENES, empty),
    **{name.replace("empty", "effect"): beside for name in EMPTY_SCENES if name != "empty"},
    "bad points": points,
    "bad points and an effect": points,
    "a ball moved in a run": ball_within,
    "a ball moved, and an effect": ball_within,
    "a ball moved between runs": ball_between,
    "a step of a parameter": step,
    "varies from run to run": varying,
    "unknown pitch": pitch,
    "one soft stem": stem,
}


def judge(case: Case) -> Record:
    """Run one case."""
    return SCENES[case.scene](case)


def cases(seeds: int, empties: int, scenes: int, only: str = "") -> Iterable[Case]:
    """All cases: effects x peaks x seeds, empty campaigns, and ``scenes`` of each other kind."""
    found: list[Case] = []
    # Seed by seed, so that a trial that is stopped has seen all effects.
    names = known_effects()
    for seed in range(seeds):
        kinds = [(name, peak) for name in names for peak in PEAKS_UM]
        # Every campaign has noise of its own.
        found += [
            Case("one effect", 10000 * (seed + 1) + place, (name,), peak)
            for place, (name, peak) in enumerate(kinds)
        ]
    for scene in SCENES:
        if scene == "one effect":
            continue
        count = empties if scene == "empty" else scenes
        for seed in range(count):
            rng = np.random.default_rng((seed, len(scene)))
            hidden: tuple[str, ...] = ()
            peak = float(rng.choice([4.0, 8.0]))
            if SCENES[scene] is beside or scene.endswith("an effect"):
                hidden = (str(rng.choice(VARIED)),)
            if scene == "varies from run to run":
                hidden = (
                    str(rng.choice(["EYX:poly2", "EAX:poly1", "EXX:reversal", "EYY:poly2", "EAZ:poly1"])),
                )
            found.append(Case(scene, 5000 + seed, hidden, peak))
    return [case for case in found if only in case.scene]


def interval(hits: int, of: int) -> str:
    """A share in per cent with its exact 95 % interval (Clopper and Pearson, Biometrika 26 (1934) 404)."""
    if of == 0:
        return "none"
    low = float(stats.beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0
    high = float(stats.beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0
    return f"{hits / of:.1%} ({hits} of {of}; {low:.1%} to {high:.1%})"


def table(records: list[Record]) -> str:
    """The results as Markdown."""
    lines = ["## One hidden effect", ""]
    ones = [one for one in records if one.scene == "one effect" and not one.skipped]
    lines += [
        "| peak | right group first | the effect itself leads | nothing else told | amplitude in its 95 % "
        "interval | held-out RMS after, of the noise floor |"
    ]
    lines += ["| --- | --- | --- | --- | --- | --- |"]
    for peak in (*PEAKS_UM, None):
        mine = [one for one in ones if peak in (None, one.peak)]
        covered = [hit for one in mine for hit in one.covered]
        held = np.array(
            [one.held_out / one.floor for one in mine if one.held_out and one.floor and one.right]
        )
        within = interval(int(np.sum(np.abs(held - 1.0) <= 0.03)), len(held))
        single_told = sum(len(one.found) == 1 and not one.suspects and not one.moves for one in mine)
        lines.append(
            f"| {'all' if peak is None else f'{peak:g} µm'} | {interval(sum(one.right for one in mine), len(mine))} | "
            f"{interval(sum(one.led for one in mine), len(mine))} | {interval(single_told, len(mine))} | "
            f"{interval(sum(covered), len(covered))} | within 3 %: {within} |"
        )
    sizes = Counter(len(one.groups[0]) for one in ones if one.groups)
    lines += [
        "",
        "Effects in the leading group: "
        + ", ".join(f"{size}: {count}" for size, count in sorted(sizes.items())),
        "",
    ]
    lines += [
        "## Other scenes",
        "",
        "| scene | right | effects told that are not there |",
        "| --- | --- | --- |",
    ]
    by: dict[str, list[Record]] = defaultdict(list)
    for one in records:
        if one.scene != "one effect" and not one.skipped:
            by[one.scene].append(one)
    for scene in SCENES:
        if scene in by:
            mine = by[scene]
            more = sum(len(one.found) > max(len(one.hidden), 0) for one in mine)
            lines.append(
                f"| {scene} | {interval(sum(one.right for one in mine), len(mine))} | {interval(more, len(mine))} |"
            )
    wrong = [
        one
        for one in sorted(records, key=lambda one: list(SCENES).index(one.scene))
        if not one.skipped and not one.right
    ]
    lines += [
        "",
        "## What went wrong",
        "",
        "| scene | seed | hidden | peak | visible RMS | told | besides |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {one.scene} | {one.seed} | {', '.join(one.hidden)} | {one.peak:g} | {one.visible:.2f} | "
        f"{'; '.join(' = '.join(group[:4]) for group in one.groups) or 'nothing'} | "
        f"{one.suspects} suspect; {' '.join(one.moves)} {' '.join(one.steps)} {one.note} {one.verdict} |"
        for one in wrong[:60]
    ]
    return "\n".join(lines)


def _opened(path: Path) -> str:
    return gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()


def _keep(path: Path, text: str) -> None:
    data = text.encode()
    path.write_bytes(gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--empties", type=int, default=500)
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=1e9, help="stop beginning new cases after so long")
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    parser.add_argument("--write", action="store_true", help="keep the tables in docs/trials-discovery.md")
    parser.add_argument(
        "--log", type=Path, help="one JSON document a case; those that it has already are not run again"
    )
    parser.add_argument("--tables", type=Path, nargs="+", help="only make the tables, of these logs")
    options = parser.parse_args()
    begin = time.perf_counter()
    records: list[Record] = []
    todo = [] if options.tables else list(cases(options.seeds, options.empties, options.scenes, options.only))
    for path in options.tables or ():
        records += [Record(**json.loads(line)) for line in _opened(path).splitlines()]
    if options.log and options.log.exists():
        records += [Record(**json.loads(line)) for line in _opened(options.log).splitlines()]
        done = {(one.scene, one.seed) for one in records}
        todo = [case for case in todo if (case.scene, case.seed) not in done]
    with ProcessPoolExecutor(options.processes) as pool:
        size = 12 * options.processes
        for start in range(0, len(todo), size):
            if time.perf_counter() - begin > 60.0 * options.minutes:
                break
            records += pool.map(judge, todo[start : start + size])
            if options.log:
                _keep(options.log, "\n".join(json.dumps(vars(one), default=float) for one in records))
    seconds = float(np.median([one.seconds for one in records if not one.skipped]))
    head = (
        "# Trial of power of `explain`\n\n"
        f"{date.today():%d %B %Y}; `OMP_NUM_THREADS=1 python {' '.join(sys.argv)}`; seeds from 10000 on for single "
        "effects, from 5000 on for the other scenes. "
        f"{len(records)} cases, {sum(one.skipped for one in records)} of them skipped because the "
        f"plan leaves less than {VISIBLE_UM} µm RMS visible; median time of an explanation {seconds:.2f} s on one "
        "core.\n\n"
        "Campaigns come from tests/simulator, which shares no code with the package: five days of four runs, 62 "
        "probings each, 1 µm white noise on every reading unless said otherwise. A share stands with its exact 95 % "
        "interval. 'Right group first': the hidden effect leads the answer or is named among those that the data "
        "cannot tell from the leader. The noise floor is what a fit of the plain model leaves of the same noise "
        "without the effect.\n\n"
    )
    text = head + table(records) + "\n"
    print(text)
    if options.write:
        (ROOT / "docs" / "trials-discovery.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
