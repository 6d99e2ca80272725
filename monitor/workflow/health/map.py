"""The volumetric error of a machine on its health report: the map of the week's last run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from monitor.documents import from_document
from monitor.reporting.health.records import PoseError, VolumetricMap
from monitor.reporting.svg.map_slices import Slice


def map_told(found: Mapping[str, Any] | None) -> VolumetricMap | None:
    """The document of `monitor map` as the report states it; None where there is none."""
    if found is None:
        return None
    worst, region = found["worst"], found["region"]
    return VolumetricMap(
        run=int(found["run"]),
        region=f"{region['points']} points of {region['from']}",
        worst_at=_place(worst["at"]),
        worst_um=float(worst["error_um"]),
        expanded_um=float(worst["expanded_um"]),
        rms_um=float(found["rms"]["error_um"]),
        by_pose=tuple(
            PoseError(_place(one["at"]) or "no rotary axes", float(one["worst_um"]), float(one["rms_um"]))
            for one in found["by_pose"]
        ),
        slices=tuple(from_document(Slice, one) for one in found["slices"]),
        k=float(found["k"]),
        p=float(found["p"]),
    )


def _place(at: Mapping[str, float]) -> str:
    """A place in words: ``X -178.9 mm, B -90°``; axes that are not named stand where the map put them."""
    words = []
    for key, value in at.items():
        axis, _, unit = key.rpartition("_")
        words.append(
            f"{axis.upper()} {value:.4g}{'°' if unit == 'deg' else ' ' + unit}".replace("-", "\N{MINUS SIGN}")
        )
    return ", ".join(words)
