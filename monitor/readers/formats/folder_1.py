"""Campaign folder, format 1: ``campaign.toml``, ``runs.csv`` and ``probings.csv``."""

from __future__ import annotations

from pathlib import Path

from monitor.exceptions import CampaignError
from monitor.readers import probings_file, runs_file
from monitor.readers.campaign_parts import EMPTY, campaign_of, read_head, read_parts
from monitor.readers.csv_table import CsvTable, parse_csv
from monitor.readers.faults import Faults
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.registry import Reader
from monitor.readers.spreadsheet import read_table, renamed
from monitor.readers.toml_table import parse_toml
from monitor.records import Campaign, SourceFile

TOML = "campaign.toml"
FILES = (TOML, runs_file.FILE, probings_file.FILE)


def read(folder: Path) -> Campaign:
    """Read the campaign of a folder. Raises CampaignError with all faults of the folder."""
    faults = Faults(FILES)
    content = read_bytes(folder, TOML, LARGEST_TOML, faults)
    texts = {TOML: None if content is None else decode(TOML, content, faults)}
    sources = {} if content is None else {TOML: SourceFile(TOML, content)}
    for name in FILES[1:]:
        source, texts[name] = read_table(folder, name, faults)
        if source is not None:
            sources[name] = source
    # One workbook may hold both tables.
    files = tuple({source.name: source for source in sources.values()}.values())
    toml = texts[TOML]
    top = None if toml is None else parse_toml(TOML, toml, faults)
    head = EMPTY if top is None else read_head(top)
    runs_table = _table(runs_file.FILE, texts, faults)
    table = _table(probings_file.FILE, texts, faults)
    parts = read_parts(head, runs_table, table, faults)
    if len(faults):
        read_from = {name: source.name for name, source in sources.items()}
        raise CampaignError(str(folder), renamed(faults.sorted(), read_from))
    return campaign_of(head, parts, files)


def _table(name: str, texts: dict[str, str | None], faults: Faults) -> CsvTable | None:
    text = texts.get(name)
    return None if text is None else parse_csv(name, text, faults)


READER = Reader(
    "campaign folder, format 1", lambda folder: any((folder / name).exists() for name in FILES), read
)
