"""Where in a run something moved, ``moved(run 7, sequence 23)``: of one ball or of the whole piece."""

from __future__ import annotations

from collections.abc import Mapping

from monitor.exceptions import EffectError

#: Behind the name of what moved; the moment may lack, so that its lack can be told.
MOVED = r"moved(?:\s*\(\s*run\s+(?P<run>\d+)\s*,\s*sequence\s+(?P<sequence>\d+)\s*\))?"


def moment_of(groups: Mapping[str, str], of: str) -> tuple[int, int]:
    """Return run and sequence from which on ``of`` had moved. Raises EffectError where they are not said."""
    if "run" not in groups:
        text = f"{of}:moved"
        raise EffectError(
            f"'{text}' must say when: write {text}(run 7, sequence 23); `explain` finds the moment"
        )
    return int(groups["run"]), int(groups["sequence"])
