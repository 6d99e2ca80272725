"""Plans of instruments: which one next, and where, for the parameters that somebody asks for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np

from monitor.effects import Effect, parse_effect
from monitor.exceptions import EffectError, InputError, did_you_mean
from monitor.machine import Joint
from monitor.methods import ChainMethod, InstrumentPlan, campaign_method
from monitor.methods.method import ExpectedTest, PlannedTest, TestForecast
from monitor.methods.model import Model, chain_of
from monitor.records import Array, Campaign
from monitor.store import StoredModel
from monitor.workflow.models import as_model, label
from monitor.workflow.plan.answer import InstrumentPlanAnswer, UnseenParameter
from monitor.workflow.plan.named_tests import PLACED, named_test, planned_test, shown_u
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.plan.strokes import strokes_of
from monitor.workflow.plan.test_answer import TestAnswer

#: So many tests are listed, and at most proposed.
LISTED, MOST_TESTS = 12, 12
#: Pairs are made of so many tests at most: some 300 pairs, each a millisecond.
MOST_PAIRED = 24
#: A rotary axis that turned by less (rad) may turn all around.
LEAST_TURN = 0.5


def plan_instruments(
    method: InstrumentPlan, campaign: Campaign, model: StoredModel, request: PlanRequest
) -> InstrumentPlanAnswer:
    """Every test ranked by the u that it would leave of the asked parameters, and the next ones in turn.

    ``parameters`` and ``separate`` of the request may name effects that the model lacks: tests are weighed as if it had
    them. Raises InputError for what such a plan does not have, a number of tests that cannot be, a parameter that there
    is not, and a wanted uncertainty that no test reaches.
    """
    count = _count(request)
    effects = _effects_asked(request, campaign, model)
    forecast, run = forecast_of(method, campaign, _with_effects(as_model(model), effects))
    present, expected = forecast.present(), tuple(forecast.expected())
    asked = _asked(request, present, expected)
    internal = {name: forecast.unit_of(name).to_internal(u) for name, u in request.wanted.items()}
    in_turn = _in_turn(forecast, expected, asked, count or (MOST_TESTS if internal else 0), internal)
    _refuse_unreached(request, forecast, in_turn, internal)
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
        present=shown_u(forecast, present),
        tests=tuple(planned_test(forecast, test, joints) for test in ranked),
        proposed=tuple(planned_test(forecast, test, joints) for test in in_turn),
        unseen=unseen(forecast, joints, present, expected),
        standing=tuple(joint.name for joint in joints if _stands(campaign, joint)),
        pairs=_pairs(forecast, present, expected, asked, joints) if _names_some(request) else {},
        not_turned=_not_turned(joints, expected),
    )


def measurement_that_tells(
    method: InstrumentPlan, campaign: Campaign, model: Model, effects: Sequence[str]
) -> TestAnswer | None:
    """The test that gives the coefficients of effects numbers, all beside each other; None where no single one does.

    Effects whose recorded drivers only the future has, and those that the chain does not have, have no such test.
    """
    try:
        forecast, _ = forecast_of(method, campaign, _with_effects(model, effects))
        expected = tuple(forecast.expected())
    except InputError:
        return None
    asked = _coefficients(effects, expected)
    best = min(
        expected, key=lambda test: (_rank(test.u, asked)[0], not test.test.available, _rank(test.u, asked)[1])
    )
    if not asked or _rank(best.u, asked)[0] > 0:
        return None
    return named_test(forecast, best, chain_of(campaign.machine).joints)


def measurements_that_show(
    method: InstrumentPlan, campaign: Campaign, model: Model, names: Sequence[str]
) -> dict[str, TestAnswer]:
    """For each of ``names`` that one test gives a number the best of them, of the campaign's own instruments where they
    do; every test at the first place of each of its movements alone."""
    base = {effect.text for effect in method_base(campaign, model)}
    joints = chain_of(campaign.machine).joints
    tests: dict[str, TestAnswer] = {}
    for added in dict.fromkeys("" if name in base else name for name in names):
        asked = [name for name in names if name == added or (not added and name in base)]
        try:
            forecast, _ = forecast_of(method, campaign, _with_effects(model, [added] if added else []))
            expected = tuple(forecast.expected(first_places=True))
        except InputError:
            continue
        for name in asked:
            best = min(expected, key=partial(_order, name), default=None)
            if best is not None and np.isfinite(best.u.get(name, np.nan)):
                tests[name] = named_test(forecast, best, joints)
    return tests


def _order(name: str, test: ExpectedTest) -> tuple[bool, bool, float]:
    """First the tests that give a parameter a number, of them those of own instruments, of these the best."""
    u = test.u.get(name, np.nan)
    return not np.isfinite(u), not test.test.available, float(u)


def _coefficients(effects: Sequence[str], expected: Sequence[ExpectedTest]) -> tuple[str, ...]:
    """The coefficients of effects among those of the tests: ``EXY:harmonic1.cos``."""
    names = dict.fromkeys(name for test in expected for name in test.u)
    return tuple(
        name for name in names if any(name == text or name.startswith(f"{text}.") for text in effects)
    )


def _with_effects(model: Model, effects: Sequence[str]) -> Model:
    """The model and effects that it lacks."""
    return replace(model, added=tuple(dict.fromkeys((*model.added, *effects))))


def _effects_asked(request: PlanRequest, campaign: Campaign, model: StoredModel) -> tuple[str, ...]:
    """The effects that the model lacks and the request names. Raises EffectError for one of ``separate`` that is
    none."""
    chain = chain_of(campaign.machine)
    texts = [parse_effect(text, chain).text for text in request.separate or ()]
    for name in (*request.parameters, *request.wanted):
        # A gain is a parameter and no effect, EXX:poly2 an effect, EB0B an error that may lack in the model.
        if name not in model.effects:
            with suppress(EffectError):
                texts.append(parse_effect(name, chain).text)
    base = {effect.text for effect in method_base(campaign, as_model(model))}
    return tuple(text for text in dict.fromkeys(texts) if text not in base)


def method_base(campaign: Campaign, model: Model) -> tuple[Effect, ...]:
    """The effects that a campaign's runs have of their own."""
    method = campaign_method(campaign)
    assert isinstance(method, ChainMethod)
    return method.problem_of(campaign, model).base


def _names_some(request: PlanRequest) -> bool:
    return bool(request.parameters or request.wanted or request.separate)


def _count(request: PlanRequest) -> int:
    """How many tests are proposed. Raises InputError for what such a plan does not have."""
    if request.balls is not None or request.keep:
        raise InputError(
            "a plan of instruments is tests: --for names parameters, --separate two effects, --poses N proposes N "
            "tests, --wanted P=U those that reach an uncertainty"
        )
    if request.figures is not None:
        raise InputError("--figures: a plan of instruments has no figure yet; leave it out")
    count = request.poses or 0
    if not 0 <= count <= MOST_TESTS or request.poses == 0:
        raise InputError(f"--poses {request.poses}: choose 1 to {MOST_TESTS} tests")
    return count


def _refuse_unreached(
    request: PlanRequest,
    forecast: TestForecast,
    in_turn: Sequence[ExpectedTest],
    limits: Mapping[str, float],
) -> None:
    """InputError where the wanted uncertainties are not reached."""
    if limits and not _reached(in_turn[-1].u if in_turn else forecast.present(), limits):
        for name, wanted in limits.items():
            least, limiting = forecast.limit([test.test for test in in_turn], name)
            if limiting and least > wanted:
                unit = forecast.unit_of(name)
                raise InputError(
                    f"{name} cannot become better than {unit.to_display(least):.2g} {unit.name}: "
                    f"{' and '.join(limiting)} limit{'s' if len(limiting) == 1 else ''} it, however often is "
                    f"measured; have {'it' if len(limiting) == 1 else 'these'} calibrated better"
                )
        raise InputError(
            f"no {MOST_TESTS} tests reach {', '.join(f'{name}={u:g}' for name, u in request.wanted.items())}; "
            "ask for more modest uncertainties, or repeat tests in several runs"
        )


def _stands(campaign: Campaign, joint: Joint) -> bool:
    """Whether nobody knows how far a linear axis travels: it stood still, and its stroke is not stated."""
    settings = campaign.machine.axes.get(joint.name)
    is_stated = settings is not None and settings.stroke is not None
    return not joint.turns and not is_stated and np.ptp(campaign.probings.readings[joint.name]) == 0.0


def _not_turned(joints: Sequence[Joint], expected: Sequence[ExpectedTest]) -> tuple[str, ...]:
    """The rotary axes around which no bar or sphere can be followed within the strokes."""
    followed = [test.test for test in expected if test.test.setup.reading in PLACED]
    return tuple(
        joint.name
        for index, joint in enumerate(joints)
        if joint.kind == "rotary" and not any(np.ptp(test.positions[:, index]) > 0.0 for test in followed)
    )


def forecast_of(
    method: InstrumentPlan, campaign: Campaign, model: Model, run: int | None = None
) -> tuple[TestForecast, int]:
    """The forecast of a ``run`` (the last with None), whose number is returned too; axes move over their strokes."""
    number = int(campaign.probings.run.max()) if run is None else run
    chain = chain_of(campaign.machine)
    positions = np.column_stack([
        joint.sign * campaign.probings.readings[joint.name] for joint in chain.joints
    ])  # fmt: skip
    rotary, linear = strokes_of(campaign, chain, positions)
    around = {
        joint.name: _angles(joint, positions[:, index])
        for index, joint in enumerate(chain.joints)
        if joint.turns
    }
    return method.forecast(campaign, model, number, {**around, **rotary, **linear}), number


def _angles(joint: Joint, visited: Array) -> tuple[float, float]:
    """The angles (rad) that a rotary axis without a stated stroke may take: those between which it went, else all."""
    low, high = float(visited.min()), float(visited.max())
    if high - low > LEAST_TURN:
        return low, high
    return (0.0, 2.0 * np.pi) if joint.sign > 0 else (-2.0 * np.pi, 0.0)


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
                    name, unit.name, unit.to_display(best.u[name]), named_test(forecast, best, joints)
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
    texts = (*(request.separate or ()), *request.parameters, *request.wanted)
    # An effect is asked for by all of its coefficients.
    asked = tuple(
        dict.fromkeys(each for text in texts for each in (_coefficients((text,), expected) or (text,)))
    ) or tuple(present)
    for name in asked:
        if name not in names:
            plain, equals, uncertainty = name.partition("=")
            if equals:
                raise InputError(
                    f"--for {name}: an uncertainty is wanted by --wanted {plain}={uncertainty or '1.5'}, "
                    f"and --for names parameters: {', '.join(names)}"
                )
            if "," in name:
                raise InputError(
                    f"--for {name}: it takes one parameter and may be repeated; two effects that are to be told apart "
                    f"are named by --separate {name}"
                )
            raise InputError(
                f"there is no parameter '{name}'; {did_you_mean(name, names)}there are {', '.join(names)}"
            )
    return asked


def _rank(u: Mapping[str, float], asked: Sequence[str]) -> tuple[int, float]:
    """How many of the asked parameters have no number, and the mean logarithm of the u of the others."""
    values = np.array([u.get(name, np.nan) for name in asked])
    is_seen = np.isfinite(values)
    return int(np.sum(~is_seen)), float(np.log(values[is_seen]).mean()) if is_seen.any() else 0.0


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
    """The best next test, the best after it, and so on, of the campaign's own instruments where these do; up to
    ``count``, or until the ``wanted`` uncertainties are reached."""
    in_turn: list[ExpectedTest] = []
    while len(in_turn) < count and not (wanted and in_turn and _reached(in_turn[-1].u, wanted)):
        before = [test.test for test in in_turn]
        lacking = _rank(in_turn[-1].u if in_turn else forecast.present(), asked)[0]
        best = _best_next(forecast, expected, before, asked, lacking)
        if _rank(best.u, asked)[0] < lacking or lacking < len(asked):
            in_turn.append(best)
            continue
        # None alone gives any of them a number: only what two give is worth a proposal.
        pair = _best_pair(forecast, expected, before, asked) if len(in_turn) + 2 <= count else None
        if pair is None:
            break
        in_turn += [forecast.together([*before, pair[0].test]), pair[1]]
    return in_turn


def _best_next(
    forecast: TestForecast,
    expected: Sequence[ExpectedTest],
    before: Sequence[PlannedTest],
    asked: Sequence[str],
    lacking: int,
) -> ExpectedTest:
    """The test that leaves least beside those ``before``: of the instruments that are there or proposed already, or of
    all where ``lacking`` parameters have no number and none of these gives one."""

    def best_of(tests: Iterable[ExpectedTest]) -> ExpectedTest | None:
        together = (forecast.together([*before, test.test]) for test in tests)
        return min(together, key=lambda test: _rank(test.u, asked), default=None)

    proposed = {test.setup.id for test in before}
    mine = [test.test.available or test.test.setup.id in proposed for test in expected]
    best = best_of(test for test, is_mine in zip(expected, mine, strict=True) if is_mine)
    if best is not None and (not lacking or _rank(best.u, asked)[0] < lacking):
        return best
    other = best_of(test for test, is_mine in zip(expected, mine, strict=True) if not is_mine)
    both = [each for each in (best, other) if each is not None]
    return min(both, key=lambda test: _rank(test.u, asked)[0])


def _best_pair(
    forecast: TestForecast,
    expected: Sequence[ExpectedTest],
    before: Sequence[PlannedTest],
    asked: Sequence[str],
) -> tuple[ExpectedTest, ExpectedTest] | None:
    """The two tests, beside those ``before``, that together give most of the asked parameters a number, the second with
    what both leave; of the campaign's own instruments where these do. None where no two do."""
    lacking = _rank(forecast.together(before).u if before else forecast.present(), asked)[0]
    for candidates in ([test for test in expected if test.test.available], list(expected)):
        pairs = list(combinations(_of_pairs(candidates), 2))
        weighed = [(first, forecast.together([*before, first.test, second.test])) for first, second in pairs]
        best = min(weighed, key=lambda pair: _rank(pair[1].u, asked), default=None)
        if best is not None and _rank(best[1].u, asked)[0] < lacking:
            return best
    return None


def _of_pairs(candidates: Sequence[ExpectedTest]) -> list[ExpectedTest]:
    """The tests of which pairs are made: of each setup the first places, so that there are no more than can be
    weighed."""
    by_setup: dict[str, list[ExpectedTest]] = {}
    for test in candidates:
        by_setup.setdefault(test.test.setup.id, []).append(test)
    each = max(MOST_PAIRED // max(len(by_setup), 1), 1)
    return [test for tests in by_setup.values() for test in tests[:each]]


def _pairs(
    forecast: TestForecast,
    present: Mapping[str, float],
    expected: Sequence[ExpectedTest],
    asked: Sequence[str],
    joints: Sequence[Joint],
) -> dict[str, tuple[TestAnswer, ...]]:
    """For every asked parameter that neither the readings nor any single test gives a number, two tests that do."""
    pairs: dict[str, tuple[TestAnswer, ...]] = {}
    for name in asked:
        if any(np.isfinite(u.get(name, np.nan)) for u in (present, *(test.u for test in expected))):
            continue
        pair = _best_pair(forecast, expected, (), (name,))
        pairs[name] = () if pair is None else tuple(planned_test(forecast, test, joints) for test in pair)
    return pairs


def _reached(u: Mapping[str, float], wanted: Mapping[str, float]) -> bool:
    return all(u.get(name, np.inf) <= limit for name, limit in wanted.items())
