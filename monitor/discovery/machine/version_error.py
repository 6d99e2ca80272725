"""The error of one version of a model: what `model history` shows falling, step by step."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import scene_of


@dataclass(frozen=True)
class VersionError:
    """Errors in mm: of all coordinates, and held out (whole runs left out, per degree of freedom; blocks of
    poses with one run of many, None with one of few), beside the repeatability and the stated
    standard uncertainty, its noise floors."""

    rms: float
    held_out_rms: float | None
    repeatability: float | None
    stated_uncertainty: float
    lack_of_fit_p: float | None


def version_error(fit: Fit) -> VersionError:
    """The error of a fitted model."""
    scene = scene_of(fit, [])
    test, repeatability = lack_of_fit(fit)
    return VersionError(
        rms=fit.rms,
        held_out_rms=scene.held_out_error(scene.shared),
        repeatability=repeatability,
        stated_uncertainty=fit.sigma,
        lack_of_fit_p=None if test is None else test.p_value,
    )
