"""What is of one run alone is said to be, and what was left out is not counted."""

from __future__ import annotations

from datetime import datetime

import pytest

from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.model_effects import printed_effects
from monitor.reporting.health.sentences import RunsNamed
from monitor.reporting.messages import not_identified_by_model
from monitor.reporting.run_coefficient import run_of
from monitor.reporting.run_left_out import RunLeftOut, runs_left_out
from monitor.reporting.texts import texts_of

DAY = datetime(2026, 3, 2, 8)


@pytest.mark.parametrize(
    ("name", "run"),
    [
        ("EXX:reversal@each_run.run2", 2),
        ("EZB:compliance@load_each_run.run10", 10),
        ("EXX:reversal", None),
        # Was: of all runs, so that a certificate stated those of the others.
        ("EBB:harmonic2@each_run.cos.run1", 1),
        ("EXX:step(20,60)@each_run.60mm.run3", 3),
        # Was: of all runs.
        ("EXX:reversal@run_time(2)", 2),
        ("EBB:harmonic2@run_time(12).cos", 12),
        ("ball:4:moved(run 2, sequence 30).x", 2),
        ("artefact:moved(run 3, sequence 7)", 3),
        ("EC0AZ@stepped(run 2, sequence 129)", 2),
        ("EBB:harmonic2@stepped(run 12, sequence 1).cos", 12),
        ("EXX:reversal@run_time", None),
    ],
)
def test_the_name_of_a_coefficient_says_its_run(name: str, run: int | None) -> None:
    assert run_of(name) == run


@pytest.mark.parametrize(("language", "said"), [("en", "those of this run"), ("de", "die dieses Laufs")])
def test_a_coefficient_of_the_run_is_no_mean_of_runs(language: str, said: str) -> None:
    """Was: no value of it is stored."""
    effect = ModelEffect("EXX:reversal@each_run.run2", "µm", 0.05, 0.22, 1, 1, of_one_run=True)
    printed = printed_effects((effect,), texts_of(language))
    assert printed is not None
    assert said in printed.explained
    assert not printed.unknown


def test_an_effect_of_one_run_that_version_0_2_0_issued_keeps_its_words() -> None:
    """The sentences of that release: of all runs."""
    effects = (
        ModelEffect("EXX:reversal@run_time(2)", "µm", 0.05, 0.22, 3, 1, joint=True),
        ModelEffect("EYY:reversal@run_time(2)", "µm", 0.05, 0.22, 3, 1),
    )
    printed = printed_effects(effects, texts_of())
    assert printed is not None
    assert "one number for all 3 runs on 1 days together" in printed.explained
    assert "Value: mean of 3 runs on 1 days, each by itself" in printed.explained


def test_a_run_left_out_is_not_among_those_compared() -> None:
    """Was: all 5 runs of bo."""
    assert str(RunsNamed("bo", 4, 0, DAY, DAY, (4,))) == "4 of 5 runs of bo, without run 4, 2026-03-02"
    assert str(RunsNamed("bo", 5, 0, DAY, DAY)) == "all 5 runs of bo, 2026-03-02"


def test_trend_names_no_command_that_refuses() -> None:
    assert not_identified_by_model("M", ["bo"], {"bo": "few"}).endswith("bo; `identify` refuses it: few")
    assert not_identified_by_model("M", ["a", "bo"], {"bo": "few"}).endswith(
        "a, bo; type `monitor identify a`; `identify` refuses bo: few"
    )


def test_of_several_runs_left_out_it_is_said_once_what_to_do() -> None:
    assert runs_left_out((RunLeftOut(4, 1),)).startswith("Run 4 is left out: its 1 readings determine")
    said = runs_left_out((RunLeftOut(4, 1), RunLeftOut(6, 2)))
    assert said.startswith("Runs 4 and 6 are left out: their 1 and 2 readings determine")
    assert said.count("is imported again") == 1
