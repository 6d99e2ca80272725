"""The request of `plan`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from monitor.exceptions import InputError
from monitor.methods.planning.search import MOST_BALLS
from monitor.workflow.uncertainty.request import COVERAGE, check_coverage

#: In the unit of the parameter (µm, µrad, µm/m): from a millionth of a nanometre to a kilometre.
LEAST_WANTED, MOST_WANTED = 1e-9, 1e9


@dataclass(frozen=True)
class PlanRequest:
    """Weigh the plan of a campaign, and propose a better one where numbers or uncertainties are named.

    ``balls`` and ``poses`` ask for the best plan of so many; ``wanted`` (parameter to display unit) for the quickest
    that reaches these standard uncertainties; ``keep`` weighs the campaign's own plan with these of its indexations
    alone (numbers from 1 on in their order); ``parameters`` are those that tests of instruments are ranked for (none
    named: all); ``separate`` asks for poses, or tests of instruments, that separate two effects. Expanded uncertainties
    are of the coverage probability ``p``. Raises InputError.
    """

    campaign: str
    model: str | None = None
    balls: int | None = None
    poses: int | None = None
    wanted: Mapping[str, float] = field(default_factory=dict)
    separate: tuple[str, str] | None = None
    p: float = COVERAGE
    figures: Path | None = None
    keep: tuple[int, ...] = ()
    parameters: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_coverage(self.p)
        if self.balls is not None and not 1 <= self.balls <= MOST_BALLS:
            raise InputError(f"--balls {self.balls}: choose 1 to {MOST_BALLS}")
        self._check_wanted()
        if self.wanted and (self.balls is not None or self.poses is not None):
            raise InputError(
                "--wanted looks for the quickest plan that reaches an uncertainty, --balls and --poses for the best "
                "plan of a size; name one of them"
            )
        if self.keep and (self.wanted or self.balls is not None or self.poses is not None):
            raise InputError(
                "choose indexations of the present plan, or let a plan of a size or an uncertainty be found; not both"
            )
        if len(set(self.keep)) < len(self.keep) or any(number < 1 for number in self.keep):
            raise InputError("the indexations to keep are numbers from 1 on, each once")
        if self.separate is not None and self.separate[0] == self.separate[1]:
            raise InputError(f"'{','.join(self.separate)}': name two different effects")

    def _check_wanted(self) -> None:
        for name, u in self.wanted.items():
            if not LEAST_WANTED <= u <= MOST_WANTED:
                raise InputError(
                    f"--wanted {name}: {u:g} is no uncertainty that a plan is made for; write {LEAST_WANTED:g} to "
                    f"{MOST_WANTED:g} in its unit"
                )

    @staticmethod
    def two_effects(text: str) -> tuple[str, str]:
        """Read two effects with a comma between them; one inside brackets belongs to a formula. Raises InputError."""
        parts, depth = [""], 0
        for letter in text:
            depth += {"(": 1, ")": -1}.get(letter, 0)
            if letter == "," and depth == 0:
                parts.append("")
            else:
                parts[-1] += letter
        if len(parts) != 2 or not all(part.strip() for part in parts):
            raise InputError(f"'{text}': name two effects with a comma, for example EBZ:poly2,EZZ:poly2")
        return parts[0].strip(), parts[1].strip()
