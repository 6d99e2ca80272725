"""What a calibration method asks of a campaign folder, beyond what every folder must hold.

One file a method in ``monitor/readers/methods``, each with a ``RULES``; a plug-in adds its own through an
entry point of the group ``monitor.readers``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import Fault
from monitor.records import Array, Artefact, Probings
from monitor.units import COLUMN_UNITS, CONDITION_SUFFIXES


@dataclass(frozen=True)
class Plan:
    """What was probed, for a method to judge.

    ``probings`` are the rows that could be read (n), ``lines`` the line of each in the file (n,), ``runs`` the
    runs without a damaged row: only these may be judged, ``turning`` the rotary axes and the spindle. ``is_whole``:
    every row could be read, so that what has none there has none in the file.
    """

    file: str
    probings: Probings
    lines: npt.NDArray[np.int64]
    runs: tuple[int, ...]
    turning: tuple[str, ...]
    artefact: Artefact
    is_whole: bool = True


@dataclass(frozen=True)
class DeclaredPlaces:
    """Where the targets stand by their declaration, up to a rigid motion: ``noun`` in the plural is what they are,
    ``places`` (3,) mm by name. ``by_normals``: what is read stands off from the place, by one length along the row's
    normal."""

    noun: str
    places: Mapping[str, Array]
    by_normals: bool = False


def nothing_declared(artefact: Artefact) -> DeclaredPlaces | None:
    """No target has a declared place."""
    return None


def no_check(plan: Plan) -> Iterable[Fault]:
    """Nothing to ask of the plan."""
    return ()


@dataclass(frozen=True)
class MethodRules:
    """The rules of one method.

    ``needs_...`` and ``targets_are_balls`` say what the artefact must hold (setups stand in the place of probe and
    targets) and whether every run must have the ambient temperature, ``targets_are_reflectors`` that targets
    are the listed reflectors where any is listed; ``suffixes`` are the units that a recorded column may end in,
    ``plain_columns`` columns that are allowed besides, ``measured_columns`` those that must be there with a number in
    every row; ``check`` judges the plan; ``declared`` says where the targets stand by their declaration.
    """

    name: str
    needs_scale_bar: bool = False
    needs_self_calibration: bool = False
    needs_l_shape: bool = False
    needs_setups: bool = False
    needs_ambient: bool = True
    targets_are_balls: bool = False
    targets_are_reflectors: bool = False
    suffixes: tuple[str, ...] = tuple(COLUMN_UNITS)
    plain_columns: tuple[str, ...] = ()
    measured_columns: tuple[str, ...] = ()
    check: Callable[[Plan], Iterable[Fault]] = no_check
    declared: Callable[[Artefact], DeclaredPlaces | None] = nothing_declared

    @property
    def targets_are_seen(self) -> bool:
        """Whether something looks at targets where they are: nominal columns say where on the tool, and the axes are
        not brought there."""
        return self.needs_setups or self.targets_are_reflectors


#: Units of the channels of a method that measures nothing but positions.
CHANNELS_ONLY = CONDITION_SUFFIXES
