"""Coverage-guided fuzzing (atheris) of what reads other people's text: an input is taken or refused in words.

``python tests/fuzz/fuzz.py --seconds 60`` runs every target that long, each in a process of its own, begins from what
``examples`` and the documentation hold, and ends with status 1 where an input raised anything but a ``MonitorError``;
such an input is kept in ``fuzz-output/`` and belongs into a test.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from targets import CHECKOUT, TARGETS

FINDINGS = CHECKOUT / "fuzz-output"
# What is instrumented: of workbooks also the reader that is not ours, whose faults have to be refused in our words.
INSTRUMENTED = {"workbooks": ["monitor", "openpyxl"]}


def fuzz(target: str, seconds: int) -> None:
    """Run a target in this process; libFuzzer ends it."""
    import atheris

    with atheris.instrument_imports(
        include=INSTRUMENTED.get(target, ["monitor"]), enable_loader_override=False
    ):
        take = TARGETS[target].make()
        from monitor.exceptions import MonitorError

    def one_input(content: bytes) -> None:
        try:
            take(content)
        except MonitorError as refusal:
            said = str(refusal).strip()
        else:
            said = "taken"
        if not said:
            raise AssertionError("a refusal without words")

    with tempfile.TemporaryDirectory() as corpus:
        for number, content in enumerate(TARGETS[target].seeds()):
            (Path(corpus) / f"{number:05d}").write_bytes(content)
        FINDINGS.mkdir(exist_ok=True)
        atheris.Setup(
            ["fuzz", corpus, f"-max_total_time={seconds}", "-max_len=20000", "-timeout=30", "-rss_limit_mb=1500",
             f"-artifact_prefix={FINDINGS}/{target}-", "-print_final_stats=1", "-verbosity=0", "-seed=1"],
            one_input,
        )  # fmt: skip
        atheris.Fuzz()


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=int, default=600)
    options.add_argument("--target", choices=sorted(TARGETS))
    options.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if chosen.alone:
        fuzz(chosen.target, chosen.seconds)
        return 0
    total, broken = 0, []
    for target in [chosen.target] if chosen.target else TARGETS:
        command = [
            sys.executable, __file__, "--alone", "--target", target, "--seconds", str(chosen.seconds),
        ]  # fmt: skip
        ended = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        said = ended.stdout + ended.stderr
        executed = re.search(r"number_of_executed_units: *(\d+)", said)
        count = int(executed[1]) if executed else 0
        total += count
        print(f"{target:<12} {count:>10} inputs{'' if ended.returncode == 0 else ', BROKEN'}", flush=True)
        if ended.returncode:
            broken.append(target)
            print(said[-3000:])
    print(f"{total} inputs, {len(broken)} of the targets broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
