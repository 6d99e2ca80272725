"""Rates of true and false warm-ups of campaigns of several days or one, by a simulator of its own."""

from __future__ import annotations

import itertools
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
import scipy

from monitor.cli.dependence_output import _warm_up
from monitor.documents import from_document, to_document
from monitor.reporting.lacks import Cause
from monitor.statistics import control_false_discoveries
from monitor.workflow.history.changes import search_changes
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import WarmUp
from monitor.workflow.trend.warming import warming

#: Parameters of a machine, which share the rate of false warm-ups.
PARAMETERS = 8


def machine(rng, what, *, days=5, runs=4, tau=1.0, size=0.0, day_sd=0.0):
    """Return parameters of unit scatter, the first with ``what``; runs an hour apart, the first of a day is cold."""
    day, number = np.divmod(np.arange(days * runs), runs)
    t = day + number / 24.0
    values = rng.normal(size=(PARAMETERS, len(t))) + day_sd * rng.normal(size=(PARAMETERS, days))[:, day]
    shapes = {
        "nothing": 0.0 * t,
        "by time": t,
        "by run": np.arange(len(t)),
        "step": (np.arange(len(t)) >= len(t) // 2) * 1.0,
        "warm-up": np.exp(-number / tau),
    }
    values[0] += size * shapes[what]
    unknown = np.full(len(t), np.nan)
    return [
        Series(f"P{i}", "µm", row, unknown, t, day, 8.0 + number, number == 0, timedelta(0))
        for i, row in enumerate(values)
    ]


def stated(rng, every):
    """Return by parameter the warm-up that the page of the machine states."""
    found = search_changes([series.steady for series in every], ())
    campaign = np.full(len(every[0].t), "of August")
    answers = {series.name: warming(series, campaign, found[series.name].changes, rng) for series in every}
    p_values = [np.nan if fit is None else fit.p_value for fit, _ in answers.values()]
    q = control_false_discoveries(p_values).q_value
    return {name: answers[name][0] for name, rate in zip(answers, q, strict=True) if rate < 0.05}


def rates(seed, machines, what, **plan):
    """Return of how many machines the first parameter is stated, and of how many any other."""
    first = others = 0
    for number in range(machines):
        rng = np.random.default_rng([seed, number])
        names = stated(rng, machine(rng, what, **plan))
        first += "P0" in names
        others += bool(set(names) - {"P0"})
    return first, others


def at_least(count, of):
    """Return the lower end of the exact 95 % interval of a rate."""
    return 0.0 if not count else float(scipy.stats.beta.ppf(0.025, count, of - count + 1))


@pytest.mark.parametrize(
    ("what", "size", "day_sd"),
    [("by time", 4.0, 0.0), ("by run", 0.8, 0.0), ("step", 20.0, 0.0), ("nothing", 0.0, 2.0)],
)
def test_drifts_steps_and_days_that_differ_are_no_warm_ups(what, size, day_sd):
    first, others = rates(2025, 10, what, size=size, day_sd=day_sd)
    assert at_least(first, 10) < 0.05, first
    assert at_least(others, 10) < 0.05, others


def test_a_warm_up_of_every_morning_is_stated_with_what_was_seen_of_it():
    rng = np.random.default_rng(7)
    for tau in (0.5, 1.0):
        fit = stated(rng, machine(rng, "warm-up", size=-30.0, tau=tau))["P0"]
        assert fit.tau_h == pytest.approx(tau, rel=0.15)
        assert fit.amplitude == pytest.approx(-30.0 * -np.expm1(-3.0 / tau), abs=3.0 * fit.u)
        assert fit.recorded_h == pytest.approx(3.0)


def test_what_does_not_settle_within_the_hours_of_a_day_is_no_warm_up():
    day = machine(np.random.default_rng(3), "by time", days=1, runs=12, size=200.0)[0]
    fit, why = warming(day, np.full(12, "A"), (), np.random.default_rng(4))
    assert fit is None
    assert why.cause is Cause.DOES_NOT_SETTLE
    assert str(why) == "no warm-up: nothing settles within the 11 h recorded of a day"


def test_a_slow_warm_up_of_a_day_is_kept_though_its_time_constant_is_not_determined():
    """Nine runs over eight hours, a time constant of six: every one is stated, of some the change alone."""
    unknown = 0
    for size, seed in itertools.product((10.0, 20.0), range(20)):
        rng = np.random.default_rng([1904, int(size), seed])
        day = machine(rng, "warm-up", days=1, runs=9, size=size, tau=6.0)[0]
        fit, why = warming(day, np.full(9, "A"), (), rng)
        assert fit is not None, why
        assert abs(fit.amplitude + size * np.expm1(-8.0 / 6.0)) < 5.0 * fit.u
        assert fit.p_value < 0.05
        if fit.tau_h is None:
            assert fit.tau_interval_h[1] is None
            assert fit.stable_after_h is None
            unknown += 1
    assert unknown > 0


def test_the_words_name_what_was_seen_and_write_hours_in_full():
    fit = WarmUp("A", -4.0, 0.3, "µm", 304.0, (250.0, 380.0), 820.0, (700.0, None), 0.6, 0.001, 0.008, 400.0)
    assert _warm_up("EZ0A", fit) == (
        "EZ0A: warms up: rises by 4 µm within 400 h, time constant 300 h; not yet stable after the 400 h recorded"
    )
    assert _warm_up(
        "EZ0A", replace(fit, amplitude=12.0, recorded_h=8.0, tau_h=None, stable_after_h=None)
    ) == (
        "EZ0A: warms up or drifts: falls by 12 µm within 8 h, time constant not determined; "
        "not yet stable after the 8 h recorded"
    )


def test_the_answer_of_a_server_of_version_0_2_0_has_no_recorded_hours():
    fit = WarmUp("A", -4.0, 0.3, "µm", 2.0, (1.5, 2.5), 6.0, (5.0, 8.0), 0.6, 0.001, 0.008, 8.0)
    document = to_document(fit)
    del document["recorded_h"]
    older = from_document(WarmUp, document)
    assert older == replace(fit, recorded_h=None)
    assert _warm_up("EZ0A", older) == "EZ0A: warms up: rises by 4 µm, time constant 2 h; stable after 6 h"
    assert _warm_up("EZ0A", replace(older, stable_after_h=None)) == (
        "EZ0A: warms up: rises by 4 µm, time constant 2 h; not yet stable after the hours recorded"
    )


if __name__ == "__main__":
    for plan in ({"days": 5, "runs": 4}, {"days": 1, "runs": 12}, {"days": 3, "runs": 8}):
        for what, extra in (
            ("nothing", {}),
            ("nothing", {"day_sd": 2.0}),
            ("by time", {"size": 2.0}),
            ("by time", {"size": 10.0}),
            ("by time", {"size": 2.0, "day_sd": 1.0}),
            ("by run", {"size": 0.8}),
            ("by run", {"size": 0.8, "day_sd": 1.0}),
            ("step", {"size": 20.0}),
            ("step", {"size": 4.0}),
            *(("warm-up", {"size": s, "tau": tau}) for s in (4.0, 8.0) for tau in (0.5, 1.0, 2.0, 3.0)),
        ):
            print(plan, what, extra, *rates(1611, 100, what, **plan, **extra), flush=True)
