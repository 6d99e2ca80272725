"""Where the work of a question is done: here, in processes of this machine, or on a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from monitor.exceptions import InputError
from monitor.uncertainty.workers.cluster import cluster as cluster_at
from monitor.uncertainty.workers.engine import Engine, Here
from monitor.uncertainty.workers.processes import processes


def check_workers(workers: int | None, cluster: str | None) -> None:
    """Raise InputError where both are asked for, and for fewer than one process."""
    if workers is not None and cluster is not None:
        raise InputError(
            "--workers starts processes here, --cluster uses those of a cluster: choose one of them"
        )
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: at least one worker is needed")


@contextmanager
def engine_of(workers: int | None, cluster: str | None) -> Iterator[Engine]:
    """The Dask cluster at an address, else so many processes of this machine, with one or none this process alone."""
    check_workers(workers, cluster)
    if cluster is not None:
        with cluster_at(cluster) as engine:
            yield engine
    elif workers is None or workers == 1:
        yield Here()
    else:
        with processes(workers) as engine:
            yield engine
