"""The command has one thread of linear algebra, unless the environment says otherwise."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from monitor.cli import THREADS

#: A verb that loads numpy, then the threads of what is loaded.
COMMAND = (
    "import sys; from monitor.cli import main; sys.argv = ['monitor', 'effects', 'reversal']; main(); "
    "import numpy, threadpoolctl; "
    "print('threads', {pool['num_threads'] for pool in threadpoolctl.threadpool_info() if pool['user_api'] == 'blas'})"
)


@pytest.mark.parametrize(("stated", "threads"), [({}, "{1}"), ({"OPENBLAS_NUM_THREADS": "2"}, "{2}")])
def test_linear_algebra_has_one_thread_unless_somebody_says_otherwise(
    stated: dict[str, str], threads: str
) -> None:
    if stated and (os.cpu_count() or 1) < 2:
        pytest.skip("a machine of one core has no second thread")
    environment = {name: value for name, value in os.environ.items() if name not in THREADS}
    done = subprocess.run(
        [sys.executable, "-c", COMMAND],
        env={**environment, **stated},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == f"threads {threads}"
