"""What a refused fit is put down to: setups that read something else, readings that are grossly off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from monitor.exceptions import DataError
from monitor.methods.chain.gross import GrossReading
from monitor.methods.chain.gross_in_parts import gross_of
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Campaign


def with_suspects(
    refusal: DataError,
    campaign: Campaign,
    problem: ChainProblem,
    problem_of: Callable[[Campaign], ChainProblem],
) -> DataError:
    """The refusal of a fit with what the problem says of its setups and the readings that the others contradict."""
    gross = gross_of(campaign, problem, None, problem_of).readings
    return type(refusal)(f"{refusal}{problem.unsettled}{_suspected(problem, gross)}")


def _suspected(problem: ChainProblem, gross: tuple[GrossReading, ...]) -> str:
    """Which readings are grossly off, as the end of a refusal; empty where none stands out, or the same target in most
    runs: then the file is wrong throughout, not a row."""
    runs_of_target = Counter(target for _, target in {(reading.run, reading.target) for reading in gross})
    if len(problem.runs) > 2 and max(runs_of_target.values(), default=0) > len(problem.runs) / 2:
        return ""
    rows = ", ".join(
        f"run {reading.run}, sequence {reading.sequence} ({reading.target})"
        + "".join(f" or sequence {other} of that run" for other in reading.others)
        for reading in gross
    )
    subject = "this reading" if len(gross) == 1 else "these readings"
    return f". First look at {subject}, which the others contradict: {rows}" if gross else ""
