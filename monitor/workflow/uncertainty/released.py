"""Reads the source of a covariance from the sentence that version 0.1.0 stored instead of the source itself.

Such documents are in databases for ever; nothing new is written in this way.
"""

from __future__ import annotations

import re

from monitor.exceptions import StoreError
from monitor.reporting.covariance_source import CovarianceKind, CovarianceSource, TakenAsKnown

_SENTENCE = re.compile(
    r"(?:selection (?P<selection>.+?): )?"
    r"(?:repeated runs, pooled by day, (?P<pooled>\d+) degrees of freedom"
    r"|all (?P<runs>\d+) runs, (?P<all>\d+) degrees of freedom"
    r"|the probe's stated standard uncertainty of (?P<stated>\S+) µm; too few repeated runs of one plan"
    r"|the repeatability of (?P<repeatability>\S+) µm, which exceeds the probe's statement; too few runs for more)"
    r"(?P<axes>; and the errors of the linear axes as stated)?"
    r"(?:; errors of (?P<known>.+) are no part of u: the method takes them as known)?"
)


def covariance_source_of(sentence: str) -> CovarianceSource:
    """The source that a sentence of version 0.1.0 names. Raises StoreError for a sentence that it did not write."""
    match = _SENTENCE.fullmatch(sentence)
    if match is None:
        raise StoreError(f"the stored result says {sentence!r} of its covariance: it was altered")
    kind, runs, dof, u_um = CovarianceKind.REPEATABILITY, None, None, match["repeatability"]
    if match["pooled"] is not None:
        kind, dof = CovarianceKind.POOLED_BY_DAY, int(match["pooled"])
    elif match["runs"] is not None:
        kind, runs, dof = CovarianceKind.ALL_RUNS, int(match["runs"]), int(match["all"])
    elif match["stated"] is not None:
        kind, u_um = CovarianceKind.STATED_BY_PROBE, match["stated"]
    names = (match["known"] or "").split(" and ")
    return CovarianceSource(
        kind=kind,
        runs=runs,
        dof=dof,
        u_um=None if u_um is None else float(u_um),
        selection=match["selection"],
        linear_axes=match["axes"] is not None,
        taken_as_known=tuple(TakenAsKnown(name) for name in names if name),
    )
