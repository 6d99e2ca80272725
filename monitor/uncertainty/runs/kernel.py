"""The gradient of the sum of squares for many trials at once, compiled: J^T r, exact, without building J.

Lanes are trials; ``LANES`` of them go through the walk of ``program`` together. For each class the walk is
made once to find where the readings act; each probing gives its weighted residual as a force on the tip; and
the sum of these forces and their moment are taken along the walk: the derivative by a shift is the force along
it, by a turn the moment about it. Steps that are the same in all classes are joined to *segments*: a segment is
multiplied out once, and the forces of all classes are summed in its own frame before they are taken through
its steps. So a class costs the same for one unknown or for thirty.
"""

from __future__ import annotations

import numba
import numpy as np

from monitor.progress import saying
from monitor.records import Array
from monitor.uncertainty.runs.program import (
    SHIFT_READING,
    SHIFT_SET,
    TURN_ERROR,
    TURN_SET,
    Program,
)
from monitor.uncertainty.workers.interrupts import interrupts_kept

#: Trials that are computed together, so that what they need stays in the first-level cache.
LANES = 64
#: What whoever waits for the first call of a process is told.
FIRST_CALL = (
    "the program of the trials is being made ready, which takes half a minute the first time on this machine"
)
# Rows of the work space, each of LANES numbers: frame (9), origin (3), readings' directions (9), force (3),
# moment (3), force times reading (9), readings (3), target (3), residual force (3), direction (3), amount,
# component, sine, cosine.
_P, _B, _C, _F, _M, _S, _Q, _T, _R, _D, _A, _E, _SIN, _COS = (
    0,
    9,
    12,
    21,
    24,
    27,
    36,
    39,
    42,
    45,
    48,
    49,
    50,
    51,
)
_ROWS = 52
# Rows of a segment: its turn (9), shift (3), shifts with the readings (9), the frame where it begins (9), its
# shifts in the frame of the last work axis (3 + 9), and force, moment, force times reading in its own frame.
_SEG_R, _SEG_T, _SEG_D, _SEG_P, _SEG_V, _SEG_VD, _SEG_F, _SEG_M, _SEG_S = 0, 9, 12, 21, 30, 33, 42, 45, 48
_SEG_ROWS = 57

_jit = numba.njit(cache=True, nogil=True, error_model="numpy", boundscheck=False)
_fast = numba.njit(
    cache=True, nogil=True, error_model="numpy", boundscheck=False, fastmath={"contract"}, forceinline=True
)
L = LANES


@_fast
def _columns(w, j, k, sine, cosine):  # type: ignore[no-untyped-def]
    for i in range(3):
        a = (_P + 3 * i + j) * L
        b = (_P + 3 * i + k) * L
        for t in range(L):
            u = w[a + t]
            v = w[b + t]
            w[a + t] = u * cosine + v * sine
            w[b + t] = v * cosine - u * sine


@_fast
def _columns_by_lane(w, j, k):  # type: ignore[no-untyped-def]
    for i in range(3):
        a = (_P + 3 * i + j) * L
        b = (_P + 3 * i + k) * L
        for t in range(L):
            u = w[a + t]
            v = w[b + t]
            w[a + t] = u * w[_COS * L + t] + v * w[_SIN * L + t]
            w[b + t] = v * w[_COS * L + t] - u * w[_SIN * L + t]


@_fast
def _turn_set(w, axis, sine, cosine):  # type: ignore[no-untyped-def]
    if axis == 0:
        _columns(w, 1, 2, sine, cosine)
    elif axis == 1:
        _columns(w, 2, 0, sine, cosine)
    else:
        _columns(w, 0, 1, sine, cosine)


@_fast
def _turn_by_lane(w, axis):  # type: ignore[no-untyped-def]
    """Turn by row _A."""
    for t in range(L):
        a = w[_A * L + t]
        s = a * a
        w[_SIN * L + t] = a * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0)))
        w[_COS * L + t] = 1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0)))
    if axis == 0:
        _columns_by_lane(w, 1, 2)
    elif axis == 1:
        _columns_by_lane(w, 2, 0)
    else:
        _columns_by_lane(w, 0, 1)


@_fast
def _direction(w, axis, sign):  # type: ignore[no-untyped-def]
    for i in range(3):
        for t in range(L):
            w[(_D + i) * L + t] = sign * w[(_P + 3 * i + axis) * L + t]


@_fast
def _fill(w, row, value):  # type: ignore[no-untyped-def]
    for t in range(L):
        w[row * L + t] = value


@_fast
def _load(w, row, source, factor):  # type: ignore[no-untyped-def]
    for t in range(L):
        w[row * L + t] = factor * source[t]


@_fast
def _load_more(w, row, source, factor):  # type: ignore[no-untyped-def]
    for t in range(L):
        w[row * L + t] += factor * source[t]


@_fast
def _load_product(w, row, first, other, factor):  # type: ignore[no-untyped-def]
    for t in range(L):
        w[row * L + t] += factor * first[t] * other[t]


@_fast
def _give(w, gradient, factor):  # type: ignore[no-untyped-def]
    for t in range(L):
        gradient[t] += factor * w[_E * L + t]


@_fast
def _give_product(w, gradient, other, factor):  # type: ignore[no-untyped-def]
    for t in range(L):
        gradient[t] += factor * other[t] * w[_E * L + t]


@_fast
def _take(gradient, w, row):  # type: ignore[no-untyped-def]
    for t in range(L):
        gradient[t] -= w[row * L + t]


@_fast
def _shift(w, out):  # type: ignore[no-untyped-def]
    """Rows out: plus direction times row _A."""
    for i in range(3):
        for t in range(L):
            w[(out + i) * L + t] += w[_A * L + t] * w[(_D + i) * L + t]


@_fast
def _lever(w, force):  # type: ignore[no-untyped-def]
    """Moment: minus row _A times direction x force."""
    for t in range(L):
        a = w[_A * L + t]
        d0 = a * w[_D * L + t]
        d1 = a * w[(_D + 1) * L + t]
        d2 = a * w[(_D + 2) * L + t]
        f0 = w[force * L + t]
        f1 = w[(force + 1) * L + t]
        f2 = w[(force + 2) * L + t]
        w[_M * L + t] -= d1 * f2 - d2 * f1
        w[(_M + 1) * L + t] -= d2 * f0 - d0 * f2
        w[(_M + 2) * L + t] -= d0 * f1 - d1 * f0


@_fast
def _along(w, force):  # type: ignore[no-untyped-def]
    """Row _E: direction times force."""
    for t in range(L):
        w[_E * L + t] = (
            w[_D * L + t] * w[force * L + t]
            + w[(_D + 1) * L + t] * w[(force + 1) * L + t]
            + w[(_D + 2) * L + t] * w[(force + 2) * L + t]
        )


@_fast
def _probe(w, w0, w1, w2):  # type: ignore[no-untyped-def]
    """Residual of one probing as a force; added to force, moment and force times reading."""
    for t in range(L):
        q0 = w[_Q * L + t]
        q1 = w[(_Q + 1) * L + t]
        q2 = w[(_Q + 2) * L + t]
        y0 = w[_B * L + t] + q0 * w[_C * L + t] + q1 * w[(_C + 3) * L + t] + q2 * w[(_C + 6) * L + t]
        y1 = (
            w[(_B + 1) * L + t]
            + q0 * w[(_C + 1) * L + t]
            + q1 * w[(_C + 4) * L + t]
            + q2 * w[(_C + 7) * L + t]
        )
        y2 = (
            w[(_B + 2) * L + t]
            + q0 * w[(_C + 2) * L + t]
            + q1 * w[(_C + 5) * L + t]
            + q2 * w[(_C + 8) * L + t]
        )
        f0 = w0 * (y0 - w[_T * L + t])
        f1 = w1 * (y1 - w[(_T + 1) * L + t])
        f2 = w2 * (y2 - w[(_T + 2) * L + t])
        w[_R * L + t] = f0
        w[(_R + 1) * L + t] = f1
        w[(_R + 2) * L + t] = f2
        w[_F * L + t] += f0
        w[(_F + 1) * L + t] += f1
        w[(_F + 2) * L + t] += f2
        w[_M * L + t] += y1 * f2 - y2 * f1
        w[(_M + 1) * L + t] += y2 * f0 - y0 * f2
        w[(_M + 2) * L + t] += y0 * f1 - y1 * f0
        w[_S * L + t] += q0 * f0
        w[(_S + 1) * L + t] += q0 * f1
        w[(_S + 2) * L + t] += q0 * f2
        w[(_S + 3) * L + t] += q1 * f0
        w[(_S + 4) * L + t] += q1 * f1
        w[(_S + 5) * L + t] += q1 * f2
        w[(_S + 6) * L + t] += q2 * f0
        w[(_S + 7) * L + t] += q2 * f1
        w[(_S + 8) * L + t] += q2 * f2


@_fast
def _begin(w):  # type: ignore[no-untyped-def]
    """Frame and origin where a walk begins."""
    for i in range(12 * L):
        w[i] = 0.0
    for i in range(3):
        for t in range(L):
            w[(_P + 4 * i) * L + t] = 1.0


@_fast
def _enter(w, g):  # type: ignore[no-untyped-def]
    """Go through a segment whose rows are g: keep frame and shift, move the origin, turn the frame."""
    for i in range(3):
        for t in range(L):
            p0 = w[(_P + 3 * i) * L + t]
            p1 = w[(_P + 3 * i + 1) * L + t]
            p2 = w[(_P + 3 * i + 2) * L + t]
            g[(_SEG_P + 3 * i) * L + t] = p0
            g[(_SEG_P + 3 * i + 1) * L + t] = p1
            g[(_SEG_P + 3 * i + 2) * L + t] = p2
            v = p0 * g[(_SEG_T) * L + t] + p1 * g[(_SEG_T + 1) * L + t] + p2 * g[(_SEG_T + 2) * L + t]
            g[(_SEG_V + i) * L + t] = v
            w[(_B + i) * L + t] += v
            w[(_P + 3 * i) * L + t] = (
                p0 * g[(_SEG_R) * L + t] + p1 * g[(_SEG_R + 3) * L + t] + p2 * g[(_SEG_R + 6) * L + t]
            )
            w[(_P + 3 * i + 1) * L + t] = (
                p0 * g[(_SEG_R + 1) * L + t] + p1 * g[(_SEG_R + 4) * L + t] + p2 * g[(_SEG_R + 7) * L + t]
            )
            w[(_P + 3 * i + 2) * L + t] = (
                p0 * g[(_SEG_R + 2) * L + t] + p1 * g[(_SEG_R + 5) * L + t] + p2 * g[(_SEG_R + 8) * L + t]
            )


@_fast
def _enter_axis(w, g, a):  # type: ignore[no-untyped-def]
    """The direction in which reading a acts within a segment."""
    for i in range(3):
        for t in range(L):
            v = (
                g[(_SEG_P + 3 * i) * L + t] * g[(_SEG_D + 3 * a) * L + t]
                + g[(_SEG_P + 3 * i + 1) * L + t] * g[(_SEG_D + 3 * a + 1) * L + t]
                + g[(_SEG_P + 3 * i + 2) * L + t] * g[(_SEG_D + 3 * a + 2) * L + t]
            )
            g[(_SEG_VD + 3 * a + i) * L + t] = v
            w[(_C + 3 * a + i) * L + t] += v


@_fast
def _enter_axes(w, g, moves):  # type: ignore[no-untyped-def]
    # Literal places: an offset that is not known when compiling is not computed in lanes.
    if moves[0]:
        _enter_axis(w, g, 0)
    if moves[1]:
        _enter_axis(w, g, 1)
    if moves[2]:
        _enter_axis(w, g, 2)


@_fast
def _leave(w, g):  # type: ignore[no-untyped-def]
    """Add force and moment in the frame of a segment; take the moment past its shift."""
    for t in range(L):
        f0 = w[_F * L + t]
        f1 = w[(_F + 1) * L + t]
        f2 = w[(_F + 2) * L + t]
        m0 = w[_M * L + t]
        m1 = w[(_M + 1) * L + t]
        m2 = w[(_M + 2) * L + t]
        for j in range(3):
            p0 = g[(_SEG_P + j) * L + t]
            p1 = g[(_SEG_P + 3 + j) * L + t]
            p2 = g[(_SEG_P + 6 + j) * L + t]
            g[(_SEG_F + j) * L + t] += p0 * f0 + p1 * f1 + p2 * f2
            g[(_SEG_M + j) * L + t] += p0 * m0 + p1 * m1 + p2 * m2
        d0 = g[(_SEG_V) * L + t]
        d1 = g[(_SEG_V + 1) * L + t]
        d2 = g[(_SEG_V + 2) * L + t]
        w[_M * L + t] = m0 - (d1 * f2 - d2 * f1)
        w[(_M + 1) * L + t] = m1 - (d2 * f0 - d0 * f2)
        w[(_M + 2) * L + t] = m2 - (d0 * f1 - d1 * f0)


@_fast
def _leave_axis(w, g, a):  # type: ignore[no-untyped-def]
    for t in range(L):
        f0 = w[(_S + 3 * a) * L + t]
        f1 = w[(_S + 3 * a + 1) * L + t]
        f2 = w[(_S + 3 * a + 2) * L + t]
        for j in range(3):
            g[(_SEG_S + 3 * a + j) * L + t] += (
                g[(_SEG_P + j) * L + t] * f0
                + g[(_SEG_P + 3 + j) * L + t] * f1
                + g[(_SEG_P + 6 + j) * L + t] * f2
            )
        d0 = g[(_SEG_VD + 3 * a) * L + t]
        d1 = g[(_SEG_VD + 3 * a + 1) * L + t]
        d2 = g[(_SEG_VD + 3 * a + 2) * L + t]
        w[_M * L + t] -= d1 * f2 - d2 * f1
        w[(_M + 1) * L + t] -= d2 * f0 - d0 * f2
        w[(_M + 2) * L + t] -= d0 * f1 - d1 * f0


@_fast
def _leave_axes(w, g, moves):  # type: ignore[no-untyped-def]
    if moves[0]:
        _leave_axis(w, g, 0)
    if moves[1]:
        _leave_axis(w, g, 1)
    if moves[2]:
        _leave_axis(w, g, 2)


@_fast
def _lever_of(w, a):  # type: ignore[no-untyped-def]
    """The lever of the force (a = -1) or of the force times reading a."""
    if a < 0:
        _lever(w, _F)
    elif a == 0:
        _lever(w, _S)
    elif a == 1:
        _lever(w, _S + 3)
    else:
        _lever(w, _S + 6)


@_fast
def _shift_of(w, a):  # type: ignore[no-untyped-def]
    if a < 0:
        _shift(w, _B)
    elif a == 0:
        _shift(w, _C)
    elif a == 1:
        _shift(w, _C + 3)
    else:
        _shift(w, _C + 6)


@_fast
def _along_of(w, a):  # type: ignore[no-untyped-def]
    if a < 0:
        _along(w, _F)
    elif a == 0:
        _along(w, _S)
    elif a == 1:
        _along(w, _S + 3)
    else:
        _along(w, _S + 6)


@_jit
def _step(k, c, i, second, theta, x, gradient, w, steps, entries):  # type: ignore[no-untyped-def]
    """One step k in class c, whose first probing is i: the first walk, or the second with forces."""
    kind, axis, sign, reading, first, amount = steps
    unknown, along, value, row, scale = entries
    what = kind[k]
    if what == TURN_SET:
        _turn_set(w, axis[k], np.sin(sign[k] * amount[c, k]), np.cos(sign[k] * amount[c, k]))
        return
    _direction(w, axis[k], sign[k])
    if what == TURN_ERROR:
        _fill(w, _A, 0.0)
        if second:
            _along(w, _M)
        for e in range(first[k], first[k + 1]):
            v = value[c, e]
            a = along[e]
            if a < 0:
                _load_more(w, _A, theta[unknown[e]], sign[k] * v)
                if second:
                    _give(w, gradient[unknown[e]], v)
            else:
                v *= scale[a]
                _load_product(w, _A, theta[unknown[e]], x[row[i, a]], sign[k] * v)
                if second:
                    _give_product(w, gradient[unknown[e]], x[row[i, a]], v)
        _turn_by_lane(w, axis[k])
    elif what == SHIFT_SET:
        _fill(w, _A, amount[c, k])
        if second:
            _lever(w, _F)
        else:
            _shift(w, _B)
    elif what == SHIFT_READING:
        _fill(w, _A, 1.0)
        if second:
            _lever_of(w, reading[k])
        else:
            _shift_of(w, reading[k])
    else:
        for e in range(first[k], first[k + 1]):
            _load(w, _A, theta[unknown[e]], value[c, e])
            if second:
                _along_of(w, along[e])
                _give(w, gradient[unknown[e]], value[c, e])
                _lever_of(w, along[e])
            else:
                _shift_of(w, along[e])


@_fast
def _reading(w, index, x, row, factor):  # type: ignore[no-untyped-def]
    if row >= 0:
        _load(w, index, x[row], factor)
    else:
        _fill(w, index, 0.0)


@_jit
def _lanes(theta, x, gradient, w, g, steps, entries, walk, probings, distances, targets_at):  # type: ignore[no-untyped-def]
    """Gradient of LANES trials, theta (p + held) rows of lanes, x N rows, gradient as theta."""
    segment_of, begin, end, moves, sine, cosine = walk
    start, target, row, weight, scale = probings
    between, length_row, length_weight = distances
    kind = steps[0]
    axis = steps[1]
    gradient[:] = 0.0
    plain = False
    for s in range(len(segment_of)):
        plain |= segment_of[s] < 0 and kind[begin[s]] != TURN_SET
        if segment_of[s] >= 0:
            segment = g[segment_of[s]]
            _begin(w)
            for i in range(_C * L, _F * L):
                w[i] = 0.0
            for k in range(begin[s], end[s]):
                _step(k, 0, 0, False, theta, x, gradient, w, steps, entries)
            for i in range(_F * L):
                segment[i] = w[i]
            for i in range(_SEG_F * L, _SEG_ROWS * L):
                segment[i] = 0.0
    for c in range(len(start) - 1):
        for i in range(_C * L, _Q * L):
            w[i] = 0.0
        _begin(w)
        for s in range(len(segment_of)):
            if segment_of[s] >= 0:
                segment = g[segment_of[s]]
                _enter(w, segment)
                _enter_axes(w, segment, moves[s])
            elif kind[begin[s]] == TURN_SET:
                _turn_set(w, axis[begin[s]], sine[c, begin[s]], cosine[c, begin[s]])
            else:
                _step(begin[s], c, start[c], False, theta, x, gradient, w, steps, entries)
        for i in range(start[c], start[c + 1]):
            at = targets_at + 3 * target[i]
            _reading(w, _Q, x, row[i, 0], scale[0])
            _reading(w, _Q + 1, x, row[i, 1], scale[1])
            _reading(w, _Q + 2, x, row[i, 2], scale[2])
            _load(w, _T, theta[at], 1.0)
            _load(w, _T + 1, theta[at + 1], 1.0)
            _load(w, _T + 2, theta[at + 2], 1.0)
            _probe(w, weight[i, 0], weight[i, 1], weight[i, 2])
            _take(gradient[at], w, _R)
            _take(gradient[at + 1], w, _R + 1)
            _take(gradient[at + 2], w, _R + 2)
        if plain:
            # Steps of this class alone need the frame they stand in: walk again.
            _begin(w)
        for s in range(len(segment_of)):
            if segment_of[s] >= 0:
                segment = g[segment_of[s]]
                if plain:
                    _enter(w, segment)
                _leave(w, segment)
                _leave_axes(w, segment, moves[s])
            elif plain:
                _step(begin[s], c, start[c], True, theta, x, gradient, w, steps, entries)
    for s in range(len(segment_of)):
        if segment_of[s] >= 0:
            segment = g[segment_of[s]]
            for i in range((_Q - _F) * L):
                w[_F * L + i] = segment[_SEG_F * L + i]
            _begin(w)
            for k in range(begin[s], end[s]):
                _step(k, 0, 0, True, theta, x, gradient, w, steps, entries)
    for d in range(len(between)):
        first = targets_at + 3 * between[d, 0]
        two = targets_at + 3 * between[d, 1]
        for t in range(L):
            d0 = theta[first, t] - theta[two, t]
            d1 = theta[first + 1, t] - theta[two + 1, t]
            d2 = theta[first + 2, t] - theta[two + 2, t]
            length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
            force = length_weight[d] * (length - x[length_row[d], t]) / length
            gradient[first, t] += force * d0
            gradient[first + 1, t] += force * d1
            gradient[first + 2, t] += force * d2
            gradient[two, t] -= force * d0
            gradient[two + 1, t] -= force * d1
            gradient[two + 2, t] -= force * d2


@_jit
def _block(theta, x, gradient, held, segments, steps, entries, walk, probings, distances, targets_at):  # type: ignore[no-untyped-def]
    """All trials of a block: theta (p, B), x (N, B), gradient (p, B)."""
    p, count = theta.shape
    inputs = x.shape[0]
    unknowns = np.empty((p + len(held), L))
    for i in range(len(held)):
        unknowns[p + i, :] = held[i]
    xs = np.empty((inputs, L))
    out = np.empty((p + len(held), L))
    w = np.zeros(_ROWS * L)
    g = np.zeros((max(segments, 1), _SEG_ROWS * L))
    for begin in range(0, count, L):
        width = min(L, count - begin)
        if width < L:
            # A last part that is not full repeats its last trial.
            for i in range(p):
                unknowns[i, :] = theta[i, count - 1]
            for i in range(inputs):
                xs[i, :] = x[i, count - 1]
        for i in range(p):
            unknowns[i, :width] = theta[i, begin : begin + width]
        for i in range(inputs):
            xs[i, :width] = x[i, begin : begin + width]
        _lanes(unknowns, xs, out, w, g, steps, entries, walk, probings, distances, targets_at)
        for i in range(p):
            gradient[i, begin : begin + width] = out[i, :width]


def call_block(*arguments: object) -> None:
    """Call the compiled block; the first call compiles it or loads it from the cache, and then Ctrl-C waits."""
    if _block.signatures:
        _block(*arguments)
        return
    with saying(FIRST_CALL), interrupts_kept():
        _block(*arguments)


def gradient_of(program: Program, unknowns: Array, inputs: Array) -> Array:
    """J^T r (p, B), whitened, at ``unknowns`` (p, B) and ``inputs`` (N, B); error angles up to 0.01 rad."""
    out = np.empty(unknowns.shape)
    angles = program.sign * program.amount
    call_block(
        np.ascontiguousarray(unknowns),
        np.ascontiguousarray(inputs),
        out,
        program.held,
        int(np.max(program.segment_of, initial=-1)) + 1,
        (program.kind, program.axis, program.sign, program.reading, program.first, program.amount),
        (program.unknown, program.along, program.value, program.row, program.scale),
        (program.segment_of, program.begin, program.end, program.moves, np.sin(angles), np.cos(angles)),
        (program.start, program.target, program.row, program.weight, program.scale),
        (program.between, program.length_row, program.length_weight),
        program.targets_at,
    )
    return out
