"""Makes the limits of ``statistics/charts/chart_limits.py`` anew: ``python tests/benchmarks/trial_chart_limits.py``.

Prints its tables. Takes some minutes: 20 000 simulated charts for each number of parameters.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from monitor.exceptions import DataError
from monitor.statistics.charts.chart_limits import ARL, ARL_VECTOR, LAM, REFERENCE, SEED, SIZES, TRIALS, K
from monitor.statistics.charts.run_length import cusum_run_length, ewma_run_length, solved_limit
from monitor.statistics.charts.vector_control import mewma_limit


def main() -> None:
    charts = {
        "EWMA": (partial(ewma_run_length, lam=LAM), 12.0),
        "CUSUM": (partial(cusum_run_length, k=K), 60.0),
    }
    for name, (chart, top) in charts.items():
        print(f"{name} = (")
        for n in SIZES:
            try:
                print(f"    {solved_limit(chart, ARL, n, n - 1.0, top)!r},  # {n} points", flush=True)
            except DataError as error:
                print(f"    nan,  # {error}", flush=True)
        print(")")
    print("MEWMA = (")
    for p in range(1, REFERENCE - 1):
        limit = mewma_limit(p, REFERENCE, LAM, ARL_VECTOR, np.random.default_rng([SEED, p]), TRIALS)
        print(f"    {limit:.6g},  # {p} parameters", flush=True)
    print(")")


if __name__ == "__main__":
    main()
