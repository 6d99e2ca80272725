"""Loads the layout engine in a process of its own while the command reads its database, and lays certificates out.

What lays out a page takes as long to load as a database to open and a result to read; on two cores both are done at
once. The process is forked before the database is opened, and only where the command has one thread: a fork takes the
locks of others along in whatever state they are. Wherever there is none, or it has no answer, this process does it
itself and raises what there is to raise.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from monitor.reporting.certificate.record import CertificateRecord

#: The threads of this process as Linux counts them, those of libraries among them.
_THREADS = Path("/proc/self/task")


class _Beside:
    """The process that lays out, and the ends of the pipes to and from it."""

    def __init__(self, process: int, questions: BinaryIO, answers: BinaryIO) -> None:
        self._process, self._questions, self._answers = process, questions, answers
        self._versions: dict[str, str] | None = None

    def versions(self) -> dict[str, str] | None:
        """Return what decides the bytes of its pages; None where it has ended."""
        if self._versions is None:
            with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
                self._versions = pickle.load(self._answers)
        return self._versions

    def certificate(self, *question: Any) -> bytes | None:
        """Return the page of ``certificate_pdf``; None where there is none, for whatever reason."""
        if self.versions() is None:
            return None
        with contextlib.suppress(EOFError, OSError, pickle.PickleError, AttributeError, TypeError):
            pickle.dump(question, self._questions)
            self._questions.flush()
            pdf: bytes | None = pickle.load(self._answers)
            return pdf
        return None

    def end(self) -> None:
        """End it, whatever it has in hand."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self._process, 0)
        for stream in (self._questions, self._answers):
            with contextlib.suppress(OSError):
                stream.close()


_waiting: _Beside | None = None


@contextlib.contextmanager
def layout_beside() -> Iterator[None]:
    """Let a process lay out the certificates of this block, where one can be had."""
    global _waiting
    _waiting = _forked() if _is_single() else None
    try:
        yield
    finally:
        if _waiting is not None:
            _waiting.end()
            _waiting = None


def engine_versions() -> dict[str, str]:
    """Return what decides the bytes of a page besides its content."""
    versions = None if _waiting is None else _waiting.versions()
    if versions is None:
        from monitor.reporting.pdf import layout_engine

        return layout_engine.engine_versions()
    return versions


def certificate_pdf(
    record: CertificateRecord, extra_fonts: Sequence[Path] = (), inputs: Mapping[str, Any] | None = None
) -> bytes:
    """Make a certificate as ``render.certificate_pdf`` does; the same bytes, the same errors."""
    pdf = None if _waiting is None else _waiting.certificate(record, tuple(extra_fonts), inputs)
    if pdf is None:
        from monitor.reporting.pdf import render

        return render.certificate_pdf(record, extra_fonts, inputs)
    return pdf


def _is_single() -> bool:
    """Whether this process has one thread and a core to spare, as far as the system tells."""
    if not hasattr(os, "fork") or not hasattr(os, "sched_getaffinity"):
        return False
    try:
        return len(os.sched_getaffinity(0)) > 1 and sum(1 for _ in _THREADS.iterdir()) == 1
    except OSError:
        return False


def _forked() -> _Beside | None:
    try:
        asked, questions = os.pipe()
        answers, answered = os.pipe()
        process = os.fork()
    except OSError:
        return None
    if process == 0:
        os.close(questions)
        os.close(answers)
        _serve(asked, answered)
    os.close(asked)
    os.close(answered)
    return _Beside(process, os.fdopen(questions, "wb"), os.fdopen(answers, "rb"))


def _serve(asked: int, answered: int) -> NoReturn:
    """Load what lays out, answer until the command has ended, and leave without what a process does at its end: what is
    unwritten of the command's output is the command's."""
    try:
        with os.fdopen(asked, "rb") as questions, os.fdopen(answered, "wb") as answers:
            from monitor.reporting.pdf import layout_engine, render

            pickle.dump(layout_engine.engine_versions(), answers)
            answers.flush()
            render.load_certificate()
            while True:
                question = pickle.load(questions)
                try:
                    pdf = render.certificate_pdf(*question)
                except Exception:
                    # The command does it again, and raises it.
                    pdf = None
                pickle.dump(pdf, answers)
                answers.flush()
    except BaseException:
        # The command has ended, or Ctrl-C: nobody waits.
        os._exit(0)
