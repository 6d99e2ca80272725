"""The volumetric error of a machine on its health report: the map of the week's last run."""

from __future__ import annotations

from collections.abc import Mapping

from monitor.reporting.health.records import PoseError, VolumetricMap
from monitor.workflow.health.stored import StoredMap


def stated_map(stored: StoredMap | None) -> VolumetricMap | None:
    """The map as the report states it; None where there is none."""
    if stored is None:
        return None
    return VolumetricMap(
        run=stored.run,
        region=f"{stored.region.points} points of {stored.region.from_}",
        worst_at=_position(stored.worst.at),
        worst_um=stored.worst.error_um,
        expanded_um=stored.worst.expanded_um,
        rms_um=stored.rms.error_um,
        by_pose=tuple(
            PoseError(_position(pose.at) or "no rotary axes", pose.worst_um, pose.rms_um)
            for pose in stored.by_pose
        ),
        slices=stored.slices,
        k=stored.k,
        p=stored.p,
    )


def _position(at: Mapping[str, float]) -> str:
    """A position for people: ``X -178.9 mm, B -90°``; axes that are not named stand where the map put them."""
    parts = []
    for key, value in at.items():
        axis, _, unit = key.rpartition("_")
        text = f"{axis.upper()} {value:.4g}{'°' if unit == 'deg' else ' ' + unit}"
        parts.append(text.replace("-", "\N{MINUS SIGN}"))
    return ", ".join(parts)
