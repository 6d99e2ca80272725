"""How long pages take: cold, for many engineers at once while an import runs, and of a fleet of 100 million values.

``python tests/benchmarks/load_pages.py many`` serves a database of ``--machines`` machines in a process of its own.
``--engineers`` open pages one after the other, each with pauses of a mean of ``--pause`` seconds, for ``--seconds``,
while campaigns are imported without a pause over HTTP. Prints the first page (cold), the 95th percentile, and what was
refused. ``large`` makes (or uses) a file of ``--machines`` machines and ``--weeks`` weekly campaigns of 4 runs and 15
parameters and asks for trend pages of machines drawn by a seed. Both say how loaded the machine was.
"""

from __future__ import annotations

import argparse
import http.client
import io
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from test_fleet import generate

from monitor.store import Database
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = ("five-days", "hidden-spindle-growth", "tilting-table")
#: Weekly campaigns of the shop of ``many``: two years of a machine.
WEEKS = 100


#: What a trend page lets one ask of a machine, pages and downloads.
TREND_PAGES = {
    "the page": "/machine?name={}&parameter=EB0C",
    "no parameter": "/machine?name={}",
    "other one": "/machine?name={}&parameter=EXX",
    "a period": "/machine?name={}&parameter=EB0C&since=2022-01-01&until=2023-01-01",
    "by day": "/machine?name={}&parameter=EB0C&colour=day",
    "warm alone": "/machine?name={}&parameter=EB0C&warm_up=warm",
    "two periods": "/machine/periods?name={}&since_1=2021-01-01&until_1=2021-12-31"
    "&since_2=2022-01-01&until_2=2022-12-31",
    "values.csv": "/machine/values.csv?name={}",
}


@contextmanager
def served(database: Path) -> Iterator[int]:
    """A server in a process of its own; yields its port."""
    command = [sys.executable, "-m", "monitor", "--db", str(database), "serve", "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        yield int(server.stdout.readline().split("/ ;")[0].rpartition(":")[2])
    finally:
        status = Path(f"/proc/{server.pid}/status")
        peak = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
        print(f"the server took at most {int(peak[1]) / 1e6 if peak else float('nan'):.2f} GB")
        server.terminate()
        server.wait()


@dataclass
class Times:
    """Seconds by page, and what was refused."""

    seconds: list[float] = field(default_factory=list)
    by_page: dict[str, list[float]] = field(default_factory=dict)
    refused: Counter[str] = field(default_factory=Counter)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def note(self, page: str, seconds: float, status: int | str) -> None:
        """Count an answer."""
        with self.lock:
            self.seconds.append(seconds)
            self.by_page.setdefault(page.partition("?")[0], []).append(seconds)
            if status != 200:
                self.refused[f"{status} {page.partition('?')[0]}"] += 1


def page(port: int, path: str, times: Times | None = None, words: str = "") -> float:
    """Open a page; the seconds until its last byte, noted under ``words`` (else its address)."""
    begin = time.perf_counter()
    status: int | str
    try:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", path)
        answer = connection.getresponse()
        answer.read()
        status = answer.status
        connection.close()
    except OSError as error:
        status = type(error).__name__
    seconds = time.perf_counter() - begin
    if times is not None:
        times.note(words or path, seconds, status)
    elif status != 200:
        raise SystemExit(f"{path}: {status}")
    return seconds


def packed(name: str) -> bytes:
    """A campaign of the examples under another name and of another machine, as a zip."""
    folder = EXAMPLES / "nothing-hidden"
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in folder.iterdir():
            text = path.read_text(encoding="utf-8")
            if path.name == "campaign.toml":
                text = text.replace('"HU40-T"', f'"HU40-{name[-1]}"').replace("nothing-hidden", name)
                text = re.sub(r'^(id = )"HU40-.*"', rf'\1"IMPORT-{name[-1]}"', text, flags=re.M)
            archive.writestr(f"{name}/{path.name}", text)
    return content.getvalue()


def importing(port: int, ends: float, counts: Counter[int]) -> None:
    """Import one campaign after the other over HTTP until the time is over."""
    number = 0
    while time.monotonic() < ends:
        number += 1
        body = (
            b"--x\r\nContent-Disposition: form-data; name=\"file\"; filename=\"c.zip\"\r\n\r\n"
            + packed(f"load-{number}") + b"\r\n--x--\r\n"
        )  # fmt: skip
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
        connection.request(
            "POST", "/api/v1/import", body, {"Content-Type": "multipart/form-data; boundary=x"}
        )
        counts[connection.getresponse().status] += 1
        connection.close()


def engineer(
    port: int, seed: int, options: argparse.Namespace, ends: float, times: Times, tables: Times
) -> None:
    """Open pages as somebody does who looks for what is urgent, and then at the machine; scroll down some of them."""
    draw = np.random.default_rng(seed)
    while time.monotonic() < ends:
        time.sleep(draw.exponential(options.pause))
        machine = f"M{draw.integers(options.machines):05d}"
        pages = (
            "/", f"/machine?name={machine}", f"/machine?name={machine}&parameter=EB0C",
            f"/campaign?name={draw.choice(CAMPAIGNS)}", "/campaigns", "/certificates", "/audit", "/import",
        )  # fmt: skip
        chosen = str(draw.choice(pages, p=(0.2, 0.25, 0.25, 0.1, 0.05, 0.05, 0.05, 0.05)))
        page(port, chosen, times)
        if chosen.startswith("/machine") and draw.random() < options.scrolled:
            # The table of all parameters, which comes when it is there; it is held, so its time is no page's.
            page(port, f"/machine/parameters?name={machine}", tables)


def told(times: Times) -> None:
    """Print the percentiles."""
    q = np.quantile(times.seconds, (0.5, 0.95, 0.99, 1.0))
    print(
        f"{len(times.seconds)} pages: median {q[0]:.3f} s, 95 % {q[1]:.3f} s, 99 % {q[2]:.3f} s, longest {q[3]:.3f} s"
    )
    for name, seconds in sorted(times.by_page.items()):
        print(f"  {name:<15} {len(seconds):5}  median {statistics.median(seconds):.3f} s, 95 % "
              f"{np.quantile(seconds, 0.95):.3f} s")  # fmt: skip
    print(f"refused: {dict(times.refused) or 'none'}")


def loads() -> str:
    """How loaded the machine is."""
    return f"load {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores"


def _make_shop(database: Path, machines: int) -> None:
    with Database(database, threads=1) as db:
        generate(db, machines, WEEKS)
        # The made-up campaigns have no probings that an import could compare itself with.
        db.execute("INSERT INTO run_fingerprint SELECT campaign_id, run, '' FROM run")
        import_folders(db, ImportRequest([EXAMPLES / name for name in CAMPAIGNS]))


def many(options: argparse.Namespace, folder: Path) -> None:
    """Many engineers at once while an import runs."""
    database = folder / "shop.duckdb"
    if options.file is not None and options.file.exists():
        shutil.copyfile(options.file, database)
    else:
        _make_shop(database, options.machines)
        if options.file is not None:
            shutil.copyfile(database, options.file)
    print(
        f"{options.machines} machines, {options.machines * WEEKS * 60 / 1e6:.1f} million values; before: {loads()}"
    )
    for turn in range(3):
        with served(database) as port:
            print(f"cold, turn {turn + 1}: first page {page(port, '/'):.3f} s, again {page(port, '/'):.3f} s")
    with served(database) as port:
        times, tables, counts = Times(), Times(), Counter[int]()
        page(port, "/")
        ends = time.monotonic() + options.seconds
        workers = [
            threading.Thread(target=engineer, args=(port, seed, options, ends, times, tables))
            for seed in range(options.engineers)
        ]
        workers.append(threading.Thread(target=importing, args=(port, ends, counts)))
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        print(
            f"{options.engineers} engineers, pauses of {options.pause:g} s; imports by status: {dict(counts)}"
        )
        told(times)
        if tables.seconds:
            print("tables of all parameters, for whoever scrolls down to them")
            told(tables)
    print(f"afterwards: {loads()}")


def large(options: argparse.Namespace, folder: Path) -> None:
    """Trend pages of a large fleet."""
    database = options.file or folder / "large.duckdb"
    if not database.exists():
        begin = time.monotonic()
        with Database(database) as db:
            db.execute("SET memory_limit = '1500MB'")
            generate(db, options.machines, options.weeks)
        print(f"made in {time.monotonic() - begin:.0f} s")
    count, size = options.machines * options.weeks * 60 / 1e6, database.stat().st_size / 1e9
    print(f"{count:.1f} million values, {size:.2f} GB; {loads()}")
    draw = np.random.default_rng(17)
    with served(database) as port:
        cold, fresh, again = page(port, "/machine?name=M00000"), Times(), Times()
        print(f"the first of all: {cold:.3f} s")
        for number in draw.permutation(options.machines)[: options.pages]:
            name = f"M{number:05d}"
            page(port, f"/machine?name={name}&parameter=EB0C", fresh)
            time.sleep(options.pause)
            for words, address in TREND_PAGES.items():
                page(port, address.format(name), again, words)
                time.sleep(options.pause / 4.0)
        print("a machine that nobody has looked at")
        told(fresh)
        print(f"the same machine a moment later (pauses of {options.pause:g} s)")
        told(again)
    print(f"afterwards: {loads()}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("many", "large"))
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--weeks", type=int, default=52)
    parser.add_argument("--engineers", type=int, default=50)
    parser.add_argument("--pause", type=float, default=3.0)
    parser.add_argument(
        "--scrolled", type=float, default=0.3, help="share of machine pages that are scrolled down"
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--pages", type=int, default=100)
    parser.add_argument("--file", type=Path, help="a database of an earlier run; made there where it is not")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="monitor-load-") as folder:
        (many if options.what == "many" else large)(options, Path(folder))


if __name__ == "__main__":
    main()
