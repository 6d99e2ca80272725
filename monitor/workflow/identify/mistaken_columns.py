"""Readings that no machine of the file fits, with the exchanged column, sign or unit that explains it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from monitor.exceptions import (
    DataError,
    MistakenAxesError,
    MonitorError,
    NotConvergedError,
    TooFewReadingsError,
    TooManyRowsError,
)
from monitor.methods.chain.parts import parts_of
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.methods.chain.suspects import with_suspects
from monitor.readers.doubts.blank_rows import blank_rows, blank_words
from monitor.readers.doubts.doubts import column_doubts, exchanged_columns
from monitor.readers.doubts.plate_doubts import plate_doubts, tracker_doubts
from monitor.readers.doubts.still_columns import still_columns
from monitor.records import Campaign
from monitor.row_files import rows_in, runs_in
from monitor.workflow.identify.poor_runs import hardly_told, refusal_of_poor_runs, standing_still
from monitor.workflow.tool_frames import tool_frames


def refusal_of(
    refusal: DataError, campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> DataError:
    """The refusal of a fit in the words of ``identify``: what is suspected, and the mistake of the file behind it."""
    if isinstance(refusal, TooFewReadingsError | TooManyRowsError):
        return with_mistake(refusal, campaign, problem_of)
    try:
        problem = problem_of(campaign)
    except DataError:
        return with_mistake(refusal, campaign, problem_of)
    return with_mistake(with_suspects(refusal, campaign, problem, problem_of), campaign, problem_of)


def with_mistake(
    refusal: DataError, campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> DataError:
    """The refusal of a fit, and in a second sentence the mistake of the file that explains it, where one does.

    Rows of zeros are named where the campaign without them fits: the origin of a plate is a reading, and stays
    where it is whatever else is mistaken. Columns that the import saw exchanged, or standing still, are said again.
    Else the changes are tried that would let the readings fit, which takes up to half a minute, and as long again
    without rows of zeros, which are named too where that is enough. Where no change is, runs are named whose plan
    leaves unknowns open, else what the import noticed of the columns is said. Where the refusal names the one setup
    that is wrong, nothing else is sought. Of very many rows a part is tried.
    """
    if isinstance(refusal, TooFewReadingsError):
        return _with_files(refusal, campaign)
    if isinstance(refusal, MistakenAxesError | TooManyRowsError):
        return refusal
    mistaken = _mistaken_axes(campaign, problem_of)
    if mistaken is not None:
        return MistakenAxesError(f"the readings contradict the machine file: {mistaken}")
    blank = blank_rows(campaign)
    if blank and _fits_without(campaign, blank, problem_of):
        return _with_sentences(refusal, tuple(blank_words(blank)))
    seen_at_import = (
        *exchanged_columns(campaign), *still_columns(campaign), *plate_doubts(campaign), *tracker_doubts(campaign),
    )  # fmt: skip
    if seen_at_import:
        return _with_sentences(refusal, seen_at_import)
    return _with_changes(refusal, campaign, problem_of, blank)


def _with_changes(
    refusal: DataError,
    campaign: Campaign,
    problem_of: Callable[[Campaign], ChainProblem],
    blank: Collection[tuple[int, int]],
) -> DataError:
    """The refusal with the changes that would let the readings fit; without one, with the runs whose plan is why."""
    # Loaded here: only readings that contradict the file need the search.
    from monitor.discovery import find_late_rows_without_fit, find_mistakes, find_still_axes, only_misread
    from monitor.reporting.machine_finding import mistake_sentence
    from monitor.workflow.explain.machine_answer import mistakes_found

    _, part = next(parts_of(campaign))
    late = find_late_rows_without_fit(part, problem_of)
    if late:
        return _with_sentences(refusal, (mistake_sentence(mistakes_found(late)),))
    misread = only_misread(part, problem_of)
    if misread is not None and f"setup {misread} " in str(refusal):
        return refusal
    mistakes = find_mistakes(part, problem_of, None) or find_still_axes(part, problem_of)
    named: tuple[str, ...] = ()
    if blank and not mistakes:
        # The two hide each other: no column is enough while the zeros stand, nor are they while the column does.
        mistakes, named = find_mistakes(_without(part, blank), problem_of, None), tuple(blank_words(blank))
    # A refusal that names an error of a run says what is wrong with it; how many poses it has does not.
    is_lost = _names_no_reading(refusal) and isinstance(refusal, NotConvergedError)
    if is_lost and not any(mistake.enough for mistake in mistakes):
        poor = refusal_of_poor_runs(campaign, problem_of)
        if poor is not None:
            return _with_files(poor, campaign)
    if mistakes:
        return _with_sentences(refusal, (*named, mistake_sentence(mistakes_found(mistakes))))
    return _with_plan(refusal, campaign, problem_of)


def _with_plan(
    refusal: DataError, campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]
) -> DataError:
    """The refusal with what its plan and the import say of it, where no change is enough."""
    names_no_reading = _names_no_reading(refusal)
    by_plan = (
        *(standing_still(campaign, problem_of) if names_no_reading else ()),
        *(
            hardly_told(campaign, problem_of)
            if names_no_reading and isinstance(refusal, NotConvergedError)
            else ()
        ),
    )
    said = (*by_plan, *column_doubts(campaign, tool_frames(campaign)))
    return _with_sentences(refusal, said) if said else refusal


def _names_no_reading(refusal: DataError) -> bool:
    """Whether a refusal blames no reading first."""
    return "First look at" not in str(refusal)


def _with_files(refusal: TooFewReadingsError, campaign: Campaign) -> DataError:
    """The refusal of too few readings with the files from which rows of runs are to be removed, where that helps."""
    if not refusal.by_run:
        return refusal
    its = "its" if len(refusal.by_run) == 1 else "their"
    files = dict.fromkeys((runs_in(campaign), rows_in(campaign)))
    return TooFewReadingsError(
        f"{refusal}: remove {its} rows from {' and '.join(files)}, withdraw the campaign and import it again",
        refusal.by_run,
        refusal.undetermined,
    )


def _mistaken_axes(campaign: Campaign, problem_of: Callable[[Campaign], ChainProblem]) -> str | None:
    """What the positions say of signs, columns and units of the axes before any fit; None where nothing."""
    try:
        return problem_of(campaign).mistaken_axes()
    except MonitorError:
        return None


def _fits_without(
    campaign: Campaign, rows: Collection[tuple[int, int]], problem_of: Callable[[Campaign], ChainProblem]
) -> bool:
    """Whether a machine of the file fits a campaign without some rows, each a run and a sequence number."""
    try:
        with np.errstate(all="ignore"):
            solve_problem(problem_of(_without(campaign, rows)))
    except (MonitorError, np.linalg.LinAlgError):
        return False
    return True


def _without(campaign: Campaign, rows: Collection[tuple[int, int]]) -> Campaign:
    """A campaign without some rows, each a run and a sequence number."""
    probings = campaign.probings
    pairs = zip(probings.run.tolist(), probings.sequence.tolist(), strict=True)
    others = np.array([pair not in rows for pair in pairs])
    return replace(campaign, probings=probings.rows(others))


def _with_sentences(refusal: DataError, said: Sequence[str]) -> DataError:
    return DataError(". ".join((str(refusal), *(sentence[0].upper() + sentence[1:] for sentence in said))))
