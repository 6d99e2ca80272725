"""What the parameters of every run take up is seen by what changes within runs alone."""

from __future__ import annotations

from types import SimpleNamespace

from monitor.cli.explain_output import _tie
from monitor.discovery import fit
from monitor.discovery.machine.missing import _shows_within_runs_alone
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.separation.separate import Separation
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of
from monitor.web.words import what_breaks
from monitor.workflow.explain.ties import ties_of


def test_what_the_runs_take_up_has_to_change_within_them(virtual_campaigns) -> None:
    """The base has a shift of the spindle in every run: another temperature from run to run shows nothing of one that
    grows with it (0 of 9 ties of `trial_ties.py` were broken by the action that was told before). A bend of Y is no
    unknown of a run."""
    problem = problem_of(virtual_campaigns.virtual(4, days=1, runs_per_day=2)[0]).for_search()
    scene = scene_of(fit(problem), [])
    seen = {
        text: _shows_within_runs_alone(scene, parse_effect(text, problem.context.chain))
        for text in ("EZC1:const@x_axis_degC", "EXX:poly1@warmup45min", "EYY:poly2@x_axis_degC", "EYY:poly2")
    }
    assert seen == {
        "EZC1:const@x_axis_degC": True,
        "EXX:poly1@warmup45min": True,
        "EYY:poly2@x_axis_degC": False,
        "EYY:poly2": False,
    }
    found = SimpleNamespace(
        effect="EZC1:const@x_axis_degC", separation=Separation((), 0.0, 0.0), within_runs=True
    )
    (tie,) = ties_of(found, ("EZC1:const@warmup",), is_planned=True)
    assert tie.within_runs
    sentence = (
        "measure runs within which x_axis_degC and the time since the day's first run change, not together, and record "
        "x_axis_degC"
    )
    assert _tie(found.effect, tie, "week") == f"to tell EZC1:const@warmup apart, {sentence}"
    assert what_breaks(tie) == sentence.replace("x_axis_degC", "x axis degC")
