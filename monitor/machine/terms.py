"""ISO 230-1 symbols of geometric errors: where in the chain, and in which direction.

``EA0B`` is the location error about X of axis B, ``EYX`` the error motion in Y of axis X.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from monitor.exceptions import EffectError, did_you_mean
from monitor.machine.topology import Chain
from monitor.units import MICROMETRE, MICRORADIAN, Unit

#: The six directions, in the order of every array of errors: translations, then rotations.
COMPONENTS = "XYZABC"
#: The two stages of a joint, in the order of every array of errors.
LOCATION, MOTION = 0, 1


@dataclass(frozen=True)
class Term:
    """One of the twelve small numbers of a joint: ``component`` counts in ``COMPONENTS``."""

    symbol: str
    joint: int
    stage: int
    component: int

    @property
    def is_rotation(self) -> bool:
        """Whether the error turns rather than shifts."""
        return self.component >= 3

    @property
    def unit(self) -> Unit:
        """The unit that people see."""
        return MICRORADIAN if self.is_rotation else MICROMETRE


def parse_term(symbol: str, chain: Chain) -> Term:
    """The term of a symbol on a chain; EffectError, with what the chain has, if there is no such term."""
    names = sorted((joint.name for joint in chain.joints), key=len, reverse=True)
    match = re.fullmatch(rf"E([{COMPONENTS}])(0?)({'|'.join(map(re.escape, names))})", symbol)
    if match is None:
        symbols = [
            f"E{component}{location}{joint}"
            for component in COMPONENTS
            for location in ("0", "")
            for joint in names
        ]
        # ``EX`` is the positioning error of X, whose axis was left out, rather than any other of X.
        of_itself = f"{symbol}{symbol[1:]}"
        hint = f"did you mean '{of_itself}'? " if of_itself in symbols else did_you_mean(symbol, symbols)
        raise EffectError(
            f"'{symbol}' is no geometric error of '{chain.topology}': {hint}"
            "write E, a direction X Y Z A B C, "
            f"0 for a location error, and one of its axes {', '.join(joint.name for joint in chain.joints)}, "
            f"for example EX0{chain.joints[-1].name} or EY{chain.joints[0].name}"
        )
    direction, location, joint = match.groups()
    return Term(symbol, chain.index(joint), LOCATION if location else MOTION, COMPONENTS.index(direction))
