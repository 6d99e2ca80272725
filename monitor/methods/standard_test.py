"""Rows as the standards of machine tools want them: a type a kind of test, made by a method, for `standards`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from monitor.records import Array


@dataclass(frozen=True)
class AxisTest:
    """A test of positioning in one setup and run: ``position`` (n,) and ``deviation`` (n,) in mm, or in rad where
    ``angular``, in the order of measuring. ``axes`` are those that move: one, or several along a diagonal.

    ``u_reading`` is the standard uncertainty of a reading, ``u_gain`` that of the instrument's unit; ``exact_scale`` is
    the instrument whose unit of length is taken as exact without its being stated, empty where none is.
    """

    setup: str
    run: int
    axes: tuple[str, ...]
    position: Array
    deviation: Array
    u_reading: float
    u_gain: float
    angular: bool
    exact_scale: str


@dataclass(frozen=True)
class CircleTest:
    """A circular test in one setup and run: ``angle`` (n,) rad from the first axis of the ``plane`` to the second,
    ``deviation`` (n,) mm of the length from ``radius`` mm, in the order of measuring; ``u_radius`` is NaN where the bar
    was not calibrated. ``axes`` move; where ``simultaneous``, rotary ones among them (ISO 10791-6)."""

    setup: str
    run: int
    axes: tuple[str, ...]
    simultaneous: bool
    plane: tuple[str, str]
    angle: Array
    deviation: Array
    radius: float
    u_reading: float
    u_radius: float


@dataclass(frozen=True)
class RotationTest:
    """An error motion of an axis of rotation in one run: ``error`` is its symbol (``EXC``), ``angle`` (n,) rad and
    ``deviation`` (n,) mm, or rad where ``angular``, in the order of measuring. ``setup`` is that of the readings, two
    of them for a tilt; ``about_circle`` says that what moves once a revolution is the artefact's place."""

    setup: str
    run: int
    axis: str
    error: str
    angle: Array
    deviation: Array
    about_circle: bool
    u_reading: float
    angular: bool


@dataclass(frozen=True)
class InterpolationTest:
    """Rotary axes that linear ones follow, so that the tool point stays at a point of the work (ISO 10791-6, one rotary
    axis: the tests AK1, BK1, CK1 and so on).

    ``axes`` are those that move, the ``rotary`` ones first, of these the one that turns most; ``angle`` (n,) rad is its
    own by its readings, ``deviations`` (n,) mm by the direction in which they were read, in the order of measuring.
    """

    setup: str
    run: int
    axes: tuple[str, ...]
    rotary: tuple[str, ...]
    angle: Array
    deviations: Mapping[str, Array]
    u_reading: float


@dataclass(frozen=True)
class PartFeature:
    """One element of a part that the machine cut: ``kind`` is ``line`` or ``circle`` by the programmed path.

    ``measured`` (n, 3) and ``nominal`` (n, 3) mm are points in the frame of the instrument; a third number that was not
    measured equals the nominal one. ``centre``, ``normal`` (3,) and ``radius`` mm are those of the programmed circle,
    of a line its middle, its direction and 0. ``turning`` says that rotary axes moved while it was cut.
    """

    name: str
    kind: str
    measured: Array
    nominal: Array
    centre: Array
    normal: Array
    radius: float
    turning: bool


@dataclass(frozen=True)
class PartPath:
    """A path on a part that is neither line nor circle: points ``measured`` (n, 3) mm, the tool's point at ``nominal``
    (n, 3) mm and unit vectors ``axes`` (n, 3) along the tool's axis, in the frame of the instrument and in the order of
    cutting. Without ``has_heights`` the third number was not measured and equals the nominal one."""

    name: str
    measured: Array
    nominal: Array
    axes: Array
    has_heights: bool


@dataclass(frozen=True)
class PartTest:
    """A part that the machine cut in one ``run``, measured by the instrument of ``setup``: ``features`` and ``paths``
    in the order of cutting, ``u_reading`` mm of one coordinate, ``u_scale`` of its unit of length; ``exact_scale`` is
    that of an axis; ``short`` are the points of paths that have too few, by name, and ``needed`` how many a line, a
    circle and any other path need."""

    setup: str
    run: int
    features: tuple[PartFeature, ...]
    paths: tuple[PartPath, ...]
    u_reading: float
    u_scale: float
    exact_scale: str
    short: Mapping[str, int]
    needed: tuple[int, int, int]


StandardTestRows = AxisTest | CircleTest | RotationTest | InterpolationTest | PartTest
