"""What stands behind a stated uncertainty, as data: for which time it holds, how days differ, each line of the budget.

Numbers are in the display units of their parameters; NaN where a number cannot be known. Words are made where a page or
a table is printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.reporting.texts import Texts


class HoldsFor(StrEnum):
    """For which time an uncertainty holds; the value is the word of the option ``--holds-for``."""

    RUN = "run"
    DAY = "day"
    CAMPAIGN = "campaign"


@dataclass(frozen=True)
class DayToDay:
    """Components of scatter of ``runs`` runs on ``days`` days, by parameter, as standard deviations.

    ``within_run`` is a run's own from the residuals, ``between_runs`` what runs of a day differ by beyond it,
    ``u_day`` what days differ by beyond their runs, with its ``u_day_interval`` for 95 %; ``spread`` the largest less
    the smallest day mean. ``not_from_zero`` names the parameters whose estimate of ``u_day`` was negative and is given
    as 0. ``not_known`` says why some of it cannot be known: one run, one day, two days, one run a day.
    """

    runs: int
    days: int
    within_run: Mapping[str, float]
    between_runs: Mapping[str, float]
    u_day: Mapping[str, float]
    u_day_interval: Mapping[str, tuple[float, float]]
    spread: Mapping[str, float]
    not_from_zero: tuple[str, ...]
    not_known: str | None = None


@dataclass(frozen=True)
class StatedSource:
    """A Type B source as it was stated. ``counted`` is false where the scatter of the repeated runs contains it.

    ``acts_on`` is its axis, direction or effect, where it has one.
    """

    name: str
    quantity: str
    size: float
    unit: str
    distribution: str
    degrees_of_freedom: float | None
    shared_by: str
    counted: bool
    acts_on: str | None = field(default=None, metadata=OMITTED)


class LengthKind(StrEnum):
    """To what the gains of a run refer; the value is the key among the texts of section ``length``."""

    CORRECTED = "corrected"
    NOT_CORRECTED = "not_corrected"
    NO_BAR = "no_bar"


@dataclass(frozen=True)
class LengthReference:
    """At which temperature gains hold. ``reference`` and ``temperature`` in °C, ``expansion`` in 1/K of the bar.

    ``columns`` are the recorded ones that the temperature of a bar was taken from. ``not_in_u`` are the quantities of
    the bar that no source states.
    """

    kind: LengthKind
    gains: tuple[str, ...]
    temperature: float | None = field(default=None, metadata=OMITTED)
    reference: float | None = field(default=None, metadata=OMITTED)
    expansion: float | None = field(default=None, metadata=OMITTED)
    columns: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    not_in_u: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Unchecked:
    """The ``sequence`` numbers of the readings of a run that no other reading checks, and the ``parameters`` that they
    move, the one that they move most first."""

    sequence: tuple[int, ...]
    parameters: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class BudgetLine:
    """A line of the budget: what it adds to u of every parameter (m,), as a standard uncertainty in display units.

    A covariance between two sources may be negative: then the root of its size, with a minus. ``degrees_of_freedom``
    None: taken as known, or not applicable.
    """

    source: str
    u: Array
    degrees_of_freedom: float | None


@dataclass(frozen=True, eq=False)
class Budget:
    """What a certificate prints beside its results. Lines with the largest share come first."""

    holds_for: HoldsFor
    lines: tuple[BudgetLine, ...]
    day_to_day: DayToDay | None = None
    sources: tuple[StatedSource, ...] = ()
    length: LengthReference | None = None
    unchecked: Unchecked | None = field(default=None, metadata=OMITTED)

    def of(self, places: Sequence[int]) -> Budget:
        """The budget of the parameters at ``places`` alone."""
        lines = tuple(replace(line, u=line.u[list(places)]) for line in self.lines)
        return replace(self, lines=lines)


#: Names of lines that are not the user's, and their key among the texts of section ``budget``.
_LINES = {
    "readings": "readings",
    "scale bar": "scale_bar",
    "calibrated quantities": "calibrated",
    "lack of fit of the model": "lack_of_fit",
    "between days": "between_days",
    "readings of the other runs": "other_runs",
    "calibrated quantities of the other runs": "other_known",
    "scatter of the added effects": "effects_scatter",
}


def line_words(source: str, texts: Texts) -> str:
    """A line's name in the language of ``texts``; that of a user's source as it was written."""
    return texts(f"budget.{_LINES[source]}") if source in _LINES else source


def budget_lines(
    shares: Mapping[str, Mapping[str, float]],
    u: Mapping[str, float],
    dof: Mapping[str, float | None],
) -> tuple[BudgetLine, ...]:
    """Lines from the ``shares`` of variance by source and parameter, the largest share first."""
    names = list(u)
    total = np.array([u[name] for name in names])
    lines = []
    for source, by_name in shares.items():
        share = np.array([by_name[name] for name in names])
        lines.append(BudgetLine(source, np.sign(share) * np.sqrt(np.abs(share)) * total, dof.get(source)))
    return tuple(lines)


def larger_than_u(days: DayToDay, expanded: Mapping[str, float]) -> tuple[str, ...]:
    """The parameters whose day means lie further apart than U."""
    return tuple(name for name, spread in days.spread.items() if spread > expanded.get(name, np.inf))
