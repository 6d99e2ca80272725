"""A certificate laid out by a process beside the command's is the same to the last byte, and is made without it too."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from monitor.documents import to_document
from monitor.reporting.certificate.record import CertificateRecord

pytestmark = pytest.mark.skipif(
    not hasattr(os, "fork")
    or not hasattr(os, "sched_getaffinity")
    or len(os.sched_getaffinity(0)) < 2
    or not os.path.isdir("/proc/self/task"),
    reason="no process is forked here",
)

#: Prints whether this process loaded the layout engine and how many bytes differ, after each step.
SCRIPT = """
import dataclasses, json, os, signal, sys, threading, time
from monitor.documents import from_document
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.pdf import beside

def loaded():
    return "weasyprint" in sys.modules

def no_child():
    try:
        os.waitpid(-1, os.WNOHANG)
    except ChildProcessError:
        return True
    return False

record = from_document(CertificateRecord, json.load(open(sys.argv[1], encoding="utf-8")))
answers = {}
done = threading.Event()
other = threading.Thread(target=done.wait)
other.start()
with beside.layout_beside():
    answers["forked beside a thread"] = beside._waiting is not None
done.set()
other.join()
while len(os.listdir("/proc/self/task")) > 1:  # The system may know a thread for a moment after it has ended.
    time.sleep(0.001)
with beside.layout_beside():
    versions, apart = beside.engine_versions(), beside.certificate_pdf(record)
    answers["loaded here"] = loaded()
answers["ended"] = no_child()
with beside.layout_beside():
    os.kill(beside._waiting._process, signal.SIGKILL)
    answers["after its death"] = beside.certificate_pdf(record) == apart
    answers["versions"] = beside.engine_versions() == versions
answers["ended after its death"] = no_child()
with beside.layout_beside():
    try:
        beside.certificate_pdf(dataclasses.replace(record, title="\\u6821"))
    except Exception as error:
        answers["refused"] = str(error)
    answers["after a refusal"] = beside.certificate_pdf(record) == apart
answers["without"] = beside.certificate_pdf(record) == apart
print(json.dumps(answers))
"""


@pytest.mark.slow
def test_a_certificate_laid_out_beside_is_the_same(
    make_record: Callable[..., CertificateRecord], tmp_path: Path
) -> None:
    stored = tmp_path / "record.json"
    stored.write_text(json.dumps(to_document(make_record(1))), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(stored)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert run.stderr == ""
    answers = json.loads(run.stdout)
    refused = answers.pop("refused")
    assert refused.startswith("the certificate's fonts lack 1 of its letters: \u6821 (U+6821)")
    assert answers == {
        "forked beside a thread": False,
        "loaded here": False,
        "ended": True,
        "after its death": True,
        "versions": True,
        "ended after its death": True,
        "after a refusal": True,
        "without": True,
    }


#: The command, which prints whether it may fork when it asks, and at its end whether it loaded the layout engine.
COMMAND = """
import atexit, sys
from monitor.cli import main
from monitor.reporting.pdf import beside

def said(is_single=beside._is_single):
    answer = is_single()
    print("may fork:", answer, file=sys.stderr)
    return answer

beside._is_single = said
atexit.register(lambda: print("loaded:", "weasyprint" in sys.modules, file=sys.stderr))
sys.exit(main())
"""


def test_the_verb_has_no_other_thread_when_it_forks(tmp_path: Path) -> None:
    # A database engine that is loaded before has threads, and the verb would lay out by itself, silently.
    (tmp_path / "none.duckdb").write_text("no database", encoding="utf-8")
    options = ["certificate", "issue", "five-days", "--laboratory", "none.toml"]
    run = subprocess.run(
        [sys.executable, "-c", COMMAND, "--db", str(tmp_path / "none.duckdb"), *options],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    lines = run.stderr.splitlines()
    assert (lines[0], lines[-1]) == ("may fork: True", "loaded: False")
