"""How often the ground ``instruments`` refuses certificates of right campaigns, and of those that were read otherwise.

``python tests/benchmarks/trial_instrument_grounds.py --seeds 300``: every seed is a horizontal centre of its own,
measured in one run by laser, ball bar and R-test (``tests/simulator/horizontal_centre.py``, no code shared with the
package). Errors are those beside the machine as it was in the middle of the run, in u of the joint fit times what all
readings scatter more than stated. ``--first``: the first seed; ``--only``: a part of a name; ``--stated``: judged by
what the instruments state alone, as before their own scatter counted; ``--who``: who is said to be the wrong one.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import robust_fit
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments import shares
from monitor.readers import read_campaign
from monitor.workflow.instruments.against_others import against_others
from monitor.workflow.uncertainty.grounds import grounds_of
from tests.benchmarks.trial_instruments import Heavy
from tests.simulator import horizontal_centre as shop


def noise_of(seed: int, times: float, heavy: bool) -> np.random.Generator:
    """What the readings scatter."""
    return Heavy(np.random.PCG64([seed, 1])) if heavy else shop.scaled(seed, times)


#: What is right, with the noise and how much the scales grew between the instruments; and what was read otherwise.
RIGHT: dict[str, dict] = {
    "as stated": {},
    "scatters 1.5 times as stated": {"times": 1.5},
    "scatters 3 times as stated": {"times": 3.0},
    "heavy tails": {"heavy": True},
    "bar scatters 3 times as stated": {"times": 3.0, "of": "bar"},
    "laser 0.5 um/m cooler, R-test 0.5 warmer": {"warmer": 0.5e-6},
    "laser 1 um/m cooler, R-test 1 warmer": {"warmer": 1e-6},
    "laser 3 um/m cooler, R-test 3 warmer": {"warmer": 3e-6},
}
WRONG = {
    "R-test, other sign": ("r-test", -1.0),
    "R-test around B, other sign": ("r-test-B", -1.0),
    "R-test in mm": ("r-test", 1e-3),
    "bar, other sign": ("bar", -1.0),
    "bar in mm": ("bar", 1e-3),
}


#: What is wrong, with who should be named for it.
WHO: dict[str, tuple[str, dict]] = {
    "bar, other sign": ("ball bar", {"otherwise": ("bar", -1.0)}),
    "one plane of the bar, other sign": ("bar-xy", {"otherwise": ("bar-xy", -1.0)}),
    "bar 5 um longer than stated": ("the stated length of ball bar", {"length": 150.005}),
    "bar 50 um longer than stated": ("the stated length of ball bar", {"length": 150.05}),
    "R-test, other sign": ("R-test", {"otherwise": ("r-test", -1.0)}),
    "R-test around A, other sign": ("r-test-A", {"otherwise": ("r-test-A", -1.0)}),
    "R-test around B, other sign": ("r-test-B", {"otherwise": ("r-test-B", -1.0)}),
    "R-test around B in mm": ("r-test-B", {"otherwise": ("r-test-B", 1e-3)}),
}


def suspects_of(
    seed: int, otherwise: tuple[str, float] | None = None, length: float = shop.BAR
) -> tuple[str, ...]:
    """Without whom the others agree; nobody where nothing contradicts."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    with tempfile.TemporaryDirectory() as folder:
        path = shop.campaign(Path(folder) / "shop", rng, truth, otherwise=otherwise)
        file = path / "campaign.toml"
        text = file.read_text(encoding="utf-8").replace(f"length_mm = {shop.BAR}", f"length_mm = {length}")
        file.write_text(text, encoding="utf-8")
        campaign = read_campaign(path)
    problem, ability = campaign_method(campaign).problem_of(campaign), campaign_method(campaign).instruments
    beside = against_others(problem, solve_problem(problem), ability, 1)
    if beside is None:
        return ()
    return tuple(suspect.name for suspect in beside.suspects) or ("no single one",)


def who(first: int, seeds: int) -> None:
    """Print how often the wrong one is named, alone or with others, and how often another one alone."""
    for name, (wrong, keys) in WHO.items():
        named = Counter(suspects_of(seed, **keys) for seed in range(first, first + seeds))
        alone = named[(wrong,)]
        among = sum(count for suspects, count in named.items() if wrong in suspects) - alone
        silent = named[()]
        print(
            f"{name}: {wrong} alone {_rate(alone, seeds)}, with others {among}, others "
            f"{seeds - alone - among - silent}, nobody {silent}; {dict(named)}",
            flush=True,
        )


def judged(seed: int, *, times: float = 1.0, heavy: bool = False, of: str = "", warmer: float = 0.0,
           otherwise: tuple[str, float] | None = None) -> tuple[str, float]:  # fmt: skip
    """What refuses the certificate of a campaign ("" where nothing does), and the largest error in u."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    states = {"laser": -warmer, "bar": 0.0, "r-test": warmer} if warmer else None
    with tempfile.TemporaryDirectory() as folder:
        noise = noise_of(seed, times, heavy)
        if of:
            path = _of_one(Path(folder) / "shop", rng, truth, seed, times, of)
        else:
            path = shop.campaign(
                Path(folder) / "shop", rng, truth, noise=noise, warmer=states, otherwise=otherwise
            )
        campaign = read_campaign(path)
    try:
        robust = robust_fit(campaign_method(campaign).problem_of(campaign))
    except MonitorError:
        return "identify", np.nan
    # These lasers state nothing of their scale, and it is exact.
    kinds = sorted({ground.kind.value for ground in grounds_of(campaign, robust, 1)} - {"scale"})
    solution, problem = robust.fit.solution, robust.fit.problem
    expected = {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}
    off = [
        abs(solution.local[0, number] - expected[name])
        / np.sqrt(solution.local_covariance[0, number, number])
        / max(1.0, times if not of else 1.0)
        for number, name in enumerate(problem.base_names)
        if solution.local_free[0, number] and name in expected
    ]
    return ", ".join(kinds), float(max(off))


def _of_one(folder: Path, rng: np.random.Generator, truth: dict, seed: int, times: float, of: str) -> Path:
    """A campaign in which one instrument alone scatters more than it states."""
    text, rows = "", []
    for number, (name, measure) in enumerate(shop.INSTRUMENTS.items()):
        drawn = noise_of(seed + 10**6 * number, times if name == of else 1.0, heavy=False)
        setups, more = measure(shop.machine(truth), rng, drawn)
        text, rows = text + setups, rows + more
    return shop.machine(truth).write(folder, text, rows)


def _rate(count: int, of: int) -> str:
    low, high = scipy.stats.binomtest(count, of).proportion_ci(method="exact")
    return f"{count} of {of}, {100 * count / of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--stated", action="store_true")
    parser.add_argument("--who", action="store_true")
    options = parser.parse_args()
    if options.who:
        who(options.first, options.seeds)
        return
    if options.stated:
        shares.scatter_of = lambda remaining, freedom: (1.0, float("inf"))
    begin = time.process_time()
    cases = {name: (keys, options.seeds) for name, keys in RIGHT.items()}
    cases |= {name: ({"otherwise": how}, max(1, options.seeds // 5)) for name, how in WRONG.items()}
    for name, (keys, count) in cases.items():
        if options.only not in f"{name},":
            continue
        answers = [judged(seed, **keys) for seed in range(options.first, options.first + count)]
        refused = [kinds for kinds, _ in answers if kinds]
        by_instruments = sum("instruments" in kinds for kinds in refused)
        largest = np.array([off for _, off in answers])
        issued = [off for kinds, off in answers if not kinds]
        print(
            f"{name}: refused {_rate(len(refused), count)}, by `instruments` {_rate(by_instruments, count)}; all by "
            f"{dict(Counter(refused))}; largest error of a campaign in u, median {np.nanmedian(largest):.1f}; issued "
            f"with one above 5 u {sum(off > 5.0 for off in issued)}; {time.process_time() - begin:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
