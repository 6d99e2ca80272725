"""Trials on a Dask distributed cluster that is there already (extra ``cluster``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from monitor.exceptions import InputError
from monitor.uncertainty.workers.engine import WorkerLostError


class Cluster:
    """A Dask distributed cluster that somebody started; ``client`` is the connection to its scheduler."""

    def __init__(self, client: Any) -> None:
        self.client = client

    @property
    def size(self) -> int:
        """How many threads of workers the scheduler has now, at least one: workers may come later."""
        return max(1, int(sum(self.client.nthreads().values())))

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Any:
        """Hand a task out."""
        return self.client.submit(task, *arguments, pure=False)

    def result(self, handle: Any) -> Any:
        """Wait for a task; the scheduler itself gives it to another worker where one died."""
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        try:
            return handle.result()
        except KilledWorker as error:
            raise WorkerLostError from error
        except (FutureCancelledError, OSError) as error:
            raise InputError(
                f"the scheduler of the cluster was lost while it worked ({error}); start it and ask again"
            ) from error

    def cancel(self, handles: Iterable[Any]) -> None:
        """Forget tasks."""
        self.client.cancel(list(handles), reason="the result is not needed any more", msg=False)


@contextmanager
def cluster(address: str, patience_s: float = 10.0) -> Iterator[Cluster]:
    """The Dask cluster whose scheduler listens at ``address``, such as ``tcp://host:8786``.

    Raises InputError where the extra is not installed, or no scheduler with a worker answers within ``patience_s``.
    Whoever reaches a scheduler can run anything on its workers: keep it inside, or use ``tls://``.
    """
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "--cluster needs Dask distributed; install it with: pip install 'machine-health-monitor[cluster]'"
        ) from error
    try:
        connect: Any = distributed.Client
        client = connect(address, timeout=patience_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers there ({error}); start one with `dask scheduler` and "
            "workers with `dask worker ADDRESS`, and give its address, for example tcp://127.0.0.1:8786"
        ) from error
    try:
        try:
            client.wait_for_workers(1, timeout=patience_s)
        except TimeoutError as error:
            raise InputError(
                f"--cluster {address}: the scheduler has no workers; start some with `dask worker {address}`"
            ) from error
        yield Cluster(client)
    finally:
        client.close()
