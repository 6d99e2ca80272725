"""What a change of the artefact is: how the targets move, or the frame of what looks at them.

Another one is one more file of ``artefact``.
"""

from __future__ import annotations

from typing import Protocol

from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.records import Array
from monitor.units import Unit


class ArtefactChange(Protocol):
    """A change of the targets' positions, in the frame of the last work axis."""

    @property
    def text(self) -> str:
        """The change as written."""
        ...

    @property
    def unit(self) -> Unit:
        """The unit of its coefficients."""
        ...

    def labels(self, context: Context) -> tuple[str, ...]:
        """Return a suffix for each of the k coefficients."""
        ...

    def shifts(self, context: Context) -> Array:
        """Return the shift (n, 3, k) of the target at every probing for each coefficient."""
        ...

    def described(self, driven: str) -> Description:
        """Return the change in words; ``driven`` is the phrase of its driver, which begins with a comma."""
        ...
