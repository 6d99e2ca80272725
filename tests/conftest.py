"""What all tests share: modules loaded by path, the independent simulator, workers, rates over few or all seeds."""

from __future__ import annotations

import fcntl
import gc
import importlib
import importlib.util
import os
import shutil
import signal
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import ModuleType

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

# A shell ignores Ctrl-C for what it starts in the background, and so would every process that a test starts and stops.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

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
    load = sys.modules["by_path"].load
    pluginmanager.register(load("processor_time", Path(__file__).with_name("processor_time.py")))
    pluginmanager.register(load("computed_once", Path(__file__).with_name("computed_once.py")))


def pytest_xdist_auto_num_workers() -> int:
    """Return the number of workers of ``-n auto``: the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


#: Files of more than 12 s of processor time, the longest first.
_LONGEST = {
    name: rank
    for rank, name in enumerate(
        (
            "workflow/test_health.py",
            "discovery/test_explain.py",
            "cli/test_output.py",
            "workflow/test_health_pictures.py",
            "test_readme.py",
            "api/test_python.py",
            "cli/test_json.py",
            "workflow/test_one_past.py",
            "discovery/test_anomalies.py",
            "cli/test_models.py",
            "workflow/test_certificate_grounds.py",
            "cli/test_interruptions.py",
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


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """What the modules of libraries and tests hold lives until the end: it is not searched for rubbish.

    Searching it again and again took 1.8 s of processor time while each worker loads the tests, more while they run.
    What the tests themselves make is searched as often as ever.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="module")
def unsearched() -> Iterator[None]:
    """For files that parse the whole package: syntax trees hold no circles, and are not searched for rubbish.

    While trees grew they were searched again and again: two thirds of the processor time of parsing.
    """
    gc.disable()
    yield
    gc.enable()


@pytest.fixture(scope="session")
def thorough(pytestconfig: pytest.Config) -> bool:
    """Whether a test shall do all of its rounds, as in ``make slow``; in ``make test`` the first of them do."""
    return bool(pytestconfig.getoption("--slow") or pytestconfig.getoption("--all-seeds"))


@pytest.fixture(scope="session")
def seeds(pytestconfig: pytest.Config) -> Callable[[int, int], range]:
    """``seeds(600, 60)``: numbers for a rate over 600 in ``make trials``, over the first 60 in ``make test``."""
    return lambda count, sample: range(count if pytestconfig.getoption("--all-seeds") else sample)


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of this session that all its workers have."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session", autouse=True)
def computed_in(shared_folder: Path) -> None:
    """Where the workers keep for each other what they computed (``computed_once.py``)."""
    sys.modules["computed_once"].FOLDER.append(shared_folder)


@pytest.fixture(scope="session")
def made_once(shared_folder: Path) -> Callable[[str, Callable[[Path], object]], Path]:
    """``made_once("filled", fill)``: a folder that ``fill`` filled, in one of the workers; the others wait for it.

    What is in it is only read, or copied.
    """

    def folder_of(name: str, make: Callable[[Path], object]) -> Path:
        folder, is_made = shared_folder / name, shared_folder / f"{name}.made"
        with (shared_folder / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not is_made.exists():
                # What a worker that failed left there.
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir()
                make(folder)
                is_made.touch()
        return folder

    return folder_of


@pytest.fixture(scope="session", autouse=True)
def database_is_copied(
    made_once: Callable[[str, Callable[[Path], object]], Path],
) -> Iterator[Callable[[str, str], None]]:
    """A new database file is a copy of the first: the 570 statements of its schema take 0.15 s of processor time.

    Yields what makes one by these statements, as processes that tests start do. See ``made_anew``.
    """
    opening = importlib.import_module("monitor.store.opening")
    versions = opening.migrations.available()
    make = opening._make

    def make_template(folder: Path) -> None:
        make(str(folder / "new.duckdb"), str(folder / "new.duckdb.new"))

    def copy(path: str, partial: str) -> None:
        if opening.migrations.available() != versions:
            make(path, partial)
            return
        shutil.copy(made_once("new", make_template) / "new.duckdb", partial)
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


@pytest.fixture
def laid_out_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of the bytes of a PDF: every page is laid out, in tests of workflow and command line too."""
    lay_out = sys.modules["computed_once"].layout()
    for name in sys.modules["computed_once"].LAYOUT:
        monkeypatch.setattr(name, lay_out)


@pytest.fixture(scope="session")
def simulator() -> ModuleType:
    """The package tests/simulator."""
    found: ModuleType = sys.modules["by_path"].simulator()
    return found
