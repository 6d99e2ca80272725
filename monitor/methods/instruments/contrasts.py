"""What a setup, or all setups of an instrument, say against all others together.

E_n compares two instruments in one parameter that each of them determines alone. A setup that was read with another
sign contradicts the others in everything that they share, and the setups of its own instrument too. So the readings are
fitted once together and once in two parts, and what the joint fit leaves more is judged at once (G. C. Chow, Tests of
equality between sets of coefficients in two linear regressions, Econometrica 28 (1960) 591). Where the readings of a
setup, fitted by themselves, scatter more than it states, their own scatter counts, with its degrees of freedom; the
distance of parts that scatter differently has those of K. Krishnamoorthy and J. Yu, Stat. Probab. Lett. 66 (2004) 161,
eq. 2.5 and 2.6. Less scatter never makes it surer.

Where one is wrong, the others agree without it: whoever has that alone is the one. What several setups have in common
and is known beforehand (the length of a bar) may be the wrong one as well: without it the setups agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy

from monitor.methods.chain.least_squares import Solution, inverse_of_full_rank, space_of_run
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.run_rows import RunRows, instruments_of, run_rows
from monitor.methods.instruments.shares import scatter_of
from monitor.methods.instruments.sides import Block, Sides, basis_of
from monitor.methods.method import Contrast, ContrastKind, SetupScatter
from monitor.records import Array

#: Below this p, of all comparisons and of its own, something is doubtful enough to ask who is wrong: a tenth of the
#: campaigns without fault are asked.
ASKED = 0.1
#: Below this p others contradict each other, however doubtful something has to be for whoever asks.
CERTAIN = 1e-6


def contrasts(
    problem: ChainProblem, solution: Solution, run: int, white: Callable[[Array], Array] | None = None
) -> tuple[Contrast, ...]:
    """What every setup and every instrument of several setups says against all others, in a run; ``white`` takes out
    of numbers (..., R, N) what neighbours share."""
    at = run_rows(problem, solution, run)
    return contrasts_of(at if white is None else at.made_independent(white))


def contrasts_of(at: RunRows) -> tuple[Contrast, ...]:
    """What every setup and every instrument of several setups says against all others."""
    sides = Sides(at, _blocks(at))
    units, among = _units(at, sides.blocks), frozenset(sides.blocks)
    every = [*_against_others(sides, units, among)]
    if comparisons_of(every) * min((each.p for each in every), default=1.0) > ASKED:
        return tuple(every)
    # Whoever contradicts all most surely does so without most of them as well.
    in_order = {each.name: units[each.name] for each in sorted(every, key=lambda each: (each.p, -each.size))}
    return tuple(
        _with_others(sides, in_order | units, each, among - each.members) if each.p < ASKED else each
        for each in every
    )


def contrast(problem: ChainProblem, solution: Solution, run: int, name: str) -> Contrast | None:
    """What the setup or instrument ``name`` says against all others in a run, without who else contradicts; None where
    they share nothing."""
    at = run_rows(problem, solution, run)
    sides = Sides(at, _blocks(at))
    mine, every = _units(at, sides.blocks).get(name, frozenset()), frozenset(sides.blocks)
    return _apart(sides, name, mine, every - mine) if mine and mine < every else None


def scatters(problem: ChainProblem, solution: Solution, run: int) -> tuple[SetupScatter, ...]:
    """What the readings of every setup of a run scatter, fitted by themselves, over what it states."""
    at = run_rows(problem, solution, run)
    return tuple(
        SetupScatter(setup, float(np.sqrt(block.remaining / block.numbers)), _least(block), block.numbers)
        for setup, block in _blocks(at).items()
        if block.numbers >= 1.0
    )


def _least(block: Block) -> float:
    """How often chance alone leaves so little of readings that scatter as stated."""
    return float(scipy.special.chdtr(block.numbers, block.remaining))


def _blocks(at: RunRows) -> dict[str, Block]:
    """The setups that read something in the run, and what several of them have in common that is known beforehand."""
    blocks: dict[str, Block] = {}
    shared = {
        name: rows
        for name, (rows, setups) in at.shared_beforehand().items()
        if sum(bool(at.is_read[at.of_setups((setup,))].any()) for setup in setups) > 1
    }
    apart = np.concatenate([np.zeros(0, dtype=np.int64), *shared.values()])
    for part in at.problem.parts:
        read = at.of_setups((part.id,))
        read = read[at.is_read[read]]
        if not len(read):
            continue
        prior = at.known_of((part.id,))
        rows = np.concatenate([read, prior[~np.isin(prior, apart)]])
        basis = basis_of(at.jacobian[rows], at.separated(rows))
        remaining = at.residual[rows] - basis @ (basis.T @ at.residual[rows])
        numbers = len(read) - float(np.sum(basis[: len(read)] ** 2))
        square, freedom = scatter_of(remaining[: len(read)], numbers)
        blocks[part.id] = Block(
            rows,
            float(remaining[: len(read)] @ remaining[: len(read)]),
            numbers,
            float(np.sqrt(square)),
            freedom,
        )
    return blocks | {name: Block(rows, 0.0, 0.0, 1.0, float("inf")) for name, rows in shared.items()}


def _units(at: RunRows, blocks: Mapping[str, Block]) -> dict[str, frozenset[str]]:
    """What may be wrong together, by name: every setup, every instrument that has several, what is known beforehand."""
    units = {name: frozenset({name}) for name in blocks}
    shared = at.shared_beforehand()
    for name, setups in instruments_of(at.problem).items():
        of_it = {what for what, (_, of) in shared.items() if of <= set(setups)}
        mine = frozenset({*setups, *of_it} & blocks.keys())
        if len(mine) > 1:
            units.setdefault(name, mine)
    return units


def _against_others(
    sides: Sides, units: Mapping[str, frozenset[str]], among: frozenset[str]
) -> Iterator[Contrast]:
    """Every unit against the others ``among`` setups, where they share something."""
    for name, mine in units.items():
        contrast = _apart(sides, name, mine, among - mine) if mine < among else None
        if contrast is not None:
            yield contrast


def _with_others(
    sides: Sides, units: Mapping[str, frozenset[str]], contrast: Contrast, others: frozenset[str]
) -> Contrast:
    """A contrast with how many comparisons the ``others`` have left without it, and what these say; as it is where they
    contradict each other for certain."""
    most = sum(mine < others for mine in units.values())
    within = []
    for each in _against_others(sides, units, others):
        if most * each.p < CERTAIN:
            return contrast
        within.append(each)
    count = comparisons_of(within)
    # Others that share nothing cannot contradict each other.
    least = min((count * each.p for each in within), default=1.0)
    return replace(contrast, others_left=count, others_p=min(1.0, least))


def comparisons_of(every: Sequence[Contrast]) -> int:
    """How many comparisons so many contrasts of the same setups are: one side against the other is one."""
    whole = frozenset(member for each in every for member in each.members)
    return len({frozenset({each.members, whole - each.members}) for each in every})


def _apart(sides: Sides, name: str, mine: frozenset[str], others: frozenset[str]) -> Contrast | None:
    """What the unit ``name`` says against others; None where they share nothing."""
    # What the whole run separates these rows may show by products of errors alone: no direction of a common fit.
    unknowns = sides.separated(mine | others).unknowns
    bases = [sides.basis(side) for side in (mine, others)]
    within = np.vstack(
        [
            basis.T @ (sides.jacobian(side) @ unknowns)
            for side, basis in zip((mine, others), bases, strict=True)
        ]
    )
    differ = _unreached(within)
    directions = differ.shape[1]
    if directions == 0:
        return None
    first, second = bases
    moved = np.vstack([first @ differ[: first.shape[1]], second @ differ[first.shape[1] :]])
    residual = np.concatenate([sides.residual(mine), sides.residual(others)])
    freedom = _freedom([*sides.counts(mine), *sides.counts(others)], moved)
    square = float(np.sum((moved.T @ residual) ** 2))
    size, p = float(np.sqrt(square / directions)), _p(square, directions, freedom)
    stated = sides.at.shared_beforehand()
    setups = sorted(
        setup for member in mine for setup in (stated[member][1] if member in stated else {member})
    )
    kind = ContrastKind.STATED if name in stated else ContrastKind.SETUP
    if len(mine) > 1:
        kind = ContrastKind.INSTRUMENT
    return Contrast(name, kind, tuple(dict.fromkeys(setups)), mine, directions, size, freedom, p)


def _unreached(columns: Array) -> Array:
    """Orthonormal directions (m, d) that nothing in the span of columns (m, r) reaches."""
    length, rank = np.linalg.norm(columns, axis=0), columns.shape[1]
    whole, triangle = np.linalg.qr(columns / np.where(length > 0.0, length, 1.0), mode="complete")
    if inverse_of_full_rank(triangle[:rank]) is None:
        space = space_of_run(columns)
        rank = space.rank
        whole, _ = np.linalg.qr(space.basis[:, :rank], mode="complete")
    return np.asarray(whole[:, rank:])


def _freedom(ordered: Sequence[tuple[int, float]], moved: Array) -> float:
    """The degrees of freedom of a distance whose parts (q, q) of the covariance, together 1, are by own scatter;
    ``ordered`` are the rows of each block and the degrees of freedom of its scatter."""
    directions, inverse, first = moved.shape[1], 0.0, 0
    for rows, freedom in ordered:
        share = moved[first : first + rows]
        first += rows
        if np.isfinite(freedom):
            part = share.T @ share
            inverse += (float(np.sum(part**2)) + float(np.trace(part)) ** 2) / freedom
    return (directions + directions**2) / inverse if inverse > 0.0 else float("inf")


def _p(square: float, directions: int, freedom: float) -> float:
    """How often chance makes a squared distance as large: Hotelling's where scatter is by the readings themselves."""
    if not np.isfinite(freedom):
        return float(scipy.special.chdtrc(directions, square))
    rest = freedom - directions + 1.0
    return (
        1.0
        if rest <= 0.0
        else float(scipy.special.fdtrc(directions, rest, square * rest / (freedom * directions)))
    )
