"""Readings in inches, of which no stated place says so, are not explained without a word."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.workflow.explain.machine_answer import machine_explanation


@pytest.fixture(scope="module")
def trial():
    return load("trial_methods", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_methods.py")


def test_readings_that_fit_ten_times_too_well_are_said_to_do_so(trial):
    """Faces of a piece, touched: a file in inches fits as well, 25.4 times too well (0.7 µm of noise, 0.7 stated)."""
    campaign = trial.rotary(np.random.default_rng(5), 1, plan="source")
    linear = {axis for axis in campaign.probings.readings if axis in "XYZ"}
    inches = {
        axis: values / 25.4 if axis in linear else values
        for axis, values in campaign.probings.readings.items()
    }
    of_unit = {
        "mm": campaign,
        "inch": replace(campaign, probings=replace(campaign.probings, readings=inches)),
    }
    answers = {unit: machine_explanation(trial.explained(each)) for unit, each in of_unit.items()}
    sentences = {
        unit: [sentence for sentence in answer.undecided if "better than" in sentence]
        for unit, answer in answers.items()
    }
    assert sentences["mm"] == []
    (sentence,) = sentences["inch"]
    assert "inches fit 25 times too well" in sentence
