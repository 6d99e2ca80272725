"""Joint curves beside what a search found under them: all of it as findings of one model that lacks it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.shapes.refine import Refined
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import ScanResult, findings_without_rivals
from monitor.discovery.search.scene import family_count


def with_curves(
    base: Fit,
    curves: Sequence[ChainVariant],
    scene: ChainScene,
    refined: Sequence[Refined],
) -> tuple[ChainScene, ChainScan, list[Refined]]:
    """The findings of a search and the ``curves`` under which it went, together under ``base``, a fit with neither.

    ``scene`` is that of the search, ``refined`` its findings at their best values.
    """
    pool = scene_of(base, [candidate.variant for candidate in scene.candidates])
    selected = scene_of(base, [*curves, *(finding.candidate.variant for finding in refined)]).candidates
    none = np.zeros((len(pool.residual), 0))
    entries = [
        *(Refined(candidate, None, none) for candidate in selected[: len(curves)]),
        *(
            replace(finding, candidate=candidate)
            for finding, candidate in zip(refined, selected[len(curves) :], strict=True)
        ),
    ]
    ordered = _by_error_taken_away(pool, entries)
    candidates = [entry.candidate for entry in ordered]
    findings = [
        # Lines are looked for by themselves, before the catalogue: their p-value has paid for all of them.
        replace(finding, q_value=finding.evidence.p_value) if is_curve(finding.candidate) else finding
        for finding in findings_without_rivals(pool, candidates, family_count(pool))
    ]
    return pool, ScanResult(tuple(findings)), ordered


def _by_error_taken_away(scene: ChainScene, entries: Sequence[Refined]) -> list[Refined]:
    """The findings in the order of what each takes of the error beside those before it."""
    basis = orthonormal(scene.shared)
    residual = without(basis, scene.residual[:, None])[:, 0]
    rest = [(entry, without(basis, entry.candidate.columns)) for entry in entries]
    ordered = []
    while rest:
        spans = [orthonormal(columns) for _, columns in rest]
        best = int(np.argmax([float(np.sum((span.T @ residual) ** 2)) for span in spans]))
        ordered.append(rest.pop(best)[0])
        residual = residual - spans[best] @ (spans[best].T @ residual)
        rest = [(entry, without(spans[best], columns)) for entry, columns in rest]
    return ordered


def is_curve(candidate: ChainCandidate) -> bool:
    """Whether a candidate is the whole curve of a joint."""
    return candidate.family.endswith(":curve")
