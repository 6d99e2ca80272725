"""Campaign folder, format 1: ``campaign.toml``, ``runs.csv`` and ``probings.csv``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from monitor.exceptions import CampaignError
from monitor.readers.campaign import probings_file, runs_file
from monitor.readers.campaign.campaign_parts import EMPTY, campaign_of, read_head, read_parts
from monitor.readers.faults import Faults
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.registry import Reader
from monitor.readers.tables.csv_table import CsvTable, parse_csv
from monitor.readers.tables.spreadsheet import TableText, read_table, renamed
from monitor.readers.toml_table import parse_toml
from monitor.records import Campaign, SourceFile

TOML = "campaign.toml"
FILES = (TOML, runs_file.FILE, probings_file.FILE)


def read(folder: Path) -> Campaign:
    """Read the campaign of a folder. Raises CampaignError with all faults of the folder."""
    faults = Faults(FILES)
    content = read_bytes(folder, TOML, LARGEST_TOML, faults)
    toml = None if content is None else decode(TOML, content, faults)
    tables = {name: read_table(folder, name, faults) for name in FILES[1:]}
    sources = [
        None if content is None else SourceFile(TOML, content),
        *(table.source for table in tables.values()),
    ]
    # One workbook may hold both tables.
    files = tuple({source.name: source for source in sources if source is not None}.values())
    top = None if toml is None else parse_toml(TOML, toml, faults)
    head = EMPTY if top is None else read_head(top)
    runs_table = _table(tables, runs_file.FILE, faults)
    table = _table(tables, probings_file.FILE, faults)
    # Its cells are in the tables now: the text of a million rows is 70 MB.
    tables = {name: replace(each, text=None) for name, each in tables.items()}
    parts = read_parts(head, runs_table, table, faults)
    if len(faults):
        raise CampaignError(str(folder), renamed(faults.sorted(), tables))
    return campaign_of(head, parts, files)


def _table(tables: Mapping[str, TableText], name: str, faults: Faults) -> CsvTable | None:
    table = tables[name]
    return None if table.text is None else parse_csv(name, table.text, faults, of_workbook=table.of_workbook)


READER = Reader(
    "campaign folder, format 1", lambda folder: any((folder / name).exists() for name in FILES), read
)
