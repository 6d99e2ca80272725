"""What it takes to start: processor time of each verb that reads, as a process of its own, on a database of 20 runs.

``python tests/benchmarks/starting.py [TIMES [FOLDER [PART]]]`` imports two examples, lets every verb answer once (what
a first answer stores is there then, and files are in the system's cache), asks each TIMES times (5) and prints the
least of user and system time together, beside that of a Python that does nothing. The first answer stands beside it.
FOLDER keeps the database for the next call; PART is what a line has to begin with. Linear algebra has one thread, and
compiled files are written, as where the package is installed. No test asserts a time.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MONITOR = (sys.executable, "-c", "import sys; from monitor.cli import main; sys.exit(main())")
#: What is typed, in the order of the table; the database is filled from ``five-days`` and ``four-instruments``.
VERBS = (
    "--version",
    "--help",
    "trend --help",
    "config show",
    "effects reversal",
    "campaigns",
    "runs five-days",
    "model list",
    "model show samba",
    "select five-days",
    "audit",
    "certificate show K-1",
    "certificate verify k-1.pdf",
    "export tables-{turn}",
    "stats five-days",
    "stats five-days --json",
    "trend HU40-T",
    "trend HU40-T --parameter EC0Y",
    "fleet",
    "identify five-days --run 20",
    "uncertainty five-days --run 20 --method guf",
    "compare five-days",
    "map five-days --run 20",
    "standards four-instruments",
    "contributions four-instruments",
    "plan five-days",
    "verify",
)
QUERIES = (
    "FROM v_machines",
    "FROM v_parameters LIMIT 5",
    "FROM v_events",
)


def processor_seconds(command: tuple[str, ...], folder: Path) -> float:
    """User and system time of a process and of those that it started."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment)
    if ended.returncode:
        raise SystemExit(f"{' '.join(command)}: {ended.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def typed(folder: Path, *words: str) -> float:
    """Processor time of one command line."""
    return processor_seconds((*MONITOR, "--db", "s.duckdb", *words), folder)


def filled(folder: Path) -> None:
    """A database with two campaigns, identified, and a certificate."""
    typed(folder, "import", str(EXAMPLES / "five-days"), str(EXAMPLES / "four-instruments"))
    typed(folder, "identify")
    typed(folder, "select", "five-days", "--name", "late", "--where", "day > 3")
    typed(
        folder, "certificate", "issue", "five-days", "--run", "20", "--laboratory",
        str(EXAMPLES / "laboratory.toml"), "--number", "K-1", "--out", "k-1.pdf",
    )  # fmt: skip


def main(times: int, kept: str | None, part: str) -> None:
    """Print the table."""
    lines = [(verb, tuple(verb.split())) for verb in VERBS]
    lines[19:19] = [(f'sql "{query}"', ("sql", query)) for query in QUERIES]
    lines = [(title, words) for title, words in lines if title.startswith(part)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name if kept is None else kept)
        if not (folder / "k-1.pdf").exists():
            filled(folder)
        nothing = min(processor_seconds((sys.executable, "-c", "pass"), folder) for _ in range(times))
        print(f"{'python -c pass':<46}{'':>8} {nothing:8.2f} s   (load {os.getloadavg()[0]:.1f})")
        print(f"{'monitor ...':<46}{'first':>8} {'least':>8}   processor time")
        seconds: dict[str, list[float]] = {}
        for turn in range(times + 1):
            for title, words in lines:
                used = typed(folder, *(word.format(turn=f"{os.getpid()}-{turn}") for word in words))
                seconds.setdefault(title, []).append(used)
        for title, (first, *others) in seconds.items():
            print(f"{title:<46}{first:8.2f} {min(others):8.2f} s")
        print(f"load {os.getloadavg()[0]:.1f} at the end")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 5,
        sys.argv[2] if len(sys.argv) > 2 else None,
        sys.argv[3] if len(sys.argv) > 3 else "",
    )
