"""A piece that slipped on the table within a run: all of it that is touched later in that run is shifted and turned.

In one run nothing else tells it from an error of the machine, and errors of rotary axes come near it. So the slip has
to say more, at its price, than any effect of the catalogue and than any ball alone, and it has to stand out of noise
that walks as far as the residual allows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.suspects.anomalies import BallMove, ball_moves, deviations_of, statistic
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import parse_effect
from monitor.effects.artefact.piece import rigid_motion
from monitor.effects.effect import ArtefactBasis

# One false alarm in a thousand campaigns, as of what varies: this search adds little to the scan's one in a hundred.
FALSE_ALARM = 1e-3
# Touches before and after: fewer are bad points, or one face.
TOUCHES_EACH_SIDE = 8


def piece_move(
    fit: Fit, variants: Sequence[ChainVariant], scene: ChainScene | None = None
) -> BallMove | None:
    """The slip of the piece that explains most of what a fit leaves; None where another effect, one of ``variants``, a
    ball alone or noise may be the cause. ``scene`` is that of the fit with all variants, where it is known."""
    if not _touches_a_piece(fit):
        return None
    slip, tests = _likeliest(fit)
    if slip is None or slip.p_value * tests > FALSE_ALARM:
        return None
    loose = max((move.chi_square for move in ball_moves(fit)), default=0.0)
    if loose > slip.chi_square:
        return None
    effect = parse_effect(slip.text, fit.problem.context.chain)
    step = scene_of(fit, [Variant(slip.text, effect, tests)]).candidates
    scene = scene_of(fit, variants) if scene is None else scene
    weighed = weigh_beside(scene, [*step, *(other for other in scene.candidates if other.visible)], [])
    if weighed[0].candidate is not step[0]:
        return None
    if len(weighed) > 1 and weighed[0].likelihood - weighed[1].likelihood < UNDECIDED:
        return None
    return slip if _stands_in_noise(fit, step[0].variant) else None


def _touches_a_piece(fit: Fit) -> bool:
    """Whether rows are touches of one piece on the table, and not what something outside sees."""
    problem = fit.problem
    touched = problem.touch_normals is not None or problem.touches_centres
    return touched and poses_of_rows(fit) is None


def _likeliest(fit: Fit) -> tuple[BallMove | None, int]:
    """The likeliest slip of all runs, its p-value that of one test, and how many were tried."""
    deviations = deviations_of(fit)
    context = fit.problem.context
    # The residual moves with the tip, which follows the piece: a shift acts on it as on the tip.
    moved = -fit.moved_by(ArtefactBasis(rigid_motion(context)))
    white = np.where(fit.has_weight[:, :, None], moved / fit.problem.sigma[:, :, None], 0.0)
    best: BallMove | None = None
    tests = 0
    for run, rows in enumerate(deviations.rows):
        first = np.arange(TOUCHES_EACH_SIDE, len(rows) - TOUCHES_EACH_SIDE + 1)
        if len(first) == 0:
            continue
        tests += len(first)
        columns = white[rows]
        # Sums over all touches from each one on.
        shared = _from_each_on(np.einsum("ndk,ndp->nkp", columns, deviations.of_run(run)))[first]
        onto = _from_each_on(np.einsum("ndk,nd->nk", columns, deviations.vectors[rows]))[first]
        gram = _from_each_on(np.einsum("ndk,ndj->nkj", columns, columns))[first]
        inflation = _from_each_on(deviations.inflation[rows])[first] / (len(rows) - first)
        # In parts of what the touches alone would show: a direction that the heights of the points follow is rounding.
        whole = np.sqrt(np.maximum(np.trace(gram, axis1=1, axis2=2), 1e-300))
        visible = (gram - shared @ np.swapaxes(shared, 1, 2)) / whole[:, None, None] ** 2
        square, rank, parts = statistic(onto / whole[:, None], visible)
        shifts = parts / whole[:, None]
        chi_square = np.where(rank > 0, square / inflation / deviations.scale[rows[0]] ** 2, -1.0)
        index = int(chi_square.argmax())
        if chi_square[index] <= max(0.0, 0.0 if best is None else best.chi_square):
            continue
        row = int(rows[first[index]])
        x, y, z = (float(part) for part in shifts[index, :3])
        best = BallMove(
            target="artefact",
            run=int(context.run[row]),
            sequence=int(context.sequence[row]),
            shift=(x, y, z),
            p_value=float(scipy.special.chdtrc(rank[index], chi_square[index])),
            chi_square=float(chi_square[index]),
            of_all=True,
        )
    return best, tests


def _from_each_on(terms: np.ndarray) -> np.ndarray:
    """Sums (n, ...) over all rows from each one on."""
    return np.cumsum(terms[::-1], axis=0)[::-1]


def _stands_in_noise(fit: Fit, variant: ChainVariant) -> bool:
    """Whether a slip stands out of the noise of neighbours that the residual with it in would show."""
    correlation = fit.whole_noise_design.correlation(fit.solution.last.residual)
    scene = scene_of(fit.with_correlation(correlation), [variant])
    return weigh_beside(scene, scene.candidates, [])[0].p_value <= FALSE_ALARM
