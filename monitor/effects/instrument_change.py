"""What an error of an instrument is: how its readings change, whatever the machine does.

Another one is one more file of ``instrument``. It is written ``instrument:NAME:CHANGE``: NAME is the id of a setup, or
an instrument as its setups name it, and then one coefficient holds for all of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context, InstrumentRows, ReadBy
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError, did_you_mean
from monitor.records import Array
from monitor.units import Unit

#: How the text of every such change begins; what follows is the setup or instrument.
BEGIN = r"instrument:(?P<name>.+):"


@dataclass(frozen=True)
class InstrumentChange(BuiltIn, ABC):
    """A change of the readings of one setup, or of all setups of one instrument; ``name`` says which."""

    name: str

    #: The word after the last colon.
    word: ClassVar[str]
    #: The kinds of readings that can change so.
    kinds: ClassVar[tuple[str, ...]]
    #: Whether only a change within a run shows: what is constant is an unknown of every run.
    needs_driver: ClassVar[bool] = False
    #: Whether all setups of one instrument may change alike.
    of_instruments: ClassVar[bool] = False
    #: Whether one setup may then still change by itself.
    also_single: ClassVar[bool] = False

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(**groups)

    @property
    def text(self) -> str:
        """The change as written."""
        return f"instrument:{self.name}:{self.word}"

    @property
    @abstractmethod
    def unit(self) -> Unit:
        """The unit of its coefficients."""

    def labels(self, context: Context) -> tuple[str, ...]:
        """Return a suffix for each of the k coefficients."""
        return ("",)

    def shown(self, context: Context) -> Array:
        """Return the change (n, d, k) in mm of every number for a unit of each coefficient."""
        instruments = self._instruments(context)
        indices = [index for index, setup in enumerate(instruments.setups) if setup in self.setups(context)]
        rows = np.flatnonzero(np.isin(instruments.setup, indices))
        shown = np.zeros((*instruments.ideal.shape, len(self.labels(context))))
        shown[rows] = self._of_rows(instruments.taken(rows), context)
        # Numbers that a kind does not have, or that were not read, change by nothing.
        return np.where(np.isfinite(instruments.ideal)[:, :, None], shown, 0.0)

    def since_the_first(self, driver: Array, context: Context) -> Array:
        """Return a driver (n, m) less what it was at the first row of each setup and run: there the zero was set."""
        groups = np.column_stack([context.run, self._instruments(context).setup])
        _, first, of_row = np.unique(groups, axis=0, return_index=True, return_inverse=True)
        return np.asarray(driver - driver[first[of_row.reshape(-1)]])

    def setups(self, context: Context) -> tuple[ReadBy, ...]:
        """Return the setups that change. Raises EffectError where there are none."""
        return self.among(self._instruments(context).setups, "this campaign has")

    def among(self, setups: Iterable[ReadBy], there_are: str) -> tuple[ReadBy, ...]:
        """Return those of the ``setups`` that change. Raises EffectError where there are none: ``there_are`` begins
        the list of what there is, ``this campaign has``."""
        setups = tuple(setups)
        named = [setup for setup in setups if self.name in (setup.id, setup.instrument)]
        if not named:
            names = tuple(
                dict.fromkeys(name for setup in setups for name in (setup.id, setup.instrument) if name)
            )
            raise EffectError(
                f"'{self.text}': no setup or instrument '{self.name}'; {did_you_mean(self.name, names)}{there_are} "
                f"{', '.join(names) or 'none'}"
            )
        able = tuple(setup for setup in named if setup.kind in self.kinds)
        if not able:
            raise EffectError(f"'{self.text}' is a change of {' or '.join(self.kinds)} readings only")
        return able

    @abstractmethod
    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        """The change (m, d, k) of the rows concerned."""

    @abstractmethod
    def described(self, driven: str) -> Description:
        """Return the change in words; ``driven`` is the phrase of its driver, which begins with a comma."""

    def _instruments(self, context: Context) -> InstrumentRows:
        """The readings. Raises EffectError where nothing says which instrument read what."""
        if context.instruments is None:
            raise EffectError(
                f"'{self.text}': nothing says which instrument read what; such effects are those of the method "
                "instruments"
            )
        return context.instruments
