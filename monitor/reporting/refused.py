"""Why a parameter has no number, in the language of a certificate.

A method gives the reason as an English sentence, which records store as it is. ``reason`` recognises it by the English
texts of section ``sentences``, part by part, and says it in another language; a sentence that nobody translated stays
as it is.
"""

from __future__ import annotations

import re
import string
from functools import cache

from monitor.reporting.texts import ENGLISH, Texts, texts_of

_NUMBER = re.compile(r"\d+\.\d+")


def reason(sentence: str, texts: Texts) -> str:
    """The English sentence of a refusal in the language of ``texts``."""
    if texts.language == ENGLISH:
        return sentence
    for key, pattern in _patterns():
        if match := pattern.fullmatch(sentence):
            return texts(key, **{name: reason(part, texts) for name, part in match.groupdict().items()})
    if _NUMBER.fullmatch(sentence):
        return sentence.replace(".", texts.decimal_sign)
    return ", ".join(reason(part, texts) for part in sentence.split(", ")) if ", " in sentence else sentence


@cache
def _patterns() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """The English sentences as patterns, in the order of their file."""
    patterns = []
    for key, text in texts_of(ENGLISH).words.items():
        if key.startswith("sentences."):
            parts = [
                re.escape(literal) + (f"(?P<{name}>.+?)" if name else "")
                for literal, name, _, _ in string.Formatter().parse(text)
            ]
            patterns.append((key, re.compile("".join(parts))))
    return tuple(patterns)
