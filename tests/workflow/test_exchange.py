"""Steps of several gains at one exchange of a laser's certificate, judged at once; drawn by a program of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import scipy

from monitor.statistics.common_error import jumps, p_of_common_error
from monitor.store import MachineHistory
from monitor.store.past.instruments import Calibrations
from monitor.workflow.history.other_instruments import between_instruments
from monitor.workflow.history.past import ParameterPast
from tests.benchmarks.trial_exchange import LASER, Case, denied, history, stepped


def denials(case: Case, histories: int) -> int:
    rng = np.random.default_rng(11)
    return sum(denied(case, rng) for _ in range(histories))


@pytest.mark.parametrize("drift", [0.5, 2.0])
def test_a_gain_that_drifts_makes_no_exchange_one_of_the_machine(drift: float) -> None:
    """The last gain of three drifts by so many um/m a year: 28 and 30 of 30 were denied."""
    assert denials(Case(20, drift=drift), 30) <= 5


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", [Case(3), Case(3, 12, 3), Case(6, 12, 3), Case(6, correlation=0.9), Case(12, drift=1.0)]
)
def test_exchanges_are_denied_at_the_stated_rate(case: Case) -> None:
    denied_of = denials(case, 400)
    assert scipy.stats.binomtest(denied_of, 400, 0.05, alternative="greater").pvalue > 1e-3, denied_of


def test_a_gain_that_stepped_besides_is_seen_though_each_alone_may_be_the_laser() -> None:
    assert denials(Case(12, other=1.0), 20) >= 18


def test_a_gain_that_changed_next_to_the_exchange_is_not_compared() -> None:
    case = Case(12)
    measured = history(case, np.random.default_rng(2))
    values = measured.values.copy()
    values[6:, 2] += 3.0
    measured = replace(measured, values=values)
    past = stepped(measured, case)
    step = past["P0"].search.changes[0]
    t = past["P2"].series.t
    earlier = replace(step, parameter="P2", index=6, at=t[6], interval=(t[5], t[6]), size=3.0)
    past["P2"] = replace(past["P2"], search=replace(past["P2"].search, changes=(earlier,)))
    judged = between_instruments(measured, past)
    assert {judged[past[name].search.changes[0]].together for name in ("P0", "P1")} == {("P0", "P1")}
    past = stepped(replace(measured, values=values), case)
    # An event there cuts the same piece for all.
    assert {each.together for each in between_instruments(measured, past, [t[6]]).values()} == {
        ("P0", "P1", "P2")
    }
    assert all(each.may_be_all for each in between_instruments(measured, past, [t[6]]).values())


def taking_turns(case: Case, turns: Sequence[str]) -> tuple[MachineHistory, dict[str, ParameterPast]]:
    """A history in which the calibrations take turns, and the machine's own step in the middle of it."""
    measured = history(case, np.random.default_rng(5))
    certificates = {name: {LASER: turn} for name, turn in zip(measured.campaign.tolist(), turns, strict=True)}
    common = {
        quantity: np.where(np.array(turns) == quantity.certificate, 1.0, 0.0)[:, None]
        * np.ones(measured.values.shape)
        for quantity in measured.common_parts
    }
    measured = replace(measured, calibrations=Calibrations(certificates, {}), common_parts=common)
    return measured, stepped(measured, case)


@pytest.mark.parametrize("turns", ["AB" * 12, "AABB" * 6, "A" * 12 + "B" * 11 + "A"])
def test_a_step_that_a_laser_shows_on_both_sides_is_no_exchange(turns: str) -> None:
    measured, past = taking_turns(Case(12), list(turns))
    assert between_instruments(measured, past) == {}


@pytest.mark.parametrize("turns", ["AB" * 12, "A" * 12 + "B" * 11 + "A"])
def test_a_laser_that_comes_back_behind_an_event_says_nothing_of_an_exchange(turns: str) -> None:
    measured, past = taking_turns(Case(12), list(turns))
    t = past["P0"].series.t
    # Between both events the one before the step is A or B, the one behind it another.
    judged = between_instruments(measured, past, [t[11] - 1.0, t[13] - 1.0])
    assert {each.before for each in judged.values()} == {f"{LASER} ({turns[11]})"}


def test_one_error_explains_equal_jumps_without_scatter() -> None:
    after = np.arange(8) >= 4
    scale = np.full(3, 0.3)
    equal = jumps(np.where(after, 1.5, 0.1)[:, None] * np.ones(3), np.arange(8.0), after, line=True)
    unlike = jumps(np.where(after, 1.5, 0.1)[:, None] * [1.0, 1.0, 1.1], np.arange(8.0), after, line=True)
    assert equal is not None
    assert unlike is not None
    assert p_of_common_error(equal, np.ones((3, 1)), scale) > 0.1
    assert p_of_common_error(unlike, np.ones((3, 1)), scale) < 1e-9


def test_jumps_beside_a_line_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(3)
    t, after = np.arange(9.0), np.arange(9) >= 4
    values = rng.normal(size=(9, 2)) + np.outer(t, [0.3, -0.2])
    design = np.column_stack([np.ones(9), after, t])
    expected, squares, _, _ = np.linalg.lstsq(design, values, rcond=None)
    found = jumps(values, t, after, line=True)
    assert found is not None
    assert found.dof == 6
    np.testing.assert_allclose(found.sizes, expected[1], rtol=1e-9)
    np.testing.assert_allclose(
        np.diag(found.covariance), squares / 6 * np.linalg.inv(design.T @ design)[1, 1], rtol=1e-9
    )
    assert jumps(values[:3], t[:3], after[2:5], line=True) is None


def test_of_two_gains_the_difference_has_students_law() -> None:
    """A common error of any size leaves what two jumps differ by to the scatter of the days."""
    rng = np.random.default_rng(4)
    after = np.arange(8) >= 4
    values = rng.normal(size=(8, 2)) + np.outer(after, [0.0, 2.0])
    found = jumps(values, np.arange(8.0), after, line=False)
    assert found is not None
    difference = values[:, 1] - values[:, 0]
    t_test = scipy.stats.ttest_ind(difference[after], difference[~after])
    p_value = p_of_common_error(found, np.full((2, 1), 1e3), np.ones(2))
    assert p_value == pytest.approx(2.0 * t_test.pvalue, rel=1e-4)
