"""What all tests share: modules loaded by path, the independent simulator, workers, rates over few or all seeds."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import pickle
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

# On matrices of this size BLAS threads mostly wait for each other in loops: beside another busy worker that took up to
# fifty times the processor time. numpy reads this when it is imported, so it stands before everything else; processes
# that tests start inherit it. Benchmarks measure what a user has.
if "--benchmark-only" not in sys.argv:
    os.environ.setdefault("OMP_NUM_THREADS", "1")

# What is compiled once need not be compiled again by each of the hundreds of processes that tests start (0.1 to 0.3 s
# of processor time each), nor by the next run. Images of continuous integration often switch it off.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

if "by_path" not in sys.modules:
    _spec = importlib.util.spec_from_file_location("by_path", Path(__file__).with_name("by_path.py"))
    assert _spec is not None
    assert _spec.loader is not None
    sys.modules["by_path"] = importlib.util.module_from_spec(_spec)
    _spec.loader.exec_module(sys.modules["by_path"])


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    parser.addoption(
        "--all-seeds",
        action="store_true",
        help="run only the tests of rates, over all their seeds (make trials)",
    )
    parser.addoption(
        "--slow",
        action="store_true",
        help="run only what is slow, and what can be tested more thoroughly (make slow)",
    )
    pluginmanager.register(
        sys.modules["by_path"].load("processor_time", Path(__file__).with_name("processor_time.py"))
    )


def pytest_xdist_auto_num_workers() -> int:
    """Return the number of workers of ``-n auto``: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


#: Files of more than 15 s of processor time, the longest first.
_LONGEST = {
    name: rank
    for rank, name in enumerate(
        (
            "workflow/test_health.py",
            "discovery/test_explain.py",
            "test_readme.py",
            "workflow/test_budget.py",
            "workflow/test_health_pictures.py",
            "cli/test_output.py",
            "cli/test_json.py",
            "discovery/test_anomalies.py",
            "workflow/test_certificate_contents.py",
            "cli/test_interruptions.py",
            "curves/test_real_data.py",
        )
    )
}


def _file(item: pytest.Item) -> str:
    """The file of a test, below this folder."""
    return os.path.relpath(item.path, Path(__file__).parent)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what only ``make trials`` or ``make slow`` runs, or everything else."""

    def is_run(item: pytest.Item) -> bool:
        fixtures = getattr(item, "fixturenames", ())
        of_trials = item.get_closest_marker("all_seeds") is not None
        if config.getoption("--all-seeds"):
            return of_trials or "seeds" in fixtures
        is_slow = item.get_closest_marker("slow") is not None
        if config.getoption("--slow"):
            return not of_trials and (is_slow or "thorough" in fixtures)
        return not of_trials and not is_slow

    config.hook.pytest_deselected(items=[item for item in items if not is_run(item)])
    # The longest files first: one that began last would be waited for by all workers but its own.
    items[:] = sorted(filter(is_run, items), key=lambda item: _LONGEST.get(_file(item), len(_LONGEST)))


@pytest.fixture(scope="session")
def thorough(pytestconfig: pytest.Config) -> bool:
    """Whether a test shall do all of its rounds, as in ``make slow``; in ``make test`` the first of them do."""
    return bool(pytestconfig.getoption("--slow") or pytestconfig.getoption("--all-seeds"))


@pytest.fixture(scope="session")
def seeds(pytestconfig: pytest.Config) -> Callable[[int, int], range]:
    """``seeds(600, 60)``: numbers for a rate over 600 in ``make trials``, over the first 60 in ``make test``."""
    return lambda count, sample: range(count if pytestconfig.getoption("--all-seeds") else sample)


@pytest.fixture(scope="session", autouse=True)
def database_is_copied(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str, str], None]]:
    """A new database file is a copy of the first: the 570 statements of its schema take 0.15 s of processor time.

    Yields what makes one by these statements, as processes that tests start do. See ``made_anew``.
    """
    opening = importlib.import_module("monitor.store.opening")
    template = tmp_path_factory.mktemp("new") / "new.duckdb"
    versions = opening.migrations.available()
    make = opening._make

    def copy(path: str, partial: str) -> None:
        if opening.migrations.available() != versions:
            make(path, partial)
            return
        if not template.exists():
            make(str(template), f"{template}.new")
        shutil.copy(template, partial)
        os.replace(partial, path)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "_make", copy)
        yield make


@pytest.fixture
def made_anew(
    database_is_copied: Callable[[str, str], None], monkeypatch: pytest.MonkeyPatch
) -> Callable[[str, str], None]:
    """For tests of making a database: each is made by its migrations."""
    monkeypatch.setattr("monitor.store.opening._make", database_is_copied)
    return database_is_copied


@pytest.fixture(scope="session")
def pdf_unread() -> Callable[[], AbstractContextManager[None]]:
    """``with pdf_unread():`` around certificates and reports of which nobody reads the PDF.

    Layout takes a second of processor time each. The template is filled in as ever, with all its refusals, and the page
    as HTML stands where the PDF would. Reports of several machines may lay out theirs in other processes.
    """

    def page(html: str, **_: object) -> bytes:
        return html.encode()

    @contextmanager
    def unread() -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            for room in ("pdf", "health"):
                patch.setattr(f"monitor.reporting.{room}.render.pdf_of", page)
            yield

    return unread


@pytest.fixture(scope="session")
def laid_out_once() -> Iterator[Callable[..., bytes]]:
    """A page that was laid out in this session, with the same files inside, is not laid out again.

    So tests of what is made again ask whether the page is the same. That its layout has the same bytes each time is
    asked with ``laid_out_anew``, and in tests/reporting. Yields what lays out.
    """
    laid_out: dict[str, bytes] = {}
    lay_out: Callable[..., bytes] = importlib.import_module("monitor.reporting.pdf.render").pdf_of

    def page(html: str, **options: Any) -> bytes:
        fonts = [font.read_bytes() for font in options.get("extra_fonts", ()) if font.is_file()]
        key = hashlib.sha256(pickle.dumps((html, fonts, sorted(options.items())))).hexdigest()
        if key not in laid_out:
            laid_out[key] = lay_out(html, **options)
        return laid_out[key]

    with pytest.MonkeyPatch.context() as patch:
        for room in ("pdf", "health"):
            patch.setattr(f"monitor.reporting.{room}.render.pdf_of", page)
        yield lay_out


@pytest.fixture
def laid_out_anew(laid_out_once: Callable[..., bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of the bytes of a PDF: every page is laid out."""
    for room in ("pdf", "health"):
        monkeypatch.setattr(f"monitor.reporting.{room}.render.pdf_of", laid_out_once)


@pytest.fixture(scope="session")
def simulator() -> ModuleType:
    """The package tests/simulator."""
    found: ModuleType = sys.modules["by_path"].simulator()
    return found
