"""Machines measured by instruments, simulated without a line of the package: rotations by scipy, one pose at a time.

A chain is a list of axes from the bed to the tool: name, kind, direction, offset, sign. Errors are given by axis and
component as small rotations and shifts that come before the axis (location) or after it (motion); a function of the
pose may add more. Everything is put together as homogeneous matrices of numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

TOML = """format = 1
campaign = "{name}"
method = "instruments"

[machine]
id = "{name}"
gravity = {gravity}
"""
#: Directions of three linear axes, and the axes with theirs as they stand on each other in the usual chain.
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
WAYS = {"Z": Z, "X": X, "Y": Y}
POINT = (0.0, 0.0, 0.0)
LASER = """
[[setups]]
id = "{id}"
reading = "displacement"
instrument = "laser"
standard_uncertainty_um = {u_um}
tool_point_mm = {tool}
work_point_mm = {work}
direction = "{along}"
"""


def laser(
    along: str = "X",
    tool: Sequence[float] = POINT,
    work: Sequence[float] = POINT,
    *,
    u_um: float = 0.5,
    name: str = "laser",
) -> str:
    """The lines of a setup: a laser between two points in mm, along an axis."""
    return LASER.format(id=name, u_um=u_um, tool=list(tool), work=list(work), along=along)


@dataclass(frozen=True)
class SimulatedAxis:
    """An axis: ``errors`` are six numbers (mm, rad) before its motion, ``motion`` gives six after it for a travel in mm
    or degrees."""

    name: str
    kind: str
    about: tuple[float, float, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sign: int = 1
    errors: tuple[float, ...] = (0.0,) * 6
    motion: Callable[[float], Sequence[float]] | None = None

    @property
    def column(self) -> str:
        """The column of its readings."""
        return f"{self.name.lower()}_{'deg' if self.kind == 'rotary' else 'mm'}"


def frame(shift: Sequence[float], turn: Rotation) -> np.ndarray:
    """A homogeneous matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), shift
    return matrix


def small(six: Sequence[float]) -> np.ndarray:
    """The frame of six small numbers: R_C R_B R_A, as the conventions have it."""
    return frame(six[:3], Rotation.from_euler("xyz", six[3:]))


@dataclass(frozen=True)
class SimulatedChain:
    """A chain: ``axes`` on the tool's side and ``work`` on the work's, both from the bed outwards.

    ``motions`` gives six numbers after the last tool axis, for readings by name and the nominal orientation.
    """

    axes: tuple[SimulatedAxis, ...]
    work: tuple[SimulatedAxis, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, -1.0)
    motions: Callable[[Mapping[str, float], np.ndarray], Sequence[float]] | None = None

    def seen(self, readings: Mapping[str, float]) -> np.ndarray:
        """The tool's frame in that of the work."""
        return np.linalg.inv(self.side(self.work, readings)) @ self.pose(readings)

    def pose(self, readings: Mapping[str, float], *, perfect: bool = False) -> np.ndarray:
        """Where the tool's frame stands for readings in degrees and mm."""
        whole = self.side(self.axes, readings, perfect=perfect)
        if self.motions is not None and not perfect:
            nominal = self.pose(readings, perfect=True)
            whole = whole @ small(self.motions(readings, nominal[:3, :3]))
        return whole

    @staticmethod
    def side(
        axes: Sequence[SimulatedAxis], readings: Mapping[str, float], *, perfect: bool = False
    ) -> np.ndarray:
        """The frame of the last axis of a side in the bed's."""
        whole = np.eye(4)
        for axis in axes:
            q = axis.sign * readings[axis.name]
            if axis.kind == "rotary":
                motion = frame((0, 0, 0), Rotation.from_rotvec(np.deg2rad(q) * np.array(axis.about)))
            else:
                motion = frame(q * np.array(axis.about), Rotation.identity())
            errors = small((0.0,) * 6 if perfect else axis.errors)
            whole = whole @ frame(axis.offset, Rotation.identity()) @ errors @ motion
            if axis.motion is not None and not perfect:
                whole = whole @ small(axis.motion(q))
        return whole

    @property
    def all_axes(self) -> tuple[SimulatedAxis, ...]:
        """The axes of both sides."""
        return (*self.work, *self.axes)

    def toml(self, name: str, setups: str) -> str:
        """The text of campaign.toml."""
        text = TOML.format(name=name, gravity=list(map(float, self.gravity)))
        for axis in self.all_axes:
            key = "about" if axis.kind == "rotary" else "along"
            side = "work" if axis in self.work else "tool"
            text += f'\n[[machine.{side}_chain]]\nname = "{axis.name}"\nkind = "{axis.kind}"\n'
            text += f"{key} = {list(map(float, axis.about))}\noffset_mm = {list(map(float, axis.offset))}\n"
            text += f"sign = {axis.sign}\n"
        return text + setups

    def write(
        self,
        folder: Path,
        setups: str,
        rows: Sequence[Mapping[str, object]],
        *,
        started: Sequence[str] = ("2026-03-02T20:00:00+00:00",),
        days: Sequence[int] | None = None,
    ) -> Path:
        """Write the folder: ``rows`` hold run, the readings by axis and the columns of the instruments; every run is a
        day of its own unless ``days`` says otherwise, and every row a minute after the one before unless it has
        ``time_s``."""
        folder.mkdir(parents=True)
        (folder / "campaign.toml").write_text(self.toml(folder.name, setups), encoding="utf-8")
        runs = ["run,started_at,day,warm_up,ambient_degC"]
        numbers = days or range(1, len(started) + 1)
        runs += [
            f"{run},{moment},{day},false,"
            for run, (moment, day) in enumerate(zip(started, numbers, strict=True), start=1)
        ]
        (folder / "runs.csv").write_text("\n".join(runs) + "\n", encoding="utf-8")
        others = list(
            dict.fromkeys(name for row in rows for name in row if name not in ("run", "setup", "time_s"))
        )
        others = [name for name in others if name not in {axis.name for axis in self.all_axes}]
        lines = [",".join(["run,sequence,time_s,setup", *(axis.column for axis in self.all_axes), *others])]
        for number, row in enumerate(rows):
            cells = [row.get("run", 1), number + 1, row.get("time_s", 60.0 * number), row["setup"]]
            cells += [repr(float(row[axis.name])) for axis in self.all_axes]
            cells += ["" if row.get(name) is None else _cell(row[name]) for name in others]
            lines.append(",".join(map(str, cells)))
        (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        return folder


def _cell(value: object) -> str:
    return value if isinstance(value, str) else repr(float(value))
