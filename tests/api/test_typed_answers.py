"""The attributes of answers have types: the stub agrees with the contract, with what answers have, and with mypy."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from by_path import TESTS, load

import monitor as mm
from monitor.api.campaign import Campaign
from monitor.api.database import Database, simulate
from monitor.documents import inlined_parts

typed_answers = load("typed_answers", TESTS / "api" / "typed_answers.py")
EXAMPLES = TESTS.parent / "examples"

#: What a user may write, and what mypy has to say of the lines that are wrong.
SCRIPT = """
import monitor as mm

with mm.open("shop.duckdb") as db:
    campaign = db.campaign("five-days")
    reveal_type(campaign.compare().verdict)
    reveal_type(campaign.explain().missing[0].amplitude)
    reveal_type(campaign.uncertainty(run=3).guf.u["EXX"])
    reveal_type(campaign.compare().to_dict())
    campaign.compare().verdikt
    db.trend("HU40-T").parameters["EXX"].slope_per_yaer
    reveal_type(db.ask("plan", campaign="five-days").by_balls)
    reveal_type(mm.simulate("folder", "w C A Y b X Z (C1) t", seed=3).errors)
"""


def test_the_stub_is_that_of_the_contract() -> None:
    same = typed_answers.STUB.read_text(encoding="utf-8") == typed_answers.stub()
    assert same, "a type of answer has changed: python tests/api/typed_answers.py writes the stub anew"


def test_every_answer_of_the_interface_is_typed() -> None:
    """No method promises a bare ``Answer``; ``ask``, which takes any question, says that it may be of any type."""
    functions = [*vars(Campaign).values(), *vars(Database).values(), simulate]
    promised = [str(getattr(made, "__annotations__", {}).get("return", "")) for made in functions]
    assert [text for text in promised if "Answer[" in text] == []
    typed = {word for text in promised for word in re.findall(r"\bTyped(\w+)", text)}
    assert typed == {content.__name__ for content in typed_answers.CONTENTS}


def test_an_answer_has_what_the_stub_says_and_no_more(tmp_path: Path) -> None:
    with mm.open(tmp_path / "shop.duckdb", new=True) as db:
        db.add(EXAMPLES / "load-cell", EXAMPLES / "hidden-reversal-x")
        for name in ("load-cell", "hidden-reversal-x"):
            answer = db.campaign(name).compare()
            said = typed_answers.attributes(type(answer.content))
            own = {key for part in inlined_parts(answer.content) for key in part.__dataclass_fields__}
            assert own <= set(said)
            for key in own:
                assert getattr(answer, key) is next(
                    getattr(part, key) for part in inlined_parts(answer.content) if hasattr(part, key)
                )


@pytest.mark.slow
def test_mypy_names_the_types_and_the_mistakes_of_a_script(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    said = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--config-file", "", "--follow-imports", "silent",
         "--ignore-missing-imports", "--cache-dir", str(tmp_path / "cache"), str(script)],
        capture_output=True, text=True, check=False, cwd=TESTS.parent,
    ).stdout  # fmt: skip
    revealed = re.findall(r'Revealed type is "(.+?)"', said)
    assert [text.rpartition(".")[2] for text in revealed[:3]] == ["Verdict", "float", "float"]
    assert revealed[3].endswith("dict[str, Any]")
    assert revealed[4] == "Any"
    assert "tuple[" in revealed[5]
    mistakes = re.findall(r"error: (.+?)  \[attr-defined\]", said)
    assert len(mistakes) == 2
    assert '"TypedCompareAnswer" has no attribute "verdikt"' in mistakes[0]
    assert 'has no attribute "slope_per_yaer"' in mistakes[1]
