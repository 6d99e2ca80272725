"""The request of `plan`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from monitor.exceptions import InputError
from monitor.methods.planning.search import MOST_BALLS


@dataclass(frozen=True)
class PlanRequest:
    """Weigh the plan of a campaign, and propose a better one where numbers or uncertainties are named.

    ``balls`` and ``poses`` ask for the best plan of so many; ``wanted`` (parameter to display unit) for the quickest
    that reaches these standard uncertainties; ``separate`` for poses that separate two effects. Expanded
    uncertainties are of the coverage probability ``p``. Raises InputError.
    """

    campaign: str
    model: str | None = None
    balls: int | None = None
    poses: int | None = None
    wanted: Mapping[str, float] = field(default_factory=dict)
    separate: tuple[str, str] | None = None
    p: float = 0.95
    figures: Path | None = None

    def __post_init__(self) -> None:
        if self.balls is not None and not 1 <= self.balls <= MOST_BALLS:
            raise InputError(f"--balls {self.balls}: choose 1 to {MOST_BALLS}")
        if self.wanted and (self.balls is not None or self.poses is not None):
            raise InputError(
                "--wanted looks for the quickest plan that reaches an uncertainty, --balls and --poses for the best "
                "plan of a size; name one of them"
            )
        if self.separate is not None and self.separate[0] == self.separate[1]:
            raise InputError(f"--separate {','.join(self.separate)}: name two different effects")
