"""What breaks a tie with an effect that follows a temperature late."""

from __future__ import annotations

from types import SimpleNamespace

from monitor.workflow.explain.ties import Tie, TieBreak, ties_of


def test_a_lag_is_told_from_its_channel_by_that_channel_alone() -> None:
    separation = SimpleNamespace(poses=(), together=(), by_order=())
    effect = SimpleNamespace(effect="EXX:poly1@lagged_x_axis_degC", separation=separation, within_runs=False)
    rivals = ("EXX:poly1@x_axis_degC", "EXX:poly1@warmup", "EYY:poly1@lagged25min_x_axis_degC")
    of_channel, of_warm_up, of_axis = ties_of(effect, rivals, is_planned=True)  # type: ignore[arg-type]
    assert of_channel == Tie((rivals[0],), TieBreak.DRIVERS, ("x_axis_degC",))
    assert of_warm_up == Tie((rivals[1],), TieBreak.DRIVERS, ("x_axis_degC", "warmup"))
    assert of_axis.broken_by is TieBreak.INDEXATIONS
    assert of_axis.axes == ("X", "Y")
