"""The words of a certificate by language: ``reports/certificate.LANGUAGE.toml``, one file a language.

All files have the same keys, so another language is another file. What belongs to a language besides its words is in
the file too: the decimal sign and how a day is written. The computation says a few things about itself in English
sentences (why a parameter has no number, where the covariance of the readings is from): ``computed`` recognises them
by their English wording, part by part, and says them in the language; one that it does not know stays as it is.
"""

from __future__ import annotations

import re
import string
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from functools import cache

from markupsafe import Markup

from monitor.exceptions import InputError
from monitor.reporting.numbers import written
from monitor.reporting.resources import report_folder, report_text

ENGLISH = "en"
_FILE = re.compile(r"certificate\.([a-z]{2})\.toml")
_NUMBER = re.compile(r"\d+\.\d+")


@dataclass(frozen=True)
class Texts:
    """The words of one ``language`` (ISO 639-1) under ``section.key``."""

    language: str
    words: Mapping[str, str]

    def __call__(self, key: str, /, **values: object) -> str:
        """A text with its places filled in. Raises KeyError for a key or a place that nobody wrote."""
        return self.words[key].format(**values)

    def markup(self, key: str, /, **values: object) -> Markup:
        """As the call, for a page: the text's own marks stay, those of ``values`` are escaped."""
        return Markup(self.words[key]).format(**values)

    @property
    def decimal_sign(self) -> str:
        return self.words["language.decimal_sign"]

    def day(self, day: date) -> str:
        """A day as the language writes it."""
        return self("language.date", year=day.year, month=day.month, day=day.day)

    def number(self, number: Decimal) -> str:
        """A decimal number with a true minus sign and the language's decimal sign."""
        return written(number, self.decimal_sign)

    def computed(self, sentence: str) -> str:
        """A sentence of the computation in this language."""
        if self.language == ENGLISH:
            return sentence
        for key, pattern in _patterns():
            if match := pattern.fullmatch(sentence):
                return self(key, **{name: self.computed(part) for name, part in match.groupdict().items()})
        if _NUMBER.fullmatch(sentence):
            return sentence.replace(".", self.decimal_sign)
        return ", ".join(map(self.computed, sentence.split(", "))) if ", " in sentence else sentence


@cache
def languages() -> tuple[str, ...]:
    """The languages that a certificate can be written in (ISO 639-1)."""
    names = (_FILE.fullmatch(file.name) for file in report_folder().iterdir())
    return tuple(sorted(match[1] for match in names if match))


@cache
def texts_of(language: str = ENGLISH) -> Texts:
    """The texts of a language. Raises InputError for one that has none."""
    if language not in languages():
        raise InputError(f"there are no texts in {language!r}; there are {', '.join(languages())}")
    tables = tomllib.loads(report_text(f"certificate.{language}.toml"))
    sentences = {f"{section}.{key}": text for section, table in tables.items() for key, text in table.items()}
    return Texts(language, sentences)


@cache
def _patterns() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """The English sentences of the computation as patterns, in the order of their file."""
    patterns = []
    for key, text in texts_of(ENGLISH).words.items():
        if key.startswith("sentences."):
            parts = [
                re.escape(literal) + (f"(?P<{name}>.+?)" if name else "")
                for literal, name, _, _ in string.Formatter().parse(text)
            ]
            patterns.append((key, re.compile("".join(parts))))
    return tuple(patterns)
