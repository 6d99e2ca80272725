"""What is said where no effect is named although something is missing, of an error that stepped within a run, and where
more is left beside what is named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

#: So many errors that may have stepped stand in a sentence.
MOST_STEPPED = 3


class LooksStepped(Protocol):
    """An error that looks as if it stepped by ``size`` in a ``run`` from the reading ``sequence`` on, with the RMS
    before and after; ``effect`` is what to add to a model, ``instead_of`` the effects that say far less."""

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
    def effect(self) -> str:
        """The step as an effect."""

    @property
    def size(self) -> float:
        """By how much it stepped, in ``unit``."""

    @property
    def u(self) -> float:
        """The standard uncertainty of the size."""

    @property
    def unit(self) -> str:
        """The unit of the size."""

    @property
    def instead_of(self) -> Sequence[str]:
        """What would have been named without it."""

    @property
    def rms_before_um(self) -> float:
        """What the model leaves."""

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


# What is said of an effect that is not named although it stands out of independent noise, and why, by the rule.
NEAREST = (
    "The model does not explain the measurements; nearest of the catalogue comes {effect}, which would leave "
    "{after:.2f} of {before:.2f} µm RMS, but it is not named: {why}."
)
# What is said where a step within a run says more than any effect, and what is said first of it.
LOOKS_STEPPED = (
    "{first} as if {error} stepped within run {run}, from sequence {sequence} on, by {size} ± {u} {unit}, which would "
    "leave {after:.2f} of {before:.2f} µm RMS{less}: see what was touched, slipped or switched then, and give the "
    "readings from there on as a run of their own, or add {effect} to the model."
)
STEP_ALONE, STEP_BESIDES = (
    "The model does not explain the measurements: it looks",
    "Besides it looks",
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
    "stepped": "a step at one moment of one run says far more",
}
# What is said where more is left with all findings in the model than noise leaves.
MORE_IS_LEFT = (
    "With {these} in the model more is left than noise leaves: add {them} and ask again, what is still missing may "
    "stand out then."
)


def nearest_sentence(nearest: ComesNearest) -> str:
    """Say which effect comes nearest where none is named, and why it is not."""
    return NEAREST.format(
        effect=nearest.effect,
        after=nearest.rms_after_um,
        before=nearest.rms_before_um,
        why=nearest.why,
    )


def step_sentence(stepped: LooksStepped, *, alone: bool) -> str:
    """Say which error stepped within a run, where that is all or besides what is named."""
    less = f" ({' and '.join(stepped.instead_of)} would explain far less)" if stepped.instead_of else ""
    digits = max(0, 1 - int(np.floor(np.log10(stepped.u)))) if stepped.u > 0 else 1
    return LOOKS_STEPPED.format(
        first=STEP_ALONE if alone else STEP_BESIDES,
        size=f"{stepped.size:.{digits}f}",
        u=f"{stepped.u:.{digits}f}",
        unit=stepped.unit,
        less=less,
        effect=stepped.effect,
        error=" or ".join(stepped.errors[:MOST_STEPPED]),
        run=stepped.run,
        sequence=stepped.sequence,
        after=stepped.rms_after_um,
        before=stepped.rms_before_um,
    )


def more_is_left(named: int) -> str:
    """Say that more is left with so many ``named`` effects in the model than noise leaves."""
    these, them = ("this", "it") if named == 1 else ("these", "them")
    return MORE_IS_LEFT.format(these=these, them=them)
