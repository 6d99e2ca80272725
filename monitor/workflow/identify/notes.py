"""What has to be known before the numbers of an identified run are used: notes in plain sentences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from monitor.exceptions import EffectError
from monitor.machine.terms import LOCATION, parse_term
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.model import chain_of
from monitor.records import Machine

# Residuals so many times as large as stated: the statement of a probe is seldom wrong by a factor of three.
TOO_LARGE = 3.0
# And so small a part: no probe is twenty times better than its owner says.
TOO_SMALL = 0.05
# Joints are mastered to some degrees at worst, and axes stand within millimetres of their drawing (five of a hundred
# parts of a link, and never less than 5 mm): beyond, the machine file says something else than the machine is.
LARGEST_ANGLE = np.deg2rad(5.0)
LARGEST_PART, LARGEST_OFFSET = 0.05, 5.0


def note(machine: Machine, found: Identification, run: RunIdentification) -> str:
    """The notes of one run, empty where nothing has to be known."""
    return "; ".join(one for one in (_residuals(run), *_locations(machine, found, run)) if one)


def _residuals(run: RunIdentification) -> str:
    if run.degrees_of_freedom < 1:
        return ""
    times = float(np.sqrt(run.chi_square / run.degrees_of_freedom))
    if times > TOO_LARGE:
        return (
            f"run {run.run}: the residuals are {times:.2g} times what the stated uncertainties leave, so u does not "
            "hold; compare and explain say where the model fails and what is missing"
        )
    if times < TOO_SMALL:
        return (
            f"run {run.run}: the residuals are far smaller than the stated uncertainties leave ({times:.1g} of it): "
            "check the units of the columns and the statement"
        )
    return ""


def _locations(machine: Machine, found: Identification, run: RunIdentification) -> Iterator[str]:
    """Location errors that are too large to be errors. Axes given by letters have no lengths to compare with, and their
    offsets are what they are."""
    chain = chain_of(machine)
    lengths = {axis.name: float(np.linalg.norm(axis.offset)) for axis in machine.chain}
    for name, value, variance in zip(found.parameters, run.estimate, np.diag(run.covariance), strict=True):
        try:
            term = parse_term(name, chain)
        except EffectError:
            continue
        if term.stage != LOCATION or not np.isfinite(value):
            continue
        # What the run hardly sees is large by chance.
        sure = max(abs(float(value)) - 3.0 * float(np.sqrt(variance)), 0.0)
        joint = chain.joints[term.joint].name
        if term.is_rotation:
            if sure > LARGEST_ANGLE:
                yield (
                    f"run {run.run}: {name} comes to {np.rad2deg(value):.2g} degrees, more than an error of a machine: "
                    f"check the zero, the direction and the sign of {joint} in campaign.toml"
                )
            continue
        length = lengths.get(joint)
        if length is not None and sure > max(LARGEST_PART * length, LARGEST_OFFSET):
            stands = f"{length:.4g} mm from the axis before it" if length else "on the axis before it"
            yield (
                f"run {run.run}: {name} comes to {value:.4g} mm, where campaign.toml puts {joint} {stands}: more than "
                f"an error of a machine; check offset_mm of {joint} and of its neighbours, and their units"
            )
