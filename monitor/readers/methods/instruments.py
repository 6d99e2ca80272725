"""The method ``instruments``: readings of any instruments, each row one of a setup of ``[[setups]]``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from monitor.exceptions import Fault
from monitor.readers.campaign.probings_file import SETUP
from monitor.readers.faults import quoted
from monitor.readers.method_rules import MethodRules, Plan
from monitor.readers.setups.file import FORMATS, QUATERNION, ReadingFormat
from monitor.records import Array, Setup
from monitor.units import CONDITION_SUFFIXES

U_LENGTH, U_ANGLE = "u_um", "u_urad"
DIRECTION = FORMATS["direction"].columns
PLAIN = tuple(
    dict.fromkeys((
        *(column for form in FORMATS.values() for column in form.columns),
        U_LENGTH,
        U_ANGLE,
        *(f"nominal_{axis}_mm" for axis in "xyz"),
    ))
)  # fmt: skip
# A direction typed to six decimals has length 1 to a millionth; one further off is none.
LENGTH_TOLERANCE = 1e-3


def check(plan: Plan) -> Iterable[Fault]:
    """Faults of the rows: a column or a number that a reading lacks, a direction that is none, an uncertainty that
    nobody states, a setup that was never read, an axis that there is not."""
    channels = plan.probings.channels
    if SETUP not in channels:
        return
    number = channels[SETUP].astype(np.int64) - 1
    for index, setup in enumerate(plan.artefact.setups):
        rows = np.flatnonzero(number == index)
        form = FORMATS[setup.reading]
        if not len(rows):
            # Its rows may be those that could not be read, of which each has its own fault.
            if plan.is_whole:
                message = f"setup {quoted(setup.id)} has no row in {plan.file}"
                yield Fault("campaign.toml", None, "setups", message)
            continue
        if setup.along is not None and setup.along not in plan.probings.readings:
            axes = ", ".join(plan.probings.readings)
            message = f"setup {quoted(setup.id)} travels along {quoted(setup.along)}; the axes are {axes}"
            yield Fault("campaign.toml", None, "setups", message)
        yield from _numbers(plan, setup, form, rows)
        yield from _uncertainties(plan, setup, form, rows)
        for columns, what in ((DIRECTION, "direction"), (QUATERNION, "quaternion")):
            if columns[0] in form.columns and all(column in channels for column in columns):
                yield from _of_length_one(plan, columns, what, rows)


def _numbers(plan: Plan, setup: Setup, form: ReadingFormat, rows: npt.NDArray[np.int64]) -> Iterator[Fault]:
    for column in form.columns:
        if column in form.optional:
            continue
        if column not in plan.probings.channels:
            text = f"the column is missing; setup {quoted(setup.id)} reads {', '.join(form.columns)}"
            yield Fault(plan.file, 1, column, text)
            continue
        for row in rows[np.isnan(plan.probings.channels[column][rows])][:1]:
            text = f"the cell is empty; setup {quoted(setup.id)} reads {', '.join(form.columns)} in every row"
            yield Fault(plan.file, int(plan.lines[row]), column, text)


def _uncertainties(
    plan: Plan, setup: Setup, form: ReadingFormat, rows: npt.NDArray[np.int64]
) -> Iterator[Fault]:
    needed = [(U_ANGLE if form.angular else U_LENGTH, setup.standard_uncertainty)]
    if form.turns:
        needed.append((U_ANGLE, setup.turn_uncertainty))
    for column, of_setup in needed:
        none: Array = np.full(len(plan.probings), np.nan)
        stated = plan.probings.channels.get(column, none)[rows]
        for row in rows[stated <= 0.0][:1]:
            yield Fault(
                plan.file, int(plan.lines[row]), column, "a standard uncertainty must be greater than 0"
            )
        for row in rows[np.isnan(stated)][:1] if of_setup is None else ():
            text = (
                f"nothing states the standard uncertainty of this reading; write standard_uncertainty_"
                f"{column.removeprefix('u_')} of setup {quoted(setup.id)}, or {column} in every row"
            )
            yield Fault(plan.file, int(plan.lines[row]), column, text)


def _of_length_one(
    plan: Plan, columns: tuple[str, ...], what: str, rows: npt.NDArray[np.int64]
) -> Iterator[Fault]:
    vectors = np.column_stack([plan.probings.channels[column][rows] for column in columns])
    length = np.linalg.norm(vectors, axis=1)
    for row, size in zip(rows, length, strict=True):
        if np.isfinite(size) and abs(size - 1.0) > LENGTH_TOLERANCE:
            text = f"the {what} has length {size:.6g}; a {what} has length 1"
            yield Fault(plan.file, int(plan.lines[row]), columns[0], text)


RULES = MethodRules(
    "instruments",
    needs_setups=True,
    suffixes=CONDITION_SUFFIXES,
    plain_columns=PLAIN,
    check=check,
)
