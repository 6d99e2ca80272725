"""The files that the rows of a campaign came from, by the names that their owner gave them."""

from __future__ import annotations

from monitor.records import Campaign

#: What a campaign folder calls its tables and its description.
TABLE, DESCRIPTION = "probings", "campaign.toml"


def is_of_mapping(campaign: Campaign) -> bool:
    """Return whether the rows came from files of instruments by a mapping, which is the first file then."""
    names = [file.name for file in campaign.files]
    return bool(names) and names[0].endswith(".toml") and names[0] != DESCRIPTION


def rows_in(campaign: Campaign) -> str:
    """Return the names of the files that hold the rows: probings.csv, a workbook, or the files of instruments."""
    names = [file.name for file in campaign.files]
    if not names:
        return f"{TABLE}.csv"
    if is_of_mapping(campaign):
        return ", ".join(names[1:])
    return next((name for name in names if name.startswith(TABLE)), names[-1])


def runs_in(campaign: Campaign) -> str:
    """Return where the runs are listed: runs.csv, a workbook, or the tables of the mapping."""
    names = [file.name for file in campaign.files]
    if is_of_mapping(campaign):
        return f"[[runs]] of {names[0]}"
    books = [name for name in names if name.endswith(".xlsx")]
    return next((name for name in names if name.startswith("runs")), books[-1] if books else "runs.csv")
