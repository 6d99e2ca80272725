"""What is fuzzed: everything that reads what other people wrote, each with inputs to begin from.

``fuzz.py`` gives these to atheris, which is guided by coverage, ``test_targets.py`` to hypothesis. A target makes what
it needs once and returns a function of bytes, which returns, or raises a ``MonitorError`` with words.
"""

from __future__ import annotations

import atexit
import io
import json
import re
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLES = CHECKOUT / "examples"
TOPOLOGY = "w C B X b Z Y (C1) t"

Take = Callable[[bytes], object]


@dataclass(frozen=True)
class Target:
    """``make`` returns what takes an input; ``seeds`` yields the inputs to begin from."""

    make: Callable[[], Take]
    seeds: Callable[[], Iterator[bytes]]


def _text(content: bytes) -> str:
    return content.decode(errors="replace")


def _room() -> Path:
    """A folder in memory, where the machine offers it, which goes with the process."""
    room = Path(tempfile.mkdtemp(prefix="fuzz-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
    atexit.register(shutil.rmtree, room, ignore_errors=True)
    return room


def _first(content: bytes, count: int) -> tuple[int, bytes]:
    """Which of several an input is for, by its first byte, and the rest."""
    return (content[0] % count if content else 0), content[1:]


# Languages -----------------------------------------------------------------------------------------------------------


def effects() -> Take:
    from monitor.effects.effect import parse_effect
    from monitor.machine import parse_topology

    chain = parse_topology(TOPOLOGY)
    return lambda content: parse_effect(_text(content), chain)


def curves() -> Take:
    from monitor.effects.curve.language import parse_curve_effect

    return lambda content: parse_curve_effect(_text(content))


def formulas() -> Take:
    """Formulas, computed at three poses."""
    import numpy as np

    from monitor.effects.formula import Formula

    columns = {"x_mm": np.array([0.0, 1.0, -20.0]), "load_N": np.array([0.0, 5.0, 1e300])}
    return lambda content: Formula(_text(content)).evaluate(columns, 3)


def topologies() -> Take:
    from monitor.machine import parse_topology

    return lambda content: parse_topology(_text(content))


def conditions() -> Take:
    """Conditions on the runs of a campaign, as `select --where` takes them."""
    from monitor.readers import read_campaign
    from monitor.workflow.run_statistics.columns import campaign_columns, selected

    campaign = read_campaign(EXAMPLES / "five-days")
    columns = campaign_columns(campaign)
    return lambda content: selected(columns, _text(content), len(campaign.runs))


def days() -> Take:
    """Days and moments: of forms, of options, and of files of instruments in each order."""
    from zoneinfo import ZoneInfo

    from monitor.moments import day_of, moment_of
    from monitor.readers.mapping.dates import ORDERS, Dates
    from monitor.web.days import typed_day

    dates = [Dates(order, "+01:00") for order in (None, *ORDERS)]
    ways: list[Callable[[str], object]] = [
        lambda text: typed_day("from", text),
        lambda text: day_of(text, "--start"),
        lambda text: moment_of(text, "--at"),
        lambda text: moment_of(text, "--at", ZoneInfo("Europe/Berlin")),
        *(read.moment for read in dates),
    ]

    def take(content: bytes) -> object:
        way, rest = _first(content, len(ways))
        return ways[way](_text(rest))

    return take


# Files ---------------------------------------------------------------------------------------------------------------

FILES_OF_A_CAMPAIGN = ("campaign.toml", "runs.csv", "probings.csv")


def campaigns() -> Take:
    """The three files of a campaign, with a zero byte between them."""
    from monitor.readers import read_campaign

    folder = _room()

    def take(content: bytes) -> object:
        for name, part in zip(FILES_OF_A_CAMPAIGN, content.split(b"\0", 2), strict=False):
            (folder / name).write_bytes(part)
        return read_campaign(folder)

    return take


def _campaigns() -> Iterator[bytes]:
    for folder in sorted(EXAMPLES.iterdir()):
        files = [folder / name for name in FILES_OF_A_CAMPAIGN]
        if all(file.is_file() for file in files):
            toml, runs, probings = (file.read_bytes() for file in files)
            # A few rows: what counts is the form.
            yield b"\0".join((toml, b"\n".join(runs.splitlines()[:4]), b"\n".join(probings.splitlines()[:9])))


def tables() -> Take:
    """Tables as a spreadsheet saves them: separated by semicolons or tabs, with decimal commas, with a title above."""
    from monitor.exceptions import CampaignError
    from monitor.readers.campaign.runs_file import read_runs
    from monitor.readers.faults import Faults
    from monitor.readers.files import decode
    from monitor.readers.tables.csv_table import parse_csv

    def take(content: bytes) -> object:
        faults = Faults(("runs.csv",))
        text = decode("runs.csv", content, faults, of_spreadsheet=True)
        table = None if text is None else parse_csv("runs.csv", text, faults)
        part = None if table is None else read_runs(table, faults)
        if len(faults):
            raise CampaignError("folder", faults.sorted())
        assert part is not None, "neither read nor refused"
        return part

    return take


def _tables() -> Iterator[bytes]:
    rows = ("1,2026-03-02T07:00:00+01:00,1,true,20.5", "2,2026-03-02T08:00:00+01:00,1,false,20.75")
    plain = "\n".join(("run,started_at,day,warm_up,ambient_degC", *rows, ""))
    german = plain.replace(",", ";").replace(".", ",").replace("true", "WAHR").replace("false", "FALSCH")
    for text in (plain, german, german.replace(";", "\t")):
        yield text.encode()
        yield ("Messprotokoll\n\n" + text).encode("cp1252")
        yield text.replace("\n1", "\n;;;;°C\n1", 1).encode("cp1252")
    yield german.replace("07:00", "7:00").encode("utf-8-sig")


def workbooks() -> Take:
    """A part of a workbook in place of a sound one; behind the parts, the whole file."""
    from monitor.exceptions import CampaignError
    from monitor.readers.faults import Faults
    from monitor.readers.tables.workbook import read_sheet

    parts = _parts_of_a_workbook()
    names = sorted(parts)

    def take(content: bytes) -> object:
        chosen, rest = _first(content, len(names) + 1)
        packed = rest if chosen == len(names) else _packed(parts | {names[chosen]: rest})
        faults = Faults(("runs.xlsx",))
        sheet = read_sheet("runs.xlsx", packed, "runs", faults, or_first=True)
        if len(faults):
            raise CampaignError("folder", faults.sorted())
        assert sheet is not None, "neither read nor refused"
        return sheet

    return take


def _packed(parts: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    return stream.getvalue()


def _parts_of_a_workbook() -> dict[str, bytes]:
    """A workbook with percent, a day, a moment, truths, and a second sheet."""
    from datetime import date, datetime

    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    sheet.title = "runs"
    sheet.append(["run", "started_at", "day", "warm_up", "humidity_percent"])
    sheet.append([1, datetime(2026, 3, 2, 7), 1, True, 0.45])
    sheet.append([2, date(2026, 3, 3), 2, False, 0.5])
    sheet["E2"].number_format = "0%"
    book.create_sheet("probings").append(["run", "note"])
    stream = io.BytesIO()
    book.save(stream)
    with zipfile.ZipFile(stream) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _workbooks() -> Iterator[bytes]:
    parts = _parts_of_a_workbook()
    for number, name in enumerate(sorted(parts)):
        yield bytes([number]) + parts[name]
        if name.endswith("sheet1.xml"):
            yield bytes([number]) + re.sub(rb"<v>2</v>", b"<f>C2+1</f><v></v>", parts[name])
    yield bytes([len(parts)]) + _packed(parts)


def exports() -> Take:
    """A file of an instrument or its mapping, in a folder with the others."""
    from monitor.readers import read_campaign

    samples, room = _samples(), _room()
    for folder in {path.parent for path in samples}:
        shutil.copytree(folder, room / folder.name)

    def take(content: bytes) -> object:
        chosen, rest = _first(content, len(samples))
        sample = samples[chosen]
        spoilt = room / sample.parent.name / sample.name
        spoilt.write_bytes(rest)
        try:
            return read_campaign(spoilt.parent)
        finally:
            shutil.copyfile(sample, spoilt)

    return take


def _samples() -> list[Path]:
    folders = [EXAMPLES / name for name in ("files-as-they-come", "files-of-a-plate")]
    return [path for folder in folders for path in sorted(folder.iterdir()) if path.name != "README.md"]


def _exports() -> Iterator[bytes]:
    for number, path in enumerate(_samples()):
        yield bytes([number]) + path.read_bytes()


def instruments() -> Take:
    """The file of one instrument alone, read as the mappings of the examples say: hundreds of times quicker."""
    from monitor.exceptions import CampaignError
    from monitor.readers.export import ExportFile
    from monitor.readers.faults import Faults

    ways = _ways_to_read()

    def take(content: bytes) -> object:
        way, rest = _first(content, len(ways))
        name, read, settings = ways[way]
        faults = Faults((name,))
        export = read(ExportFile(name, rest), settings, faults)
        if len(faults):
            raise CampaignError("folder", faults.sorted())
        assert export is not None, "neither read nor refused"
        return export

    return take


def _ways_to_read() -> list[tuple[str, Callable[..., object], object]]:
    """The name, the reader and the settings of every sample of an instrument."""
    from monitor.readers.faults import Faults
    from monitor.readers.mapping.mapping_file import read_mapping
    from monitor.readers.toml_table import parse_toml

    ways = []
    for mapping in sorted({path.with_name("mapping.toml") for path in _samples()}):
        top = parse_toml(mapping.name, mapping.read_text("utf-8"), Faults((mapping.name,)))
        assert top is not None
        for entry in read_mapping(top).entries:
            name = next(path.name for path in sorted(mapping.parent.glob(entry.pattern)))
            ways.append((name, entry.format.read, entry.settings))
    return ways


def _instruments() -> Iterator[bytes]:
    by_name = {path.name: path for path in _samples()}
    for number, (name, _, _) in enumerate(_ways_to_read()):
        # The head and some rows: what counts is the form.
        yield bytes([number]) + by_name[name].read_bytes()[:4000]


def settings() -> Take:
    """Files of settings: the configuration, a laboratory, mail, users, and the manifest of a backup."""
    from monitor.cli import configuration
    from monitor.reporting.certificate.laboratory import read_laboratory
    from monitor.store.copies.manifest import read_manifest
    from monitor.web.laboratory_form import texts_of_file
    from monitor.web.users import read_users
    from monitor.workflow.health.mail import read_mail_settings

    file = _room() / "settings"
    ways: list[Callable[[Path], object]] = [
        configuration.read,
        read_laboratory,
        read_mail_settings,
        read_users,
        lambda path: texts_of_file(path.read_bytes()),
        read_manifest,
    ]

    def take(content: bytes) -> object:
        way, rest = _first(content, len(ways))
        file.write_bytes(rest)
        return ways[way](file)

    return take


def _settings() -> Iterator[bytes]:
    from monitor.cli.configuration import TEMPLATE
    from monitor.reporting.certificate.laboratory import template

    laboratory = (EXAMPLES / "laboratory.toml").read_bytes()
    mail = (EXAMPLES / "mail.toml").read_bytes()
    users = b'[users.anna]\nrole = "engineer"\nsha256 = "' + b"0" * 64 + b'"\n'
    manifest = {
        "tables": {"run": [1, "a"]},
        "made_at": "2026-01-01T00:00:00",
        "span": None,
        "path": "a.duckdb",
    }
    yield b"\0" + re.sub(r"(?m)^# (?=\S+ = |\[|EC0Y|volumetric)", "", TEMPLATE).encode()
    for way in (1, 4):
        yield bytes([way]) + laboratory
        yield bytes([way]) + template("de").encode()
    yield b"\x02" + mail
    yield b"\x03" + users
    yield b"\x05" + json.dumps(manifest).encode()
    for way in range(6):
        yield bytes([way]) + b"a = [[1], {b = 2026-01-01T00:00:00Z}]\n"


def logs() -> Take:
    """The log beside a database, and the copy of its blocks, as a crash may leave them: asked about, never opened."""
    from monitor.store.kept_blocks import ENDING, has_foreign_log, has_torn_blocks, has_torn_log
    from monitor.store.log import LOG_ENDING, ends_with_mark, whole_length

    database = _room() / "a.duckdb"
    database.write_bytes(_a_database())
    log, copy = Path(f"{database}{LOG_ENDING}"), Path(f"{database}{ENDING}")

    def take(content: bytes) -> object:
        of_log, _, of_copy = content.partition(b"copy:")
        log.write_bytes(of_log)
        copy.write_bytes(_with_sum(of_copy))
        return (
            ends_with_mark(str(database)),
            whole_length(str(database)),
            has_torn_log(str(database)),
            has_torn_blocks(str(database)),
            has_foreign_log(str(database)),
        )

    return take


def _with_sum(content: bytes) -> bytes:
    """A copy of blocks whose sum is right: what comes behind it is read."""
    import hashlib

    from monitor.store import kept_blocks

    return kept_blocks._BEGIN + hashlib.sha256(content).digest() + content


def _a_database() -> bytes:
    import duckdb

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.duckdb")
        with duckdb.connect(str(path)) as connection:
            connection.execute("CREATE TABLE a AS SELECT range AS b FROM range(10)")
        return path.read_bytes()


def _logs() -> Iterator[bytes]:
    import struct

    begin = b"d\0be\0\x02\xff\xff"
    entry = b"d\0d" + b"\xff\xff"
    framed = struct.pack("<QQ", len(entry), 7) + entry
    mark = struct.pack("<QQ", 5, 7) + b"d\0c" + b"\xff\xff"
    for log in (b"", begin, begin + framed, begin + framed + mark, begin + framed + bytes(40)):
        yield log + b"copy:" + _a_database()[:12288]
        yield log + b"copy:"


# Requests ------------------------------------------------------------------------------------------------------------


def requests() -> Take:
    """A question and the JSON of its request, as they come over HTTP."""
    from monitor.web.asking import request_of
    from monitor.workflow.contract import QUESTIONS

    names = sorted(QUESTIONS)

    def take(content: bytes) -> object:
        chosen, document = _document(content, len(names))
        return request_of(names[chosen], document, {})

    return take


def arguments() -> Take:
    """A question and its arguments, as they come from Python."""
    from monitor.api.asking import options_as_arguments, request_of
    from monitor.workflow.contract import QUESTIONS

    kinds = [QUESTIONS[name].request for name in sorted(QUESTIONS) if QUESTIONS[name].request is not None]

    def take(content: bytes) -> object:
        chosen, document = _document(content, len(kinds))
        with options_as_arguments(kinds[chosen]):
            return request_of(kinds[chosen], document)

    return take


def _document(content: bytes, count: int) -> tuple[int, dict[str, object]]:
    from monitor.exceptions import InputError

    chosen, rest = _first(content, count)
    try:
        document = json.loads(rest)
    except (ValueError, RecursionError) as error:
        raise InputError("no JSON") from error
    if not isinstance(document, dict):
        raise InputError("no document")
    return chosen, document


def _requests() -> Iterator[bytes]:
    from monitor.web.access import taken_fields
    from monitor.workflow.contract import QUESTIONS

    for number, question in enumerate(sorted(QUESTIONS)):
        for value in ("x", 1, -0.5, None, [], ["2026-01-01"], {"a": True}):
            yield bytes([number]) + json.dumps(dict.fromkeys(taken_fields(question), value)).encode()


def forms() -> Take:
    """What a form sends besides texts: its number fields, where it came from, what is sent again after a log-in."""
    from monitor.web.forms import Typed, own_address, whole_number
    from monitor.web.received import Body, received

    room = _room()

    def body(content: bytes) -> object:
        folder = room / "body"
        folder.mkdir()
        try:
            return received("trend", Body("application/json", io.BytesIO(content)), folder)
        finally:
            shutil.rmtree(folder)

    ways: list[Callable[[bytes], object]] = [
        lambda content: Typed.of_document(_text(content)),
        lambda content: own_address(_text(content)),
        lambda content: whole_number("runs", _text(content)),
        body,
    ]

    def take(content: bytes) -> object:
        way, rest = _first(content, len(ways))
        return ways[way](rest)

    return take


def _forms() -> Iterator[bytes]:
    yield b"\0" + json.dumps(["/machine/HU40-T", [["day", "02.03.2026"]], False]).encode()
    yield b"\x01/machine/HU40-T?from=2026-03-02"
    yield b"\x0220"
    yield b'\x03{"machine": "HU40-T", "tolerances": {"*": {"EXX": 1.0}}}'


# ---------------------------------------------------------------------------------------------------------------------


def _codes() -> Iterator[bytes]:
    """Whatever the documentation sets as code."""
    for path in [*sorted(CHECKOUT.glob("docs/*.md")), CHECKOUT / "README.md"]:
        yield from (code.encode() for code in re.findall(r"`([^`\n]{2,80})`", path.read_text("utf-8")))


def _effects() -> Iterator[bytes]:
    yield from (
        b"EXX",
        b"EXX:reversal",
        b"EZC1:const@warmup",
        b"EYB:harmonics(1,2)",
        b"EXX:poly2@x_mm",
        b"EB0C:step(3)",
    )
    yield from _codes()


def _conditions() -> Iterator[bytes]:
    yield from (b"hours > 6", b"day == 1 and not warm_up")
    yield from _codes()


def _topologies() -> Iterator[bytes]:
    yield from (TOPOLOGY.encode(), b"w X Y b Z t", b"w b A1 A2 A3 A4 A5 A6 t", b"w X b Y t")


def _formulas() -> Iterator[bytes]:
    yield from (
        b"sin(2*pi*x_mm/20)",
        b"not 0 < x_mm <= 2 and load_N > 1 or 1",
        b"-x_mm**2 + 1e3",
        b"abs(+x_mm)",
    )


def _days() -> Iterator[bytes]:
    texts = (
        "2026-03-02", "02.03.2026", "2. 3. 2026", "2026-03-02 7:00", "2026-03-02T07:00:00.5-05:00",
        "9999-12-31T23:59:59-23:59", "0001-01-01", "3/2/2026 7:00:00 PM", "Mon, 2. März 2026 7:00", "02-Mar-2026",
    )  # fmt: skip
    for way in range(8):
        for text in texts:
            yield bytes([way]) + text.encode()


TARGETS = {
    "effects": Target(effects, _effects),
    "curves": Target(curves, _codes),
    "formulas": Target(formulas, _formulas),
    "topologies": Target(topologies, _topologies),
    "conditions": Target(conditions, _conditions),
    "days": Target(days, _days),
    "campaigns": Target(campaigns, _campaigns),
    "tables": Target(tables, _tables),
    "workbooks": Target(workbooks, _workbooks),
    "exports": Target(exports, _exports),
    "instruments": Target(instruments, _instruments),
    "settings": Target(settings, _settings),
    "logs": Target(logs, _logs),
    "requests": Target(requests, _requests),
    "arguments": Target(arguments, _requests),
    "forms": Target(forms, _forms),
}
