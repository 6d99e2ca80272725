"""What hangs on tool points and scales that are taken as they are stated.

The tool point of a sphere that goes round with a table tells where the table's axis is: stated 0.1 mm beside it, the
axis comes out 0.1 mm beside it, and no reading shows that (``EX0B``, ``EZ0B`` of a table; along the axis of a head that
turns ``EX0B`` alone). Where the setup states how well the point is known, u holds that; where it does not, the numbers
are those of the stated point, and whoever reads them is told which.

The scale of a laser (of a tracker, a camera, a CMM) likewise (``exact_scales``).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace

import numpy as np

from monitor.methods.chain.exact_scales import exact_scales
from monitor.methods.chain.identification import AsStated
from monitor.methods.chain.least_squares import MEMBER_SHARE, eliminate
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.part import TOOL_POINT, Part, exact_scale_of
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.records import FROM_TOOL_POINT, Array

#: What readings show of a coordinate of a tool point beside free errors is more than this part, or rounding.
SHOWN = 1e-6


def as_stated(problem: ChainProblem) -> tuple[AsStated, ...]:
    """The tool points without a stated uncertainty that move numbers, with the errors that do the same as each
    coordinate, and the scales without one, with the errors that they move, on a machine without errors."""
    assert isinstance(problem, InstrumentProblem)
    return (*_tool_points(problem), *_scales(problem))


def _tool_points(problem: InstrumentProblem) -> tuple[AsStated, ...]:
    groups = _groups(problem.parts)
    if not groups:
        return ()
    group_of = {setup: group for group in groups for setup in group}
    parts = tuple(
        replace(part, tool_point=1.0, tool_id=group_of[part.id]) if part.id in group_of else part
        for part in problem.parts
    )
    wider = replace(problem, parts=parts, is_whole=True, separated=None, from_others=None)
    at = wider.linearise(wider.start, wider.common_start)
    readings = at.local.shape[1] - len(wider.extra_names)
    beforehand = {len(wider.base_names) + wider.own_names.index(name) for name in wider.extra_names}
    free = [index for index in range(at.local.shape[2]) if index not in beforehand]
    columns = np.concatenate([at.local[:, :readings, free], at.common[:, :readings]], axis=2)
    stated = (
        AsStated(_label(problem.parts, group), group, _moved(wider, group, columns, at.local[:, :readings]))
        for group in groups
    )
    return tuple(each for each in stated if each.moved)


def _scales(problem: InstrumentProblem) -> Iterator[AsStated]:
    """The scales that are taken as exact, with what each moves: the fit with what is known beforehand of all others."""
    exact = {setup.id: exact_scale_of(setup) for setup in problem.setups if setup.takes_scale}
    groups = {
        name: tuple(part.id for part in problem.parts if len(part.at) and exact.get(part.id) == name)
        for name in dict.fromkeys(exact.values())
    }
    lengths = {}
    for name, group in groups.items():
        if group:
            read = np.zeros_like(problem.sigma)
            for part in problem.parts:
                if part.id in group:
                    read[part.at, : part.lengths().shape[1]] = part.lengths()
            lengths[name] = group, read
    return exact_scales(problem, lengths)


def _moved(
    wider: InstrumentProblem, group: tuple[str, ...], columns: Array, by_local: Array
) -> dict[str, tuple[str, ...]]:
    """The errors that move with each coordinate of the tool point of a group; ``columns`` (R, N, p) of the unknowns of
    which nothing is known beforehand, ``by_local`` (R, N, q) of all."""
    number = [part.id for part in wider.parts].index(group[0])
    moved = {}
    for axis, name in zip("xyz", TOOL_POINT, strict=True):
        column = wider.own_columns[number][wider.parts[number].unknowns.index(name)]
        by_point = by_local[:, :, len(wider.base_names) + column]
        members = (
            member
            for of_run, by_of_run in zip(columns, by_point, strict=True)
            for member in _members(wider.base_names, of_run, by_of_run)
        )
        if names := tuple(dict.fromkeys(members)):
            moved[axis] = names
    return moved


def _groups(parts: tuple[Part, ...]) -> list[tuple[str, ...]]:
    """The setups that have a tool point in common, of those that state no uncertainty of it."""
    groups: dict[Hashable, tuple[str, ...]] = {}
    for part in parts:
        if part.reading.name in FROM_TOOL_POINT and part.tool_point is None and len(part.at):
            key = part.tool_id or part.id
            groups[key] = (*groups.get(key, ()), part.id)
    return list(groups.values())


def _members(names: tuple[str, ...], columns: Array, by_point: Array) -> Iterator[str]:
    """The determined base errors that do the same as a coordinate (N,) of a tool point in one run, whose unknowns have
    the ``columns`` (N, p); none where the readings show the coordinate itself."""
    size = float(np.linalg.norm(by_point))
    if size == 0.0:
        return
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = columns / scale
    shares = np.linalg.lstsq(scaled, by_point / size, rcond=1e-9)[0]
    if np.linalg.norm(by_point / size - scaled @ shares) > SHOWN:
        return
    open_part = np.abs(eliminate(columns[None]).null_space[0][:, : len(names)]).max(axis=0, initial=0.0)
    for name, share, is_open in zip(names, shares, open_part > MEMBER_SHARE, strict=False):
        if abs(share) > SHOWN**0.5 and not is_open:
            yield name


def _label(parts: tuple[Part, ...], group: tuple[str, ...]) -> str:
    """The instrument, where the group has all of its setups; else the setups themselves."""
    one_of_them = next(part for part in parts if part.id in group)
    of_instrument = tuple(
        part.id for part in parts if part.instrument and part.instrument == one_of_them.instrument
    )
    return one_of_them.instrument if of_instrument == group else ", ".join(group)
