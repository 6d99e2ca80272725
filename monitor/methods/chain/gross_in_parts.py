"""Grossly wrong readings of a campaign of very many rows: each is held against its part, which is a plan of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

from monitor.exceptions import DataError
from monitor.methods.chain.deviation import MOST_ROWS
from monitor.methods.chain.gross import GrossReading, gross_readings
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.parts import parts_of
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.records import Campaign


def gross_of(
    campaign: Campaign,
    problem: ChainProblem,
    solution: Solution | None,
    problem_of: Callable[[Campaign], ChainProblem],
) -> tuple[GrossReading, ...]:
    """The gross readings of a campaign with its problem, before any fit of it and, where there is a ``solution``, under
    that; of a problem that ``is_in_parts``, part by part, each under a fit of its own, which ``problem_of`` gives."""
    if not problem.is_in_parts:
        return gross_readings(problem, solution)
    readings: list[GrossReading] = []
    for rows, part in parts_of(campaign):
        of_part = problem_of(part)
        fitted = None if solution is None else _settled(of_part)
        readings += [
            replace(reading, row=int(rows[reading.row])) for reading in gross_readings(of_part, fitted)
        ]
    # So many in a run are no single mistakes, as within a part, which tells so many of each of two kinds.
    counts = Counter(reading.run for reading in readings)
    within = (reading for reading in readings if counts[reading.run] <= 2 * MOST_ROWS)
    return tuple(sorted(within, key=lambda reading: reading.row))


def _settled(problem: ChainProblem) -> Solution | None:
    """The solution of a part; None where it has none, though the whole has."""
    try:
        return solve_problem(problem)
    except DataError:
        return None
