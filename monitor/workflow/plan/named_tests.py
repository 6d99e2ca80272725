"""Tests of instruments as answers name them: with what they promise, and where the axes stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from monitor.machine import Joint
from monitor.methods.method import ExpectedTest, PlannedTest, TestForecast
from monitor.records import Array
from monitor.workflow.plan.test_answer import TestAnswer

#: Kinds whose bar or sphere stands at a place that the plan chooses.
PLACED = ("distance", "vector")


def shown_u(forecast: TestForecast, u: Mapping[str, float]) -> dict[str, float | None]:
    """Uncertainties in display units; None where there is no number."""
    return {
        name: forecast.unit_of(name).to_display(value) if np.isfinite(value) else None
        for name, value in u.items()
    }


def planned_test(forecast: TestForecast, expected: ExpectedTest, joints: Sequence[Joint]) -> TestAnswer:
    """A test with where the axes stand at each of its poses."""
    columns = _readings(expected.test, joints)
    poses = zip(*columns.values(), strict=True)
    return replace(
        named_test(forecast, expected, joints),
        axes_by_pose=tuple(
            {column: round(float(reading), 4) + 0.0 for column, reading in zip(columns, pose, strict=True)}
            for pose in poses
        ),
    )


def _readings(test: PlannedTest, joints: Sequence[Joint]) -> dict[str, Array]:
    """What the axes read at the poses (m) of a test by the column of a campaign: mm, and degrees of those that turn."""
    readings = {}
    for index, joint in enumerate(joints):
        shown = joint.sign * test.positions[:, index]
        column = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
        readings[column] = np.rad2deg(shown) if joint.turns else shown
    return readings


def named_test(forecast: TestForecast, expected: ExpectedTest, joints: Sequence[Joint]) -> TestAnswer:
    """A test with the ranges of its axes and what it promises."""
    test = expected.test
    x, y, z = (round(value, 3) + 0.0 for value in test.setup.work_point)
    return TestAnswer(
        instrument=test.setup.instrument or test.setup.id,
        setup=test.setup.id,
        reading=test.setup.reading,
        available=test.available,
        poses=len(test.positions),
        axes={
            column: (round(float(shown.min()), 3) + 0.0, round(float(shown.max()), 3) + 0.0)
            for column, shown in _readings(test, joints).items()
        },
        u=shown_u(forecast, expected.u),
        work_point_mm=(x, y, z) if test.setup.reading in PLACED else None,
    )
