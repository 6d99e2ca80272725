"""The problem of a campaign of instruments under a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.effects import (
    ArtefactEffect,
    Context,
    InstrumentEffect,
    ParsedEffect,
    context_of,
)
from monitor.exceptions import DataError, EffectError
from monitor.machine import Chain, evaluate
from monitor.methods.instruments.base import instrument_base
from monitor.methods.instruments.frames import refuse_other_sizes
from monitor.methods.instruments.ideal_rows import ideal_rows
from monitor.methods.instruments.part import Part, scale_id_of, tool_id_of
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.reading import LEVER, Reading, Rows, in_mm
from monitor.methods.instruments.readings import readings
from monitor.methods.instruments.readings.direction import Direction
from monitor.methods.instruments.readings.point import Point
from monitor.methods.instruments.turned_beyond import turned_beyond
from monitor.methods.model import Model, chain_of
from monitor.records import Array, Campaign, Setup
from monitor.sources import SCALE

NAME = "instruments"
DEFAULT_MODEL = Model(NAME)
#: The column of a row's setup, counted from 1 in the order of the file, and those of a row's own uncertainty.
SETUP, U_LENGTH, U_ANGLE = "setup", "u_um", "u_urad"


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> InstrumentProblem:
    """The least-squares problem of a campaign: every number with the standard uncertainty of its row, or else that of
    its setup.

    Raises DataError where no setup is described or one was never used, EffectError for effects of an artefact.
    """
    setups = campaign.artefact.setups
    if not setups:
        raise DataError(f"campaign {campaign.name} has no [[setups]]; the method {NAME} needs one or more")
    chain = chain_of(campaign.machine)
    context = context_of(campaign, chain)
    number = campaign.probings.channels[SETUP].astype(np.int64) - 1
    parts = _parts(campaign, chain, context, number)
    used = tuple(setups[index] for index in np.unique(number))
    texts = replace(model, base=model.base or instrument_base(chain, used))
    # A level alone sees no location error: then no effect is free in every run.
    base = texts.base_of(chain) if texts.base else ()
    added = texts.added_to(chain)
    _refuse_artefact((*base, *added))
    ratios = {name: axis.gear_ratio for name, axis in campaign.machine.axes.items()}
    context = replace(context, sight=_sight(setups, number), nominal=_places(context, parts))
    context = replace(context, instruments=ideal_rows(context, parts))
    context = replace(context, set_up=set_ups(context, number))
    context = replace(context, approach=turned_beyond(context, parts))
    absent = _absent(context, added)
    problem = InstrumentProblem(
        context=context,
        base=base,
        added=tuple(effect for effect in added if effect.text not in absent),
        sigma=_sigma(context, setups, number, parts),
        parts=parts,
        setups=used,
        gear_ratios=tuple((name, ratio) for name, ratio in ratios.items() if ratio is not None),
        # A bar that is stated with its uncertainty is one bar in the whole campaign, however many days that takes.
        shares_bars=True,
        absent=tuple(absent.items()),
    )
    return problem.foreseen() if problem.added else problem


def set_ups(context: Context, number: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The number (n,) in its run of what was measured between two set-ups: whoever sets up the next instrument
    (``number`` (n,) of the setup of each row) moves the axes by hand. Setups that are read by turns stand there
    together."""
    between = np.zeros(len(number), dtype=np.int64)
    for run in np.unique(context.run):
        rows = np.flatnonzero(context.run == run)
        changes = np.flatnonzero(np.diff(number[rows])) + 1
        # A change is for good where no setup before it comes after it.
        for at in changes.tolist():
            between[rows[at:]] += not {*number[rows[:at]]} & {*number[rows[at:]]}
    return between


def _absent(context: Context, added: tuple[ParsedEffect, ...]) -> dict[str, str]:
    """The effects of instruments that measured nothing here, and why: a model holds for every campaign of a machine,
    whatever it was measured by."""
    reasons = {}
    for effect in added:
        if isinstance(effect, InstrumentEffect):
            try:
                effect.change.setups(context)
            except EffectError as error:
                reasons[effect.text] = str(error)
    return reasons


def _parts(
    campaign: Campaign, chain: Chain, context: Context, number: npt.NDArray[np.int64]
) -> tuple[Part, ...]:
    """Every setup that has rows. The outer frame of the first direction is the machine's; another one floats."""
    runs = np.searchsorted(np.unique(context.run), context.run)
    parts: list[Part] = []
    for index in np.unique(number):
        setup = campaign.artefact.setups[index]
        kind = readings()[setup.reading]
        at = np.flatnonzero(number == index)
        rows = Rows(
            chain=chain,
            run=runs[at],
            target=context.target[at],
            measured=np.column_stack([_column(context, name)[at] for name in kind.columns]),
            positions=context.positions[at],
            nominal=context.nominal[at],
            elapsed=_elapsed(context.time[at], runs[at]),
            guess=np.zeros((len(at), 0)),
        )
        reading: Reading
        reading, rows = kind.of(setup, rows)
        if isinstance(reading, Direction) and "frame" not in setup.known:
            floating = any(isinstance(part.reading, Direction) for part in parts)
            reading = replace(reading, floating=floating)
        if isinstance(reading, Point) and not reading.plane:
            refuse_other_sizes(rows, np.array(reading.places), setup.id)
        drift = setup.drift_uncertainty
        if drift is not None:
            _refuse_one_moment(campaign, setup, rows)
            drift *= LEVER if kind.angular else 1.0
        parts.append(
            Part(
                id=setup.id,
                reading=reading,
                rows=rows,
                at=at,
                instrument=setup.instrument or "",
                drift=drift,
                tool_point=setup.tool_point_uncertainty,
                tool_id=tool_id_of(setup),
                scale=None if SCALE in setup.known else setup.scale_uncertainty,
                scale_id=scale_id_of(setup),
            )
        )
    return tuple(parts)


def _elapsed(time: Array, run: npt.NDArray[np.int64]) -> Array:
    """The times (m,) from 0 at the first row of their run to 1 at the last; 0 where all rows have one time."""
    elapsed = np.zeros(len(time))
    for number in np.unique(run):
        of_run = run == number
        since = time[of_run] - time[of_run].min()
        elapsed[of_run] = since / max(float(since.max()), np.finfo(np.float64).tiny)
    return elapsed


def _refuse_one_moment(campaign: Campaign, setup: Setup, rows: Rows) -> None:
    """DataError where rows of a setup that drifts all have one time."""
    if len(rows) > 1 and not rows.elapsed.any():
        raise DataError(
            f"campaign {campaign.name}, setup {setup.id}: it states a drift, and all its rows have the same time_s; "
            "write when each row was measured, or leave the drift out"
        )


def _places(context: Context, parts: tuple[Part, ...]) -> Array:
    """Where people look for a row (n, 3) mm in the frame of the last work axis: the tool point of a machine without
    errors, of a direction its end at one metre."""
    places = context.nominal.copy()
    for part in parts:
        if isinstance(part.reading, Direction):
            places[part.at] = LEVER * part.reading.pointed(part.rows)
            continue
        start = part.reading.start(1)[np.zeros(len(part.at), dtype=np.int64)]
        work, tool = part.reading.ends(start, part.rows)
        none = np.zeros((len(part.at), len(context.chain.joints), 2, 6))
        places[part.at] = evaluate(context.chain, part.rows.positions, none, work, tool).residual + work
    return places


def _column(context: Context, name: str) -> Array:
    """A column in mm (a component of a direction as it is); NaN where it is empty or not there."""
    values = context.columns.get(name, np.full(len(context), np.nan))
    return in_mm(name, values)


def _sigma(
    context: Context, setups: tuple[Setup, ...], number: npt.NDArray[np.int64], parts: tuple[Part, ...]
) -> Array:
    """Standard uncertainty (n, d) in mm of every number; infinite where a row has none."""
    sigma = np.full((len(context), max(len(part.reading.numbers) for part in parts)), np.inf)
    for part in parts:
        setup, kinds = setups[number[part.at[0]]], len(part.reading.numbers)
        angular = part.reading.angular
        u = np.tile(_u(context, part, setup.standard_uncertainty, angular=angular)[:, None], kinds)
        turns = kinds - part.reading.turns
        u[:, turns:] = _u(context, part, setup.turn_uncertainty, angular=True)[:, None]
        read = np.isfinite(part.rows.measured)
        # Of a direction all three components together make two numbers; of a pose all seven make six.
        read = read[:, :kinds] & (
            read.all(axis=1, keepdims=True) if part.rows.measured.shape[1] > kinds else True
        )
        sigma[part.at, :kinds] = np.where(read, u, np.inf)
    return sigma


def _u(context: Context, part: Part, stated: float | None, *, angular: bool) -> Array:
    """Standard uncertainty (m,) in mm of the lengths or angles of a setup: of the row, else as ``stated``."""
    of_rows = _column(context, U_ANGLE if angular else U_LENGTH)[part.at]
    return np.where(np.isfinite(of_rows), of_rows, (stated or np.nan) * (LEVER if angular else 1.0))


def _sight(setups: tuple[Setup, ...], number: npt.NDArray[np.int64]) -> Array | None:
    """Where the tool points (n, 3) in the frame of the last tool axis: as each setup says it, else as the first one
    that does; None where none does."""
    stated = [setup.tool_direction for setup in setups if setup.tool_direction is not None]
    if not stated:
        return None
    of_setups = np.array([setup.tool_direction or stated[0] for setup in setups])
    sight: Array = of_setups[number]
    return sight


def _refuse_artefact(effects: tuple[ParsedEffect, ...]) -> None:
    for effect in effects:
        if isinstance(effect, ArtefactEffect):
            raise EffectError(
                f"'{effect.text}' is a change of targets that are touched or tracked; the readings of the method "
                f"{NAME} have none. Effects of axes, flexure:... and sight:... are possible"
            )
