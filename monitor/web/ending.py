"""Ends a server within a stated time: what it computes is taken back at once, and what goes on all the same is cut off.

A computation ends at its next checkpoint with its transaction undone. One that passes none in time is cut off with the
process, as by a loss of power: what was stored stays, and nothing is stored half.
"""

from __future__ import annotations

import asyncio
import logging
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from socket import socket

import uvicorn

from monitor.web.desk import Desk
from monitor.web.words import asked_for

#: A server has ended so long after it was told to, in s: systemd kills after 90 s, a container after 10 s.
ENDING_S = 10.0
#: So much of that is left to close the database, and to end threads that have nothing to do.
_CLOSING_S, _IDLE_S = 2.0, 0.5
_LOOK_S = 0.05


class EndingServer(uvicorn.Server):
    """A server that says where it listens once it does, and ends in time.

    ``listens`` is called with the port, ``ends`` when it begins to end; ``say`` tells people what is cut off.
    """

    def __init__(
        self, config: uvicorn.Config, desk: Desk, say: Callable[[str], None],
        listens: Callable[[int], None], ends: Callable[[], None],
    ) -> None:  # fmt: skip
        super().__init__(config)
        self._desk = desk
        self._say = say
        self._listens = listens
        self._ends = ends

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Listen; the port is the one that the system gave where none was named."""
        await super().startup(sockets)
        for server in self.servers:
            for taken in server.sockets:
                self._listens(int(taken.getsockname()[1]))
                return

    async def shutdown(self, sockets: list[socket] | None = None) -> None:
        """Take back what is computed and answer who waits, as long as there is time; a second Ctrl-C waits no more."""
        in_time = asyncio.create_task(self._end_work(time.monotonic() + ENDING_S - _CLOSING_S))
        await super().shutdown(sockets)
        await in_time

    async def _end_work(self, deadline: float) -> None:
        # First, while uvicorn closes its sockets: who asks now waits for the file.
        self._ends()
        unfinished = self._desk.end()
        if unfinished:
            self._say(
                f"the server ends within {ENDING_S:g} s, at once with Ctrl-C once more; taken back: "
                f"{', '.join(map(asked_for, unfinished))}"
            )
        while (unfinished := self._desk.end()) or self.server_state.connections:
            if self.force_exit or time.monotonic() > deadline:
                break
            await asyncio.sleep(_LOOK_S)
        if unfinished:
            self._say(
                f"cut off: {', '.join(map(asked_for, unfinished))}; what was not finished is not stored"
            )
        # What is cut off now is known, and no fault of the software.
        logging.getLogger("uvicorn.error").disabled = True
        self.force_exit = True
        for connection in tuple(self.server_state.connections):
            connection.transport.abort()


@contextmanager
def cut_off_at_the_end(folder: Path) -> Iterator[None]:
    """Leave the process at the end of the block where threads that it began still work, and remove the ``folder``.

    Python would wait for each of them, and to close the database while it is used takes as long.
    """
    before = set(threading.enumerate())
    status = 0
    try:
        yield
    except BaseException as error:
        status = 130 if isinstance(error, KeyboardInterrupt) else 0 if isinstance(error, SystemExit) else 1
        raise
    finally:
        idle_at = time.monotonic() + _IDLE_S
        for thread in set(threading.enumerate()) - before:
            if not thread.daemon:
                thread.join(max(0.0, idle_at - time.monotonic()))
        if any(thread.is_alive() and not thread.daemon for thread in set(threading.enumerate()) - before):
            shutil.rmtree(folder, ignore_errors=True)
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
