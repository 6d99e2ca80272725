"""For every rival of a finding, what to do in the next run."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from monitor.discovery import Explanation, RobustFit, compare, fit
from monitor.discovery.machine.separation.separate import Separation
from monitor.effects import parse_effect
from monitor.methods import ChainMethod, campaign_method, methods
from monitor.readers import read_campaign
from monitor.records import Campaign, SecondSetup
from monitor.reporting.runs_that_tell import poses_that_tell
from monitor.store import Database, StoredModel
from monitor.web.words import what_breaks
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.machine_answer import has_plan_of_pairs
from monitor.workflow.explain.planned_ties import PlanOfPairs
from monitor.workflow.explain.ties import Tie, TieBreak, ties_of
from monitor.workflow.health.task import Task, computed
from monitor.workflow.identify.fitting import machine_problem
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.models import as_model, resolve
from monitor.workflow.plan.answer import SeparationVerdict
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.plan.separate import deviations_apart, separation_of

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
POSES = Separation(({"C": 0.5},), 0.1, 12.0, (("EXC:harmonic2", "EYC:harmonic2"),))
STYLUS = Separation(
    (), 0.0, 0.0, (("EAY:reversal", "EYY:reversal"), ("EAY:reversal", "EZY:reversal")),
    ((SecondSetup.LONGER_STYLUS, 3), None),
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
                Tie(("EYY:reversal",), TieBreak.SETUP, runs=3, setup=SecondSetup.LONGER_STYLUS),
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


def test_jumps_at_reversal_are_told_by_another_order_before_more_poses() -> None:
    separation = Separation((), 0.0, 0.0, by_order=(("EXX:reversal", 1),))
    effect = SimpleNamespace(effect="EZZ:reversal", separation=separation, within_runs=False)
    ties = ties_of(effect, ("EXX:reversal", "EYY:poly1"), is_planned=False)
    assert ties == (
        Tie(("EXX:reversal",), TieBreak.REVERSED_ORDER, runs=1),
        Tie(("EYY:poly1",), TieBreak.MORE_POSES, axes=("Z", "Y")),
    )
    assert "from the last reading to the first" in what_breaks(ties[0])


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


def test_what_moved_once_is_told_by_no_pose() -> None:
    """Of a station and the base under the machine poses over "the whole range of " no axis were asked for."""
    found = SimpleNamespace(effect="tracker:moved(run 1, sequence 80)", separation=NONE, within_runs=False)
    ties = ties_of(found, ("base:moved(run 1, sequence 80)", "EXX:poly1@run_time"), is_planned=False)
    assert [tie.broken_by for tie in ties] == [TieBreak.REFERENCES, TieBreak.REPEATED]
    assert "targets that rest beside the machine" in what_breaks(ties[0])


def test_orders_of_one_gear_are_told_apart_by_its_ratio() -> None:
    """Positions on a grid see several orders as one; errors of other directions no ratio tells apart."""
    assert poses_that_tell(("C",), ("ECC:harmonic12", "ECC:harmonic72")).endswith("(gear_ratio)")
    assert poses_that_tell(("C",), ("ECC:harmonic2", "ECC:harmonic3")).endswith("present ones")
    assert poses_that_tell(("C",), ("ECC:harmonic12", "EAC:harmonic12")).endswith("present ones")


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        (("flexure:tool@gravity", "EBEL:poly1"), "some poses under another load"),
        (("sight:up:formula(x)",), "more poses over the whole range of all axes, between the present ones"),
    ],
)
def test_no_list_of_axes_is_empty(effects: tuple[str, ...], words: str) -> None:
    assert poses_that_tell((), effects) == words


def test_a_linear_axis_is_not_indexed() -> None:
    words = what_breaks(Tie(("EZZ:poly1@warmup",), TieBreak.INDEXATIONS, ("warmup",), ("C1", "Z")))
    assert words == "bring C1 and Z to other positions while warmup acts"


def test_the_weekly_report_asks_the_plan_as_explain_does(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It stored the poses that `explain` names only where the plan has them."""
    campaign = read_campaign(EXAMPLES / "r-test")
    with Database(tmp_path / "one.duckdb") as db:
        model = resolve(db, None, campaign.method)
    asked: list[object] = []

    def with_plans(answer: MachineExplanation, *others: object) -> MachineExplanation:
        asked.append(answer)
        return answer

    def unsearched(campaign: Campaign, model: StoredModel, robust: RobustFit) -> Explanation:
        comparison = compare(robust.fit, campaign.name, model.name)
        return Explanation(comparison, (), (), (), (), (), (), robust.fit)

    monkeypatch.setattr("monitor.workflow.explain.explain.with_plans", with_plans)
    monkeypatch.setattr("monitor.workflow.health.task.explanation_of", unsearched)
    task = Task(model, (), campaign, True, 1, uncertainty=False, explanation=True, map=False, versions=())
    assert asked == [computed(task).explanation]


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> PlanOfPairs:
    """The plan of the example in which C turns three times as far as B."""
    campaign = read_campaign(EXAMPLES / "cold-cold")
    with Database(tmp_path_factory.mktemp("ties") / "one.duckdb") as db:
        return PlanOfPairs(fit(machine_problem(campaign, resolve(db, None, "samba"))), campaign)


@pytest.mark.parametrize(
    ("effect", "rival", "kind"),
    [
        ("EXC:harmonic2", "EXB:harmonic3", TieBreak.PLAN),
        ("EXC1:harmonic1", "EYC1:harmonic1", TieBreak.NO_POSES),
        ("EAZ:poly2", "EAZ:poly3", TieBreak.MORE_RUNS),
    ],
)
def test_a_tie_is_broken_by_what_the_plan_says(
    planned: PlanOfPairs, effect: str, rival: str, kind: TieBreak
) -> None:
    """`explain` named `plan --separate` for pairs that it tells apart already, and for those that no pose does."""
    said = separation_of(planned.fitted, planned.campaign, (effect, rival))
    context = planned.fitted.problem.context
    size = parse_effect(effect, context.chain).basis(context).size
    (tie,) = planned.of_tie(effect, np.full(size, 1e-7), Tie((rival,), TieBreak.PLAN))
    assert tie.broken_by is kind
    assert (
        said.verdict
        is {
            TieBreak.PLAN: SeparationVerdict.WITH_POSES,
            TieBreak.NO_POSES: SeparationVerdict.IMPOSSIBLE,
            TieBreak.MORE_RUNS: SeparationVerdict.ALREADY,
        }[kind]
    )
    assert (said.standard_deviations_apart.present > 5.0) is (kind is TieBreak.MORE_RUNS)


def test_as_many_runs_more_are_asked_for_as_make_five_standard_deviations(planned: PlanOfPairs) -> None:
    pair, coefficients = ("EAZ:poly2", "EAZ:poly3"), np.array([1e-9])
    apart = deviations_apart(planned.fitted, planned.campaign, pair, coefficients)
    coefficients *= 2.0 / apart  # two standard deviations apart: 44 * (5 / 2)² runs are 275
    (tie,) = planned.of_tie(pair[0], coefficients, Tie(pair[1:], TieBreak.PLAN))
    assert len(planned.fitted.problem.runs) == 44
    assert tie.runs in (275 - 44, 276 - 44)
    (tie,) = planned.of_tie(pair[0], coefficients / 10.0, Tie(pair[1:], TieBreak.PLAN))
    assert (tie.broken_by, tie.runs) == (TieBreak.NO_POSES, None)
