"""The volumetric error of a machine on its health report: the map of the week's last run."""

from __future__ import annotations

from monitor.reporting.health.records import MapShare, PoseError, VolumetricMap
from monitor.reporting.health.sentences import Pose, Position, Region
from monitor.workflow.history.beyond_limit import longest_beyond
from monitor.workflow.volumetric.answer import VolumetricAnswer


def probability_beyond(answer: VolumetricAnswer, limit_um: float) -> float:
    """The probability that the worst error of a map is beyond its limit (JCGM 106:2012, 7), by Student's t
    distribution.

    That of the point that is worst by the estimates: the length of a vector with its own uncertainty.
    """
    worst = answer.worst
    return longest_beyond(worst.error_um - limit_um, worst.u_um, answer.degrees_of_freedom)


def stated_map(
    answer: VolumetricAnswer | None, limit_um: float | None = None, probability_out: float | None = None
) -> VolumetricMap | None:
    """The map as the report states it, with its limit where there is one; None where there is no map."""
    if answer is None:
        return None
    return VolumetricMap(
        run=answer.run,
        region=Region(answer.region.points, answer.region.origin),
        worst_at=Position(tuple(answer.worst.at.items())),
        worst_um=answer.worst.error_um,
        expanded_um=answer.worst.expanded_um,
        rms_um=answer.rms.error_um,
        by_pose=tuple(
            PoseError(Pose(tuple(pose.at.items())), pose.worst_um, pose.rms_um) for pose in answer.by_pose
        ),
        slices=answer.slices,
        k=answer.k,
        p=answer.p,
        limit_um=limit_um,
        probability_out=probability_out,
        by_parameter=_shares(answer),
        between_points=answer.between_points,
        step_places=answer.step_places,
    )


def _shares(answer: VolumetricAnswer) -> tuple[MapShare, ...] | None:
    """What each parameter adds to the worst error, the largest first; None in a map that was stored without."""
    shares = answer.worst.by_parameter_um
    if shares is None:
        return None
    return tuple(MapShare(name, shares[name]) for name in sorted(shares, key=lambda name: -shares[name]))
