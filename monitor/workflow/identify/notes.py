"""Warnings to those who use the numbers of an identified run, as kinds with their numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from monitor.exceptions import EffectError
from monitor.machine.terms import LOCATION, parse_term
from monitor.methods import method_named
from monitor.methods.chain.gross import GrossReading
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.measured import Displaced
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.model import chain_of
from monitor.readers.row_places import RowPlaces
from monitor.records import Machine
from monitor.reporting.run_notes import (
    AngleNoted,
    AxisAt,
    GrossReadingNoted,
    OffsetNoted,
    ResidualsNoted,
    UnsearchedNoted,
    WorkPointsElsewhere,
)
from monitor.units import DEGREE
from monitor.workflow.history.refuted import CONTRADICTED

# Residuals of so small a part of the stated standard uncertainties: no probe is twenty times better than its owner
# says; readings in inches fit 25 times too well.
TOO_SMALL = 0.05
# Joints are mastered to some degrees at worst, and axes stand within millimetres of their drawing (five of a hundred
# parts of a link, and never less than 5 mm): beyond, the machine file says something else than the machine is.
LARGEST_ANGLE = np.deg2rad(5.0)
LARGEST_PART, LARGEST_OFFSET = 0.05, 5.0


def note(machine: Machine, identification: Identification, run: RunIdentification, places: RowPlaces) -> str:
    """The notes of one run, empty where there is nothing to note."""
    gross = (
        gross_noted(reading, method_named(identification.method).nouns.target, places)
        for reading in identification.gross
        if reading.run == run.run
    )
    unsearched = (UnsearchedNoted(number) for number in identification.unsearched if number == run.run)
    return "; ".join(
        map(
            str,
            (*gross, *unsearched, *_residuals(run), *_locations(machine, identification, run)),
        )
    )


def elsewhere(points: Iterable[Displaced]) -> WorkPointsElsewhere | None:
    """Work points of all runs that are not where the file states them, in one sentence; None where all are."""
    largest: dict[str, float] = {}
    for point in points:
        largest[point.setup] = max(point.distance, largest.get(point.setup, 0.0))
    return WorkPointsElsewhere(tuple(largest), tuple(largest.values())) if largest else None


def elsewhere_under(problem: ChainProblem, solution: Solution) -> WorkPointsElsewhere | None:
    """Work points that a solution puts elsewhere than the file, in one sentence."""
    return elsewhere(point for local in solution.local for point in problem.displaced(local))


def gross_noted(reading: GrossReading, target_word: str, places: RowPlaces) -> GrossReadingNoted:
    """Which reading is wrong beyond doubt, and where it stands in the file."""
    pose = tuple(
        AxisAt(at.joint, DEGREE.to_display(at.reading) if at.turns else at.reading, at.turns)
        for at in reading.pose
    )
    return GrossReadingNoted(
        reading.run, reading.sequence, target_word, reading.target, pose, reading.size, reading.axis,
        tuple(reading.others), reading.is_along_surface, places.row(reading.run, reading.sequence),
        reading.moves,
    )  # fmt: skip


def _residuals(run: RunIdentification) -> Iterator[ResidualsNoted]:
    """Residuals that contradict the stated uncertainties."""
    if run.degrees_of_freedom < 1:
        return
    times = float(np.sqrt(run.chi_square / run.degrees_of_freedom))
    if times > CONTRADICTED or times < TOO_SMALL:
        yield ResidualsNoted(run.run, times)


def _locations(
    machine: Machine, identification: Identification, run: RunIdentification
) -> Iterator[AngleNoted | OffsetNoted]:
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
            yield AngleNoted(run.run, name, float(value), joint)
        length = None if term.is_rotation else lengths.get(joint)
        if length is not None and least > max(LARGEST_PART * length, LARGEST_OFFSET):
            yield OffsetNoted(run.run, name, float(value), joint, length)
