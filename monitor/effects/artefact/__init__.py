"""Changes of the artefact, one a file: a ball that moved, an artefact that grows, bending stems, a probe's lobes, a
tracker's drift."""

from __future__ import annotations

from monitor.effects.artefact.workpiece import normals_of
from monitor.effects.artefact_change import ArtefactChange
from monitor.effects.registry import parse
from monitor.exceptions import EffectError

__all__ = ["HEADS", "PROBE_HEAD", "ArtefactChange", "normals_of", "parse_artefact"]

#: What the texts of these changes begin with, before a colon; no term of a chain is called so.
PROBE_HEAD = "probe"
HEADS = ("ball", "artefact", "stem", "shape", "tracker", "base", PROBE_HEAD)


def parse_artefact(body: str) -> ArtefactChange:
    """Return the change that a text names. Raises EffectError, listing what there is, for an unknown one."""
    change: ArtefactChange | None = parse(body, __name__)
    if change is None:
        raise EffectError(
            f"there is no effect '{body}' of the artefact; there are ball:2:moved(run 7, sequence 23), "
            "artefact:expansion@ambient_degC, stem:gravity, shape, probe:lobing2, probe:lobing3, "
            "tracker:shift@run_time, tracker:turn@run_time, tracker:moved(run 7, sequence 23) and "
            "base:moved(run 7, sequence 23)"
        )
    return change
