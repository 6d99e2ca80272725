"""Refuses to look at very many rows at once where there is not the memory: the kernel would end the process unheard."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from monitor.exceptions import TooManyRowsError
from monitor.methods.chain.problem import ChainProblem
from monitor.progress import saying

#: So many times what the derivatives of all rows take: of 29 990 touches on six joints `compare` took 0.3 GB more than
#: to load them, 4 times their derivatives, and `explain` 4.9 GB when it was stopped, 65 times (26 November 2026).
TIMES_OF_FIT, TIMES_OF_SEARCH = 5, 70
#: Less is taken without a word, in bytes.
SMALL = 2e9
_MEMORY, _LIMIT, _USED = (
    Path(name) for name in ("/proc/meminfo", "/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current")
)


@contextmanager
def within_memory(problem: ChainProblem, times: int) -> Iterator[None]:
    """Look at all rows of a problem at once in the block, which takes ``times`` what their derivatives take.

    Raises TooManyRowsError where more memory is needed than is free; says how much is, where it is much.
    """
    derivatives = len(problem.components) * (
        12 * len(problem.context.chain.joints) + len(problem.local_names) + 1
    )
    needed, rows = 8.0 * times * derivatives * len(problem.context), len(problem.context)
    if needed <= SMALL:
        yield
        return
    free = free_memory()
    if free is not None and needed > free:
        raise TooManyRowsError(
            f"to look at {rows} rows at once takes some {needed / 1e9:.0f} GB of memory, and {free / 1e9:.1f} GB are "
            "free here; `monitor identify` takes so many rows some at a time; for all else import fewer of them: some "
            "runs, or one row of so many, as a campaign of its own"
        )
    with saying(f"{rows} rows at once, some {needed / 1e9:.0f} GB of memory"):
        yield


def free_memory() -> float | None:
    """Return how many bytes this process may still take without swapping; None where the system does not say."""
    try:
        lines = dict(line.split(":", 1) for line in _MEMORY.read_text().splitlines())
        free = 1024.0 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
    try:
        return min(free, float(_LIMIT.read_text()) - float(_USED.read_text()))
    except (OSError, ValueError):
        # No limit for this process ("max"), or none that can be read.
        return free
