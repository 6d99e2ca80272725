"""A laboratory's file to be filled in: every key, no answer, in each language; and refusals that name its keys."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.reporting.certificate.laboratory_keys import SECTIONS
from monitor.reporting.texts import languages


@pytest.mark.parametrize("language", languages())
def test_a_template_has_every_key_and_no_answer(typed: Any, language: str) -> None:
    answer = typed("certificate", "template", "--language", language, "--json")
    assert answer.document == {"file": "laboratory.toml", "language": language}
    text = Path("laboratory.toml").read_text(encoding="utf-8")
    sections = {
        name: set(re.findall(r"^(?:# )?(\w+) = ", part, re.MULTILINE))
        for name, part in re.findall(
            r"^(?:# )?\[+(\w+)\]+(.*?)(?=^(?:# )?\[|\Z)", text, re.MULTILINE | re.DOTALL
        )
    }
    assert sections == {name: set(keys) for name, keys in SECTIONS.items()}
    assert read_laboratory("laboratory.toml").language == language


def test_an_unanswered_template_is_refused_with_the_key_of_every_item(typed: Any, db: Path) -> None:
    assert typed("certificate", "template", "--language", "de", "--out", "lab.toml").status == 0
    answer = typed("certificate", "issue", "cold-cold", "--run", 3, "--laboratory", "lab.toml", db=db)
    assert (answer.status, answer.out) == (2, "")
    assert "customer, contact: write [customer] contact (ISO/IEC 17025:2017, 7.8.2.1 e)" in answer.err
    assert "`monitor certificate template` writes one with all of them" in answer.err
    asked = set(re.findall(r": write \[+(\w+)\]+ (\w+) \(", answer.err))
    # What the campaign answers, and what may be left out, is not asked for.
    free = {
        ("laboratory", "accreditation"), ("laboratory", "country"), ("laboratory", "language"),
        ("item", "description"), ("item", "identification"), ("traceability", "scale_bar"), ("statements", "title"),
        ("traceability", "instruments"), ("laboratory", "mark"), ("laboratory", "dcc_version"),
    }  # fmt: skip
    whole = {"accreditation", "standards", "temperature"}
    every = {(section, key) for section, keys in SECTIONS.items() for key in keys if section not in whole}
    assert asked == every - free


def test_a_template_that_is_answered_key_by_key_is_enough(typed: Any, db: Path) -> None:
    assert typed("certificate", "template").status == 0
    file = Path("laboratory.toml")
    text = file.read_text(encoding="utf-8").replace('= ""', '= "an answer"').replace("= []", '= ["a line"]')
    file.write_text(text.replace('= "an answer" }', '= "why" }'), encoding="utf-8")
    answer = typed("certificate", "issue", "cold-cold", "--run", 3, "--laboratory", file, db=db)
    assert (answer.status, answer.err) == (0, "")


def test_a_template_is_not_written_over_a_file(typed: Any) -> None:
    Path("laboratory.toml").write_text("mine", encoding="utf-8")
    answer = typed("certificate", "template")
    assert (answer.status, Path("laboratory.toml").read_text(encoding="utf-8")) == (2, "mine")
    assert "laboratory.toml is there already and is not written over" in answer.err
    answer = typed("certificate", "template", "--language", "fr", "--out", "x.toml")
    assert "there is no template in 'fr'; there are de, en" in answer.err
