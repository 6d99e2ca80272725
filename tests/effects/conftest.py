"""A context of probings whose every number is chosen by the test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from monitor.effects import Context
from monitor.machine import parse_topology


@pytest.fixture
def make() -> Callable[..., Context]:
    """Builds a context of n probings; what is not given is one ball, one run, a minute apart."""

    def build(
        positions: Mapping[str, Sequence[float]],
        *,
        topology: str = "w C B X b Z Y (C1) t",
        run: Sequence[int] | None = None,
        target: Sequence[str] | None = None,
        nominal: Sequence[Sequence[float]] | None = None,
        columns: Mapping[str, Sequence[float]] | None = None,
        day_time: Sequence[float] | None = None,
        run_time: Sequence[float] | None = None,
    ) -> Context:
        chain = parse_topology(topology)
        count = len(next(iter(positions.values())))
        table = np.zeros((count, len(chain.joints)))
        for name, values in positions.items():
            table[:, chain.index(name)] = values
        time = 60.0 * np.arange(count)
        return Context(
            chain=chain,
            positions=table,
            run=np.array(run or [1] * count),
            sequence=np.arange(1, count + 1),
            time=time,
            day_time=np.array(time if day_time is None else day_time, dtype=float),
            run_time=np.array(time / max(time[-1], 1.0) if run_time is None else run_time, dtype=float),
            target=np.array(target or ["1"] * count),
            nominal=np.array(nominal or [[0.0, 0.0, 0.0]] * count, dtype=float),
            columns={name: np.array(values, dtype=float) for name, values in (columns or {}).items()},
        )

    return build
