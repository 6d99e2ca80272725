"""The command line: ``monitor [--db PATH] VERB ...``. A thin face; the work is done in ``workflow``.

Exit status 0: done; 1: the answer is no; 2: bad input or usage, with one plain message on standard error.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator, Sequence

from monitor.cli.garbage import collect_rarely
from monitor.cli.parser import parse
from monitor.exceptions import InputError, MonitorError

DONE, NO, BAD_INPUT, OUR_FAULT = 0, 1, 2, 3

#: What says how many threads the linear algebra has, which reads it when it is loaded.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; the exit status."""
    if arguments is None:
        collect_rarely()
        _one_thread()
    typed = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that has no µ shows a substitute; a file on its way to people is never cut off at it.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        return _run(typed, alone=arguments is None)
    except MonitorError as error:
        print(f"monitor: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("monitor: stopped; what was not finished was not stored", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output went away (`monitor ... | head`): no fault of anyone.
        _let_go_of_output()
        return DONE
    except Exception as error:
        return _unexpected(error)


def _one_thread() -> None:
    """Give linear algebra one thread, unless somebody says otherwise.

    The matrices of a campaign are small: more threads gain nothing on a quiet machine (uncertainty of 806 rows 3.7 and
    4.0 s) and wait for each other in loops on a busy one (124 and 19 s beside ten other processes on two cores).
    """
    if not any(name in os.environ for name in THREADS):
        os.environ[THREADS[0]] = "1"


def _run(typed: Sequence[str], *, alone: bool) -> int:
    """Run a verb; one that is ``alone`` is all that this process is for."""
    for text in typed:
        # A shell passes none on; who calls the command from Python may.
        if "\0" in text:
            raise InputError(f"{text!a} holds a character NUL, which no name and no text has")
        if not text.isprintable() and any("\ud800" <= sign <= "\udfff" for sign in text):
            raise InputError(f"{text!a} is not UTF-8 text; rename it, or type it in UTF-8")
    options = parse(typed)
    options.alone = alone
    if options.quiet and options.json:
        raise InputError("--quiet says nothing and --json says all: choose one")
    with _muted() if options.quiet else contextlib.nullcontext():
        status = int(options.run(options))
    # What is still in the buffer is written now, where a reader who went away is no fault.
    sys.stdout.flush()
    return status


@contextlib.contextmanager
def _muted() -> Iterator[None]:
    """Discard what the block would print, and show no progress."""
    from monitor.cli import output

    with (
        open(os.devnull, "w", encoding="utf-8") as nowhere,
        contextlib.redirect_stdout(nowhere),
        output.without_progress(),
    ):
        yield


def _unexpected(error: Exception) -> int:
    """Report a full disk under the output, or a fault of the software, which MONITOR_DEBUG raises."""
    if isinstance(error, OSError) and error.filename is None and error.errno is not None:
        _let_go_of_output()
        print(f"monitor: the output could not be written: {os.strerror(error.errno)}", file=sys.stderr)
        return BAD_INPUT
    if os.environ.get("MONITOR_DEBUG"):
        raise error
    print(
        f"monitor: this is a fault of the software, please report it: {type(error).__name__}: {error} "
        "(with MONITOR_DEBUG=1 it shows where)",
        file=sys.stderr,
    )
    return OUR_FAULT


def _let_go_of_output() -> None:
    """Discard what is still in the buffer: Python would complain of it when it ends."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
