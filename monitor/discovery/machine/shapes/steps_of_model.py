"""Where the steps of a fitted model lie, as its readings leave it open: what maps, tables and certificates say."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.step_places import Between, nearest_readings, steps_between
from monitor.discovery.search.candidate import Variant
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes import Step
from monitor.exceptions import DataError


def steps_of_model(fitted: Fit) -> dict[str, tuple[Between, ...]]:
    """The readings between which each step of a fitted model lies, by its effect: what ``explain`` says of the step
    where it is all that the model lacks. One that follows a driver, or without which the model cannot be fitted, is
    known to the nearest readings around it."""
    problem = fitted.problem.for_search()
    between = {}
    for effect in (*problem.base, *problem.added):
        if not isinstance(effect, ChainEffect) or not isinstance(effect.shape, Step):
            continue
        shape = effect.shape
        measured = effect.joint.sign * problem.context.places[:, effect.term.joint]
        between[effect.text] = tuple(
            nearest_readings(measured, at_mm, shape.width) for at_mm in shape.readings
        )
        if isinstance(effect.driver, Always) and effect in problem.added:
            rest = tuple(other for other in problem.added if other is not effect)
            with suppress(DataError, np.linalg.LinAlgError):
                without_it = fit(replace(problem, added=rest), fitted.left_out)
                scene = scene_of(without_it, [Variant(effect.text, effect)])
                if scene.candidates:
                    between[effect.text] = steps_between(scene, scene.candidates[0], [])
    return between
