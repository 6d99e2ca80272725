"""What `compare` and the certificate say of setups that contradict each other: nobody is accused who may be right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.cli.contradiction_output import against_others
from monitor.methods.method import ContrastKind
from monitor.readers import read_campaign
from monitor.reporting.certificate.grounds import IN_U, Ground, GroundKind, ground_sentence
from monitor.reporting.texts import texts_of
from monitor.store import Database
from monitor.workflow.certificate.grounds import grounds_against
from monitor.workflow.instruments.answer import AgainstOthers, Suspect
from monitor.workflow.models import resolve
from tests.simulator import horizontal_centre as centre

LENGTH = "the stated length of ball bar"


def _answer(*names: str, comparisons: int = 3) -> AgainstOthers:
    suspects = tuple(
        Suspect(name, ContrastKind.STATED, ("bar-xy", "bar-yz"), others_agree=True)
        if name == LENGTH
        else Suspect(name, ContrastKind.SETUP, (name,), others_agree=comparisons > 1)
        for name in names
    )
    return AgainstOthers(
        1, "laser-X", ContrastKind.SETUP, ("laser-X",), 1, 29.1, 2.6, comparisons, 1e-9, suspects
    )


def _said(answer: AgainstOthers, capsys: pytest.CaptureFixture[str]) -> str:
    against_others(answer)
    return " ".join(capsys.readouterr().out.split())


def test_compare_accuses_one_alone_only_where_it_alone_explains_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = _said(_answer("bar-xy"), capsys)
    assert said.startswith("bar-xy in run 1 contradicts all others together by 29.1 u in 1 direction")
    assert "Without bar-xy the others agree: look first at signs, unit, points and rows of bar-xy;" in said
    said = _said(_answer("laser-X", "bar-xy", comparisons=1), capsys)
    assert said.startswith("laser-X and bar-xy in run 1 contradict each other by 29.1 u")
    assert "Without laser-X or bar-xy nothing contradicts, so that any of these may be the wrong one" in said
    for names in ((), ("bar-xy", "laser-Y")):
        assert _said(_answer(*names), capsys).startswith("setups in run 1 contradict each other by 29.1 u")
    assert "No single setup or instrument explains it" in _said(_answer(), capsys)


def test_nothing_of_a_stated_number_was_read(capsys: pytest.CaptureFixture[str]) -> None:
    said = _said(_answer(LENGTH), capsys)
    assert f"look first at {LENGTH}, one number for bar-xy, bar-yz (its certificate" in said
    assert "rows of" not in said
    said = _said(_answer("laser-X", LENGTH), capsys)
    assert f"look at signs, unit, points and rows of laser-X and at {LENGTH}, one number for" in said


def test_a_comma_in_the_name_of_an_instrument_makes_no_two_of_it() -> None:
    name = "Renishaw XL-80, no. 4711"
    alone = Ground(GroundKind.INSTRUMENTS, 1, name, 29.1, 2.6, IN_U)
    either = Ground(GroundKind.INSTRUMENTS, 1, "", 29.1, 2.6, IN_U, ("bar-xy", name))
    nobody = Ground(GroundKind.INSTRUMENTS, 1, "", 29.1, 2.6, IN_U)
    english, german = texts_of("en"), texts_of("de")
    assert ground_sentence(alone, english).startswith(
        f"run 1: {name} contradicts all others together by 29.1"
    )
    assert f"without bar-xy or {name} nothing contradicts any more" in ground_sentence(either, english)
    assert f"ohne bar-xy oder {name} widerspricht nichts mehr" in ground_sentence(either, german)
    assert "no single setup or instrument explains it" in ground_sentence(nobody, english)
    assert "keine einzelne Aufstellung" in ground_sentence(nobody, german)


def test_a_certificate_names_both_of_two_that_contradict_each_other(tmp_path: Path) -> None:
    """The bar with the other sign beside two lasers: without laser X the others agree as well."""
    rng = np.random.default_rng(5)
    truth = {**centre.truth_of(rng), "EXX": 15e-6, "EYY": 0.0}
    laser, bar = (measure(centre.machine(truth), rng, rng) for measure in (centre.laser, centre.ball_bar))
    rows = [*laser[1], *bar[1]]
    centre.read_otherwise(rows, "bar-xy", -1.0)
    kept = centre.only_of(("laser-X", "laser-Y", "bar-xy"), laser[0] + bar[0], rows)
    campaign = read_campaign(centre.machine(truth).write(tmp_path / "shop", *kept))
    with Database(":memory:") as db:
        model = resolve(db, None, campaign.method)
    grounds = [ground for ground in grounds_against(campaign, model, {1: None}) if ground.unit == IN_U]
    assert [(ground.kind, ground.subject, ground.several) for ground in grounds] == [
        (GroundKind.INSTRUMENTS, "", ("laser-X", "bar-xy"))
    ]
