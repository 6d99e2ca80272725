"""The compiled gradient against the plain one: every topology, model and size of error (two ways must agree)."""

import numpy as np
import pytest

from monitor.machine import chain_of_axes
from monitor.progress import listening
from monitor.records import ChainAxis
from monitor.uncertainty import sensitivity_of
from monitor.uncertainty.runs import kernel
from monitor.uncertainty.runs.kernel import LANES, gradient_of
from monitor.uncertainty.runs.program import compile_program

TOPOLOGIES = [
    "w C B X b Z Y (C1) t",
    "w C A Y b X Z (C1) t",
    "w C b X Y Z B (C1) t",
    "w b X Y Z B A (C1) t",
    "w X Y b Z C A t",
    "w Y b X Z t",
]


def compare(run, trials, size=1e-5, seed=2):
    rng = np.random.default_rng(seed)
    scale = np.where(
        [name[0] == "E" and name[1] in "ABC" for name in run.problem.local_names], size, 100 * size
    )
    theta = run.problem.start[0][:, None] + scale[:, None] * rng.standard_normal((run.unknowns, trials))
    inputs = run.inputs[:, None] + 2e-3 * rng.standard_normal((len(run.inputs), trials))
    program = compile_program(run)
    assert program is not None
    plain = run.gradient(theta, inputs)
    return np.max(
        np.abs(gradient_of(program, theta, inputs) - plain) / np.max(np.abs(plain), axis=1, keepdims=True)
    )


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_gradient_of_every_topology(make_run, topology):
    assert compare(make_run(topology), 5) < 1e-9


SLANTED = chain_of_axes(
    [
        ChainAxis("X", "linear", "work", (0.8, -0.6, 0.0), (10.0, 0.0, 5.0)),
        ChainAxis("B", "rotary", "work", (0.0, 0.6, -0.8), (0.0, -20.0, 0.0)),
        ChainAxis("Y", "linear", "tool", (0.0, 1.0, 0.0)),
        ChainAxis("Z", "linear", "tool", (0.0, 0.28, 0.96)),
        ChainAxis("C", "rotary", "tool", (0.0, 0.0, -1.0), (0.0, 30.0, 0.0)),
        ChainAxis("B2", "rotary", "tool", (0.0, 2**-0.5, 2**-0.5), (15.0, 0.0, 100.0)),
    ]
)


def test_gradient_of_slanted_axes_with_offsets(make_run):
    assert compare(make_run(SLANTED), 5) < 1e-9


@pytest.mark.parametrize("trials", [1, LANES - 1, LANES, LANES + 1])
def test_blocks_that_do_not_fill_the_lanes(make_run, trials):
    assert compare(make_run(TOPOLOGIES[0]), trials) < 1e-9


def test_gradient_with_errors_up_to_the_largest_angle(make_run):
    assert compare(make_run(TOPOLOGIES[0]), 20, size=2e-3) < 1e-9


@pytest.mark.parametrize(
    "effect",
    [
        "EBB:harmonic2",
        "EYX:poly1",
        "EYX:poly2",
        "EAX:poly1",
        "ECY:poly3",
        "EXX:cyclic20mm",
        "EXX:reversal",
        "EZC1:const@run_time",
        "EAB:harmonic1@run_time",
    ],
)
def test_gradient_with_an_added_effect_held(make_run, effect):
    assert compare(make_run(TOPOLOGIES[0], (effect,)), 5) < 5e-8


def test_model_that_the_program_cannot_follow_goes_the_plain_way(make_run):
    straight = sensitivity_of(make_run(TOPOLOGIES[0], ("EYX:poly2",)))
    assert straight.compiled
    hats = sensitivity_of(make_run(TOPOLOGIES[0], ("EYX:table",)))
    assert not hats.compiled


class _Block:
    """Stands for the compiled block: it has a signature once it was called."""

    def __init__(self):
        self.signatures = []

    def __call__(self, *arguments):
        self.signatures.append(arguments)


def test_whoever_waits_for_the_compiler_is_told_so_once(monkeypatch):
    monkeypatch.setattr(kernel, "_block", _Block())
    said = []
    with listening(lambda share: None, said.append):
        kernel.call_block(1)
        kernel.call_block(2)
    assert said == [kernel.FIRST_CALL, ""]
    assert "half a minute the first time on this machine" in said[0]
