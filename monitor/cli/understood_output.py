"""What was understood of the files of an import, as tables."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.cli import output
from monitor.readers import UnderstoodFile


def show(files: Sequence[UnderstoodFile]) -> None:
    """Print file by file what each column was taken for, its range, and its first and last row."""
    for file in files:
        whose = "" if file.setup is None else f", setup {file.setup}"
        run = "" if file.run is None else f", run {file.run}"
        layout = f" ({file.layout})" if file.layout else ""
        output.say(
            f"{file.file}: {file.format}{layout}{whose}{run}, {file.rows} rows, SHA-256 {file.sha256[:16]}"
        )
        for fact in file.facts:
            output.say(f"  {fact}")
        rows = [
            [
                column.column,
                column.source,
                "" if column.smallest is None else f"{column.smallest:.10g}",
                "" if column.largest is None else f"{column.largest:.10g}",
                column.first,
                column.last,
                column.moves or "",
            ]
            for column in file.columns
        ]
        output.table(
            "",
            ["column", "read from", "smallest", "largest", "first row", "last row", "the axis"],
            rows,
            text_columns=2,
        )
