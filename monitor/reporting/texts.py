"""The words of a certificate by language: ``reports/certificate.LANGUAGE.toml``, one file a language.

All files have the same keys, so another language is another file. What belongs to a language besides its words is in
the file too: the decimal sign and how a day is written.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from functools import cache

from markupsafe import Markup, escape

from monitor.exceptions import InputError
from monitor.reporting.numbers import written
from monitor.reporting.resources import report_folder, report_text

ENGLISH = "en"
#: Symbols as sentences write them, with what stands below the line in print.
_SYMBOL = re.compile(r"\b(k|R|u)_(q|p|C|P|day|Tag)\b")
#: SHA-256 in hexadecimal digits.
_HASH = re.compile(r"\b[0-9a-f]{64}\b")
#: A space between a number and its unit, and on both sides of a sign between a symbol and its number.
_NUMBER_AND_UNIT = re.compile(r"(?<=[0-9]) (?=(?:%|°C|K|mm|[µn]m(?:/m)?|[µm]?rad(?:/m)?|arcsec)(?![\w]))")
_SYMBOL_AND_NUMBER = re.compile(r"(?<=\b[A-Za-z]) ([=±<>]) (?=[−+-]?[0-9])")
#: A sign before a number, which stands by itself: ± 20, > 99.9 (in markup &gt; 99.9).
_SIGN_AND_NUMBER = re.compile(r"(?<![^ (])([±<>]|&[lg]t;) (?=[0-9])")
#: Which coefficient of an effect, behind its shape or driver: ``.110mm`` of EXX:step(-60,110).110mm.
_COEFFICIENT = re.compile(r"(?<=[A-Za-z)])\.[^.].*$")
_FILE = re.compile(r"certificate\.([a-z]{2})\.toml")


@dataclass(frozen=True)
class Texts:
    """The words of one ``language`` (ISO 639-1) under ``section.key``."""

    language: str
    sentences: Mapping[str, str]

    def __call__(self, key: str, /, **values: object) -> str:
        """A text with its places filled in. Raises KeyError for a key or a place that nobody wrote."""
        return self.sentences[key].format(**values)

    def markup(self, key: str, /, **values: object) -> Markup:
        """As the call, for a page: the text's own marks stay, those of ``values`` are escaped."""
        return Markup(self.sentences[key]).format(**values)

    @property
    def decimal_sign(self) -> str:
        """The sign between whole and decimal digits."""
        return self.sentences["language.decimal_sign"]

    def day(self, day: date) -> str:
        """A day as the language writes it."""
        return self("language.date", year=day.year, month=day.month, day=day.day)

    def number(self, number: Decimal) -> str:
        """A decimal number with a true minus sign and the language's decimal sign."""
        return written(number, self.decimal_sign)


def breakable(name: str) -> Markup:
    """The name of an effect for a narrow column, which goes on in the next line behind the name of its error, or with
    which of its coefficients it is."""
    broken = str(escape(name)).replace(":", ":<wbr>")
    return Markup(_COEFFICIENT.sub(r'<wbr><span class="nowrap">\g<0></span>', broken))


def with_subscripts(text: str) -> Markup:
    """A sentence for a page, its symbols (``k_q``) set with subscripts; text that is no markup is escaped.

    Its numbers stay with their units; a hash in it goes on in the next line without a hyphen, which would be copied
    with it.
    """
    marked = _SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(with_bound_units(text))))
    return Markup(_HASH.sub(r'<span class="hash">\g<0></span>', marked))


def with_bound_units(text: str) -> str:
    """A sentence, or markup, in which no line ends between a number and its unit, its sign, or its symbol."""
    bound = _NUMBER_AND_UNIT.sub("\N{NO-BREAK SPACE}", text)
    bound = _SYMBOL_AND_NUMBER.sub("\N{NO-BREAK SPACE}\\1\N{NO-BREAK SPACE}", bound)
    bound = _SIGN_AND_NUMBER.sub("\\1\N{NO-BREAK SPACE}", bound)
    return Markup(bound) if isinstance(text, Markup) else bound


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
