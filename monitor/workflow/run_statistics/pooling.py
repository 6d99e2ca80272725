"""Pools the values of runs over their groups and tests the groups for homogeneity."""

from __future__ import annotations

from monitor.records import Array
from monitor.statistics import Homogeneity, Pooling, pool
from monitor.statistics.homogeneity import homogeneity


def pooled_by_group(values: Array, groups: list[str], names: list[str]) -> tuple[Pooling, Homogeneity | None]:
    """Pool ``values`` (R, p) over the ``groups`` (R) and test them; no test where there is nothing to compare."""
    # Groups of one run each cannot be compared: all runs are one group then.
    single = len(set(groups)) == len(groups)
    pooled = pool(values, ["all"] * len(groups) if single else groups, names)
    return pooled, None if single or len(set(groups)) < 2 else homogeneity(values, groups, names)
