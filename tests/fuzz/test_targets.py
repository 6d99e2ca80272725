"""Whatever reads what others wrote takes an input or refuses it in words: damaged inputs by hypothesis.

The same targets, guided by coverage and with a million inputs, are run by ``make fuzz``; what that found stands in the
tests of each reader.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from by_path import load
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

from monitor.exceptions import InputError, MonitorError

fuzz: ModuleType = load("fuzz_targets", Path(__file__).with_name("targets.py"))

#: Signs that mean something to one of the readers.
PIECES = [
    b"", b",", b";", b"\n", b"\r", b'"', b"'", b"nan", b"1e999", b"-", b"\0", b"\xff", b"[" * 3000, b"[[a]]\n", b"=",
    b"{", b".", b'"""', b"9" * 5000, b"true", b"(", b"<a>", b"\\ud800", b"1,5", b"%", b"+", b":", b"@", b"\xc2\xb2",
]  # fmt: skip
#: Their types alone take some seconds to load: the tests of both interfaces give them what is wrong.
LONG_TO_LOAD = {"requests", "arguments"}


@functools.cache
def taker(name: str) -> tuple[Callable[[bytes], object], tuple[bytes, ...]]:
    """What takes the inputs of a target, and those to begin from, the long ones cut."""
    target = fuzz.TARGETS[name]
    return target.make(), tuple(content[:6000] for content in target.seeds())


def give(name: str, content: bytes) -> None:
    try:
        taker(name)[0](content)
    except MonitorError as refusal:
        said = str(refusal)
        assert said.strip()
        said.encode("utf-8")  # raises where a message cannot be printed


def damage(data: st.DataObject, name: str) -> None:
    sound = data.draw(st.sampled_from(taker(name)[1]))
    start = data.draw(st.integers(0, len(sound)))
    piece = data.draw(st.sampled_from(PIECES) | st.binary(max_size=8))
    give(name, sound[:start] + piece + sound[start + data.draw(st.integers(0, 20)) :])


QUIET = {
    "deadline": None,
    "suppress_health_check": list(HealthCheck),
    "database": None,
    "phases": [Phase.generate],
}


@pytest.mark.parametrize("name", sorted(fuzz.TARGETS.keys() - LONG_TO_LOAD))
def test_damaged_inputs_are_taken_or_refused_in_words(name: str) -> None:
    @settings(max_examples=10, derandomize=True, **QUIET)
    @given(st.data())
    def each(data: st.DataObject) -> None:
        damage(data, name)

    each()


@pytest.mark.slow
@pytest.mark.parametrize("name", fuzz.TARGETS)
def test_many_damaged_inputs_are_taken_or_refused_in_words(name: str) -> None:
    @settings(max_examples=150, derandomize=True, **QUIET)
    @given(st.data())
    def each(data: st.DataObject) -> None:
        damage(data, name)

    each()


@pytest.mark.parametrize("name", sorted(fuzz.TARGETS.keys() - LONG_TO_LOAD))
def test_an_input_to_begin_from_is_taken(name: str) -> None:
    # A target that refuses whatever it is given would show nothing.
    take, seeds = taker(name)
    refusals = []
    for content in seeds[:60]:
        try:
            take(content)
        except MonitorError as refusal:
            refusals.append(str(refusal))
    assert len(refusals) < len(seeds[:60]), refusals[:3]


def test_half_a_character_of_a_name_is_escaped_in_the_refusal() -> None:
    """Such a refusal ended in UnicodeEncodeError where it was printed or sent."""
    from monitor.web.asking import request_of

    with pytest.raises(InputError, match=r"takes no 'mo.ud800el'; did you mean 'model'") as refused:
        request_of("identify all", {"mo\ud800el": "x"}, {})
    assert str(refused.value).encode("utf-8")
