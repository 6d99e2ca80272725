"""What changes have in common that a driver may scale: of the artefact, of an instrument, and turns of a joint."""

from __future__ import annotations

from typing import Protocol

from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.units import Unit


class Change(Protocol):
    """A change with a coefficient or several."""

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

    def described(self, driven: str) -> Description:
        """Return the change in words; ``driven`` is the phrase of its driver, which begins with a comma."""
        ...
