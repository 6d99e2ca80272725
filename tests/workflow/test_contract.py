"""One contract: every question takes a frozen request and gives a frozen answer, and the faces ask nothing else."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import monitor
from monitor.documents import Sentence
from monitor.workflow.contract import QUESTIONS, Question

PACKAGE = Path(monitor.__file__).parent
#: What a document holds as it is; a sentence as its text.
SCALARS = (Sentence, str, int, float, bool, datetime, date, Path, type(None))
#: What is handed out as it was stored, whatever it holds: the record of a certificate of any version.
AS_STORED = ["show certificate.record[]: typing.Any"]
#: What the command line takes from the workflow besides questions, and why.
BESIDES_QUESTIONS = {
    "demo:examples_folder",  # the demo types the verbs of the command line itself
    "demo:fresh_database",
    "watching.letter:lines_of",  # the words of a letter, on a screen
    "health.mail:mail_report",  # sends what was written; nothing is asked
    "health.mail:read_mail_settings",
    "intake.checked_tolerances:wrong_on_any_machine",  # looks at a configuration, which is no database's
}

each_question = pytest.mark.parametrize("question", QUESTIONS.values(), ids=lambda question: question.name)


def _not_plain(kind: Any, path: str, seen: frozenset[type] = frozenset()) -> Iterator[str]:
    """Every part of a type that ``from_document`` could not restore."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType, tuple, list, Sequence):
        for member in typing.get_args(kind):
            if member is not Ellipsis:
                yield from _not_plain(member, path, seen)
    elif origin in (dict, Mapping):
        yield from _not_plain(typing.get_args(kind)[1], f"{path}[]", seen)
    elif origin is typing.Literal or origin is np.ndarray or kind in SCALARS:
        return
    elif dataclasses.is_dataclass(kind):
        if kind in seen:
            return
        assert isinstance(kind, type)
        if not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
            yield f"{path}: {kind.__name__} is not frozen"
        hints = typing.get_type_hints(kind)
        for field in dataclasses.fields(kind):
            if field.name.startswith("why_no_") and hints[field.name] in (str, str | None):
                yield f"{path}.{field.name}: a sentence, where a kind is wanted"
            yield from _not_plain(hints[field.name], f"{path}.{field.name}", seen | {kind})
    elif not (isinstance(kind, type) and issubclass(kind, Enum)):
        yield f"{path}: {kind}"


@each_question
def test_a_request_is_a_frozen_record_of_plain_values(question: Question) -> None:
    if question.request is not None:
        assert list(_not_plain(question.request, question.request.__name__)) == []


@each_question
def test_an_answer_is_a_frozen_record_that_json_can_hold(question: Question) -> None:
    assert [part for part in _not_plain(question.answer, question.name) if part not in AS_STORED] == []


@each_question
def test_a_question_takes_a_database_and_a_request_and_nothing_else(question: Question) -> None:
    names = list(inspect.signature(question.load()).parameters)
    assert set(names) <= {"db", "request", "progress"}


def _functions_asked(path: Path) -> Iterator[str]:
    """``module:name`` of every function of the workflow that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("monitor.workflow"):
            module = importlib.import_module(str(node.module))
            for alias in node.names:
                value = getattr(module, alias.name, None)
                if inspect.isfunction(value):
                    yield f"{value.__module__}:{alias.name}".removeprefix("monitor.workflow.")
                elif value is None or inspect.ismodule(value):
                    yield from _attributes(path, f"{node.module}.{alias.name}", alias.asname or alias.name)


def _attributes(path: Path, module_name: str, local: str) -> Iterator[str]:
    module = importlib.import_module(module_name)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == local:
            value = getattr(module, node.attr, None)
            if inspect.isfunction(value):
                yield f"{value.__module__}:{node.attr}".removeprefix("monitor.workflow.")


def _asked_by(face: str) -> set[str]:
    paths = sorted((PACKAGE / face).rglob("*.py"))
    return {function for path in paths for function in _functions_asked(path)}


def test_the_faces_ask_nothing_but_the_questions_of_the_contract() -> None:
    questions = {question.function for question in QUESTIONS.values()}
    command_line, python = _asked_by("cli"), _asked_by("api")
    assert command_line - questions == BESIDES_QUESTIONS
    assert python <= questions
    # The pages ask every question by its name.
    assert _asked_by("web") == set()
    # What people in Python and the pages ask: the kinematic model alone, and what the command line has in other words.
    assert questions - command_line == {
        "events:events",
        "explain.residual_vectors:residual_vectors",
        "explain.residuals_by_driver:residuals_by_driver",
        "history.periods:periods",
        "history.values:values_of_machine",
        "kinematics:poses",
        "query:readings",
        "simulation:simulate_machine",
        "uncertainty.cloud:cloud",
        "volumetric.over_stroke:over_stroke",
    }
