"""A mistyped verb, option, machine, parameter, effect or campaign is answered with the nearest that there is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from monitor.exceptions import did_you_mean

TYPED = [
    (["improt", "x"], "there is no verb 'improt'; did you mean 'import'? there are "),
    (["Campaigns"], "did you mean 'campaigns'?"),
    (["model", "ad", "EXX:reversal"], "did you mean 'add'?"),
    (["campaigns", "--jsno"], "did you mean '--json'?"),
    (["runs", "five-day"], "there is no campaign 'five-day'; did you mean 'five-days'? there are "),
    (["trend", "hu-40"], "there is no machine 'hu-40'; did you mean 'HU40-T'? there are "),
    (["trend", "HU40-T", "--campaign", "coldcold"], "did you mean 'cold-cold'?"),
    (["trend", "HU40-T", "--campaign", "cold-cold", "--parameter", "ex0y"], "did you mean '"),
    (["identify", "five-days", "--model", "sambba"], "did you mean 'samba'?"),
    (["model", "add", "ec0b", "--to", "samba"], "did you mean 'EC0B'?"),
    (["model", "add", "EXX:revrsal", "--to", "samba"], "no shape 'revrsal'; did you mean 'reversal'?"),
    (["model", "add", "EXX:poly1@wramup", "--to", "samba"], "did you mean 'warmup'?"),
    (["model", "use", "samba", "--machine", "HU4-T", "--reason", "x"], "did you mean 'HU40-T'?"),
    (["plan", "five-days", "--wanted", "ea0b=1"], "did you mean 'EA0B'?"),
]


@pytest.mark.parametrize(("arguments", "words"), TYPED, ids=[" ".join(typed) for typed, _ in TYPED])
def test_a_mistyped_name_is_answered_with_the_nearest(
    typed: Any, filled: Path, arguments: list[str], words: str
) -> None:
    answer = typed(*arguments, db=filled)
    assert (answer.status, answer.out) == (2, "")
    assert words in answer.err


def test_nothing_near_is_no_hint() -> None:
    assert did_you_mean("trun-1", ["TRUN-01", "HU40-T"]) == "did you mean 'TRUN-01'? "
    assert did_you_mean("lathe", ["TRUN-01", "HU40-T"]) == ""
    assert did_you_mean("x", []) == ""
