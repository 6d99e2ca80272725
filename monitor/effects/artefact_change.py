"""What a change of the artefact is: how the targets move, or the frame of what looks at them.

Another one is one more file of ``artefact``.
"""

from __future__ import annotations

from typing import Protocol

from monitor.effects.change import Change
from monitor.effects.context import Context
from monitor.records import Array


class ArtefactChange(Change, Protocol):
    """A change of the targets' positions, in the frame of the last work axis."""

    def shifts(self, context: Context) -> Array:
        """Return the shift (n, 3, k) of the target at every probing for each coefficient."""
        ...
