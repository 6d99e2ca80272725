"""Set-ups that would separate effects which no pose of the present one can.

With one stylus a tilt of a head and a shift of it move the tip alike wherever the machine stands, and a correction of
either serves for that stylus alone. Another length tells them apart; so does a target that stands higher, further out
or turned. A second set-up is another run: all its own unknowns are its own again, and only the size of the effect is
common to both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.separation.distances import DECIDES, WORTHWHILE, Pair, distance_of
from monitor.machine import Chain
from monitor.records import Array, SecondSetup

# mm and rad; a longer stylus and a riser of these sizes are at hand, and a piece is turned by less than a quarter of a
# turn, which many harmonics would not notice.
LONGER, BESIDE, HIGHER, FURTHER, TURN = 50.0, 50.0, 50.0, 50.0, np.pi / 4.0
RIDGE = 1e-10


@dataclass(frozen=True)
class Moved:
    """A second set-up: where the tip (3,) stands, and where each of the targets (n, 3) does, in mm."""

    setup: SecondSetup
    tip: Array
    targets: Callable[[Array], Array]


def setups_of(chain: Chain, tip: Array) -> list[Moved]:
    """The set-ups that may be tried with a stylus ``tip`` (3,), the easiest first; about the last axis of the work that
    turns, or Z."""
    turning = [joint for joint in chain.work if joint.turns]
    main = turning[-1].main if turning else 2
    along, across = np.eye(3)[main], np.eye(3)[(main + 1) % 3]
    cos, sin = np.cos(TURN), np.sin(TURN)

    def turned(places: Array) -> Array:
        axial = np.outer(places @ along, along)
        return np.asarray(axial + cos * (places - axial) + sin * np.cross(along, places))

    length = float(np.linalg.norm(tip))
    moved = []
    if length > BESIDE:
        stylus = int(np.abs(tip).argmax())
        moved.append(Moved(SecondSetup.LONGER_STYLUS, tip * (1.0 + LONGER / length), np.asarray))
        moved.append(Moved(SecondSetup.STYLUS_BESIDE, tip + BESIDE * np.eye(3)[(stylus + 1) % 3], np.asarray))
    return [
        *moved,
        Moved(SecondSetup.TURNED, tip, turned),
        Moved(SecondSetup.FURTHER, tip, lambda places: places + FURTHER * across),
        Moved(SecondSetup.HIGHER, tip, lambda places: places + HIGHER * along),
    ]


def runs_that_decide(pair: Pair, unknowns: int, runs: int) -> int | None:
    """How many runs in the second set-up, whose products are the additions of a pair, tell its effects apart beside the
    present ``runs``, no more than these; None where none do. The first ``unknowns`` belong to each run by itself."""
    present = of_effects(pair.present, unknowns)
    added = of_effects(pair.additions.sum(axis=0), unknowns)
    wanted = max(DECIDES, WORTHWHILE * distance_of(present, runs))
    return next(
        (more for more in range(1, runs + 1) if distance_of(runs * present + more * added, 1) >= wanted),
        None,
    )


def of_effects(products: Array, unknowns: int) -> Array:
    """The products of the effects with the unknowns of their own set-up taken out."""
    inner = products[:unknowns, :unknowns] + RIDGE * np.eye(unknowns)
    across = products[:unknowns, unknowns:]
    return np.asarray(products[unknowns:, unknowns:] - across.T @ np.linalg.solve(inner, across))
