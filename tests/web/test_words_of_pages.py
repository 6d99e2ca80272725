"""What pages say of questions and machines reads as sentences do."""

from __future__ import annotations

import re
from typing import Any


def test_the_interface_lists_what_each_question_answers_without_marks_of_the_code(local: Any) -> None:
    text = local.client.get("/interface").text
    answers = re.findall(r'<td data-title="Answers">(.*?)</td>', text)
    assert len(answers) > 40
    for answer in answers:
        assert answer
        assert "Raises" not in answer
        assert "`" not in answer
