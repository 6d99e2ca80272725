"""Plans of instruments: which one next, and where, for the parameters that somebody asks for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from monitor.exceptions import InputError, did_you_mean
from monitor.machine import Joint
from monitor.methods import InstrumentPlan
from monitor.methods.method import ExpectedTest, TestForecast
from monitor.methods.model import chain_of
from monitor.records import Campaign
from monitor.store import StoredModel
from monitor.workflow.models import as_model, label
from monitor.workflow.plan.answer import InstrumentPlanAnswer, TestAnswer, UnseenParameter
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.plan.strokes import strokes_of

#: So many tests are listed, and at most proposed.
LISTED, MOST_TESTS = 12, 12
#: Kinds whose bar or sphere stands at a place that the plan chooses.
PLACED = ("distance", "vector")


def plan_instruments(
    method: InstrumentPlan, campaign: Campaign, model: StoredModel, request: PlanRequest
) -> InstrumentPlanAnswer:
    """Every test ranked by the u that it would leave of the asked parameters, and the next ones in turn.

    Raises InputError for what such a plan does not have, a number of tests that cannot be, a parameter that there is
    not, and a wanted uncertainty that no test reaches.
    """
    if request.balls is not None or request.keep or request.separate is not None:
        raise InputError(
            "a plan of instruments is tests: --for names parameters, --poses N proposes N tests, --wanted P=U those "
            "that reach an uncertainty"
        )
    if request.figures is not None:
        raise InputError("--figures: a plan of instruments has no figure yet; leave it out")
    count = request.poses or 0
    if not 0 <= count <= MOST_TESTS or request.poses == 0:
        raise InputError(f"--poses {request.poses}: choose 1 to {MOST_TESTS} tests")
    forecast, run = forecast_of(method, campaign, model)
    present, expected = forecast.present(), tuple(forecast.expected())
    asked = _asked(request, present, expected)
    internal = {name: forecast.unit_of(name).to_internal(u) for name, u in request.wanted.items()}
    chosen = _in_turn(forecast, expected, asked, count or (MOST_TESTS if internal else 0), internal)
    if internal and not _reached((chosen or [ExpectedTest(expected[0].test, present)])[-1].u, internal):
        raise InputError(
            f"no {MOST_TESTS} tests reach {', '.join(f'{name}={u:g}' for name, u in request.wanted.items())}; "
            "ask for more modest uncertainties, or repeat tests in several runs"
        )
    joints = chain_of(campaign.machine).joints
    ranked = _best_of_setups(expected, asked)[:LISTED]
    return InstrumentPlanAnswer(
        campaign=campaign.name,
        machine=campaign.machine.id,
        method=campaign.method,
        model=label(model),
        run=run,
        asked=asked,
        units={name: forecast.unit_of(name).name for name in _names(present, expected)},
        present=_shown(forecast, present),
        tests=tuple(_answer(forecast, test, joints) for test in ranked),
        proposed=tuple(_answer(forecast, test, joints) for test in chosen),
        unseen=unseen(forecast, joints, present, expected),
        standing=tuple(joint.name for joint in joints if _stands(campaign, joint)),
    )


def _stands(campaign: Campaign, joint: Joint) -> bool:
    """Whether nobody knows how far a linear axis travels: it stood still, and its stroke is not stated."""
    settings = campaign.machine.axes.get(joint.name)
    is_stated = settings is not None and settings.stroke is not None
    return not joint.turns and not is_stated and np.ptp(campaign.probings.readings[joint.name]) == 0.0


def forecast_of(
    method: InstrumentPlan, campaign: Campaign, model: StoredModel, run: int | None = None
) -> tuple[TestForecast, int]:
    """The forecast of a ``run`` (the last with None), whose number is returned too; axes may move over their strokes, a
    rotary axis without one all around."""
    number = int(campaign.probings.run.max()) if run is None else run
    chain = chain_of(campaign.machine)
    positions = np.column_stack([
        joint.sign * campaign.probings.readings[joint.name] for joint in chain.joints
    ])  # fmt: skip
    rotary, linear = strokes_of(campaign, chain, positions)
    turn = 2.0 * np.pi
    around = {
        joint.name: (0.0, turn) if joint.sign > 0 else (-turn, 0.0) for joint in chain.joints if joint.turns
    }
    return method.forecast(campaign, as_model(model), number, {**around, **rotary, **linear}), number


def unseen(
    forecast: TestForecast,
    joints: Sequence[Joint],
    present: Mapping[str, float],
    expected: Sequence[ExpectedTest],
) -> tuple[UnseenParameter, ...]:
    """Parameters without a number, each with the single test that gives it the smallest u; what none sees is left
    out."""
    answers = []
    for name in _names(present, expected):
        if np.isfinite(present.get(name, np.nan)):
            continue
        able = [test for test in expected if np.isfinite(test.u.get(name, np.nan))]
        if able:
            best = min(able, key=lambda test: (not test.test.available, test.u[name]))
            unit = forecast.unit_of(name)
            answers.append(
                UnseenParameter(
                    name, unit.name, unit.to_display(best.u[name]), _answer(forecast, best, joints)
                )
            )
    return tuple(answers)


def _names(present: Mapping[str, float], expected: Iterable[ExpectedTest]) -> tuple[str, ...]:
    """All parameters, those of the run first."""
    return tuple(dict.fromkeys([*present, *(name for test in expected for name in test.u)]))


def _asked(
    request: PlanRequest, present: Mapping[str, float], expected: Sequence[ExpectedTest]
) -> tuple[str, ...]:
    """The parameters that tests are ranked for. Raises InputError for one that there is not."""
    names = _names(present, expected)
    asked = tuple(dict.fromkeys((*request.parameters, *request.wanted))) or tuple(present)
    for name in asked:
        if name not in names:
            raise InputError(
                f"there is no parameter '{name}'; {did_you_mean(name, names)}there are {', '.join(names)}"
            )
    return asked


def _rank(u: Mapping[str, float], asked: Sequence[str]) -> tuple[int, float]:
    """How many of the asked parameters have no number, and the mean logarithm of the u of the others."""
    values = np.array([u.get(name, np.nan) for name in asked])
    seen = np.isfinite(values)
    return int(np.sum(~seen)), float(np.log(values[seen]).mean()) if seen.any() else 0.0


def _best_of_setups(expected: Sequence[ExpectedTest], asked: Sequence[str]) -> list[ExpectedTest]:
    """The best place of each setup, best first."""
    best: dict[str, ExpectedTest] = {}
    for test in sorted(expected, key=lambda test: _rank(test.u, asked)):
        best.setdefault(test.test.setup.id, test)
    return list(best.values())


def _in_turn(
    forecast: TestForecast,
    expected: Sequence[ExpectedTest],
    asked: Sequence[str],
    count: int,
    wanted: Mapping[str, float],
) -> list[ExpectedTest]:
    """The best next test, the best after it, and so on, of the campaign's own instruments where it has some; up to
    ``count``, or until the ``wanted`` uncertainties are reached."""
    own = [test for test in expected if test.test.available] or list(expected)
    chosen: list[ExpectedTest] = []
    for _ in range(count):
        if wanted and chosen and _reached(chosen[-1].u, wanted):
            break
        before = [test.test for test in chosen]
        chosen.append(
            min(
                (forecast.together([*before, test.test]) for test in own),
                key=lambda test: _rank(test.u, asked),
            )
        )
    return chosen


def _reached(u: Mapping[str, float], wanted: Mapping[str, float]) -> bool:
    return all(u.get(name, np.inf) <= limit for name, limit in wanted.items())


def _shown(forecast: TestForecast, u: Mapping[str, float]) -> dict[str, float | None]:
    return {
        name: forecast.unit_of(name).to_display(value) if np.isfinite(value) else None
        for name, value in u.items()
    }


def _answer(forecast: TestForecast, expected: ExpectedTest, joints: Sequence[Joint]) -> TestAnswer:
    test = expected.test
    axes = {}
    for index, joint in enumerate(joints):
        readings = joint.sign * test.positions[:, index]
        shown = np.rad2deg(readings) if joint.turns else readings
        column = f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}"
        axes[column] = (round(float(shown.min()), 3) + 0.0, round(float(shown.max()), 3) + 0.0)
    x, y, z = (round(value, 3) + 0.0 for value in test.setup.work_point)
    return TestAnswer(
        instrument=test.setup.instrument or test.setup.id,
        setup=test.setup.id,
        reading=test.setup.reading,
        available=test.available,
        poses=len(test.positions),
        axes=axes,
        u=_shown(forecast, expected.u),
        work_point_mm=(x, y, z) if test.setup.reading in PLACED else None,
    )
