"""A curve that no single shape of the catalogue follows: one error table instead of several shapes of one error.

A bump of a guideway is found as a cube, then a square, then cycles that mend what is left. Where a search has found
several effects, tables of the errors among them are tried in their place; a table leads if it says more, given
what else stands beside it, than all of them at the price of their coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.evidence import weigh
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.discovery.machine.visible import SMALLEST_SHARE, Candidate, Variant, Visible, see
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import Always
from monitor.effects.shapes import nodes_text
from monitor.machine import MOTION
from monitor.records import Array
from monitor.units import DEGREE

# Nodes of the tables that are tried.
NODES = (5, 7, 9, 13)
# A curve needs more places than nodes, or it follows the noise of each.
PLACES_A_NODE = 2
# Places closer than this, in mm or degrees, are one.
SAME_PLACE = 0.5
# So many tables of one campaign at most, and so many tried for each.
MOST_TABLES, MOST_TRIED = 2, 3

#: Scans what is visible.
Scan = Callable[[Visible], ScanResult]


def _error(candidate: Candidate) -> str | None:
    """The error motion that a candidate is a shape of; None for others, and for what follows a driver."""
    effect = candidate.variant.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.driver, Always):
        return None
    return effect.term.symbol if effect.term.stage == MOTION and effect.joint.kind != "spindle" else None


def table_variants(fit: Fit, visible: Visible, chosen: Sequence[Candidate]) -> list[Variant]:
    """Tables of the errors of which ``chosen`` has shapes; their ends are held at zero where the base or the plan
    leaves nothing of a constant and a slope."""
    context = fit.problem.context
    sloping = {one.family for one in visible.candidates if one.share > SMALLEST_SHARE}
    found = []
    for symbol in dict.fromkeys(name for one in chosen if (name := _error(one)) is not None):
        effect = next(one.variant.effect for one in chosen if _error(one) == symbol)
        assert isinstance(effect, ChainEffect)
        joint = effect.joint
        reading = joint.sign * context.places[:, effect.term.joint] / (DEGREE.factor if joint.turns else 1.0)
        places = len(np.unique(np.round(reading / SAME_PLACE)))
        low, high = np.floor(reading.min()), np.ceil(reading.max())
        for count in NODES:
            if places < PLACES_A_NODE * count:
                break
            nodes = np.round(np.linspace(low, high, count), 1)
            held = nodes[:1] if f"{symbol}:poly1" in sloping else nodes[[0, -1]]
            text = f"{symbol}:{nodes_text(nodes, held)}"
            found.append(Variant(f"{symbol}:table", parse_effect(text, context.chain), len(NODES)))
    return found


def _stack(visible: Visible, chosen: Sequence[Candidate]) -> Array:
    return np.concatenate([visible.added, *(one.columns for one in chosen)], axis=1)


def _score(visible: Visible, chosen: Sequence[Candidate]) -> float:
    """What effects say together, one after the other."""
    return sum(
        weigh([one], visible.residual, _stack(visible, chosen[:place]), visible.degrees_of_freedom)[0].score
        for place, one in enumerate(chosen)
    )


def _promising(visible: Visible, tables: Sequence[Candidate], chosen: Sequence[Candidate]) -> list[Candidate]:
    """Of every error the table that says most more than its chosen shapes, as if there were nothing else."""
    best: dict[str | None, tuple[float, Candidate]] = {}
    for table in tables:
        shapes = [one for one in chosen if _error(one) == _error(table)]
        gain = _score(visible, [table]) - _score(visible, shapes)
        if gain > max(best.get(_error(table), (0.0, table))[0], 0.0):
            best[_error(table)] = gain, table
    return [table for _, table in sorted(best.values(), key=lambda one: -one[0])][:MOST_TRIED]


def with_tables(fit: Fit, visible: Visible, result: ScanResult, scan: Scan) -> tuple[Visible, ScanResult]:
    """The result with tables in the place of several effects, where they say more."""
    for _ in range(MOST_TABLES):
        chosen = [one.candidate for one in result.findings]
        tables = see(fit, table_variants(fit, visible, chosen)).candidates if len(chosen) > 1 else ()
        # What one error does looks like others' at the places where they are alike: each is tried to its end.
        best, worth = None, _score(visible, chosen) + WORTH_EXCHANGING
        for table in _promising(visible, tables, chosen):
            beside = scan(replace(visible, added=_stack(visible, [table])))
            more = [table, *(one.candidate for one in beside.findings)]
            if len(more) < len(chosen) and _score(visible, more) > worth:
                best, worth = (more, beside.remaining), _score(visible, more)
        if best is None:
            break
        visible = replace(visible, candidates=(*visible.candidates, *tables))
        result = ScanResult(findings_of(visible, best[0]), best[1])
    return visible, result
