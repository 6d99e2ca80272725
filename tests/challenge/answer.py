"""Answer the challenge: with ours, or with what others do on the same columns of the same library.

``python tests/challenge/answer.py OUT PROGRAM [PROGRAM ...]`` writes ``OUT/answers-PROGRAM.json`` (format: README.md
beside this file). Programs: ``ours``, ``stepwise-bic`` (forward and backward by BIC, as analysts of telescope pointing
do), ``lasso`` (cross-validated over runs, refitted), ``sindy`` (sequentially thresholded ridge regression on
standardised columns, the threshold by BIC), ``knockoffs`` (model-X, equicorrelated, false discovery rate 0.2).
The others need the extra ``challenge``. They get what ours starts from: the residual of the base model and the columns
of all effects, with all that is free in every run taken out.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery import Fit, explain, fit
from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of
from monitor.readers import read_campaign

Effects = list[dict[str, Any]]
#: False discovery rate asked of the knockoffs: with a smaller one none can be called of up to four effects.
KNOCKOFF_RATE = 0.2
#: Columns that LASSO and knockoffs look at.
MOST = 200


@dataclass(frozen=True)
class Library:
    """The response (M,) and the columns (M, k) of every effect, all without what is free in every run; ``run`` (M,)."""

    scene: ChainScene
    candidates: Sequence[ChainCandidate]
    y: np.ndarray
    x: np.ndarray
    owner: np.ndarray
    freedom: int
    run: np.ndarray


def library_of(folder: Path) -> Library:
    campaign = read_campaign(folder)
    problem = problem_of(campaign).for_search()
    first = fit(problem)
    scene = scene_of(
        first, variants_of_campaign(campaign, problem, surroundings_of(campaign, problem).drivers)
    )
    seen = [candidate for candidate in scene.candidates if candidate.visible and np.any(candidate.columns)]
    x = np.concatenate([candidate.columns for candidate in seen], axis=1)
    owner = np.repeat(np.arange(len(seen)), [candidate.columns.shape[1] for candidate in seen])
    used = np.linalg.norm(x, axis=0) > 1e-9
    return Library(scene, seen, scene.residual, x[:, used], owner[used], scene.degrees_of_freedom, scene.run)


def refitted(library: Library, selected: Sequence[int]) -> Effects:
    """The selected effects by least squares, with their peaks at the tip and standard uncertainties."""
    if not len(selected):
        return []
    columns = [library.x[:, library.owner == k] for k in selected]
    x = np.concatenate(columns, axis=1)
    beta, *_ = np.linalg.lstsq(x, library.y, rcond=None)
    rest = library.y - x @ beta
    covariance = np.linalg.pinv(x.T @ x) * float(rest @ rest) / max(library.freedom - x.shape[1], 1)
    effects, start = [], 0
    for k, part in zip(selected, columns, strict=True):
        place = slice(start, start + part.shape[1])
        start += part.shape[1]
        candidate = library.candidates[k]
        c, size = beta[place], float(np.linalg.norm(beta[place]))
        if candidate.raw.shape[2] != len(c) or size == 0.0:
            peak, u = 0.0, 0.0
        else:
            peak = 1e3 * float(np.linalg.norm(candidate.raw @ c, axis=1).max())
            u = peak * float(np.sqrt((c / size) @ covariance[place, place] @ (c / size))) / size
        effects.append({"effect": candidate.effect.text, "rivals": [], "peak_um": peak, "u_um": u})
    return effects


def bic(library: Library, selected: Sequence[int]) -> float:
    x = library.x[:, np.isin(library.owner, selected)]
    rest = library.y - x @ np.linalg.lstsq(x, library.y, rcond=None)[0] if len(selected) else library.y
    n = library.freedom
    return float(n * np.log(rest @ rest / n) + x.shape[1] * np.log(n))


def stepwise_bic(library: Library) -> list[int]:
    """Add the effect that lowers BIC most, take out those that raise it, until nothing changes."""
    groups = [np.flatnonzero(library.owner == k) for k in range(len(library.candidates))]
    selected: list[int] = []
    now = bic(library, selected)
    while len(selected) < 20:
        basis = np.linalg.qr(library.x[:, np.isin(library.owner, selected)])[0]
        rest, left = library.y - basis @ (basis.T @ library.y), library.x - basis @ (basis.T @ library.x)
        gain = np.zeros(len(groups))
        for k, columns in enumerate(groups):
            if k not in selected and np.linalg.norm(left[:, columns]) > 1e-6 * np.linalg.norm(
                library.x[:, columns]
            ):
                q = np.linalg.svd(left[:, columns], full_matrices=False)[0]
                gain[k] = float(np.sum((q.T @ rest) ** 2)) - np.log(library.freedom) * (len(columns) - 1)
        best = int(gain.argmax())
        trial = bic(library, [*selected, best])
        if trial >= now:
            break
        selected, now = [*selected, best], trial
        for other in list(selected[:-1]):
            without = [k for k in selected if k != other]
            if bic(library, without) < now:
                selected, now = without, bic(library, without)
    return selected


def standardised(library: Library) -> np.ndarray:
    return library.x / np.linalg.norm(library.x, axis=0) * np.sqrt(len(library.x))


def distinct(library: Library) -> tuple[np.ndarray, np.ndarray]:
    """At most ``MOST`` standardised columns (M, k), those that go with the response most; of columns alike to 0.99 one.

    With all of them, most of which have twins, coordinate descent takes minutes and knockoffs do not exist.
    """
    x = standardised(library)
    gram = x.T @ x / len(x)
    kept: list[int] = []
    for column in np.argsort(-np.abs(x.T @ library.y)):
        if not kept or np.abs(gram[column, kept]).max() < 0.99:
            kept.append(int(column))
        if len(kept) == MOST:
            break
    return x[:, kept], library.owner[kept]


def lasso(library: Library) -> list[int]:
    from sklearn.linear_model import LassoCV
    from sklearn.model_selection import GroupKFold

    x, owner = distinct(library)
    folds = list(GroupKFold(5).split(x, groups=library.run))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = LassoCV(
            cv=folds, fit_intercept=False, alphas=20, max_iter=300, tol=1e-3, precompute=True
        ).fit(x, library.y)
    return sorted(set(owner[np.abs(model.coef_) > 0.0].tolist()))


def sindy(library: Library) -> list[int]:
    """STLSQ (Brunton, Proctor and Kutz, PNAS 113 (2016) 3932) over a grid of thresholds."""
    x = standardised(library)
    gram, projected = x.T @ x, x.T @ library.y
    best, least = [], bic(library, [])
    for threshold in np.geomspace(0.01, 0.5, 8):
        active = np.ones(x.shape[1], dtype=bool)
        for _ in range(10):
            # 0.05 of a column's length, as pysindy has it for columns of length one.
            ridge = gram[np.ix_(active, active)] + 0.05 * len(x) * np.eye(int(active.sum()))
            beta = np.linalg.solve(ridge, projected[active])
            small = np.abs(beta) < threshold
            if not small.any():
                break
            active[np.flatnonzero(active)[small]] = False
            if not active.any():
                break
        selected = sorted(set(library.owner[active].tolist()))
        if len(selected) <= 60 and (value := bic(library, selected)) < least:
            best, least = selected, value
    return best


def knockoffs(library: Library) -> list[int]:
    from knockpy.knockoff_stats import data_dependent_threshhold
    from knockpy.knockoffs import GaussianSampler

    x, owner = distinct(library)
    np.random.seed(1)  # noqa: NPY002 (the library draws from numpy's global generator)
    covariance = np.corrcoef(x.T) + 1e-3 * np.eye(x.shape[1])
    scale = np.sqrt(np.diag(covariance))
    sampler = GaussianSampler(
        x, Sigma=covariance / np.outer(scale, scale), method="equicorrelated", verbose=False
    )
    copies = sampler.sample_knockoffs()
    # The difference of Barber and Candès (Ann. Stat. 43 (2015) 2055), of a ridge in place of the lasso path.
    both = np.concatenate([x, copies], axis=1)
    beta = np.abs(np.linalg.solve(both.T @ both + 0.01 * len(x) * np.eye(both.shape[1]), both.T @ library.y))
    difference = beta[: x.shape[1]] - beta[x.shape[1] :]
    threshold = data_dependent_threshhold(difference, fdr=KNOCKOFF_RATE, offset=0)
    return sorted({int(k) for k in owner[difference >= threshold]})


OTHERS: dict[str, Callable[[Library], list[int]]] = {
    "stepwise-bic": stepwise_bic, "lasso": lasso, "sindy": sindy, "knockoffs": knockoffs,
}  # fmt: skip


def ours(folder: Path) -> Effects:
    campaign = read_campaign(folder)
    explanation = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    effects = []
    for effect in explanation.missing:
        peak_um = 1e3 * peak_by_itself(explanation.final, effect.effect, effect.coefficients)
        effects.append(
            {
                "effect": effect.effect,
                "rivals": [rival.effect for rival in effect.rivals],
                "peak_um": peak_um,
                "u_um": peak_um * effect.u / effect.amplitude if effect.amplitude else 0.0,
            }
        )
    return effects


def peak_by_itself(fitted: Fit, effect: str, coefficients: np.ndarray) -> float:
    """The largest displacement in mm that an effect with coefficients (k,) causes at any probing, as ``truth.json`` has
    it; ours tells of a power what of it goes beyond the base model, and of others the same (test_challenge.py)."""
    variant = Variant(effect, parse_effect(effect, fitted.problem.context.chain))
    (candidate,) = scene_of(fitted, [variant]).candidates
    return float(np.linalg.norm(candidate.raw @ coefficients, axis=1).max())


def answer(folder: Path, programs: Sequence[str]) -> dict[str, dict[str, Any]]:
    """The answers to one campaign by program; the library is made once, its time counts for each."""
    answers = {}
    began = time.process_time()
    library = library_of(folder) if set(programs) & set(OTHERS) else None
    shared = time.process_time() - began
    for program in programs:
        began, spent = time.process_time(), 0.0
        if program == "ours":
            effects = ours(folder)
        else:
            assert library is not None
            try:
                effects, spent = refitted(library, OTHERS[program](library)), shared
            except np.linalg.LinAlgError:
                effects, spent = [], shared
        answers[program] = {
            "campaign": folder.name, "seconds": round(time.process_time() - began + spent, 2), "effects": effects,
        }  # fmt: skip
    return answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("programs", nargs="*", default=["ours", *OTHERS])
    options = parser.parse_args()
    programs = options.programs or ["ours", *OTHERS]
    if unknown := set(programs) - {"ours", *OTHERS}:
        sys.exit(f"no program {', '.join(sorted(unknown))}; there are ours, {', '.join(OTHERS)}")
    every: dict[str, list[dict[str, Any]]] = {program: [] for program in programs}
    for folder in sorted((options.out / "campaigns").iterdir()):
        for program, of_campaign in answer(folder, programs).items():
            every[program].append(of_campaign)
            text = json.dumps({"program": program, "answers": every[program]}, indent=1, ensure_ascii=False)
            (options.out / f"answers-{program}.json").write_text(text, encoding="utf-8")
        print(folder.name, *(f"{name} {rows[-1]['seconds']:g} s" for name, rows in every.items()), flush=True)


if __name__ == "__main__":
    main()
