"""What a certificate takes, the whole command in a fresh process: from the typed line to the file on the disk.

``python tests/benchmarks/test_certificate.py [TIMES]`` stores the uncertainty of one run of several examples, then
drafts and issues their certificates TIMES times (3) each and prints the least of clock and processor time, and how
often the least time of loading WeasyPrint alone, taken in turn with them, goes into that: on a busy computer this
ratio says more than a time. ``fresh`` are certificates of runs without a stored result. As a test one is issued.
No test asserts a time.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory.toml"
#: What is certified: what it is called here, campaign, run, further options.
CASES: tuple[tuple[str, str, int, tuple[str, ...]], ...] = (
    ("SAMBA, 13 parameters", "five-days", 20, ()),
    ("SAMBA with its map", "five-days", 20, ("--map",)),
    ("rotary probing, 8", "tilting-table", 4, ()),
    ("tracker, 18", "tracked-robot", 1, ("--accept", "lack-of-fit=an example that hides effects")),
    ("L shape, 51", "l-shape", 4, ()),
    ("free form, 149", "free-form-pocket", 4, ()),
)
MONITOR = (sys.executable, "-c", "import sys; from monitor.cli import main; sys.exit(main())")
WEASYPRINT = (sys.executable, "-c", "import weasyprint")


def run(command: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Clock and processor time of a command, its own processes included, in seconds."""
    before, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    # One thread of linear algebra: several slow small matrices down on shared cores.
    subprocess.run(
        command, cwd=folder, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    after, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - clock
    return clock, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def monitor(folder: Path, *words: str) -> tuple[float, float]:
    """The times of one command line."""
    return run((*MONITOR, "--db", "c.duckdb", *words), folder)


def certificate(
    folder: Path, campaign: str, number_of_run: int, number: str, *options: str
) -> tuple[float, float]:
    """The times of one certificate."""
    return monitor(
        folder, "certificate", "issue", campaign, "--run", str(number_of_run), "--laboratory", str(LABORATORY),
        "--number", number, "--out", f"{number}.pdf", *options,
    )  # fmt: skip


def filled(folder: Path, campaigns: list[str]) -> None:
    """A database with these campaigns."""
    monitor(folder, "import", *(str(EXAMPLES / one) for one in campaigns))


def test_a_certificate_is_issued_by_a_fresh_process(tmp_path: Path) -> None:
    filled(tmp_path, ["five-days"])
    monitor(tmp_path, "uncertainty", "five-days", "--run", "20", "--method", "guf")
    certificate(tmp_path, "five-days", 20, "N-1")
    assert (tmp_path / "N-1.pdf").read_bytes().startswith(b"%PDF-")


def main(times: int) -> None:
    """Print the least of several times of every case."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        filled(folder, sorted({campaign for _, campaign, _, _ in CASES}))
        # Without a stored result first: the next step stores one.
        found = {
            ("fresh", CASES[0][0]): [certificate(folder, *CASES[0][1:3], f"F-{n}") for n in range(times)]
        }
        loading = [run(WEASYPRINT, folder)]
        for campaign, number_of_run in sorted({(campaign, at) for _, campaign, at, _ in CASES}):
            monitor(folder, "uncertainty", campaign, "--run", str(number_of_run), "--method", "guf")
        for again in range(times):
            loading.append(run(WEASYPRINT, folder))
            for place, (words, campaign, at, options) in enumerate(CASES):
                for state, more in (("draft", ("--draft",)), ("issue", ())):
                    number = f"{state}-{place}-{again}"
                    found.setdefault((state, words), []).append(
                        certificate(folder, campaign, at, number, *options, *more)
                    )
    least = [min(one[of] for one in loading) for of in (0, 1)]
    print(f"{'import weasyprint':<32} {least[0]:5.2f} s clock {least[1]:5.2f} s processor")
    for (state, words), measured in found.items():
        clock, processor = (min(one[of] for one in measured) for of in (0, 1))
        print(
            f"{state} {words:<26} {clock:5.2f} s clock {processor:5.2f} s processor, "
            f"{clock / least[0]:4.1f} and {processor / least[1]:4.1f} times loading WeasyPrint"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
