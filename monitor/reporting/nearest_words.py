"""What is said where no effect is named although something is missing, and where more is left beside those that are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

#: So many errors that may have stepped stand in a sentence.
MOST_STEPPED = 3


class LooksStepped(Protocol):
    """An error that looks as if it stepped in a ``run`` from the reading ``sequence`` on."""

    @property
    def errors(self) -> Sequence[str]:
        """Its name, first of those that the data do not tell from it."""

    @property
    def run(self) -> int:
        """The run."""

    @property
    def sequence(self) -> int:
        """The first reading after the step."""

    @property
    def rms_after_um(self) -> float:
        """What would be left with the step."""


class ComesNearest(Protocol):
    """The effect that comes nearest where none is named, ``why`` it is not, and the RMS that it would leave."""

    @property
    def effect(self) -> str:
        """Its name."""

    @property
    def rms_before_um(self) -> float:
        """What the model leaves."""

    @property
    def rms_after_um(self) -> float:
        """What it would leave with the effect."""

    @property
    def why(self) -> str:
        """The rule that refuses it, as a clause."""

    @property
    def stepped(self) -> LooksStepped | None:
        """A step that says more than any effect."""


# What is said of an effect that is not named although it stands out of independent noise, and why, by the rule.
NEAREST = (
    "The model does not explain the measurements; nearest of the catalogue comes {effect}, which would leave "
    "{after:.2f} of {before:.2f} µm RMS, but it is not named: {why}."
)
# What is said instead where a step within a run says more, which is no effect.
LOOKS_STEPPED = (
    "The model does not explain the measurements; no effect of the catalogue stands, but it looks as if {error} "
    "stepped within run {run}, from sequence {sequence} on, which would leave {after:.2f} of {before:.2f} µm RMS: see "
    "what was touched, slipped or switched then, and give the readings from there on as a run of their own."
)
WHY_REFUSED = {
    "noise": "noise that neighbouring readings share, which is seen here, may look the same",
    "poses": "with every pose counted once it may be chance",
    "runs": "its size differs from run to run, as if it acted in some of them alone",
    "other_shapes": "another error in some other shape would do the same",
    "wander": "a tracker that wanders would do the same",
    "size": "it would have to be larger than such an error is, or nearly cancelled by what is free in every run",
    "held_out": "readings that were left out are not predicted better with it",
    "flips": "what is left, with signs drawn at random, looks as much like an effect too often",
    "unsettled": "it did not stand when bad points, noise and other effects were judged again beside it",
}
# What is said where more is left with all findings in the model than noise leaves.
MORE_IS_LEFT = (
    "With {these} in the model more is left than noise leaves: add {them} and ask again, what is still missing may "
    "stand out then."
)


def nearest_sentence(nearest: ComesNearest) -> str:
    """Say what comes nearest where no effect is named: a step within a run, or an effect and why it is not named."""
    stepped = nearest.stepped
    if stepped is None:
        return NEAREST.format(
            effect=nearest.effect,
            after=nearest.rms_after_um,
            before=nearest.rms_before_um,
            why=nearest.why,
        )
    return LOOKS_STEPPED.format(
        error=" or ".join(stepped.errors[:MOST_STEPPED]),
        run=stepped.run,
        sequence=stepped.sequence,
        after=stepped.rms_after_um,
        before=nearest.rms_before_um,
    )


def more_is_left(named: int) -> str:
    """Say that more is left with so many ``named`` effects in the model than noise leaves."""
    these, them = ("this", "it") if named == 1 else ("these", "them")
    return MORE_IS_LEFT.format(these=these, them=them)
