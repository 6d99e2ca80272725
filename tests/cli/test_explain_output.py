"""What the screen says of a finding, beside its numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from monitor.cli.explain_output import _machine_effect
from monitor.effects.description import Description
from monitor.workflow.explain.explain_answer import DeviationsApart, MachineExplanation, MachineMissing

WAVE = MachineMissing(
    rank=1, effect="EAX:cyclic35mm", description=Description("a tilt", "a screw", "a nut", ""), amplitude=2.0, u=0.4,
    unit="µrad", coefficients={}, peak_um=1.2, p_value=0.0001, q_value=0.012, rms_before_um=1.0, rms_after_um=0.9,
    heldout_before_um=None, heldout_after_um=None, heldout_days_before_um=None, heldout_days_after_um=None,
    heldout_poses_before_um=None, heldout_poses_after_um=None, indistinguishable_from=(), coinciding=(),
    tell_apart_by=(), standard_deviations_apart=DeviationsApart(0.0, 0.0), varies_from_run_to_run=False,
    shape_unknown=False, nearest_shape=None, curve=(),
)  # fmt: skip


@pytest.mark.parametrize(
    ("q_value", "rate", "is_said"), [(0.012, 0.01, True), (0.004, 0.01, False), (0.012, None, False)]
)
def test_why_q_is_above_the_rate(
    capsys: pytest.CaptureFixture[str], q_value: float, rate: float | None, is_said: bool
) -> None:
    """What was asked for at a level of its own had a q above the rate, without a word; older answers have no rate."""
    explanation = cast("MachineExplanation", SimpleNamespace(target_word="ball", held_out="runs", rate=rate))
    _machine_effect(replace(WAVE, q_value=q_value), explanation)
    said = capsys.readouterr().out
    assert ("above its rate of 0.01: this was asked for afterwards" in said) is is_said
