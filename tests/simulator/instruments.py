"""Machines measured by instruments, simulated without a line of the package: rotations by scipy, one pose at a time.

A chain is a list of axes from the bed to the tool: name, kind, direction, offset, sign. Errors are given by axis and
component as small rotations and shifts that come before the axis (location) or after it (motion); a function of the
pose may add more. Everything is put together as homogeneous matrices of numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class SimulatedAxis:
    """An axis: ``errors`` are six numbers (mm, rad) before its motion, ``motion`` gives six after it for a pose."""

    name: str
    kind: str
    about: tuple[float, float, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sign: int = 1
    errors: tuple[float, ...] = (0.0,) * 6

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
    """A chain on the tool's side; ``motions`` gives six numbers after the last axis for readings by name."""

    axes: tuple[SimulatedAxis, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -1.0)
    motions: Callable[[Mapping[str, float], np.ndarray], Sequence[float]] | None = field(default=None)

    def pose(self, readings: Mapping[str, float], *, perfect: bool = False) -> np.ndarray:
        """Where the tool's frame stands for readings in degrees and mm."""
        whole = np.eye(4)
        for axis in self.axes:
            q = axis.sign * readings[axis.name]
            if axis.kind == "rotary":
                motion = frame((0, 0, 0), Rotation.from_rotvec(np.deg2rad(q) * np.array(axis.about)))
            else:
                motion = frame(q * np.array(axis.about), Rotation.identity())
            errors = small((0.0,) * 6 if perfect else axis.errors)
            whole = whole @ frame(axis.offset, Rotation.identity()) @ errors @ motion
        if self.motions is not None and not perfect:
            nominal = self.pose(readings, perfect=True)
            whole = whole @ small(self.motions(readings, nominal[:3, :3]))
        return whole

    def toml(self, name: str, setups: str) -> str:
        """The text of campaign.toml."""
        text = TOML.format(name=name, gravity=list(map(float, self.gravity)))
        for axis in self.axes:
            key = "about" if axis.kind == "rotary" else "along"
            text += (
                f'\n[[machine.tool_chain]]\nname = "{axis.name}"\nkind = "{axis.kind}"\n{key} = {list(map(float, axis.about))}\n'
                f"offset_mm = {list(map(float, axis.offset))}\nsign = {axis.sign}\n"
            )
        return text + setups

    def write(
        self,
        folder: Path,
        setups: str,
        rows: Sequence[Mapping[str, object]],
        *,
        started: Sequence[str] = ("2026-03-02T20:00:00+00:00",),
    ) -> Path:
        """Write the folder: ``rows`` hold run, the readings by axis and the columns of the instruments."""
        folder.mkdir(parents=True)
        (folder / "campaign.toml").write_text(self.toml(folder.name, setups), encoding="utf-8")
        runs = ["run,started_at,day,warm_up,ambient_degC"]
        runs += [f"{run},{moment},{run},false," for run, moment in enumerate(started, start=1)]
        (folder / "runs.csv").write_text("\n".join(runs) + "\n", encoding="utf-8")
        others = list(dict.fromkeys(name for row in rows for name in row if name not in ("run", "setup")))
        others = [name for name in others if name not in {axis.name for axis in self.axes}]
        lines = [",".join(["run,sequence,time_s,setup", *(axis.column for axis in self.axes), *others])]
        for number, row in enumerate(rows):
            cells = [row.get("run", 1), number + 1, 60.0 * number, row["setup"]]
            cells += [repr(float(row[axis.name])) for axis in self.axes]
            cells += ["" if row.get(name) is None else _cell(row[name]) for name in others]
            lines.append(",".join(map(str, cells)))
        (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        return folder


def _cell(value: object) -> str:
    return value if isinstance(value, str) else repr(float(value))
