"""Warnings to those who use the numbers of an identified run, in plain sentences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from monitor.exceptions import EffectError
from monitor.machine.terms import LOCATION, parse_term
from monitor.methods import method_named
from monitor.methods.chain.gross import GrossReading
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.model import chain_of
from monitor.records import Machine
from monitor.units import DEGREE, MICROMETRE

# Residuals beyond so many stated standard uncertainties: a probe's statement is seldom wrong by a factor of three.
TOO_LARGE = 3.0
# And so small a part: no probe is twenty times better than its owner says.
TOO_SMALL = 0.05
# Joints are mastered to some degrees at worst, and axes stand within millimetres of their drawing (five of a hundred
# parts of a link, and never less than 5 mm): beyond, the machine file says something else than the machine is.
LARGEST_ANGLE = np.deg2rad(5.0)
LARGEST_PART, LARGEST_OFFSET = 0.05, 5.0


def note(machine: Machine, identification: Identification, run: RunIdentification) -> str:
    """The notes of one run, empty where there is nothing to note."""
    gross = (
        gross_sentence(reading, method_named(identification.method).nouns.target)
        for reading in identification.gross
        if reading.run == run.run
    )
    return "; ".join((*gross, *_residuals(run), *_locations(machine, identification, run)))


def gross_sentence(reading: GrossReading, target_word: str) -> str:
    """Which reading is wrong beyond doubt, where it stands in the file, and what to do."""
    pose = " ".join(
        f"{at.joint}={DEGREE.to_display(at.reading):.6g}°" if at.turns else f"{at.joint}={at.reading:.6g} mm"
        for at in reading.pose
    )
    stands = f" at {pose}" if pose else ""
    size = (
        f"{reading.size:+.3g} mm"
        if abs(reading.size) >= 0.1
        else f"{MICROMETRE.to_display(reading.size):+.3g} µm"
    )
    others = ", ".join(map(str, reading.others))
    instead = f" (or sequence {others}: these readings cannot say which)" if others else ""
    return (
        f"run {reading.run}: sequence {reading.sequence}, {target_word} {reading.target}{stands}, is off by {size} in "
        f"{reading.axis}{instead}: no number of this run holds; correct or remove the row in probings.csv, withdraw "
        "the campaign and import it again"
    )


def _residuals(run: RunIdentification) -> Iterator[str]:
    """Residuals that contradict the stated uncertainties."""
    if run.degrees_of_freedom < 1:
        return
    times = float(np.sqrt(run.chi_square / run.degrees_of_freedom))
    if times > TOO_LARGE:
        yield (
            f"run {run.run}: the residuals are {times:.2g} times what the stated uncertainties leave, so u does not "
            "hold; compare and explain say where the model fails and what is missing"
        )
    if times < TOO_SMALL:
        yield (
            f"run {run.run}: the residuals are far smaller than the stated uncertainties leave ({times:.1g} of it): "
            "check the units of the columns and the statement"
        )


def _locations(machine: Machine, identification: Identification, run: RunIdentification) -> Iterator[str]:
    """Location errors that are too large to be errors. Axes given by letters have no lengths to compare with, and their
    offsets are what they are."""
    chain = chain_of(machine)
    lengths = {axis.name: float(np.linalg.norm(axis.offset)) for axis in machine.chain}
    rows = zip(identification.parameters, run.estimate, np.diag(run.covariance), strict=True)
    for name, value, variance in rows:
        if not np.isfinite(value):
            continue
        try:
            term = parse_term(name, chain)
        except EffectError:
            continue
        if term.stage != LOCATION:
            continue
        joint = chain.joints[term.joint].name
        # An error that the run hardly determines is large by chance.
        least = max(abs(float(value)) - 3.0 * float(np.sqrt(variance)), 0.0)
        if term.is_rotation and least > LARGEST_ANGLE:
            yield (
                f"run {run.run}: {name} comes to {np.rad2deg(value):.2g} degrees, more than an error of a machine: "
                f"check the zero, the direction and the sign of {joint} in campaign.toml"
            )
        length = None if term.is_rotation else lengths.get(joint)
        if length is not None and least > max(LARGEST_PART * length, LARGEST_OFFSET):
            stands = f"{length:.4g} mm from the axis before it" if length else "on the axis before it"
            yield (
                f"run {run.run}: {name} comes to {value:.4g} mm, where campaign.toml puts {joint} {stands}: more than "
                f"an error of a machine; check offset_mm of {joint} and of its neighbours, and their units"
            )
