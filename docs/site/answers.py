"""Leads the types of answers in the Python reference to the page of questions and documents."""

from __future__ import annotations

from typing import Any

import documents
from docutils import nodes
from sphinx.application import Sphinx


def _anchors() -> dict[str, str]:
    """Return the anchor of every type of answer: that of the first question that gives it; of any answer the page's."""
    anchors = {"AnyAnswer": "questions-and-documents"}
    for name, question in documents.QUESTIONS.items():
        for answer in documents.members(question.answer):
            anchors.setdefault(answer.__name__, name.replace(" ", "-"))
    return anchors


def setup(app: Sphinx) -> dict[str, Any]:
    """Resolve what would be a missing reference of the domain ``py``."""
    anchors = _anchors()

    def resolve(app: Sphinx, env: object, node: Any, content: nodes.Node) -> nodes.Node | None:
        anchor = anchors.get(str(node.get("reftarget", "")).rpartition(".")[2].removeprefix("Typed"))
        if anchor is None or node.get("refdomain") != "py" or node.get("refdoc") != "reference/python":
            return None
        return nodes.reference("", "", content, internal=True, refuri=f"documents.html#{anchor}")

    app.connect("missing-reference", resolve)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
