"""Numbers that no question means, in every numeric field of every question by HTTP: refused in words, or answered.

None is a fault of the software, and none is computed without end: a test that hangs is stopped by the runner.
"""

from __future__ import annotations

import copy
import json
import math
import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi", reason="the extra web is not installed")
pytest.importorskip("plotly", reason="the extra web is not installed")

from monitor.store import Database
from monitor.web.access import FILES, offered, taken_fields
from monitor.workflow.contract import QUESTIONS
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGN, OTHER, MACHINE, TOPOLOGY = "nothing-hidden", "hidden-reversal-x", "HU40-T", "w C B X b Z Y (C1) t"
#: A document of each question that is answered, with a number in each of its fields that takes numbers. A # tells
#: documents of one question apart.
DOCUMENTS: dict[str, dict[str, Any]] = {
    "audit": {"last": 5},
    "campaigns": {"latest": 5},
    "contributions": {"campaign": "four-instruments", "run": 1},
    "explain": {"campaign": CAMPAIGN, "rate": 0.05},
    "fleet": {"top": 5},
    "identify": {"campaign": CAMPAIGN, "run": 1},
    "identify stepwise": {"campaign": CAMPAIGN, "run": 1},
    "map": {"campaign": CAMPAIGN, "run": 1, "p": 0.95, "points": 3},
    "map over the stroke": {"campaign": CAMPAIGN, "run": 1, "minus": 2, "pose": 0, "points": 3},
    "monte carlo cloud": {
        "campaign": CAMPAIGN, "first": "EB0C", "second": "EX0C", "run": 1, "p": 0.95, "trials": 100,
    },
    "plan": {"campaign": CAMPAIGN, "poses": 6, "balls": 1, "p": 0.95},
    "plan#wanted": {"campaign": CAMPAIGN, "wanted": {"EB0C": 20.0}},
    "plan#keep": {"campaign": CAMPAIGN, "keep": [1, 2, 3, 4, 5, 6]},
    "poses": {
        "topology": TOPOLOGY, "readings": {"X": [0.0]}, "errors": {"EXX:poly1": [1.0]}, "tool_mm": [0.0, 0.0, 1.0],
        "target_mm": [0.0, 0.0, 0.0],
    },
    "report": {"options": {"risk": 0.05}},
    "selections side by side": {"names": [CAMPAIGN, OTHER], "p": 0.95},
    "simulate like a campaign": {
        "like": CAMPAIGN, "machines": ["x"], "start": "2026-01-05", "months": 1, "seed": 1,
        "effect": "EZC1:const@warmup", "peak_um": 5.0, "drifts": [{"parameter": "EB0C", "per_month": 1.0}],
        "events": [{"parameter": "EB0C", "size": 1.0, "on": "2026-01-06"}],
    },
    "sql": {"query": "SELECT 1", "limit": 5},
    "standards": {"campaign": "laser", "seed": 1},
    "trend": {"machine": MACHINE, "reliability": 0.9, "volumetric_limit_um": 20.0},
    "uncertainty": {
        "campaign": CAMPAIGN, "run": 1, "digits": 2, "seed": 1, "p": 0.95, "method": "guf",
        "sources": [{"name": "balls", "quantity": "ball_form", "size": 1e-4, "degrees_of_freedom": 5.0}],
    },
    "verify": {"recompute": 0, "seed": 1},
    "withdraw event": {"machine": MACHINE, "number": 1, "reason": "the year was mistyped"},
}  # fmt: skip
#: What other quantities of sources have, and rotary probing alone: refused as such before any number is looked at.
NOT_OF_THESE = (
    "sources.expansion_coefficient",
    "sources.temperature_offset",
    "sources.node_spacing",
    "linear_axes.",
)
NO_NUMBERS = [math.nan, math.inf, -math.inf, "1e400", [1.0, 2.0]]
ODD_NUMBERS = [-1, -1.5, 0, 1e-300, 1e300, -1e300, 10**30, -(10**30), True]


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory, serve: Any) -> Any:
    path = tmp_path_factory.mktemp("hostile") / "monitor.duckdb"
    with Database(path, threads=1) as db:
        names = (CAMPAIGN, OTHER, "four-instruments", "laser")
        import_folders(db, ImportRequest([EXAMPLES / name for name in names]))
        for name in (CAMPAIGN, OTHER):
            identify(db, IdentifyRequest(name))
    return serve(path, False)


def answer(asked: Any, name: str, document: Mapping[str, Any]) -> tuple[int, str]:
    """Status and text of the answer to a document that may hold what JSON has not (NaN, Infinity)."""
    address = f"/api/v1/{name.partition('#')[0].replace(' ', '-')}"
    sent = asked.client.post(
        address, content=json.dumps(document).encode(), headers={"Content-Type": "application/json"}
    )
    return sent.status_code, sent.text[:300]


def numbers(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths of the numbers of a document."""
    if isinstance(value, dict | list):
        for key, element in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers(element, (*path, key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path


def replaced(document: dict[str, Any], path: tuple[Any, ...], value: Any) -> dict[str, Any]:
    changed = copy.deepcopy(document)
    inner: Any = changed
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return changed


def numeric_fields(hint: Any, path: str) -> Iterator[str]:
    """The names of the numeric fields of a type, with those of the records that it holds."""
    if hint in (int, float):
        yield path
    elif is_dataclass(hint) and isinstance(hint, type):
        hints = typing.get_type_hints(hint)
        for field in fields(hint):
            yield from numeric_fields(hints[field.name], f"{path}.{field.name}")
    else:
        for member in typing.get_args(hint):
            yield from numeric_fields(member, path)


def test_every_numeric_field_of_every_question_is_tried() -> None:
    tried, there = set(), set()
    for name, document in DOCUMENTS.items():
        for path in numbers(document):
            names = [key for key in path if isinstance(key, str)]
            field = names[0] if names[0] in ("wanted", "readings", "errors") else ".".join(names)
            tried.add((name.partition("#")[0], field))
    for question in offered():
        kind = QUESTIONS[question].request
        # What reads an upload is asked with its file, in tests of its own.
        if kind is None or (question in FILES and FILES[question].upload is not None):
            continue
        hints = typing.get_type_hints(kind)
        for name in taken_fields(question):
            there |= {(question, field) for field in numeric_fields(hints[name], name)}
    assert {(question, field) for question, field in there if not field.startswith(NOT_OF_THESE)} == tried


@pytest.mark.parametrize("name", DOCUMENTS)
def test_what_is_no_number_is_refused_in_words(asked: Any, name: str) -> None:
    for path in numbers(DOCUMENTS[name]):
        for value in NO_NUMBERS:
            status, text = answer(asked, name, replaced(DOCUMENTS[name], path, value))
            assert status == 400, (path, value, text)


@pytest.mark.slow
@pytest.mark.parametrize("name", DOCUMENTS)
def test_an_odd_number_is_answered_or_refused_in_words(asked: Any, name: str) -> None:
    status, text = answer(asked, name, DOCUMENTS[name])
    # No event was recorded, and none is withdrawn here.
    assert status == {"identify stepwise": 400, "withdraw event": 404}.get(name, 200), text
    for path in numbers(DOCUMENTS[name]):
        for value in ODD_NUMBERS:
            status, text = answer(asked, name, replaced(DOCUMENTS[name], path, value))
            assert status in (200, 400, 404, 422), (path, value, text)
            if status == 200 and text.startswith("{"):
                assert not {"NaN", "Infinity"} & set(re.findall("[A-Za-z]+", text)), (path, value, text)


MANY = 20_000
#: Lists and texts of a length that nobody types, and what is said of them.
LONG: dict[str, tuple[dict[str, Any], str]] = {
    "add effect": ({"effect": "EXX:reversal", "to": "samba", "beside": ["EXX:poly2"] * MANY}, "100 effects at most"),
    "campaigns": ({"containing": "x " * MANY}, "at most 20 words"),
    "export": ({"tables": ["x"] * MANY}, "there is no table 'x'"),
    "plan": ({"campaign": CAMPAIGN, "keep": list(range(MANY))}, "the indexations to keep are numbers from 1 on"),
    "plan#wanted": ({"campaign": CAMPAIGN, "wanted": {f"E{n}": 1.0 for n in range(MANY)}}, "no such parameter"),
    "poses": ({"topology": f"w {'X ' * MANY}b t", "readings": {"X": [0.0]}}, "topology"),
    "report": ({"options": {"campaigns": ["x"] * MANY}}, "there is no campaign 'x'"),
    "selections side by side": ({"names": [CAMPAIGN] * MANY}, "at least two"),
    "simulate like a campaign": (
        {"like": CAMPAIGN, "machines": ["x"], "start": "2026-01-05", "months": 1,
         "drifts": [{"parameter": "EB0C", "per_month": 1.0}] * MANY}, "drifts and events: 1000 at most together",
    ),
    "sql": ({"query": f"SELECT {'(' * MANY}1{')' * MANY}"}, "no SQL that DuckDB understands"),
    "trend": ({"machine": MACHINE, "campaigns": ["x"] * MANY}, "holds no campaign 'x'"),
}  # fmt: skip


@pytest.mark.parametrize("name", LONG)
def test_a_list_or_text_of_any_length_is_no_server_error(asked: Any, name: str) -> None:
    document, said = LONG[name]
    status, text = answer(asked, name, document)
    assert status in (400, 404), text
    assert said in text
