"""What a laboratory states on a certificate, as boxes of a form and as the file that the questions read.

The boxes are the keys of the laboratory's file (``laboratory_keys.SECTIONS``), named ``section.key``; of a list they
are numbered, ``authorised_by.0.name``. What does not apply is said in a box of its own, ``na:section.key``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from monitor.exceptions import InputError
from monitor.reporting.certificate.laboratory import MAY_NOT_APPLY
from monitor.reporting.certificate.laboratory_keys import REPEATED, SECTIONS
from monitor.reporting.texts import ENGLISH, Texts, languages, texts_of
from monitor.toml_text import toml_tables
from monitor.web.days import typed_day

#: Entries that the form has boxes for: persons who authorise, measurement standards.
ENTRIES = {"authorised_by": 2, "standards": 3}
#: A picture lies beside the laboratory's file; a form has none.
_NOT_IN_FORM = frozenset({"laboratory.mark"})
_LINES = frozenset({"laboratory.address", "customer.address"})
_DAYS = frozenset({"item.received_on", "standards.issued_on", "standards.valid_until"})
_NUMBERS = frozenset(f"temperature.{key}" for key in SECTIONS["temperature"] if key != "reference")
#: What a reader of the form may leave blank; every other box has to be filled in.
OPTIONAL = frozenset(
    {
        "laboratory.accreditation", "laboratory.country", "laboratory.dcc_version", "item.description",
        "item.identification", "traceability.scale_bar", "traceability.instruments",
        *(f"{section}.{key}" for section in ("accreditation", "standards", "temperature") for key in SECTIONS[section]),
    }
)  # fmt: skip


@dataclass(frozen=True)
class Box:
    """A box of the form: its ``name``, its label, its ``key`` in the laboratory's file, how it is filled in (line,
    lines, day, number), and what it holds.

    ``not_applicable`` is the name of the box beside it where the item may not apply. ``fault`` is what is wrong.
    """

    name: str
    label: str
    key: str
    kind: str
    value: str
    not_applicable: str
    reason: str
    optional: bool
    fault: str


@dataclass(frozen=True)
class Group:
    """A section of the form, numbered where there are several."""

    title: str
    boxes: tuple[Box, ...]
    optional: bool

    @property
    def is_open(self) -> bool:
        """Whether somebody has to look at it: it is not optional, filled in, or has a fault."""
        return not self.optional or any(box.value or box.reason or box.fault for box in self.boxes)


def groups(texts: Mapping[str, str], faults: Mapping[str, str]) -> list[Group]:
    """Return the form in the certificate's language: what is filled in, and what is wrong by the names of its boxes."""
    shown = []
    say = form_words(texts)
    for section, keys in SECTIONS.items():
        prefixes = _prefixes(section)
        for number, prefix in enumerate(prefixes, 1):
            boxes = tuple(
                _box(section, prefix, key, say, texts, faults)
                for key in keys
                if f"{section}.{key}" not in _NOT_IN_FORM
            )
            optional = prefix.endswith((".1", ".2")) or all(box.optional for box in boxes)
            title = say(f"sections.{section}")
            if len(prefixes) > 1:
                title = say("sections.several", title=title, number=number, count=len(prefixes))
            shown.append(Group(title, boxes, optional))
    return shown


def form_words(texts: Mapping[str, str]) -> Texts:
    """Return the words of the certificate's language as the form states it, English where it states none of ours."""
    language = texts.get("laboratory.language", ENGLISH)
    return texts_of(language if language in languages() else ENGLISH)


def _prefixes(section: str) -> list[str]:
    return [f"{section}.{number}" for number in range(ENTRIES[section])] if section in REPEATED else [section]


def _box(
    section: str, prefix: str, key: str, say: Texts, texts: Mapping[str, str], faults: Mapping[str, str]
) -> Box:  # fmt: skip
    key_of_file, name = f"{section}.{key}", f"{prefix}.{key}"
    kind = (
        "lines" if key_of_file in _LINES
        else "day" if key_of_file in _DAYS
        else "number" if key_of_file in _NUMBERS
        else "language" if key_of_file == "laboratory.language"
        else "line"
    )  # fmt: skip
    optional = key_of_file in OPTIONAL or prefix.endswith((".1", ".2"))
    label = say(f"boxes.{section}_{key}")
    return Box(
        name, say("boxes.if_any", label=label) if optional else label,
        f"[[{section}]] {key}" if section in REPEATED else f"[{section}] {key}", kind, texts.get(name, ""),
        f"na:{name}" if key_of_file in MAY_NOT_APPLY else "", texts.get(f"na:{name}", ""),
        optional, faults.get(name, ""),
    )  # fmt: skip


def box_of(key: str) -> list[str]:
    """Return the names of the boxes that ``MissingItem.key`` means: ``[customer] contact``, ``[[standards]] name``."""
    section, _, keys = key.replace("[", "").partition("]")
    keys = keys.lstrip("]").strip()
    if section not in SECTIONS:
        return []
    return [
        f"{_prefixes(section)[0]}.{name.strip()}"
        for name in keys.split(",")
        if name.strip() in SECTIONS[section]
    ]


def laboratory_file(texts: Mapping[str, str]) -> str:
    """Return the laboratory's file (TOML) that says what the form says.

    Raises InputError for a number or a day that is none.
    """
    lines: list[str] = []
    for section, keys in SECTIONS.items():
        for prefix in _prefixes(section):
            answers = [
                f"{key} = {answer}"
                for key in keys
                if (answer := _answer(f"{section}.{key}", f"{prefix}.{key}", texts)) is not None
            ]
            if answers:
                lines += [f"[[{section}]]" if section in REPEATED else f"[{section}]", *answers, ""]
    return "\n".join(lines)


def _answer(key_of_file: str, name: str, texts: Mapping[str, str]) -> str | None:
    """A box as a value of TOML; None where it is blank."""
    text, reason = texts.get(name, "").strip(), texts.get(f"na:{name}", "").strip()
    if not text:
        return (
            f"{{ not_applicable = {_quoted(reason)} }}" if reason and key_of_file in MAY_NOT_APPLY else None
        )
    if key_of_file in _LINES:
        return f"[{', '.join(_quoted(line.strip()) for line in text.splitlines() if line.strip())}]"
    if key_of_file in _DAYS:
        return typed_day(name, text).isoformat()
    if key_of_file in _NUMBERS:
        try:
            return repr(float(text.replace(",", ".")))
        except ValueError as error:
            raise InputError(f"{name} is a number, such as 20.5, not '{text}'") from error
    return _quoted(text)


def _quoted(text: str) -> str:
    """A text in the quotes of TOML: every letter that is not plain by its number."""
    return '"' + "".join(
        letter if letter.isprintable() and letter not in '"\\' else f"\\U{ord(letter):08X}" for letter in text
    ) + '"'  # fmt: skip


def texts_of_file(content: bytes) -> dict[str, str]:
    """Return what a laboratory's file says as texts of the form. Raises InputError for what is no TOML."""
    tables = toml_tables("the laboratory's file", content)
    texts: dict[str, str] = {}
    for section in SECTIONS:
        value = tables.get(section)
        entries: Iterable[Any] = value if isinstance(value, list) else [value]
        for prefix, entry in zip(_prefixes(section), entries, strict=False):
            if isinstance(entry, dict):
                texts |= _texts(prefix, entry)
    return texts


def _texts(prefix: str, entry: Mapping[str, Any]) -> dict[str, str]:
    texts = {}
    for key, value in entry.items():
        if isinstance(value, dict):
            texts[f"na:{prefix}.{key}"] = str(value.get("not_applicable", ""))
        elif isinstance(value, list):
            texts[f"{prefix}.{key}"] = "\n".join(map(str, value))
        else:
            texts[f"{prefix}.{key}"] = str(value)
    return texts
