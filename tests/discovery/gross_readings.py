"""Campaigns with one reading wrong by a known amount, for the test and the trial of gross readings; loaded by path."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from monitor.records import Campaign


def with_wrong_reading(campaign: Campaign, row: int, axis: str, off_mm: float) -> Campaign:
    """The campaign with the reading of an ``axis`` at a ``row`` off by so many millimetres."""
    probings = campaign.probings
    readings = dict(probings.readings)
    readings[axis] = readings[axis].copy()
    readings[axis][row] += off_mm
    return replace(campaign, probings=replace(probings, readings=readings))


def along_normal(campaign: Campaign, problem: Any, row: int) -> str:
    """The linear axis whose reading a touch along a normal notices most: by a numeric step of 1 µm."""
    best, most = "", -1.0
    before = problem.vectors(problem.start, problem.common_start)[row]
    for axis in campaign.probings.readings:
        if not campaign.machine.is_linear(axis):
            continue
        positions = problem.context.positions.copy()
        positions[row, problem.context.chain.index(axis)] += 1e-3
        moved = replace(problem, context=replace(problem.context, positions=positions))
        change = float(abs(moved.vectors(problem.start, problem.common_start)[row] - before).max())
        if change > most:
            best, most = axis, change
    return best
