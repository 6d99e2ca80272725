"""``instrument:plate:expansion@run_time``: an artefact of points, such as a plate of holes, that grows within a run.

What it has grown before a run begins is a gain of the axes that go along it, and free in every run. Where it is held is
written in the readings of the linear axes there: ``instrument:plate:expansion(X=0,Y=120)@plate_degC``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.effects.context import Context, InstrumentRows
from monitor.effects.description import Description
from monitor.effects.instrument_change import BEGIN, InstrumentChange
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import METRE, MICROMETRE, Unit

_PLACE = r"[A-Za-z]\w*=-?\d+(?:\.\d+)?"


@dataclass(frozen=True)
class PlateExpansion(InstrumentChange):
    """All points of an artefact go apart from where it is ``held``, the readings in mm of linear axes, or from the
    middle of those that were read. Those that are stated stay as they are, so what they should be grows less."""

    held: tuple[tuple[str, float], ...] = ()

    pattern: ClassVar[str] = BEGIN + rf"expansion(?:\((?P<held>{_PLACE}(?:,{_PLACE})*)\))?"
    word: ClassVar[str] = "expansion"
    kinds: ClassVar[tuple[str, ...]] = ("point",)
    needs_driver: ClassVar[bool] = True
    of_instruments: ClassVar[bool] = True

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        places = re.findall(r"(\w+)=(-?[\d.]+)", groups.get("held") or "")
        return cls(groups["name"], tuple((axis, float(value)) for axis, value in places))

    @property
    def text(self) -> str:
        held = ",".join(f"{axis}={value:g}" for axis, value in self.held)
        return super().text + (f"({held})" if held else "")

    @property
    def unit(self) -> Unit:
        return MICROMETRE.per(METRE)

    def since_the_first(self, driver: Array, context: Context) -> Array:
        """Return the driver as it is: one artefact has grown for all its setups, whichever is measured first."""
        return driver

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        read = np.isfinite(rows.ideal)
        middle = np.nansum(rows.ideal, axis=0) / np.maximum(read.sum(axis=0), 1)
        return -np.asarray(rows.ideal - middle)[:, :, None]

    def shown(self, context: Context) -> Array:
        shown = super().shown(context)
        if self.held:
            instruments = self._instruments(context)
            for run, setup in np.unique(np.column_stack([context.run, instruments.setup]), axis=0):
                rows = np.flatnonzero((context.run == run) & (instruments.setup == setup))
                if shown[rows].any():
                    off = instruments.ideal[rows] - self._held_at(instruments.ideal[rows], rows, context)
                    shown[rows, :, 0] = -np.where(np.isfinite(off), off, 0.0)
        return shown

    def _held_at(self, ideal: Array, rows: npt.NDArray[np.int64], context: Context) -> Array:
        """Where (d,) the point that is held would be read, by how the numbers (m, d) of some rows go with the axes."""
        joints = [joint.name for joint in context.chain.joints]
        unknown = [axis for axis, _ in self.held if axis not in joints]
        if unknown:
            raise EffectError(
                f"'{self.text}': there is no axis '{unknown[0]}'; the machine has {', '.join(joints)}"
            )
        at = [joints.index(axis) for axis, _ in self.held]
        held = np.array(
            [
                context.chain.joints[joint].sign * value
                for joint, (_, value) in zip(at, self.held, strict=True)
            ]
        )
        whole = np.isfinite(ideal).all(axis=1)
        places = context.positions[rows][whole][:, at] - held
        numbers = np.column_stack([np.ones(len(places)), places])
        return np.asarray(np.linalg.lstsq(numbers, ideal[whole], rcond=None)[0][0])

    def described(self, driven: str) -> Description:
        return Description(
            f"the points of {self.name} go apart{driven}",
            "the artefact warms up on the machine or under the hands that mounted it; of a tracker, the air along its "
            "beam changes",
            "let the artefact take the machine's temperature, record its temperature with every point, or give its "
            "expansion coefficient; correct no axis by it",
            "ISO 230-3:2020; ISO/TR 16015:2003",
        )


REGISTERED = (PlateExpansion,)
