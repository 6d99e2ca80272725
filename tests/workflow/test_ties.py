"""For every rival of a finding, what to do in the next run."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from monitor.discovery.machine.separation.separate import Separation
from monitor.records import SecondSetup
from monitor.workflow.explain.ties import Tie, TieBreak, ties_of

POSES = Separation(({"C": 0.5},), 0.1, 12.0, (("EXC:harmonic2", "EYC:harmonic2"),))
STYLUS = Separation(
    (), 0.0, 0.0, (("EAY:reversal", "EYY:reversal"), ("EAY:reversal", "EZY:reversal")),
    (SecondSetup.LONGER_STYLUS, None),
)  # fmt: skip
NONE = Separation((), 0.0, 0.0)


@pytest.mark.parametrize(
    ("effect", "separation", "rivals", "ties"),
    [
        (
            "EXC:harmonic2", POSES, ("EXB:harmonic3", "EYC:harmonic2"),
            (Tie(("EXB:harmonic3",), TieBreak.POSES), Tie(("EYC:harmonic2",), TieBreak.NOTHING)),
        ),
        ("EXC:harmonic2", NONE, ("EXB:harmonic3",), (Tie(("EXB:harmonic3",), TieBreak.PLAN),)),
        (
            "EAY:reversal", STYLUS, ("EYY:reversal", "EZY:reversal"),
            (
                Tie(("EYY:reversal",), TieBreak.SETUP, setup=SecondSetup.LONGER_STYLUS),
                Tie(("EZY:reversal",), TieBreak.NOTHING),
            ),
        ),
        (
            "EXX:poly1@warmup20min", NONE, ("EXX:poly1@x_axis_degC", "EXX:poly1"),
            (
                Tie(("EXX:poly1@x_axis_degC",), TieBreak.DRIVERS, ("warmup", "x_axis_degC")),
                Tie(("EXX:poly1",), TieBreak.DRIVERS, ("warmup",)),
            ),
        ),
        (
            "EXC1:const@warmup", NONE, ("EX0C1@warmup", "EXZ:const@warmup"),
            (
                Tie(("EX0C1@warmup",), TieBreak.INDEXATIONS, ("warmup",), ("C1",)),
                Tie(("EXZ:const@warmup",), TieBreak.INDEXATIONS, ("warmup",), ("C1", "Z")),
            ),
        ),
    ],
)  # fmt: skip
def test_what_breaks_a_tie(
    effect: str, separation: Separation, rivals: tuple[str, ...], ties: tuple[Tie, ...]
) -> None:
    found = SimpleNamespace(effect=effect, separation=separation, within_runs=False)
    assert ties_of(found, rivals, is_touched=True) == ties


def test_poses_that_something_outside_sees_have_no_plan_of_touches() -> None:
    """`monitor plan` refuses such a campaign: what it would be told for is more poses."""
    effect = SimpleNamespace(effect="EBJ2:compliance@gravity", separation=NONE, within_runs=False)
    ties = ties_of(effect, ("EBJ1:compliance@gravity",), is_touched=False)
    assert ties == (Tie(("EBJ1:compliance@gravity",), TieBreak.MORE_POSES, (), ("J2", "J1")),)
