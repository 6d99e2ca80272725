"""What is wrong with the simulated machine: `term:shape@driver`, as columns of numbers over the probings.

Own reading of the language of effects; nothing is taken from the product. A shape gives one or more columns of
the axis's displacement q (mm or rad), a driver one or more columns that multiply them; an effect is the columns
times its coefficients. The amplitude is given either as coefficients (mm, rad and powers of them) or as `peak_um`,
the largest norm, over all probings of the campaign, of the displacement of the tip-to-ball vector it causes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .chain import LETTERS, Axis, Chain


@dataclass(frozen=True)
class Effect:
    """One effect. `name` is e.g. `EXX:reversal`, `EZC1:const@warmup`, `ball:2:moved`, `stem:gravity`.

    coefficients: one number a column (see `columns`), or for a plain term an array with one value a run.
    peak_um: instead of coefficients; `direction` then gives their ratio (default: all equal).
    tau_s: time constant of `@warmup`. reference: what is taken off an `@channel` (default 20 degC, ISO 1).
    grid: nodes of `table`, in mm or rad of q. at: (run, sequence) from which a ball is moved.
    targets: the balls that `artefact:expansion` and `stem:gravity` act on (default: all, the bar too).
    curve: of the shape `curve`: values (N,) from displacements q, travel signs and circumstances.
    """

    name: str
    coefficients: float | Sequence[float] | np.ndarray | None = None
    peak_um: float | None = None
    direction: Sequence[float] | None = None
    tau_s: float = 3600.0
    reference: float = 20.0
    grid: Sequence[float] | None = None
    at: tuple[int, int] = (1, 1)
    targets: Sequence[str] | None = None
    curve: Callable[[np.ndarray, np.ndarray, Circumstances], np.ndarray] | None = None

    @property
    def term(self) -> str:
        return self.name.split("@")[0].split(":")[0]

    @property
    def shape(self) -> str:
        parts = self.name.split("@")[0].split(":")
        return ":".join(parts[1:]) if len(parts) > 1 else "const"

    @property
    def driver(self) -> str:
        return self.name.split("@")[1] if "@" in self.name else ""

    @property
    def of_artefact(self) -> bool:
        return self.term in ("ball", "artefact", "stem")


@dataclass(frozen=True)
class Circumstances:
    """What drivers and shapes may depend on, over the N probings of a campaign."""

    run: np.ndarray  # number of the run, from 1
    sequence: np.ndarray
    target: np.ndarray  # names
    since_first_run_s: np.ndarray  # since the start of the first run of the day
    run_fraction: np.ndarray  # 0 at the first probing of a run, 1 at the last
    channels: Mapping[str, np.ndarray]
    gravity: Mapping[str, np.ndarray]
    angles: Mapping[str, np.ndarray] = field(default_factory=dict)  # rad, of the rotary axes


def place(effect: Effect, chain: Chain) -> tuple[Axis, bool, int]:
    """Axis, whether it is a location error, and which of X Y Z A B C, of an ISO 230-1 symbol."""
    found = re.fullmatch(r"E([XYZABC])(0?)([XYZABC]\d*)", effect.term)
    if not found:
        raise ValueError(f"term {effect.term!r} is not an ISO 230-1 symbol such as EX0C or EYX")
    if found[2] and effect.shape != "const":
        raise ValueError(f"location error {effect.name!r} can only be constant in its axis's position")
    return chain.axis(found[3]), bool(found[2]), LETTERS.index(found[1])


def shape_columns(effect: Effect, q: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """(N, n) columns of a shape at displacements q; `travel` is the sign of the last travel of the axis."""
    shape = effect.shape
    if shape == "const":
        return np.ones((len(q), 1))
    if found := re.fullmatch(r"poly([1-9])", shape):
        return (q ** int(found[1]))[:, None]
    if found := re.fullmatch(r"harmonic([1-9])", shape):
        return np.column_stack([np.cos(int(found[1]) * q), np.sin(int(found[1]) * q)])
    if found := re.fullmatch(r"cyclic([0-9.]+)mm", shape):
        phase = 2 * np.pi * q / float(found[1])
        return np.column_stack([np.cos(phase), np.sin(phase)])
    if shape == "reversal":
        return travel[:, None]
    if shape == "table" and effect.grid is not None:
        grid = np.asarray(effect.grid, float)
        return np.column_stack([np.interp(q, grid, unit) for unit in np.eye(len(grid))])
    raise ValueError(f"no shape {shape!r} (of {effect.name!r}), or a table without its grid")


def driver_columns(effect: Effect, frame: str, now: Circumstances) -> np.ndarray:
    """(N, n) columns of a driver; `frame` names the frame in which gravity is seen."""
    driver = effect.driver
    if driver == "":
        return np.ones((len(now.run), 1))
    if driver == "warmup":
        return (1.0 - np.exp(-now.since_first_run_s / effect.tau_s))[:, None]
    if driver == "run_time":
        return now.run_fraction[:, None]
    if driver == "gravity":
        return now.gravity[frame]
    if driver in now.channels:
        return (now.channels[driver] - effect.reference)[:, None]
    raise ValueError(f"no driver {driver!r} (of {effect.name!r}); channels are {sorted(now.channels)}")


def products(shape: np.ndarray, driver: np.ndarray) -> np.ndarray:
    """(N, n*m) every shape column times every driver column, the driver's running fastest."""
    return (shape[:, :, None] * driver[:, None, :]).reshape(len(shape), -1)


def axis_columns(
    effect: Effect, axis: Axis, location: bool, q: np.ndarray, travel: np.ndarray, now: Circumstances
) -> np.ndarray:
    """(N, n) columns of an effect on an axis."""
    frame = ("before:" if location else "") + axis.name
    if effect.shape == "curve" and effect.curve is not None:
        return products(effect.curve(q, travel, now)[:, None], driver_columns(effect, frame, now))
    return products(shape_columns(effect, q, travel), driver_columns(effect, frame, now))


def artefact_columns(effect: Effect, points: np.ndarray, now: Circumstances) -> np.ndarray:
    """(N, 3, n) displacement of the probed balls, in the frame of the last work axis, per unit coefficient.

    `ball:ID:moved` has the three coordinates of the move; `artefact:expansion` grows from the frame's origin;
    `stem:gravity` bends a stem along the table's Z by the lateral components of gravity (all stems alike).
    """
    count = len(points)
    if effect.term == "ball":
        ball, shape = effect.shape.split(":")
        if shape != "moved":
            raise ValueError(f"no artefact effect {effect.name!r}")
        run, sequence = effect.at
        after = (now.run > run) | ((now.run == run) & (now.sequence >= sequence))
        hit = (after & (now.target == ball)).astype(float)
        return hit[:, None, None] * np.eye(3)
    acts = (
        np.ones(count) if effect.targets is None else np.isin(now.target, list(effect.targets)).astype(float)
    )
    if effect.name == "stem:gravity":
        bend = now.gravity["end:work"] * np.array([1.0, 1.0, 0.0])
        return (acts[:, None] * bend)[:, :, None]
    if effect.term == "artefact" and effect.shape == "expansion":
        return (acts[:, None] * points)[:, :, None] * driver_columns(effect, "end:work", now)[:, None, :]
    raise ValueError(f"no artefact effect {effect.name!r}")


def coefficients_over_runs(effect: Effect, columns: int, now: Circumstances) -> np.ndarray:
    """(n,) coefficients, or (N, 1) when a plain term was given one value a run."""
    given = np.atleast_1d(np.asarray(effect.coefficients, float))
    if given.shape == (columns,):
        return given
    runs = int(now.run.max())
    if columns == 1 and given.shape == (runs,):
        return given[now.run - 1][:, None]
    raise ValueError(
        f"{effect.name!r} needs {columns} coefficients, or one a run ({runs}); {given.shape} given"
    )
