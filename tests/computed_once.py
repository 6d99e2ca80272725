"""What the product computes from equal inputs is computed once in a session of tests, by the first worker to need it.

Only costly functions whose answer depends on their arguments alone, and only in the folders whose tests ask something
else (``FOLDERS``): where such a function is itself the subject, every call computes. An answer is kept as a file in a
folder that the workers share, and read anew by each who asks, so that nobody can alter another's. Loaded by
``tests/conftest.py``; the processes that tests start compute everything themselves.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib
import os
import pickle
from collections.abc import Callable, Generator, Iterator, Mapping
from datetime import date, timedelta, tzinfo
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

#: Folders and files of tests in which equal questions are computed once.
FOLDERS = ("api", "cli", "manual", "web", "workflow", "test_readme.py")

#: The functions, each by the modules' names for it that are replaced.
LAYOUT = ("monitor.reporting.pdf.render.pdf_of", "monitor.reporting.health.render.pdf_of")
REGION_FACTORS = (
    "monitor.uncertainty.framework.region_factors",
    "monitor.workflow.uncertainty.stating.region_factors",
)
JOINT_COVERAGE = ("monitor.workflow.uncertainty.stating.joint_coverage",)
ROBUST_FIT = (
    "monitor.discovery.robust_fit",
    "monitor.workflow.explain.explain.robust_fit",
    "monitor.workflow.uncertainty.evaluation.robust_fit",
)
FIT = ("monitor.workflow.uncertainty.evaluation.machine_fit",)
SEARCH = ("monitor.workflow.explain.explain.explanation_of", "monitor.workflow.health.task.explanation_of")
IDENTIFICATION = ("monitor.workflow.identify.identify.compute", "monitor.workflow.identify.every.compute")
CHANGES = ("monitor.workflow.history.past.search_changes",)
COMPUTED_ONCE = (
    LAYOUT,
    REGION_FACTORS,
    JOINT_COVERAGE,
    ROBUST_FIT,
    FIT,
    SEARCH,
    IDENTIFICATION,
    CHANGES,
)

#: Classes and their fields on which none of these answers depends. Each database stores the model of a method when it
#: first identifies with it: by that moment equal questions of two databases would differ.
WITHOUT_INFLUENCE = {("StoredModel", "created_at")}

#: The folder of this session's answers, which a fixture of ``conftest.py`` names.
FOLDER: list[Path] = []


def parts_of(value: object) -> Iterator[bytes]:
    """Yield bytes that are equal for equal values, whichever objects hold them."""
    yield type(value).__qualname__.encode()
    if isinstance(value, np.ndarray):
        yield repr((value.shape, value.dtype.str)).encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Path):
        # A file is what is in it.
        yield value.read_bytes() if value.is_file() else str(value).encode()
    elif isinstance(value, Enum):
        yield value.name.encode()
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if (type(value).__qualname__, field.name) not in WITHOUT_INFLUENCE:
                yield from parts_of(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from parts_of(key)
            yield from parts_of(inner)
    elif isinstance(value, (list, tuple)):
        yield str(len(value)).encode()
        for inner in value:
            yield from parts_of(inner)
    elif isinstance(value, frozenset):
        yield from parts_of(sorted(value))
    elif isinstance(value, (bytes, str, int, float, type(None), date, timedelta, tzinfo)):
        yield repr(value).encode()
    else:
        raise TypeError(f"{value!r} has no key: a function that takes it cannot be computed once")


def key_of(*values: object) -> str:
    """Return a key that equal values share."""
    digest = hashlib.sha256()
    for part in parts_of(values):
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def computed_once(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that computes only what no worker has computed; what it raises is not kept."""

    @functools.wraps(function)
    def answer(*arguments: Any, **options: Any) -> Any:
        file = FOLDER[-1] / key_of(name, arguments, sorted(options.items()))
        if not file.exists():
            partial = file.with_suffix(f".{os.getpid()}")
            partial.write_bytes(pickle.dumps(function(*arguments, **options)))
            partial.replace(file)
        return pickle.loads(file.read_bytes())

    return answer


@dataclasses.dataclass(frozen=True)
class Replacement:
    """What stands for a function in a module that calls it by a name of its own."""

    module: ModuleType
    attribute: str
    answer: Callable[..., Any]


_REPLACEMENTS: dict[str, Replacement] = {}


def _replacements() -> dict[str, Replacement]:
    """What stands for each function while the tests of ``FOLDERS`` run, made with the first of them.

    With their modules: to find these by name took 2 ms for each of some 2300 tests.
    """
    if not _REPLACEMENTS:
        for names in COMPUTED_ONCE:
            places = [(name, *name.rpartition(".")[::2]) for name in names]
            modules = {name: importlib.import_module(module) for name, module, _ in places}
            answer = computed_once(names[0], getattr(modules[names[0]], places[0][2]))
            _REPLACEMENTS.update(
                {name: Replacement(modules[name], attribute, answer) for name, _, attribute in places}
            )
    return _REPLACEMENTS


def layout() -> Callable[..., bytes]:
    """Return what lays out a page each time."""
    function: Callable[..., bytes] = _replacements()[LAYOUT[0]].answer.__wrapped__  # type: ignore[attr-defined]
    return function


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Replace the functions around a test, with the fixtures that it is the first to need."""
    below = item.path.relative_to(Path(__file__).parent).parts[0]
    with pytest.MonkeyPatch.context() as patch:
        if below in FOLDERS:
            for replacement in _replacements().values():
                patch.setattr(replacement.module, replacement.attribute, replacement.answer)
        return (yield)
