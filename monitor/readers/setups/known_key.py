"""The key by which a setup, or a tracker, states which of its unknowns are known: they hold without an uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.readers.faults import one_of, quoted
from monitor.readers.toml_table import Table


def read_known(table: Table, holdable: Sequence[str]) -> tuple[str, ...]:
    """Return the names of what is known; what may be is ``holdable``."""
    value = table.raw("known", required=False, example='["zero"]')
    if value is None:
        return ()
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        table.fault(
            "known", f'{quoted(value)} is no list of names; write for example known = ["{holdable[0]}"]'
        )
        return ()
    for name in value:
        if name not in holdable:
            table.fault(
                "known",
                f"{quoted(name)} is no unknown of this reading; what may be known is {one_of(holdable)}",
            )
    return tuple(value)
