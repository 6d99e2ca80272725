"""Why a part of an answer is lacking: a sentence for every kind, and what of it stands in the document."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from monitor.documents import OMITTED, WORDED, from_document, to_document
from monitor.reporting.lacks import Cause, Lack, Part, Undecided, refused
from monitor.web.schemas import Schemas


@dataclass(frozen=True)
class _Answer:
    why_none: Lack | None = field(metadata=WORDED)
    undecided: Undecided | None = field(default=None, metadata={**WORDED, **OMITTED})


@pytest.mark.parametrize("cause", Cause)
def test_every_cause_has_its_sentence(cause: Cause) -> None:
    lack = Lack(Part.CYCLES, cause, 3, 0, 2, (12.0, 300.0), "runs", split=False, text="too few runs")
    sentence = str(lack)
    assert "{" not in sentence
    assert "None" not in sentence
    assert sentence.startswith("3 days of history" if cause is Cause.TOO_SHORT else "no cycles")


def test_every_part_has_its_subject() -> None:
    sentences = [str(refused(part, ValueError("2 runs are too few"))) for part in Part]
    assert all(sentence.startswith("no ") for sentence in sentences)
    assert len(set(sentences)) == len(Part)


def test_the_sentence_stands_in_the_document_and_the_kind_beside_it() -> None:
    lack = Lack(Part.DRIFT, Cause.TOO_SHORT, count=1, needed=(30.0,), split=True)
    document = to_document(_Answer(lack, Undecided.ONE_DAY_EACH))
    assert document == {
        "why_none": (
            "1 day of history since the last change or event is too short for a slope a year; at least 30 are needed"
        ),
        "why_none_kind": {"part": "drift", "cause": "too_short", "count": 1, "needed": [30.0], "split": True},
        "undecided": str(Undecided.ONE_DAY_EACH),
        "undecided_kind": "one_day_each",
    }
    assert from_document(_Answer, document) == _Answer(lack, Undecided.ONE_DAY_EACH)


def test_what_is_not_lacking_has_no_kind() -> None:
    assert to_document(_Answer(None)) == {"why_none": None}
    assert from_document(_Answer, {"why_none": None}) == _Answer(None)


def test_the_schema_has_both_keys() -> None:
    schemas = Schemas()
    schemas.of(_Answer)
    properties = schemas.definitions["_Answer"]["properties"]
    assert properties["why_none"] == {"anyOf": [{"type": "string"}, {"type": "null"}]}
    assert properties["why_none_kind"]["anyOf"][0] == {"$ref": "#/components/schemas/Lack"}
