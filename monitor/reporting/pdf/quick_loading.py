"""Loads WeasyPrint without the compilers that it would start to look for its libraries.

Python's ``ctypes.util.find_library`` asks gcc and ld for a name that the loader does not know, and WeasyPrint tries the
names of other platforms first: seventeen starts, a quarter of the processor time of loading it. Found by no search path
they are not started, and the names of this platform are found by the loader. Only in a process with one thread: another
could start a program meanwhile.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

#: A search path on which no program is found: an empty one would be the system's own.
_NOWHERE = os.devnull


@contextmanager
def no_programs_are_found() -> Iterator[None]:
    """Let no program be found by its name in this block, where no other thread could want one."""
    path = os.environ.get("PATH")
    if path is None or threading.active_count() != 1:
        yield
        return
    os.environ["PATH"] = _NOWHERE
    try:
        yield
    finally:
        os.environ["PATH"] = path


def load_weasyprint() -> None:
    """Load WeasyPrint. Raises OSError where a library that it needs is not installed."""
    try:
        with no_programs_are_found():
            import weasyprint
    except OSError:
        # A system whose libraries only its compiler finds.
        import weasyprint  # noqa: F401
