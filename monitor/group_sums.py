"""Sums over groups of values, which the store makes of a whole fleet and statistics tests without the values."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.records import Array


@dataclass(frozen=True)
class GroupSums:
    """Sums of c cells about an origin that every cell has for itself; all arrays (c,).

    ``offset`` sums value less origin, ``squares`` the n_j times squared offset of the mean of each group, ``within``
    the squared deviations from the group means. ``repeated`` groups have two runs or more; ``log_variances`` sums
    (n_j - 1) ln s_j² and ``inverse_dof`` 1 / (n_j - 1) over them, ``least_variance`` is the smallest s_j².
    """

    groups: Array
    runs: Array
    offset: Array
    squares: Array
    within: Array
    repeated: Array
    least_variance: Array
    log_variances: Array
    inverse_dof: Array
