"""An error whose shape the catalogue does not have: what was found of it becomes one effect of free shape.

Where the flexible competitor of an error says more than its shapes of the catalogue, a few parts of it are selected
(``free_parts``). The free shape leads if it says more at its price and lowers the error at left-out poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.bends import bends_instead, foretells_poses, score_beside
from monitor.discovery.machine.shapes.cycles import cycle_instead
from monitor.discovery.machine.shapes.edges import edges_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    PRICE,
    in_any_shape,
    is_free,
    most_together,
    of_parts,
    of_parts_alone,
    parts_worth_keeping,
    price_of_parts,
    price_of_powers,
    priced,
    whole_basis,
    with_nearest,
)
from monitor.discovery.machine.shapes.inside_shapes import (
    LEVEL,
    bending_sight,
    standing_beside,
    with_those_outside,
)
from monitor.discovery.machine.shapes.refined_instead import refined_instead
from monitor.discovery.machine.shapes.shown_cycles import is_told
from monitor.discovery.machine.shapes.slight_shapes import (
    best_wave,
    p_value_of_all,
    slight_error,
    slight_shape,
    slight_wave,
)
from monitor.discovery.machine.shapes.steps_instead import steps_instead
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.waves import many_periods, waves_instead
from monitor.discovery.search.comparison import LACK_OF_FIT_LEVEL
from monitor.discovery.search.evidence import Pool, weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import (
    WORTH_EXCHANGING,
    ScanResult,
    by_error_taken_away,
    findings_of,
    findings_without_rivals,
)
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes.free import Free
from monitor.machine import MOTION

# An error is asked for steps where it explains in any shape such a part of what the best one does.
PROMISING = 0.5
# So many times the stated noise is an error that is missing, not a statement that is wrong.
FAR = 1.5


def _is_of_shape(candidate: ChainCandidate) -> bool:
    """Whether a candidate is an error motion of an axis that follows no driver."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and isinstance(effect.driver, Always)
        and effect.term.stage == MOTION
        and not isinstance(effect.shape, Free)
    )


def with_unknown_shapes(scene: ChainScene, result: ChainScan) -> tuple[ChainScene, ChainScan]:
    """The result with one effect of free shape instead of those of the catalogue, for every error whose shape they are
    not."""
    selected = result.candidates or _both_bends(scene)
    if selected or _lacks_something(scene) or _is_lost_sight(scene):
        scene, selected = _in_any_shapes(scene, selected)
    if not selected:
        # What all poses together show may be one wave as well, which is little of a whole free shape.
        scene, slight = _slight(scene)
        scene, selected = _in_any_shapes(scene, slight) if slight else (scene, slight)
    scene, selected = _rather_waves(scene, selected)
    if len(selected) == len(result.findings) and all(
        _is_among(shape, result.candidates) for shape in selected
    ):
        return scene, result
    return scene, ScanResult(findings_of(scene, selected))


def _in_any_shapes(
    scene: ChainScene, selected: list[ChainCandidate]
) -> tuple[ChainScene, list[ChainCandidate]]:
    """The selected effects with free shapes, waves and cycles in place of those that say less at their price."""
    scene, selected = _with_free(scene, selected)
    margin = _margin(scene, selected)
    instead = [] if margin is None else _in_place(scene, selected, margin)
    if instead:
        new = [each for each in instead if not _is_among(each, [*selected, *scene.candidates])]
        selected = instead
        scene = replace(scene, candidates=(*scene.candidates, *new))
    return _with_waves(*_with_those_outside(scene, selected))


def _with_those_outside(
    scene: ChainScene, selected: list[ChainCandidate]
) -> tuple[ChainScene, list[ChainCandidate]]:
    """The selected effects without those inside a free shape, and the scene with the shapes that came of it."""
    without = with_those_outside(scene, selected)
    for shape in without:
        if is_free(shape) and not _is_among(shape, scene.candidates):
            scene = _with_candidate(scene, shape)
    return scene, without


def _rather_waves(
    scene: ChainScene, selected: list[ChainCandidate]
) -> tuple[ChainScene, list[ChainCandidate]]:
    """The selected effects with a wave of many periods a turn, of whatever error, in place of each that says less.

    At few angles such a wave looks like one of another axis, or like a play, which the catalogue has. Where neighbours
    resemble each other noise is an estimate, and nothing is exchanged.
    """
    if not selected or scene.fit.whitening is not None or poses_of_rows(scene.fit) is not None:
        return scene, selected
    waves = [wave for shapes in _shapes_by_error(scene).values() for wave in many_periods(scene, shapes)]
    for effect in selected:
        others = [other for other in selected if other is not effect]
        score = priced(scene, [effect], others) + WORTH_EXCHANGING
        best = best_wave(scene, waves, others)
        if best is not None and best.score > score and foretells_poses(scene, [best.candidate], others):
            selected = [*others, best.candidate]
            scene = _with_candidate(scene, best.candidate)
    return scene, selected


def _with_waves(scene: ChainScene, selected: list[ChainCandidate]) -> tuple[ChainScene, list[ChainCandidate]]:
    """The selected effects with waves by their names, a cycle or steps in place of a free shape or a table."""
    for free in [shape for shape in selected if _is_any_curve(shape)]:
        others = [shape for shape in selected if shape is not free]
        shapes = [each for each in filter(_is_of_shape, scene.candidates) if error_of(each) == error_of(free)]
        if not shapes:
            continue
        score = partial(_named_or_free, scene, others)
        in_parts = partial(of_parts, scene, error_of(free), shapes=shapes, others=others)
        taken = {other.family for other in others}
        split = waves_instead(scene, free, taken, in_parts, score)
        split = split or cycle_instead(scene, free, others, score) or steps_instead(scene, free, others)
        if split and all(
            foretells_poses(scene, [wave], [*others, *split[:at]]) for at, wave in enumerate(split)
        ):
            selected = [*others, *split]
            # The whole it came from is no rival of its parts.
            without_free = [
                each
                for each in scene.candidates
                if not (_is_any_curve(each) and error_of(each) == error_of(free))
            ]
            more = [each for each in split if not _is_among(each, without_free)]
            scene = replace(scene, candidates=(*without_free, *more))
    return scene, selected


def _named_or_free(
    scene: ChainScene, others: Sequence[ChainCandidate], effects: Sequence[ChainCandidate]
) -> float:
    """The score of effects beside others, at the price of the choice of parts and of waves."""
    price_of_choices = sum(price_of_parts(effect) or 2.0 * PRICE for effect in effects)
    return score_beside(scene, effects, others) - price_of_choices


def _margin(scene: ChainScene, selected: Sequence[ChainCandidate]) -> float | None:
    """By how much one error of free shape has to say more than selected effects; None where none is asked.

    Effects of the catalogue beside which nothing stands out may still be what comes nearest to the shape of another
    error (a bump of 3 um that the second harmonic of a table follows a fifth as well): that has to be decided.
    """
    if not selected:
        return UNDECIDED
    if any(is_free(shape) for shape in selected) or _leaves_something(scene, selected):
        return WORTH_EXCHANGING
    # Over a part of a turn flexure and refraction bend as any shape does, where they leave nothing; of a single night
    # no other says what is a shape.
    problem = scene.fit.problem
    if problem.needs_whole_periods and len(problem.runs) == 1 and not _far_from_noise(scene, selected):
        return None
    return UNDECIDED


def _far_from_noise(scene: ChainScene, selected: Sequence[ChainCandidate]) -> bool:
    """Whether selected effects leave more than the stated noise, by a factor that no statement is wrong by."""
    beside = scene.remainders.beside(selected)
    return bool(beside.residual @ beside.residual > FAR**2 * beside.degrees_of_freedom)


def _with_free(scene: ChainScene, selected: list[ChainCandidate]) -> tuple[ChainScene, list[ChainCandidate]]:
    """The selected effects with one of free shape for each error whose shapes of the catalogue are not the whole."""
    for symbol in dict.fromkeys(map(error_of, filter(_is_of_shape, selected))):
        mine = [shape for shape in filter(_is_of_shape, selected) if error_of(shape) == symbol]
        others = [shape for shape in selected if not _is_among(shape, mine)]
        free = _free(scene, symbol, mine, others)
        if free is not None:
            price = 2.0 * free.columns.shape[1] * PRICE
            bends = bends_instead(scene, symbol, score_beside(scene, [free], others) - price, others)
            selected = [*others, *(bends or [free])]
            scene = scene if bends else _with_candidate(scene, free)
        elif (single := refined_instead(scene, mine, others)) is not None:
            selected, scene = [*others, single], _with_candidate(scene, single)
    return scene, selected


def _is_among(candidate: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    """Whether a candidate is the same object as one of the others: their columns are arrays, which do not compare."""
    return any(candidate is other for other in others)


def _both_bends(scene: ChainScene) -> list[ChainCandidate]:
    """Flexure and refraction where a sight is lost that both bend: one of them takes back most of what the other does,
    and neither stands alone."""
    bends = bending_sight(scene) if _is_lost_sight(scene) else []
    both = len(bends) > 1 and all(
        standing_beside(scene, [other], [bend]) for bend, other in zip(bends, bends[::-1], strict=True)
    )
    return bends if both and foretells_poses(scene, bends, []) else []


def _lacks_something(scene: ChainScene) -> bool:
    """Whether the runs agree on what the model leaves, although no effect of the catalogue stands out."""
    test, _ = lack_of_fit(scene.fit)
    return test is not None and test.p_value < LACK_OF_FIT_LEVEL


def _is_lost_sight(scene: ChainScene) -> bool:
    """Whether what points somewhere is far from its noise, in a night that repeats no pose and shows no lack of fit."""
    problem = scene.fit.problem
    is_pointing = problem.needs_whole_periods and problem.context.sight is not None
    return is_pointing and _far_from_noise(scene, [])


def _leaves_something(scene: ChainScene, selected: Sequence[ChainCandidate]) -> bool:
    """Whether some candidate stands out beside selected effects: a scan that ends so was led astray by one of them."""
    pool = [candidate for candidate in scene.candidates if candidate.visible]
    weighed = weigh_beside(scene, pool, selected)
    return bool(weighed) and weighed[0].p_value * scene.families < LEVEL


def _is_any_curve(candidate: ChainCandidate) -> bool:
    """Whether an effect follows any curve: a free shape or an error table."""
    return is_free(candidate) or candidate.family.endswith(":table")


def _slight(scene: ChainScene) -> tuple[ChainScene, list[ChainCandidate]]:
    """One part of an error of free shape, or one wave of many periods a turn, that stands out and predicts poses and
    runs that were left out, or an error that does so in several parts, if any; and the scene with it, with all such
    waves of its error where it is one."""
    shapes = _shapes_by_error(scene)
    if not shapes:
        return scene, []
    wholes = [in_any_shape(symbol, of[0]) for symbol, of in shapes.items()]
    part = slight_shape(scene, wholes)
    waves = [wave for of in shapes.values() for wave in many_periods(scene, of)]
    wave = slight_wave(scene, waves)
    if wave is not None and (part is None or wave.p_value <= part.p_value):
        slight = waves[wave.number]
        more = [other for other in waves if error_of(other) == error_of(slight) and other.visible]
    elif part is not None:
        slight = of_parts(scene, part.family, [part.number], shapes[part.family], [])
        more = [slight]
    else:
        symbol = slight_error(scene, wholes)
        return (scene, []) if symbol is None else _in_several_parts(scene, symbol, shapes[symbol])
    if not _predicts_runs(scene, slight) or not foretells_poses(scene, [slight], []):
        return scene, []
    return replace(scene, candidates=(*scene.candidates, *more)), [slight]


def _in_several_parts(
    scene: ChainScene, symbol: str, shapes: Sequence[ChainCandidate]
) -> tuple[ChainScene, list[ChainCandidate]]:
    """An error as several powers of the position where these say as much as its free shape, else in that, and the scene
    with it; nothing where it foretells no poses."""
    parts = parts_worth_keeping(scene, whole_basis(scene, symbol, shapes[0]), [])
    free = of_parts(scene, symbol, parts, shapes, []) if parts else None
    if free is not None and not foretells_poses(scene, [free], []):
        free = None
    bends = bends_instead(scene, symbol, priced(scene, [free]) if free else 0.0, [])
    if bends or free is None:
        return scene, bends
    return _with_candidate(scene, free), [free]


def _shapes_by_error(scene: ChainScene) -> dict[str, list[ChainCandidate]]:
    """The shapes of the catalogue by their error, but for what bends as any shape does: over a part of a turn flexure
    and refraction."""
    shapes: dict[str, list[ChainCandidate]] = {}
    for shape in filter(_is_of_shape, scene.candidates):
        effect = shape.effect
        turns = isinstance(effect, ChainEffect) and effect.joint.turns
        if not (turns and scene.fit.problem.needs_whole_periods):
            shapes.setdefault(error_of(shape), []).append(shape)
    return shapes


def _predicts_runs(scene: ChainScene, slight: ChainCandidate) -> bool:
    """Whether an effect alone lowers the error on runs left out; true with too few runs."""
    before, after = scene.held_out_error(scene.columns([])), scene.held_out_error(scene.columns([slight]))
    return before is None or after is None or after < before


def _in_place(scene: ChainScene, selected: Sequence[ChainCandidate], margin: float) -> list[ChainCandidate]:
    """The selected effects with one error, of free shape or as several powers of the position, in place of all but
    those that take away most, where that says more at its price, by a margin; none where none does.

    The entries of the catalogue that come nearest to an unknown shape may be those of other errors, beside a right one
    as well as alone. What stands beside the new error as well stays.
    """
    ordered = by_error_taken_away(
        scene, ScanResult((*findings_without_rivals(scene, selected, 1),))
    ).candidates
    errors = _likeliest_errors(scene, ordered[:-1])
    best: list[ChainCandidate] = []
    worth = max(priced(scene, selected), priced(scene, bending_sight(scene))) + margin
    wholes = Pool(tuple(whole for _, whole in errors.values()))
    counts = range(max(len(ordered), 1))
    promising = [_promising(scene, wholes, ordered[:count]) for count in counts]
    for symbol, (shapes, whole) in errors.items():
        # One error after the other: the sawtooths of all together would be as much as the whole catalogue.
        edges = edges_of(scene, shapes[0])
        for count in counts:
            leading, gone = ordered[:count], ordered[count:]
            of_others = [each for each in gone if error_of(each) != symbol]
            # One goes in any case: where edges take the place of their error's other shapes, these do.
            beside_edges = of_others if len(of_others) < len(gone) else gone[:-1]
            edged = edges.beside(leading, beside_edges, worth, with_steps=symbol in promising[count])
            for new in [*_of_error(scene, whole, leading, gone[:-1], worth), *edged]:
                has_edges = any(new is some for some in edged)
                # What rounded edges leave is no other error.
                beside = [*leading, *new, *([whole] if has_edges else [])]
                staying = standing_beside(scene, beside, beside_edges if has_edges else gone[:-1])
                price = has_edges * price_of_powers(scene, new)
                score = priced(scene, [*leading, *new, *staying]) - price
                if score > worth and _foretells_if_free(scene, new, leading):
                    best, worth = [*leading, *_named(scene, new, shapes, leading), *staying], score
    return best


def _likeliest_errors(
    scene: ChainScene, beside: Sequence[ChainCandidate]
) -> dict[str, tuple[list[ChainCandidate], ChainCandidate]]:
    """The shapes and the whole basis of every error, the one first that is likeliest in any shape beside effects: what
    comes later has to be worth more."""
    shapes: dict[str, list[ChainCandidate]] = {}
    for shape in filter(_is_of_shape, scene.candidates):
        shapes.setdefault(error_of(shape), []).append(shape)
    wholes = [whole_basis(scene, symbol, some[0]) for symbol, some in shapes.items()]
    weighed = [each.candidate for each in weigh_beside(scene, wholes, beside)]
    return {error_of(whole): (shapes[error_of(whole)], whole) for whole in weighed}


def _foretells_if_free(
    scene: ChainScene, new: Sequence[ChainCandidate], leading: Sequence[ChainCandidate]
) -> bool:
    """Whether a free shape foretells poses; of others it was asked before."""
    return not is_free(new[0]) or foretells_poses(scene, new, leading)


def _named(
    scene: ChainScene,
    new: list[ChainCandidate],
    shapes: Sequence[ChainCandidate],
    leading: Sequence[ChainCandidate],
) -> list[ChainCandidate]:
    """A free shape with what comes nearest to it; others as they are."""
    return [with_nearest(scene, new[0], shapes, leading)] if is_free(new[0]) else new


def _promising(
    scene: ChainScene, wholes: Pool[ChainCandidate], leading: Sequence[ChainCandidate]
) -> set[str]:
    """The errors that explain in any shape beside leading effects no less than half of what the best one does: a step
    of another would say less."""
    weighed = weigh_beside(scene, wholes, leading)
    most = max((evidence.explained for evidence in weighed), default=0.0)
    return {error_of(each.candidate) for each in weighed if each.explained >= PROMISING * most}


def _of_error(
    scene: ChainScene,
    whole: ChainCandidate,
    leading: Sequence[ChainCandidate],
    may_stay: Sequence[ChainCandidate],
    worth: float,
) -> list[list[ChainCandidate]]:
    """What an error, of which the ``whole`` basis is given, may be beside leading effects: one free shape, whether or
    not it foretells poses, or several powers of the position that say as much; none where it is among them in another
    shape than a cycle, or where with those that may stay it is not worth so much."""
    symbol = error_of(whole)
    if is_told(symbol, leading):
        return []
    parts = parts_worth_keeping(scene, whole, leading)
    if not parts:
        return []
    free = of_parts_alone(scene, symbol, parts)
    if not any(error_of(power) == symbol for power in scene.powers):
        return [[free]] if most_together(scene, free, leading, may_stay) > worth else []
    able = foretells_poses(scene, [free], leading)
    bends = bends_instead(scene, symbol, priced(scene, [free], leading) if able else 0.0, leading)
    return [some for some in ([free] if able else [], bends) if some]


def _with_candidate(scene: ChainScene, candidate: ChainCandidate) -> ChainScene:
    return ChainScene(scene.fit, scene.shared, (*scene.candidates, candidate), scene.refused)


def _free(
    scene: ChainScene, symbol: str, mine: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> ChainCandidate | None:
    """The effect of free shape that says more than the shapes of one error beside others; None where none does."""
    whole = whole_basis(scene, symbol, mine[0])
    if not _says_more(scene, whole, [*others, *mine]):
        return None
    parts = parts_worth_keeping(scene, whole, others)
    if not parts:
        return None
    free = of_parts(scene, symbol, parts, mine, others)
    price = 2.0 * len(parts) * PRICE
    worth = score_beside(scene, [free], others) - price > score_beside(scene, mine, others) + WORTH_EXCHANGING
    return free if worth and foretells_poses(scene, [free], others) else None


def _says_more(scene: ChainScene, whole: ChainCandidate, selected: Sequence[ChainCandidate]) -> bool:
    """Whether an error in any shape explains more than chance of what the selected effects leave."""
    return p_value_of_all(scene, whole.columns, selected) < LEVEL
