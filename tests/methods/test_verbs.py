"""Every method and every verb: an answer on an example campaign, or a plain refusal with the reason of the method.

``docs/methods.md`` is made of the same fields (``test_documented.py``), so the page says what the verbs do.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.exceptions import DataError, RefusedResultError
from monitor.methods import Able, Method, Unable, methods
from monitor.readers import read_campaign
from monitor.records import Campaign, CurveCampaign
from monitor.reporting.certificate.grounds import GroundKind
from monitor.store import Database, import_campaign, import_curve
from monitor.workflow.contract import QUESTIONS, Question

EXAMPLES = Path(__file__).parents[2] / "examples"
Ability = Able | Unable
ABLE = Able()

#: The question, its request for a campaign and a machine, and the field of a method that says whether it answers.
VERBS: dict[str, tuple[Callable[[str, str, Path], dict[str, Any]], Callable[[Method], Ability]]] = {
    "identify": (lambda name, machine, out: {"campaign": name}, lambda method: ABLE),
    "identify stepwise": (lambda name, machine, out: {"campaign": name}, lambda method: method.stepwise),
    "compare": (lambda name, machine, out: {"campaign": name}, lambda method: ABLE),
    "explain": (lambda name, machine, out: {"campaign": name}, lambda method: ABLE),
    "effects of campaign": (lambda name, machine, out: {"campaign": name}, lambda method: ABLE),
    "statistics": (lambda name, machine, out: {"campaign": name}, lambda method: method.statistics),
    "uncertainty": (
        lambda name, machine, out: {"campaign": name, "method": "guf"},
        lambda method: method.uncertainty,
    ),
    "plan": (lambda name, machine, out: {"campaign": name}, lambda method: method.plan),
    "map": (lambda name, machine, out: {"campaign": name, "points": 2}, lambda method: method.map),
    "trend": (lambda name, machine, out: {"machine": machine}, lambda method: method.trend),
    "issue certificate": (
        lambda name, machine, out: {
            "campaign": name,
            "run": 1,
            "laboratory": EXAMPLES / "laboratory.toml",
            "out": out / f"{name}.pdf",
            "draft": True,
        },
        lambda method: method.certificate,
    ),
    "report": (
        lambda name, machine, out: {"machine": machine, "out": out / name, "workers": 1},
        lambda method: method.trend,
    ),
    "simulate like a campaign": (
        lambda name, machine, out: {
            "out": out / f"like-{name}", "like": name, "machines": ("M1",), "start": date(2026, 1, 12), "months": 1
        },
        lambda method: ABLE,
    ),
    "contributions": (lambda name, machine, out: {"campaign": name}, lambda method: method.instruments),
    "standards": (lambda name, machine, out: {"campaign": name}, lambda method: method.standards),
}  # fmt: skip
#: Take up to five seconds of processor time: asked of the quickest method here, of the others in ``make slow``.
HEAVY = {"explain", "issue certificate", "map", "report", "statistics", "uncertainty"}
QUICKEST = "rotary-probing"
#: What a machine or a campaign lacks besides, whatever its method, and the words for it.
LACKS = {
    ("curve", "simulate like a campaign"): "is a curve, not a machine",
    ("tracker", "map"): "a map runs over the strokes of linear axes, and this machine has none",
}
#: The example of a method whose first one is not the smallest.
SMALLEST = {"samba": "cold-cold", "instruments": "laser"}


def example(method: str) -> Campaign | CurveCampaign:
    """The first run of an example of a method, and the same rows once more a day later with the noise of another."""
    folders = [EXAMPLES / SMALLEST[method]] if method in SMALLEST else sorted(EXAMPLES.iterdir())
    for folder in folders:
        toml = folder / "campaign.toml"
        if toml.exists() and tomllib.loads(toml.read_text(encoding="utf-8"))["method"] == method:
            campaign = read_campaign(folder)
            return campaign if isinstance(campaign, CurveCampaign) else _two_runs(campaign)
    raise AssertionError(f"no example campaign was measured by {method}")


def _two_runs(campaign: Campaign) -> Campaign:
    first = campaign.runs[0]
    old = campaign.probings.rows(campaign.probings.run == first.run)
    count = len(old)

    def twice(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, values])

    rng = np.random.default_rng(1)
    channels = {
        # A nanometre, so that two runs are not one and the same file.
        name: np.concatenate([values, values + 1e-3 * rng.standard_normal(count)])
        if name.endswith("_um") and not name.startswith("u_")
        else twice(values)
        for name, values in old.channels.items()
    }
    second = replace(
        first, run=first.run + 1, day=first.day + 1, started_at=first.started_at + timedelta(days=1)
    )
    probings = replace(
        old, run=np.repeat([first.run, second.run], count), sequence=twice(old.sequence), time=twice(old.time),
        target=twice(old.target), readings={name: twice(values) for name, values in old.readings.items()},
        channels=channels,
    )  # fmt: skip
    setups = tuple(replace(setup, certificate="K 1/2026") for setup in campaign.artefact.setups)
    artefact = replace(campaign.artefact, setups=setups)
    return replace(campaign, runs=(first, second), probings=probings, artefact=artefact)


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], tuple[Database, str, str]]]:
    """A database for each method, with its example alone."""
    opened: dict[str, tuple[Database, str, str]] = {}

    def of(method: str) -> tuple[Database, str, str]:
        if method not in opened:
            db = Database(tmp_path_factory.mktemp("verbs") / f"{method}.duckdb").__enter__()
            measured = example(method)
            if isinstance(measured, CurveCampaign):
                import_curve(db, measured)
            else:
                import_campaign(db, measured)
            machine = measured.machine.id if isinstance(measured, Campaign) else measured.name
            opened[method] = db, measured.name, machine
        return opened[method]

    yield of
    for db, *_ in opened.values():
        db.__exit__(None, None, None)


def answered(db: Database, question: Question, request: dict[str, Any]) -> object:
    """The answer; of a certificate also where one run, repeated to the nanometre, shows lack of fit."""
    try:
        return question.load()(db, question.request(**request))
    except RefusedResultError as refusal:
        grounds = re.findall(r"^  ([a-z-]+):", str(refusal), re.MULTILINE)
    accept = {GroundKind(ground): "two runs that are one" for ground in grounds}
    return question.load()(db, question.request(**request, accept=accept))


@pytest.mark.parametrize(
    ("method", "verb"),
    [
        pytest.param(method, verb, marks=pytest.mark.slow if verb in HEAVY and method != QUICKEST else ())
        for method in methods()
        for verb in VERBS
    ],
)
def test_a_verb_answers_or_refuses_with_the_reason_of_the_method(
    method: str,
    verb: str,
    filled: Callable[[str], tuple[Database, str, str]],
    tmp_path: Path,
    pdf_unread: Callable[[], AbstractContextManager[None]],
) -> None:
    request_of, ability_of = VERBS[verb]
    db, name, machine = filled(method)
    question, ability = QUESTIONS[verb], ability_of(methods()[method])
    why = LACKS.get((method, verb), ability.why if isinstance(ability, Unable) else None)
    if isinstance(ability, Unable) and "machine" in request_of("", "", Path()):
        pytest.skip("a curve has no machine that could be asked for")
    with pdf_unread():
        if why is None:
            assert answered(db, question, request_of(name, machine, tmp_path)) is not None
        else:
            with pytest.raises(DataError, match=re.escape(why)) as refusal:
                question.load()(db, question.request(**request_of(name, machine, tmp_path)))
            assert "\n" not in str(refusal.value)
