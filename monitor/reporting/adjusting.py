"""What to do about a value that is wrong, where the model that it comes from may be what is wrong.

Use it wherever a page, a report or a command says to adjust or compensate: a value of a model that lacks an effect
holds a part of that effect, and a machine adjusted by it is worse than before.
"""

from __future__ import annotations

from collections.abc import Sequence

#: What stands in place of an adjustment.
SEE_FIRST = "adjust nothing by these values yet: see first what the model lacks"


def adjusting(action: str, *, is_doubted: bool, remedy: str = "") -> str:
    """Return an ``action`` that adjusts by values of a model; what comes before it where the model ``is_doubted``.

    ``is_doubted``: its readings refute it, or a comparison says that something is missing. ``remedy`` is what mends the
    effect that it lacks, where that is known.
    """
    if not is_doubted:
        return action
    return f"{remedy.rstrip('.')}; then measure again" if remedy else SEE_FIRST


def remedy_holds_for(effect: str, rivals: Sequence[str]) -> str:
    """Return what stands behind the word remedy: that it is one of an ``effect`` alone, where data do not tell it from
    ``rivals`` of another error; nothing where there are none."""
    error = effect.partition(":")[0]
    if all(rival.partition(":")[0] == error for rival in rivals):
        return ""
    return f", if it is {effect} and not one of those named below"
