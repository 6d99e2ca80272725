"""For every rival of a finding, what to do in the next run."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from monitor.discovery.machine.separation.separate import Separation
from monitor.methods import ChainMethod, campaign_method, methods
from monitor.readers import read_campaign
from monitor.records import SecondSetup
from monitor.store import Database
from monitor.web.words import what_breaks
from monitor.workflow.explain.machine_answer import has_plan_of_pairs
from monitor.workflow.explain.ties import Tie, TieBreak, ties_of
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.models import as_model, resolve
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
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
    assert ties_of(found, rivals, is_planned=True) == ties


def test_poses_that_something_outside_sees_have_no_plan_of_touches() -> None:
    """`monitor plan` refuses such a campaign: what it would be told for is more poses."""
    effect = SimpleNamespace(effect="EBJ2:compliance@gravity", separation=NONE, within_runs=False)
    ties = ties_of(effect, ("EBJ1:compliance@gravity",), is_planned=False)
    assert ties == (Tie(("EBJ1:compliance@gravity",), TieBreak.MORE_POSES, (), ("J2", "J1")),)


@pytest.mark.parametrize(
    "method", [name for name, each in methods().items() if isinstance(each, ChainMethod)]
)
def test_no_method_is_told_to_type_what_is_refused(method: str, tmp_path: Path) -> None:
    """Of rotary probing `explain` told `monitor plan --separate`, which refuses such a campaign."""
    folder = next(
        folder
        for folder in (EXAMPLES / name for name in ("hidden-reversal-x", *sorted(os.listdir(EXAMPLES))))
        if (folder / "campaign.toml").exists()
        and f'method = "{method}"' in (folder / "campaign.toml").read_text()
    )
    campaign = read_campaign(folder)
    with Database(tmp_path / "one.duckdb") as db:
        problem = campaign_method(campaign).problem_of(campaign, as_model(resolve(db, None, method)))
        name = problem.context.chain.joints[-1].name
        pair = (f"EX{name}:poly2", f"EY{name}:poly2")
        effect = SimpleNamespace(effect=pair[0], separation=NONE, within_runs=False)
        (tie,) = ties_of(effect, pair[1:], is_planned=has_plan_of_pairs(problem))
        assert tie.broken_by in (TieBreak.PLAN, TieBreak.MORE_POSES)
        if tie.broken_by is TieBreak.PLAN:
            import_folders(db, ImportRequest([folder]))
            answer = plan(db, PlanRequest(campaign.name, separate=pair))
            assert answer.separate.effects == pair
        else:
            assert (
                what_breaks(tie)
                == f"measure more poses over the whole range of {name}, between the present ones"
            )
