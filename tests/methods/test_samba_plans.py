"""What a plan cannot separate is named and gets no number; what contradicts itself is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from typing import Any

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods.samba.method import METHOD as samba
from monitor.reporting.refused import refusal_sentence


@pytest.mark.parametrize(
    ("still", "refused"),
    [
        ({"B": 0.0}, {"EA0B", "EA0C", "EC0B", "EX0C", "EX0C1", "EZZ"}),
        ({"C": 0.0}, {"EX0C", "EA0C", "EB0C", "EY0C1"}),
        ({"C1": 0.0}, {"EX0C1", "EY0C1"}),
    ],
)
def test_an_axis_that_stands_still_hides_its_parameters(
    simulated: Callable[..., Any], still: dict[str, float], refused: set[str]
) -> None:
    campaign = simulated(9)[1]
    rows = np.all([campaign.probings.readings[axis] == angle for axis, angle in still.items()], axis=0)
    found = samba.identify(replace(campaign, probings=campaign.probings.rows(rows)))
    run = found.runs[0]
    named = {name for refusal in run.refused for name in refusal.parameters}
    without = {name for name, value in zip(found.parameters, run.estimate, strict=True) if np.isnan(value)}
    assert named == without == refused
    axis = next(iter(still))
    assert {axis in refusal_sentence(refusal).partition(":")[2] for refusal in run.refused} == {True}


def test_every_parameter_without_a_number_is_named_whatever_the_plan(simulated: Callable[..., Any]) -> None:
    campaign = simulated(10)[1]
    probings = campaign.probings
    bar = np.isin(probings.target, ["S1", "S2"])
    rng = np.random.default_rng(10)
    seen = set()
    for _ in range(40):
        chosen = rng.choice(15, size=rng.integers(2, 6), replace=False)
        indexation = np.cumsum(np.append(False, probings.target[1:] == "1"))
        rows = np.isin(indexation, chosen) | bar
        try:
            found = samba.identify(replace(campaign, probings=probings.rows(rows)))
        except DataError as refused:
            seen.add(str(refused).partition(" ")[0])
            continue
        run = found.runs[0]
        named = [name for refusal in run.refused for name in refusal.parameters]
        without = [
            name for name, value in zip(found.parameters, run.estimate, strict=True) if np.isnan(value)
        ]
        assert sorted(named) == sorted(without)
        seen.add(len(without))
    assert len(seen) > 2


def test_a_run_without_the_bar_has_no_unit_of_length(simulated: Callable[..., Any]) -> None:
    campaign = simulated(11, days=1, runs=2)[1]
    rows = ~(np.isin(campaign.probings.target, ["S1", "S2"]) & (campaign.probings.run == 2))
    found = samba.identify(replace(campaign, probings=campaign.probings.rows(rows)))
    assert found.runs[0].refused == ()
    assert [refusal.parameters for refusal in found.runs[1].refused] == [("EXX", "EYY", "EZZ")]
    assert refusal_sentence(found.runs[1].refused[0]).endswith(
        ": run 2 did not probe S1 and S2 of the scale bar, the unit of length"
    )


def test_confused_targets_do_not_converge(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    probings = campaign.probings
    confused = replace(probings, target=np.random.default_rng(0).permutation(probings.target))
    with pytest.raises(
        DataError, match=r"did not converge in 50 steps: the readings contradict the machine file"
    ):
        samba.identify(replace(campaign, probings=confused))


@pytest.mark.parametrize("axis", ["X", "Y", "Z", "B"])
def test_a_wrong_sign_fits_perfectly_and_is_refused_all_the_same(
    simulated: Callable[..., Any], axis: str
) -> None:
    campaign = simulated(1)[1]
    axes = dict(campaign.machine.axes)
    axes[axis] = replace(axes[axis], sign=-1)
    with pytest.raises(
        DataError, match=r"comes out at -2 mm/mm, which is no error of a machine.* check the axis signs"
    ):
        samba.identify(replace(campaign, machine=replace(campaign.machine, axes=axes)))


def test_a_wrong_unit_is_refused(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    readings = dict(campaign.probings.readings)
    readings["X"] = readings["X"] / 1000.0
    with pytest.raises(
        DataError, match=r"EXX comes out at 999 mm/mm.*it looks as if its positions were in metres"
    ):
        samba.identify(replace(campaign, probings=replace(campaign.probings, readings=readings)))


def test_another_bar_in_half_of_the_runs_is_refused(simulated: Callable[..., Any]) -> None:
    """Was: EXX = -14 830 um/m of the second of two runs, and `explain` said "explained"."""
    campaign = simulated(5, days=1, runs=2)[1]
    readings = dict(campaign.probings.readings)
    second = campaign.probings.run == 2
    first_ball, other_ball = (second & (campaign.probings.target == ball) for ball in ("S1", "S2"))
    for axis in "XYZ":
        of_axis = readings[axis].copy()
        of_axis[other_ball] += 0.015 * (of_axis[other_ball] - of_axis[first_ball])
        readings[axis] = of_axis
    with pytest.raises(DataError, match=r"run 2: E.. comes out at -0.0148 mm/mm.* the length of the bar"):
        samba.identify(replace(campaign, probings=replace(campaign.probings, readings=readings)))


def test_too_few_readings(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    rows = campaign.probings.sequence >= 9
    few, fewer = rows & (campaign.probings.sequence <= 18), rows & (campaign.probings.sequence <= 16)
    with pytest.raises(DataError, match="the 24 readings of run 1 determine as many unknowns of the model"):
        samba.identify(replace(campaign, probings=campaign.probings.rows(fewer)))
    (run,) = samba.identify(replace(campaign, probings=campaign.probings.rows(few))).runs
    # 31 readings and 34 names, of which two touches a ball determine 27.
    assert run.degrees_of_freedom == 4
    refused = {name for refusal in run.refused for name in refusal.parameters}
    assert {"EA0B", "EC0B", "EZZ"} <= refused
    assert "EXX" not in refused


def test_a_bar_that_was_never_probed(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    rows = campaign.probings.target != "S2"
    with pytest.raises(DataError, match="campaign virtual never probed S2 of the scale bar"):
        samba.identify(replace(campaign, probings=campaign.probings.rows(rows)))


def test_no_bar_at_all(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    bare = replace(campaign, artefact=replace(campaign.artefact, scale_bar=None))
    with pytest.raises(DataError, match=r"has no scale bar; samba needs \[artefact.scale_bar\]"):
        samba.identify(bare)


def test_two_linear_axes_are_refused(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    machine = replace(campaign.machine, topology="w C B X b Z (C1) t", axes={})
    with pytest.raises(DataError, match="has 2 linear axes; a touch needs three"):
        samba.identify(replace(campaign, machine=machine))


def test_runs_without_probings_are_left_out(simulated: Callable[..., Any]) -> None:
    campaign = simulated(12, days=1, runs=2)[1]
    bar = campaign.artefact.scale_bar
    assert bar is not None
    hot = replace(campaign.runs[0], run=7, started_at=campaign.runs[0].started_at + timedelta(days=30))
    empty = replace(campaign, runs=(hot, *campaign.runs))
    assert [run.run for run in samba.identify(empty).runs] == [1, 2]
