"""Where the rows of a campaign stand in the files of its owner, for those who have to correct one."""

from __future__ import annotations

import tempfile
from functools import cached_property
from pathlib import Path

from monitor.exceptions import CampaignError
from monitor.readers.mapping.reading import Exports, read_exports
from monitor.records import Campaign
from monitor.row_files import is_of_mapping, rows_in


class RowPlaces:
    """The places of the rows of one campaign. Files of instruments are read again, once, when a row is asked for."""

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign

    def row(self, run: int, sequence: int) -> str:
        """Return where a row stands: ``line 12 of laser-X.rtl``, or the file alone where its line is not known."""
        found_at = None if self._exports is None else self._exports.place(run, sequence)
        return (
            f"the row in {rows_in(self._campaign)}"
            if found_at is None
            else f"line {found_at[1]} of {found_at[0]}"
        )

    @cached_property
    def _exports(self) -> Exports | None:
        """The files of instruments, read again; None for a campaign folder, and where they were archived."""
        files = self._campaign.files
        if not is_of_mapping(self._campaign) or not all(file.content for file in files):
            return None
        with tempfile.TemporaryDirectory() as folder:
            paths = [Path(folder, file.name) for file in files]
            for path, file in zip(paths, files, strict=True):
                path.write_bytes(file.content)
            try:
                return read_exports(paths[0], paths[1:], self._campaign.name)
            except CampaignError:
                # Stored by an earlier version, which took what is refused now.
                return None
