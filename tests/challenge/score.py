"""Score answers to the challenge against its truth.

``python tests/challenge/score.py OUT`` prints the table of docs/challenge.md for every ``OUT/answers-*.json``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import beta

#: Peaks, in µm, between which the share that is found is counted; the smallest from which on it is 90 %.
EDGES_UM = (1.5, 3.0, 4.5, 6.0, 8.0, 10.0)
FOUND = 0.9


@dataclass
class Score:
    """Counts of a program: effects hidden and found, by kind and peak; false ones; intervals that hold the peak."""

    campaigns: int = 0
    hidden: int = 0
    right: int = 0
    false: int = 0
    clean: int = 0
    covered: int = 0
    stated: int = 0
    seconds: float = 0.0
    by_kind: dict[str, list[tuple[float, bool]]] = field(default_factory=lambda: defaultdict(list))


def term(effect: str) -> str:
    return effect.partition("@")[0].partition(":")[0]


def plain(effect: str) -> str:
    """A name without what is searched of it: the time constant of a warm-up, the decimals of a pitch."""
    name, _, driver = effect.partition("@")
    head, _, shape = name.partition(":")
    if shape.startswith("cyclic"):
        shape = f"cyclic{round(float(shape[6:].removesuffix('mm')), 0):g}mm"
    driver = "warmup" if driver.startswith("warmup") else driver
    return f"{head}:{shape}@{driver}" if driver else f"{head}:{shape}"


def is_right(hidden: Mapping[str, Any], group: Sequence[str]) -> bool:
    """Whether an answered effect with its rivals holds a hidden one: by its name, without a shape by its term."""
    if hidden["shape_outside"]:
        return any(term(name) == hidden["effect"] for name in group)
    return plain(hidden["effect"]) in {plain(name) for name in group}


def score(truth: Sequence[Mapping[str, Any]], answers: Sequence[Mapping[str, Any]]) -> Score:
    """Compare; a campaign without an answer counts as one in which nothing was found. Every effect is found once."""
    by_campaign = {answer["campaign"]: answer for answer in answers}
    if unknown := set(by_campaign) - {campaign["campaign"] for campaign in truth}:
        raise ValueError(f"answers to campaigns that are not in the truth: {', '.join(sorted(unknown))}")
    result = Score()
    for campaign in truth:
        answer = by_campaign.get(campaign["campaign"], {"effects": [], "seconds": 0.0})
        result.campaigns += 1
        result.seconds += float(answer.get("seconds", 0.0))
        open_effects = list(campaign["effects"])
        false = 0
        for effect in answer["effects"]:
            group = [effect["effect"], *effect.get("rivals", ())]
            match = next((hidden for hidden in open_effects if is_right(hidden, group)), None)
            if match is None:
                false += 1
                continue
            open_effects.remove(match)
            result.right += 1
            result.by_kind[match["kind"]].append((match["peak_um"], True))
            if (
                not match["shape_outside"]
                and plain(effect["effect"]) == plain(match["effect"])
                and effect.get("u_um")
            ):
                result.stated += 1
                result.covered += abs(effect["peak_um"] - match["peak_um"]) <= 2.0 * effect["u_um"]
        for hidden in open_effects:
            result.by_kind[hidden["kind"]].append((hidden["peak_um"], False))
        result.hidden += len(campaign["effects"])
        result.false += false
        result.clean += false == 0
    return result


def smallest(cases: Sequence[tuple[float, bool]]) -> str:
    """The peak from which on 90 % are found, in the classes of ``EDGES_UM``; with how many from there on."""
    peaks, right = np.array([peak for peak, _ in cases]), np.array([ok for _, ok in cases])
    for edge in EDGES_UM[:-1]:
        above = peaks >= edge
        if above.sum() >= 3 and right[above].mean() >= FOUND:
            return f"{edge:g} ({int(above.sum())})"
    return f"none ({len(cases)})"


def share(count: int, of: int) -> str:
    """A share in percent with its exact 95 % interval (Clopper and Pearson)."""
    if not of:
        return "-"
    low = beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return f"{100 * count / of:.0f} ({100 * low:.0f} to {100 * high:.0f})"


def tables(scores: Mapping[str, Score]) -> list[str]:
    lines = [
        "| program | hidden effects found, % | campaigns without a false effect, % | false effects a campaign "
        "| peak within 2 u, % | seconds |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, one in scores.items():
        lines.append(
            f"| {name} | {share(one.right, one.hidden)} | {share(one.clean, one.campaigns)} | "
            f"{one.false / max(one.campaigns, 1):.2f} | {share(one.covered, one.stated)} | "
            f"{one.seconds / max(one.campaigns, 1):.1f} |"
        )
    kinds = sorted({kind for one in scores.values() for kind in one.by_kind})
    lines += ["", "| program | " + " | ".join(kinds) + " |", "| --- |" + " --- |" * len(kinds)]
    for name, one in scores.items():
        lines.append(
            f"| {name} | " + " | ".join(smallest(one.by_kind.get(kind, [])) for kind in kinds) + " |"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    text = (out / "truth.json").read_text(encoding="utf-8")
    sealed = (out / "truth.sha256").read_text(encoding="utf-8").split()[0]
    if hashlib.sha256(text.encode()).hexdigest() != sealed:
        raise SystemExit("truth.json is not what was sealed: its sha256 differs from truth.sha256")
    truth = json.loads(text)["campaigns"]
    scores = {}
    for path in sorted(out.glob("answers-*.json")):
        document = json.loads(path.read_text(encoding="utf-8"))
        scores[document["program"]] = score(truth, document["answers"])
    print("\n".join(tables(scores)))


if __name__ == "__main__":
    main()
