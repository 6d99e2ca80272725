"""Reads the documents that version 0.1.0 stored: what it wrote as a sentence alone becomes the kind that it says.

The source of a covariance, and why a parameter has no number. Such documents are in databases for ever; nothing new
is written in this way, and no other file reads a sentence.
"""

from __future__ import annotations

import re
from dataclasses import replace

from monitor.exceptions import StoreError
from monitor.refusal import Advice, AdviceKind, Reason, ReasonKind
from monitor.reporting.covariance_source import CovarianceKind, CovarianceSource, TakenAsKnown
from monitor.reporting.refused import RefusedParameters

_SOURCE = re.compile(
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
    match = _SOURCE.fullmatch(sentence)
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


_OF_MAPS = {
    "it has no number in this run": ReasonKind.NO_NUMBER,
    "it is no error of the machine": ReasonKind.NO_MACHINE_ERROR,
    "the plan does not determine it": ReasonKind.NOT_DETERMINED,
}
_WHAT = r"with this plan .+?(?: cannot be told apart(?: from (?P<others>.+?))?)?"
_ADVICE = {
    AdviceKind.NOT_PROBED: r"run (?P<run>\d+) did not probe (?P<names>.+) of the scale bar, the unit of length",
    AdviceKind.SPINDLE_STILL: (
        r"(?P<names>\S+) stands at one angle throughout; "
        r"probe also with (?P=names) at 90, 180 and 270 degrees"
    ),
    AdviceKind.AXIS_STILL: r"(?P<names>.+) stands at one angle throughout; index it too",
    AdviceKind.STOOD_STILL: r"(?P<names>.+) stood still throughout; move (?:it|them) too",
    AdviceKind.BOUNDARY_CONDITION: (
        r"the boundary conditions? (?P<conditions>.+) (?:is|are) missing; "
        r"add to the conditions of \[artefact\.self_calibration\]"
    ),
    AdviceKind.NO_POINT: (
        r"no point was probed where (?P<names>.+) acts; probe nearer to the ends, or leave the node out"
    ),
    AdviceKind.SWAPPED_TABLES: (
        r"the angles of (?P<names>\S+) are multiples of 90 degrees apart, which swaps the tables of the linear axes; "
        r"probe at another angle too"
    ),
    AdviceKind.MORE_ANGLES: (
        r"(?P<count>\d+) angles of (?P<names>\S+) do not suffice for these points; "
        r"probe at more angles, or more points"
    ),
    AdviceKind.MORE_INDEXATIONS: r"probe more indexations",
    AdviceKind.MORE_FACES: (
        r"touch more faces or other angles: the same points at opposite angles, and faces that look elsewhere"
    ),
    AdviceKind.PIECE_PLANES: r"lay the piece in the (?P<names>.+) plane too",
    AdviceKind.MORE_MODULES: r"scan (?P<count>\d+) or more modules along every arm, as a cubic needs",
    AdviceKind.MORE_REFLECTORS: (
        r"add reflectors away from the last axis, or poses that turn the wrist more"
    ),
    AdviceKind.MORE_POSES: r"add poses over the whole range of the joints",
}
_REASONS = {
    kind: re.compile(_WHAT + (": " if kind.is_cause else "; ") + pattern) for kind, pattern in _ADVICE.items()
}
_BETWEEN_NAMES = re.compile(r", | and the | and ")
_CONDITION = re.compile(r"(?P<name>\S+) = 0 \((?P<meaning>.+?)\)(?:; |$)")


def with_reason(refused: RefusedParameters) -> RefusedParameters:
    """Restore the reason of a refusal that has only its sentence; a sentence in other words stays as it is."""
    return refused if refused.reason is not None else replace(refused, reason=reason_of(refused.why))


def reason_of(sentence: str) -> Reason | None:
    """Read the reason from a sentence of version 0.1.0; None where it did not write it."""
    if sentence in _OF_MAPS:
        return Reason(_OF_MAPS[sentence])
    for kind, pattern in _REASONS.items():
        match = pattern.fullmatch(sentence)
        if match is not None:
            groups = match.groupdict()
            others = tuple(groups["others"].split(", ")) if groups["others"] else ()
            return Reason(ReasonKind.NOT_SEPARATED, others, _advice(kind, groups))
    return None


def _advice(kind: AdviceKind, groups: dict[str, str | None]) -> Advice:
    conditions = _CONDITION.findall(groups.get("conditions") or "")
    names = tuple(name for name, _ in conditions) or _names(groups.get("names"))
    count, run = groups.get("count"), groups.get("run")
    return Advice(
        kind,
        names,
        meanings=tuple(meaning for _, meaning in conditions) or None,
        count=None if count is None else int(count),
        run=None if run is None else int(run),
    )


def _names(joined: str | None) -> tuple[str, ...]:
    return () if joined is None else tuple(_BETWEEN_NAMES.split(joined))
