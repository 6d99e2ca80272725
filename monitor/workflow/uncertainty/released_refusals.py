"""Reads why a parameter has no number from the sentence that version 0.1.0 stored instead of the reason itself.

Such documents are in databases for ever; nothing new is written in this way.
"""

from __future__ import annotations

import re
from dataclasses import replace

from monitor.refusal import Advice, AdviceKind, Reason, ReasonKind
from monitor.reporting.refused import RefusedParameters

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
_SENTENCES = {
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
    for kind, pattern in _SENTENCES.items():
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
