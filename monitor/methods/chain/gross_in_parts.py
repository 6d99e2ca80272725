"""Grossly wrong readings of a campaign of very many rows: each is held against its part, which is a plan of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from monitor.exceptions import DataError, InputError
from monitor.methods.chain.deviation import MOST_ROWS
from monitor.methods.chain.gross import GrossReading, gross_readings
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.parts import parts_of
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.records import Campaign


@dataclass(frozen=True)
class GrossSearch:
    """The gross ``readings`` of a campaign in file order. ``unsearched`` are the runs with rows in a part that is no
    plan of its own, which is passed over."""

    readings: tuple[GrossReading, ...]
    unsearched: tuple[int, ...] = ()


def gross_of(
    campaign: Campaign,
    problem: ChainProblem,
    solution: Solution | None,
    problem_of: Callable[[Campaign], ChainProblem],
) -> GrossSearch:
    """The gross readings of a campaign with its problem, before any fit of it and, where there is a ``solution``, under
    that; of a problem that ``is_in_parts``, part by part, each under a fit of its own, which ``problem_of`` gives."""
    if not problem.is_in_parts:
        return GrossSearch(gross_readings(problem, solution))
    return gross_in_parts(campaign, problem_of, is_fitted=solution is not None)


def gross_in_parts(
    campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem], *, is_fitted: bool
) -> GrossSearch:
    """The gross readings of a campaign's parts, before any fit and, where it ``is_fitted``, under one of each part.

    Never an error: a part may lack what the whole has (runs without the scale bar), which is no fault of the campaign.
    """
    by_row: dict[int, GrossReading] = {}
    unsearched: set[int] = set()
    for rows, part in parts_of(campaign):
        try:
            of_part = problem_of(part)
            readings = gross_readings(of_part, _settled(of_part) if is_fitted else None)
        except (InputError, np.linalg.LinAlgError):
            unsearched.update(part.probings.run.tolist())
            continue
        # A touch of the bar is in several parts, of which one may show it better.
        for reading in readings:
            row = int(rows[reading.row])
            if row not in by_row or reading.chi_square > by_row[row].chi_square:
                by_row[row] = replace(reading, row=row)
    # So many in a run are no single mistakes, as within a part, which tells so many of each of two kinds.
    counts = Counter(reading.run for reading in by_row.values())
    return GrossSearch(
        tuple(by_row[row] for row in sorted(by_row) if counts[by_row[row].run] <= 2 * MOST_ROWS),
        tuple(sorted(unsearched)),
    )


def _settled(problem: ChainProblem) -> Solution | None:
    """The solution of a part; None where it has none, though the whole has."""
    try:
        return solve_problem(problem)
    except DataError:
        return None
