"""WeasyPrint is loaded without starting programs, and the search path is as it was."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading

from monitor.reporting.pdf.quick_loading import no_programs_are_found

LOADED = """
import os, sys
started = []
sys.addaudithook(lambda event, args: started.append(args[0]) if event == "subprocess.Popen" else None)
path = os.environ["PATH"]
from monitor.reporting.pdf import layout_engine
assert os.environ["PATH"] == path
print(sorted({os.path.basename(os.fsdecode(program)) for program in started} & {"gcc", "cc", "objdump"}))
print(layout_engine.engine_versions()["pango"])
"""


def test_weasyprint_is_loaded_without_a_compiler() -> None:
    answer = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=False)
    assert answer.stderr == ""
    started, pango = answer.stdout.split("\n")[:2]
    assert started == "[]"
    assert pango.count(".") == 2


def test_the_search_path_comes_back_and_is_left_alone_beside_another_thread() -> None:
    path = os.environ["PATH"]
    alone = threading.active_count() == 1
    with no_programs_are_found():
        assert (shutil.which("sh") is None) == alone
    assert os.environ["PATH"] == path
    done = threading.Event()
    other = threading.Thread(target=done.wait)
    other.start()
    try:
        with no_programs_are_found():
            assert os.environ["PATH"] == path
    finally:
        done.set()
        other.join()
