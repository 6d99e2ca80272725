"""A process that runs a function and dies on the way: before a change to a file, in the middle of one, or at a time.

Moments are counted in calls and in processor time, not in seconds: they fall on the work however busy the machine is.
``dying.c`` counts the calls; it needs a C compiler and a process that was started with it (``loaded``). Without one all
moments are times.
"""

from __future__ import annotations

import ctypes
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).with_suffix(".c")
#: How a process that was killed ends: by dying.c, and by its timer.
KILLED = (-signal.SIGKILL, -signal.SIGPROF)


@dataclass(frozen=True)
class Effort:
    """What a function takes: system calls that change files, and processor time in s."""

    calls: int
    processor_s: float


@dataclass(frozen=True)
class Death:
    """When a process dies: before a call, in the middle of a write (``torn``), or after a processor time in s.

    ``share`` is how much of the write happens.
    """

    call: int = 0
    torn: bool = False
    processor_s: float = 0.0
    share: float = 0.5

    def __str__(self) -> str:
        if self.call:
            return f"{f'{self.share:.0%} into' if self.torn else 'before'} call {self.call}"
        return f"after {self.processor_s:.2f} s of processor time"


def drawn(effort: Effort, generator: random.Random) -> Death:
    """A death within an effort: half before a call, a fifth in the middle of one, the others at a time."""
    kind = generator.random()
    if effort.calls and kind < 0.7:
        return Death(generator.randint(1, effort.calls), kind >= 0.5, share=generator.random())
    return Death(processor_s=max(1e-4, generator.uniform(0.0, effort.processor_s)))


def loaded() -> bool:
    """Whether this process counts its calls; where it could, it is started anew so that it does."""
    library = os.environ.get("LD_PRELOAD", "")
    if library.endswith("die_before.so"):
        # What this process starts later does not need it.
        del os.environ["LD_PRELOAD"]
        shutil.rmtree(Path(library).parent)
        return True
    compiler = shutil.which("cc")
    if compiler is not None and sys.platform == "linux":
        made = Path(tempfile.mkdtemp()) / "die_before.so"
        subprocess.run([compiler, "-O1", "-shared", "-fPIC", SOURCE, "-o", made, "-ldl"], check=True)
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, "LD_PRELOAD": str(made)})
    return False


def _calls() -> int:
    library = ctypes.CDLL(None)
    return int(library.changes()) if hasattr(library, "changes") else 0


def _arm(death: Death) -> None:
    if death.call:
        ctypes.CDLL(None).die_before(
            ctypes.c_long(death.call), ctypes.c_int(max(1, int(1024 * death.share)) if death.torn else 0)
        )
    elif death.processor_s:
        # Counts all threads of the process; nobody catches the signal.
        signal.setitimer(signal.ITIMER_PROF, death.processor_s)


def forked(function: Callable[[], tuple[int, str]], death: Death | None = None) -> tuple[int, str, Effort]:
    """Run a function in a process of its own; its status (of ``KILLED`` where it died), words and effort."""
    return started(function, death).ended()


@dataclass(frozen=True)
class Child:
    """A process that runs a function; ``reader`` is where its words come from."""

    pid: int
    reader: int

    def ended(self) -> tuple[int, str, Effort]:
        """Wait for its end; its status, words and effort."""
        with os.fdopen(self.reader, "rb") as words_of_child:
            numbers, _, said = words_of_child.read().decode(errors="replace").partition("\n")
        _, status = os.waitpid(self.pid, 0)
        calls, processor_s = numbers.split() if numbers else ("0", "0")
        return os.waitstatus_to_exitcode(status), said, Effort(int(calls), float(processor_s))


def started(function: Callable[[], tuple[int, str]], death: Death | None = None) -> Child:
    """Start a function in a process of its own."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reader)
        try:
            before = _calls()
            if death is not None:
                _arm(death)
            status, said = function()
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            used = resource.getrusage(resource.RUSAGE_SELF)
            calls = _calls() - before
            if death is not None and death.call:
                ctypes.CDLL(None).die_before(ctypes.c_long(0), ctypes.c_int(0))
            message = f"{calls} {used.ru_utime + used.ru_stime}\n{said}".encode()
        except BaseException as error:
            status, message = 70, f"0 0\n{type(error).__name__}: {error}".encode()
        os.write(writer, message[:60000])
        os._exit(status)
    os.close(writer)
    return Child(pid, reader)
