"""Processor time of each test, that of the processes it starts included: ``--processor-time 10`` lists the ten slowest.

A clock would measure what else the machine does. What several tests share is counted to the first of them. A process
counts when its end was waited for. Loaded by ``tests/conftest.py``.
"""

from __future__ import annotations

import os
from collections.abc import Generator

import pytest

_SECONDS = pytest.StashKey[float]()
_PROPERTY = "processor_s"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--processor-time", type=int, default=0, metavar="N", help="list the N slowest tests")


def _used() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _phase(item: pytest.Item) -> Generator[None]:
    start = _used()
    try:
        return (yield)
    finally:
        item.stash[_SECONDS] = item.stash.get(_SECONDS, 0.0) + _used() - start


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    return (yield from _phase(item))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None]:
    return (yield from _phase(item))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None]:
    try:
        return (yield from _phase(item))
    finally:
        # A worker's reports carry it to the process that prints.
        item.user_properties.append((_PROPERTY, item.stash[_SECONDS]))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    count = config.getoption("--processor-time")
    if not count:
        return
    seconds = {
        report.nodeid: dict(report.user_properties).get(_PROPERTY, 0.0)
        for reports in terminalreporter.stats.values()
        for report in reports
        if isinstance(report, pytest.TestReport) and report.when == "teardown"
    }
    terminalreporter.write_line(f"processor time of {len(seconds)} tests: {sum(seconds.values()):.0f} s")
    for nodeid in sorted(seconds, key=lambda test: -seconds[test])[:count]:
        terminalreporter.write_line(f"{seconds[nodeid]:7.1f} s  {nodeid}")
