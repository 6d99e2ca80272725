"""What moved or stepped within a run, ``moved(run 7, sequence 23)``: from where on, and how its points go with it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from monitor.exceptions import EffectError
from monitor.records import Array

#: Behind the name of what moved; the moment may lack, so that its lack can be told.
MOVED = r"moved(?:\s*\(\s*run\s+(?P<run>\d+)\s*,\s*sequence\s+(?P<sequence>\d+)\s*\))?"


def moment_of(groups: Mapping[str, str], text: str) -> tuple[int, int]:
    """Return run and sequence from which on something had moved, as ``text`` names it. Raises EffectError where they
    are not said."""
    if "run" not in groups:
        raise EffectError(
            f"'{text}' must say when: write {text}(run 7, sequence 23); `explain` finds the moment"
        )
    return int(groups["run"]), int(groups["sequence"])


def shifts_and_turns(arms: Array, farthest: float) -> Array:
    """Return how points (n, 3, 6) at ``arms`` (n, 3) mm from their middle move with a shift along X, Y, Z and a turn
    about these, of as much at the ``farthest`` distance in mm."""
    turns = np.stack([np.cross(axis, arms) for axis in np.eye(3)], axis=-1) / max(farthest, 1e-12)
    return np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=-1)
