"""The volumetric error of a machine on its health report: the stored map of the week's last run that has one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from monitor.exceptions import NotFoundError
from monitor.reporting.health import PoseError, VolumetricMap
from monitor.store import Database, StoredModel, load_analysis


def stored_map(db: Database, campaign: str, runs: Sequence[int], model: StoredModel) -> VolumetricMap | None:
    """The map of the last of ``runs`` of a campaign that has one under a model (`monitor map CAMPAIGN`), or None."""
    for run in reversed(runs):
        try:
            return _told(
                load_analysis(
                    db,
                    "volumetric map",
                    campaign=campaign,
                    run=run,
                    model=model.name,
                    model_version=model.version,
                ).document
            )
        except NotFoundError:
            continue
    return None


def _told(found: Mapping[str, Any]) -> VolumetricMap:
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
