"""Parameters without a number, and why: kinds with what belongs to them, of which reporting makes sentences."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from monitor.documents import OMITTED


class AdviceKind(Enum):
    """What a plan left out, or would have to do; the value is its key among the texts of section ``sentences``.

    ``OWN_WORDS`` is what a method from outside says in English: it has no text in any language.
    """

    NOT_PROBED = "not_probed"
    SPINDLE_STILL = "spindle_still"
    AXIS_STILL = "axis_still"
    STOOD_STILL = "stood_still"
    BOUNDARY_CONDITION = "boundary_condition"
    NO_POINT = "no_point"
    SWAPPED_TABLES = "swapped_tables"
    MORE_ANGLES = "more_angles"
    MORE_INDEXATIONS = "more_indexations"
    BAR_DIRECTION = "bar_direction"
    MORE_FACES = "more_faces"
    PIECE_PLANES = "piece_planes"
    MORE_MODULES = "more_modules"
    MORE_REFLECTORS = "more_reflectors"
    MORE_POSES = "more_poses"
    OTHER_MEASUREMENT = "other_measurement"
    OWN_WORDS = "own_words"

    @property
    def is_cause(self) -> bool:
        """Whether the plan lacks something that can be named, so that a colon comes before it."""
        return self in _CAUSES


_CAUSES = frozenset({
    AdviceKind.NOT_PROBED, AdviceKind.SPINDLE_STILL, AdviceKind.AXIS_STILL, AdviceKind.STOOD_STILL,
    AdviceKind.BOUNDARY_CONDITION, AdviceKind.NO_POINT, AdviceKind.SWAPPED_TABLES, AdviceKind.MORE_ANGLES,
})  # fmt: skip


@dataclass(frozen=True)
class Advice:
    """What a plan would have to do for parameters that one run cannot separate.

    ``names`` are the axes, targets, planes or parameters that the advice is of (of BAR_DIRECTION the rotary axis, the
    gain along it and those across), ``meanings`` what a boundary condition of each name fixes, in English; ``count`` is
    how many modules are needed or angles were there, ``run`` the run that lacks a target. ``text`` belongs to
    OWN_WORDS.
    """

    kind: AdviceKind
    names: tuple[str, ...] = ()
    meanings: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    count: int | None = field(default=None, metadata=OMITTED)
    run: int | None = field(default=None, metadata=OMITTED)
    text: str | None = field(default=None, metadata=OMITTED)


class ReasonKind(Enum):
    """Why parameters have no number; but for the first the value is the key among the texts of ``sentences``."""

    NOT_SEPARATED = "not_separated"
    ROWS_ALIKE = "rows_alike"
    UNSEEN = "unseen"
    HELD_AT_ZERO = "held_at_zero"
    BARELY_SEEN = "barely_seen"
    NO_NUMBER = "no_number"
    NO_MACHINE_ERROR = "no_machine_error"
    NOT_DETERMINED = "not_determined"
    NOT_SHOWN = "not_shown"
    OUTSIDE_MODEL = "outside_model"
    TURNS_WORKPIECE = "turns_workpiece"

    @property
    def is_outside_model(self) -> bool:
        """Whether it is said of errors of the machine that are no parameters of the model."""
        return self in (ReasonKind.NOT_SHOWN, ReasonKind.OUTSIDE_MODEL, ReasonKind.TURNS_WORKPIECE)


@dataclass(frozen=True)
class Reason:
    """Why parameters have no number.

    Of NOT_SEPARATED, ``others`` are the unknowns that they cannot be told from, beside each other; of HELD_AT_ZERO
    those that do the same. Of BARELY_SEEN, ``u`` is the standard uncertainty, in ``unit``, that exceeds what a machine
    may have; of NOT_SHOWN, OUTSIDE_MODEL and TURNS_WORKPIECE the largest error of the tool, in ``unit``, that an error
    of ``size`` makes beside all numbers.
    """

    kind: ReasonKind
    others: tuple[str, ...] = ()
    advice: Advice | None = field(default=None, metadata=OMITTED)
    u: float | None = field(default=None, metadata=OMITTED)
    unit: str | None = field(default=None, metadata=OMITTED)
    size: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Refusal:
    """Parameters that the plan cannot separate, and why; none of them gets a number."""

    parameters: tuple[str, ...]
    reason: Reason
