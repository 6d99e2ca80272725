"""The configuration of a place: one TOML file with what would be typed again and again.

``$MONITOR_CONFIG``, else ``monitor.toml`` in the working folder, else ``monitor/monitor.toml`` in the user's folder of
configurations (``$XDG_CONFIG_HOME``, else ``~/.config``). An option that is typed and ``$MONITOR_DB`` stand above it.
"""

from __future__ import annotations

import math
import os
import re
import zoneinfo
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from monitor.exceptions import InputError, StoreError, did_you_mean
from monitor.toml_text import toml_file

NAME = "monitor.toml"
#: The units of angle that a screen may have.
ANGLE_UNITS = ("µrad", "arcsec", "µm/m")
_TEXTS = ("language", "time_zone", "angle_unit", "timestamp_url")
#: Terms as ISO 230-1:2012, 3.4.16 spells them, of axes of any name.
_TERM = re.compile(r"E[XYZABC]0?[A-Za-z][A-Za-z0-9]*|[A-Za-z0-9]+:\S+")
_EFFECT_SIGN = ":"
#: The letter O where a location error has a zero, before an axis of ISO 841: ``ECOY`` would be of an axis OY. ``EXOP``
#: may be of an axis OP; where no machine of the type has one, ``trend`` and ``fleet`` say so.
_LETTER_FOR_ZERO = re.compile(r"(E[XYZABC])[Oo]([A-CU-Za-cu-z][0-9]*)")
_AXIS_IN_SMALL_LETTERS = re.compile(r"(E[XYZABC]0?)([xyzabc][0-9]*)")
TEMPLATE = """# The configuration of monitor. Take the # away from what you need; `monitor config check` says
# whether it can be read.
# Paths without a leading / are counted from the folder of this file.

# database = "shop.duckdb"         # in place of --db
# laboratory = "laboratory.toml"   # in place of --laboratory of a certificate
# language = "en"                  # of `certificate template`: en or de
# mail = "mail.toml"               # what `report --mail` without a file sends by
# time_zone = "Europe/Berlin"      # of moments that are typed without an offset from UTC; else that of this computer
# angle_unit = "arcsec"            # of angles on the screen: µrad, arcsec or µm/m
# trusted_signers = "signers.pem"  # who may sign: certificates (PEM, DER), or a SHA-256 fingerprint a line
# timestamp_url = "https://tsa.example.org"  # authority whose time stamp (RFC 3161) signed certificates get
# long_term = "authorities.pem"    # certificates that signer and time stamp lead to: PAdES B-LT

# Tolerances by machine type ([machine] model of campaign.toml; "*" for all others): limits of absolute values in µm,
# µrad or µm/m for trend, fleet and report, where the machine's campaign states none of its own. A certificate states
# conformity with the tolerances of its campaign alone.
# [tolerances."HU40-T"]
# EC0Y = 20.0
# volumetric = 50.0
"""


@dataclass(frozen=True)
class Configuration:
    """What a configuration says, None where it says nothing; ``file`` is None where there is none."""

    file: Path | None = None
    database: Path | None = None
    laboratory: Path | None = None
    language: str | None = None
    mail: Path | None = None
    time_zone: str | None = None
    angle_unit: str | None = None
    timestamp_url: str | None = None
    trusted_signers: Path | None = None
    long_term: Path | None = None
    tolerances: Mapping[str, Mapping[str, float]] | None = None


def place() -> Path | None:
    """The file that is read; None where there is none. Raises InputError where $MONITOR_CONFIG names no file."""
    named = os.environ.get("MONITOR_CONFIG")
    if named:
        if not os.path.isfile(named):
            raise InputError(
                f"MONITOR_CONFIG names {named}, which is no file; `monitor config init` writes one"
            )
        return Path(named)
    home = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    # A folder that this user may not look into, as under another's $HOME, holds no configuration for him.
    return next((file for file in (Path(NAME), Path(home) / "monitor" / NAME) if os.path.isfile(file)), None)


def configuration() -> Configuration:
    """The configuration of the working folder or the user. Raises InputError with every fault of the file."""
    file = place()
    return Configuration() if file is None else read(file.absolute())


def read(file: Path) -> Configuration:
    """Read a configuration. Raises InputError with every fault of the file."""
    document = toml_file(file)
    faults = [fault for key, value in document.items() for fault in _faults(key, value, file)]
    if faults:
        raise InputError("\n  ".join([f"{file} was refused:", *faults]))
    paths = {
        key: file.parent / document[key]
        for key in ("database", "laboratory", "mail", "trusted_signers", "long_term")
        if key in document
    }
    texts = {key: document[key] for key in _TEXTS if key in document}
    return Configuration(file, **paths, **texts, tolerances=document.get("tolerances"))


def _faults(key: str, value: object, file: Path) -> Iterator[str]:
    """Yield what is wrong with a key."""
    if key == "tolerances":
        yield from _tolerances(value)
    elif key not in _CHECKS:
        keys = (*_CHECKS, "tolerances")
        yield f"there is no key {key}; {did_you_mean(key, keys)}there are {', '.join(keys)}"
    elif not isinstance(value, str) or not value.strip():
        yield f'{key} is a text in quotes, such as {key} = "..."'
    elif wrong := _CHECKS[key](value, file):
        yield f"{key} = {value!r}: {wrong}"


def _tolerances(value: object) -> Iterator[str]:
    """Yield what is wrong with the tolerances by machine type."""
    example = 'write [tolerances."TYPE"] and below it limits such as EC0Y = 20.0'
    if not isinstance(value, dict) or not all(isinstance(limits, dict) for limits in value.values()):
        yield f"tolerances are tables, one a machine type; {example}"
        return
    if twice := _one_type_twice(value):
        yield twice
    for name, limits in value.items():
        if not limits:
            yield f'[tolerances."{name}"] states no limit; {example}'
        for term, limit in limits.items():
            if wrong := _wrong_term(term):
                yield f'[tolerances."{name}"] {term}: {wrong}'
            number = isinstance(limit, (int, float)) and not isinstance(limit, bool)
            if not number or not 0.0 < limit < math.inf:
                yield f'[tolerances."{name}"] {term} = {limit!r}: a number above 0 in µm, µrad or µm/m'


def _wrong_term(term: str) -> str:
    """Why no machine has a limit of such a name; empty where one may have."""
    if term != "volumetric" and not _TERM.fullmatch(term):
        return (
            "no name of a term; write it as in ISO 230-1, such as EC0Y or EXX, as an effect such as EXX:reversal, or "
            "volumetric"
        )
    if letter := _LETTER_FOR_ZERO.fullmatch(term.partition(_EFFECT_SIGN)[0]):
        return f"this has the letter O where a zero stands; did you mean '{letter[1]}0{letter[2]}'?"
    if _EFFECT_SIGN in term:
        return _wrong_effect(term)
    if small := _AXIS_IN_SMALL_LETTERS.fullmatch(term):
        return f"axes are named by capital letters; did you mean {small[1]}{small[2].upper()}?"
    return ""


def _one_type_twice(types: Iterable[str]) -> str | None:
    """What is wrong with machine types of which two are one but for upper and lower case; None where nothing is."""
    first: dict[str, str] = {}
    for name in types:
        if first.setdefault(name.casefold(), name) != name:
            other = first[name.casefold()]
            return f'[tolerances."{other}"] and [tolerances."{name}"] are one type; write one of them'
    return None


def _wrong_effect(name: str) -> str:
    """Why no machine has such an effect; empty where one may have."""
    # Loaded here: hardly any configuration limits an effect, and the language takes a tenth of a second.
    from monitor.workflow.intake.checked_tolerances import wrong_on_any_machine

    return wrong_on_any_machine(name)


def _database(value: str, file: Path) -> str:
    # Loaded here: a configuration without a database needs none.
    from monitor.store import check_database_name

    try:
        check_database_name(value)
        check_database_name(str(file.parent / value))
    except StoreError as error:
        return str(error)
    if value.startswith(":memory:"):
        return "this names no file; name one, for example monitor.duckdb"
    folder = (file.parent / value).parent
    return "" if folder.is_dir() else f"the folder {folder} does not exist"


def _file(value: str, file: Path) -> str:
    return "" if (file.parent / value).is_file() else f"there is no file {file.parent / value}"


def _language(value: str, file: Path) -> str:
    return "" if value in ("de", "en") else "write de or en"


def _angle(value: str, file: Path) -> str:
    return "" if value in ANGLE_UNITS else f"write {', '.join(ANGLE_UNITS[:-1])} or {ANGLE_UNITS[-1]}"


def _zone(value: str, file: Path) -> str:
    try:
        zoneinfo.ZoneInfo(value)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        return "there is no such time zone; write for example Europe/Berlin or UTC"
    return ""


def _address(value: str, file: Path) -> str:
    return "" if value.startswith(("http://", "https://")) else "write an address with http:// or https://"


_CHECKS: dict[str, Callable[[str, Path], str]] = {
    "database": _database,
    "laboratory": _file,
    "language": _language,
    "mail": _file,
    "time_zone": _zone,
    "angle_unit": _angle,
    "timestamp_url": _address,
    "trusted_signers": _file,
    "long_term": _file,
}
