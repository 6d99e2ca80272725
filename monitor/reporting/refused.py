"""Why a parameter has no number: as data, and as one sentence in each language."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import reduce

from monitor.documents import OMITTED
from monitor.refusal import Advice, AdviceKind, Reason, ReasonKind, Refusal
from monitor.reporting.texts import ENGLISH, Texts, texts_of
from monitor.reporting.unknown_names import unknown_words

#: So many places of one table are named one by one.
MOST_PLACES = 3


@dataclass(frozen=True)
class RefusedParameters:
    """Parameters without a number, and ``why`` in an English sentence.

    ``reason`` is the same as data; None where the sentence is all there is: a result that an earlier version stored,
    in words that this one does not know.
    """

    parameters: tuple[str, ...]
    why: str
    reason: Reason | None = field(default=None, metadata=OMITTED)


def refused_parameters(refusal: Refusal) -> RefusedParameters:
    """The refusal with its English sentence."""
    return RefusedParameters(refusal.parameters, refusal_sentence(refusal), refusal.reason)


def refusal_of(refused: RefusedParameters) -> Refusal | None:
    """The refusal as data; None where its sentence is all there is."""
    return None if refused.reason is None else Refusal(refused.parameters, refused.reason)


def why_refused(refused: RefusedParameters, texts: Texts) -> str:
    """The reason in the language of ``texts``; an English sentence stays as it was stored."""
    refusal = refusal_of(refused)
    return refused.why if refusal is None or texts.language == ENGLISH else refusal_sentence(refusal, texts)


def printed_names(names: Sequence[str], texts: Texts) -> list[str]:
    """Return the names of parameters and unknowns as they are printed."""
    return [unknown_words(name, texts) for name in names]


def refusal_sentence(refusal: Refusal, texts: Texts | None = None) -> str:
    """The reason of a refusal in a sentence without its full stop, in the language of ``texts`` (English without)."""
    say = texts or texts_of()
    parameters, reason = refusal.parameters, refusal.reason
    if reason.kind is ReasonKind.NOT_SEPARATED:
        return _not_separated(parameters, reason, say)
    u = "" if reason.u is None else f"{reason.u:.2g}".replace(".", say.decimal_sign)
    names = _joined(printed_names(parameters, say), "both", say)
    key, several = f"sentences.{reason.kind.value}", f"sentences.{reason.kind.value}_several"
    return say(
        several if len(reason.others) > 1 and several in say.sentences else key,
        names=names,
        others=", ".join(printed_names(_by_table(reason.others, say), say)),
        u=u,
        unit=reason.unit,
        size=reason.size,
    )


def _not_separated(parameters: tuple[str, ...], reason: Reason, say: Texts) -> str:
    what = _joined(printed_names(_by_table(parameters, say), say), "both", say)
    if reason.others:
        others = ", ".join(printed_names(reason.others, say))
        what = say("sentences.apart_from", names=what, others=others)
    elif len(parameters) > 1:
        what = say("sentences.apart", names=what)
    assert reason.advice is not None  # what is not separated has an advice
    key = "advised" if reason.advice.kind.is_cause else "advised_more"
    return say(f"sentences.{key}", what=what, advice=_advice(reason.advice, say))


def _advice(advice: Advice, say: Texts) -> str:
    if advice.kind is AdviceKind.OWN_WORDS:
        return advice.text or ""
    key, several = f"sentences.{advice.kind.value}", f"sentences.{advice.kind.value}_several"
    # What a condition fixes is stored in English.
    meanings = (advice.meanings or ()) if say.language == ENGLISH else ()
    axis, along, *across = (*advice.names, "", "")
    conditions = [f"{name} = 0 ({meaning})" for name, meaning in zip(advice.names, meanings, strict=False)]
    return say(
        several if len(advice.names) > 1 and several in say.sentences else key,
        names=", ".join(advice.names),
        joined=_joined(advice.names, "both", say),
        axis=axis,
        along=along,
        across=_joined([name for name in across if name], "both", say),
        planes=_joined(advice.names, "planes", say),
        conditions="; ".join(conditions or [f"{name} = 0" for name in advice.names]),
        count=advice.count,
        run=advice.run,
    )


def _joined(names: Sequence[str], key: str, say: Texts) -> str:
    if not names:
        return ""
    return reduce(lambda first, second: say(f"sentences.{key}", first=first, second=second), names)


def _by_table(names: Sequence[str], say: Texts) -> list[str]:
    """The names; those of many places of one table, ``EYX(-88)``, as one."""
    tables = [name.partition("(")[0] if name.endswith(")") else name for name in names]
    parts: list[str] = []
    for table in dict.fromkeys(tables):
        members = [name for name, of_table in zip(names, tables, strict=True) if of_table == table]
        parts += (
            members
            if len(members) <= MOST_PLACES
            else [say("sentences.many_places", name=table, count=len(members))]
        )
    return parts
