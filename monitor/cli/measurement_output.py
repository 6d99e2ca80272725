"""A measurement that could be made, in words: its instrument, and where the axes stand."""

from __future__ import annotations

from monitor.workflow.plan.test_answer import TestAnswer


def where(test: TestAnswer) -> str:
    """Which axes move between which readings, and where the others stand."""
    parts = []
    for column, (low, high) in test.axes.items():
        axis, unit = column.upper().rpartition("_")[0], "°" if column.endswith("_deg") else " mm"
        parts.append(f"{axis} {low:g}{unit}" if low == high else f"{axis} {low:g} to {high:g}{unit}")
    sentence = f"{test.poses} poses, {', '.join(parts)}"
    if test.work_point_mm is not None:
        sentence += f"; work point {', '.join(f'{value:g}' for value in test.work_point_mm)} mm"
    return sentence


def test_name(test: TestAnswer) -> str:
    """The instrument of a test, and its setup or that a usual one is meant."""
    name = f"{test.instrument} ({test.setup})" if test.available else f"{test.instrument} (usual)"
    return (
        name
        if test.available
        else f"{name} {test.setup.rpartition('-')[2]}".removesuffix(" bar").removesuffix(" test")
    )
