"""Refuses to look at very many rows at once where there is not the memory: the kernel would end the process unheard."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from monitor.exceptions import TooManyRowsError
from monitor.methods.chain.problem import ChainProblem
from monitor.progress import saying

#: So many times what the derivatives of all rows take: of 29 990 touches on six joints `compare` took 0.3 GB more than
#: to load them, 4 times their derivatives, and `explain` 4.9 GB when it was stopped, 65 times (26 November 2026).
TIMES_OF_FIT, TIMES_OF_SEARCH = 5, 70
#: Columns of a search (pitches of long axes) stand in memory once, and now and then beside what is made of them.
TIMES_OF_COLUMNS = 1.5
#: Less is taken without a word, in bytes.
SMALL = 2e9
_MEMORY, _OWN_GROUPS, _GROUPS = map(Path, ("/proc/meminfo", "/proc/self/cgroup", "/sys/fs/cgroup"))


@contextmanager
def within_memory(problem: ChainProblem, times: int, columns: int = 0) -> Iterator[None]:
    """Look at all rows of a problem at once in the block, which takes ``times`` what their derivatives take, and so
    many ``columns`` besides.

    Raises TooManyRowsError where more memory is needed than is free; says how much is, where it is much.
    """
    needed, rows = bytes_needed(problem, times, columns), len(problem.context)
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


def bytes_needed(problem: ChainProblem, times: int, columns: int = 0) -> float:
    """Return how many bytes ``times`` the derivatives of all rows of a problem and so many ``columns`` besides take."""
    derivatives = 12 * len(problem.context.chain.joints) + len(problem.local_names) + 1
    numbers = len(problem.components) * len(problem.context)
    return 8.0 * numbers * (times * derivatives + TIMES_OF_COLUMNS * columns)


def free_memory() -> float | None:
    """Return how many bytes this process may still take without swapping; None where the system does not say."""
    try:
        lines = dict(line.split(":", 1) for line in _MEMORY.read_text().splitlines())
        free = 1024.0 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
    return min([free, *_free_in_groups()])


@dataclass(frozen=True)
class _GroupFiles:
    """What the kernel calls limit, use and the part of the use that files on disk hold (Linux,
    admin-guide/cgroup-v2.rst and admin-guide/cgroup-v1/memory.rst), and the ``root`` of the groups."""

    root: str
    limit: str
    used: str
    of_files: str


_VERSION_1 = _GroupFiles("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
_VERSION_2 = _GroupFiles("", "memory.max", "memory.current", "inactive_file")


def _free_in_groups() -> Iterator[float]:
    """How many bytes each control group with a limit leaves: the process's own and those around it.

    Files that were read stay in memory until it is needed, and are no use of it. In a container the path may be that
    on the host, which is not there; the container's own group is the root then.
    """
    try:
        lines = _OWN_GROUPS.read_text().splitlines()
    except OSError:
        return
    for line in lines:
        number, controllers, path = line.split(":", 2)
        if number != "0" and "memory" not in controllers.split(","):
            continue
        files = _VERSION_2 if number == "0" else _VERSION_1
        group = PurePosixPath(path.strip("/"))
        for part in (group, *group.parents):
            with suppress(OSError, KeyError, ValueError):
                yield _free_in_group(_GROUPS / files.root / part, files)


def _free_in_group(folder: Path, files: _GroupFiles) -> float:
    """ValueError where the group has no limit ("max")."""
    unused = float((folder / files.limit).read_text()) - float((folder / files.used).read_text())
    counts = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
    return max(unused + float(counts[files.of_files]), 0.0)
