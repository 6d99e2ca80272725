"""Reads and writes campaigns: bytes in, a campaign out, or every fault of the folder in one refusal.

``read_campaign`` reads a folder in any format that is registered; ``write_campaign`` writes campaign folder
format 1, for virtual campaigns and for handing data on. A format is one file in ``formats``, a method's rules
are one file in ``methods``, an instrument's own file is one in ``exports``, read by what ``mapping.toml`` says of it;
plug-ins come through the entry points of the group ``monitor.readers``.
"""

from monitor.readers.doubts.doubts import doubts
from monitor.readers.folder_names import names_in
from monitor.readers.formats.export_1 import files_in, recognises as is_export_folder
from monitor.readers.linear_axes import read_linear_axes
from monitor.readers.mapping.mapping_file import FILE as MAPPING
from monitor.readers.mapping.reading import Exports, read_exports
from monitor.readers.mapping.understood import UnderstoodColumn, UnderstoodFile, understood_tables
from monitor.readers.method_rules import MethodRules, Plan
from monitor.readers.registry import Reader, export_formats, method_rules, read_campaign, readers
from monitor.readers.sources_file import line_of_source, line_of_tolerance, read_sources_file
from monitor.readers.writer import write_campaign

__all__ = [
    "MAPPING",
    "Exports",
    "MethodRules",
    "Plan",
    "Reader",
    "UnderstoodColumn",
    "UnderstoodFile",
    "doubts",
    "export_formats",
    "files_in",
    "is_export_folder",
    "line_of_source",
    "line_of_tolerance",
    "method_rules",
    "names_in",
    "read_campaign",
    "read_exports",
    "read_linear_axes",
    "read_sources_file",
    "readers",
    "understood_tables",
    "write_campaign",
]
