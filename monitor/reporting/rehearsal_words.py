"""What is said of rehearsals: virtual campaigns, and what they hide."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def likenesses_written(out: Path, campaigns: int, machines: int, pattern: tuple[str, str], truth: str) -> str:
    """Return what is said of campaigns that are like a ``pattern``: its name and its method."""
    name, method = pattern
    return (
        f"{out}: {campaigns} campaign{'s' * (campaigns > 1)} of {machines} machine{'s' * (machines > 1)} "
        f"like {name} ({method}); {truth} has the true values"
    )


def hidden_in_all(effect: str, peak_um: float) -> str:
    """Return what is said of an effect that all campaigns hide."""
    return f"; {effect} with a peak of {peak_um:g} µm is hidden in all of them"


def told_smaller(effect: str, told_um: float) -> str:
    """Return what follows where ``explain`` tells another peak than the hidden one."""
    return (
        f"; at most {told_um:.2g} µm of {effect} differ from the straight line that the model takes up: explain "
        "tells that as its peak"
    )


def hardly_seen(effect: str, standard_deviations: float, certain_from_um: float | None) -> str:
    """Return what follows where a plan shows a hidden effect too little for a search to find it, or not at all."""
    if certain_from_um is None:
        return (
            f"; this plan cannot see {effect}: the errors that it identifies take up all that the effect does, so "
            "neither compare nor explain can tell that it is there"
        )
    return (
        f"; this plan shows {effect} by {standard_deviations:.2g} standard deviations of its readings: explain may "
        f"see nothing of it; from a peak of {certain_from_um:.2g} µm on it sees that something is missing"
    )


def virtual_written(out: Path, runs: int, probings: int, hidden: tuple[str, float] | None) -> str:
    """Return what is said of a virtual campaign in which an effect is ``hidden``, with its peak in µm."""
    effect = (
        "nothing is hidden" if hidden is None else f"{hidden[0]} with a peak of {hidden[1]:g} µm is hidden"
    )
    return f"{out}: {runs} run{'s' if runs > 1 else ''} of {probings} probings; {effect}"


def virtual_machine_written(out: Path, runs: int, probings: int, errors: Sequence[str]) -> str:
    """Return what is said of a virtual campaign of a machine with chosen ``errors``."""
    listed = f"the machine has {', '.join(errors)}" if errors else "the machine has no errors"
    return f"{out}: {runs} run{'s' if runs > 1 else ''} of {probings} probings; {listed}"
