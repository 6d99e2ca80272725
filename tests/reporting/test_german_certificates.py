"""German certificates hold no English word of the product: those of its English texts, no list by hand."""

from __future__ import annotations

import html
import io
import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pypdf
import pytest
from by_path import load

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.refusal import Advice, AdviceKind, Reason, ReasonKind, Refusal
from monitor.reporting.certificate.assembly import CertificateIdentity, certificate_record
from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.grounds import IN_U, AcceptedGround, Ground, GroundKind
from monitor.reporting.certificate.laboratory import LaboratoryFile, read_laboratory
from monitor.reporting.certificate.model_effect import ModelEffect
from monitor.reporting.certificate.record import CertificateRecord
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.covariance_source import (
    CovarianceKind,
    CovarianceSource,
    TakenAsKnown,
    covariance_sentence,
)
from monitor.reporting.pdf.render import certificate_html
from monitor.reporting.refused import refused_parameters
from monitor.reporting.texts import Texts, texts_of
from monitor.store import Database, import_campaign
from monitor.workflow.certificate.conformity import statement_of
from monitor.workflow.certificate.issue import issue
from monitor.workflow.certificate.request import RULES, CertificateRequest
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

page_fill = load("page_fill", Path(__file__).with_name("test_page_fill.py"))
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LABORATORY = EXAMPLES / "laboratory-de.toml"
GERMAN = texts_of("de")
#: Not of the product: the sentence of a map of the fixture, the symbols of its effects.
OWN = ("the plan does not determine it", "EXX:reversal", "EYY:reversal", "(reversal)")
#: Sections of the texts that stand in forms, not in certificates.
FORMS = ("boxes", "sections", "methods")


def words(text: str) -> set[str]:
    """The words of a text, but those that are hyphenated or spelt with digits."""
    return {word.lower() for word in re.findall(r"(?<![\w-])[A-Za-zÄÖÜäöüß]{3,}(?![\w-])", text)}


def words_of(texts: Texts) -> set[str]:
    """The words of a language's texts, without what is filled in and without markup."""
    said = [text for key, text in texts.sentences.items() if not key.startswith(FORMS)]
    return words(re.sub(r"\{\w+\}|<[^>]*>|`[^`]*`", " ", "\n".join(said)))


#: Of both languages: the German ones are no sign of an untranslated text.
ENGLISH = words_of(texts_of()) - words_of(GERMAN)


def english_in(text: str, *of_the_user: str) -> set[str]:
    """The English words of the product in a text, commands and the phrases that the user wrote left out."""
    said = " ".join(re.sub("`[^`]*`", " ", text).split())
    for phrase in sorted(of_the_user, key=len, reverse=True):
        said = re.sub(rf"(?<!\w){re.escape(' '.join(phrase.split()))}(?!\w)", " ", said)
    return words(said) & ENGLISH


def phrases(written: Any) -> list[str]:
    """The texts among the values of a file: what the user wrote, not the keys, which are the product's."""
    if isinstance(written, str):
        return [phrase for phrase in {written, *written.splitlines()} if phrase.strip()]
    values = written.values() if isinstance(written, dict) else written if isinstance(written, list) else []
    return [phrase for value in values for phrase in phrases(value)]


def read_aloud(page: str) -> str:
    """The text of a page of HTML or XML, what stands for its pictures with it."""
    plain = re.sub(r"<style>.*?</style>|<meta[^>]*>", " ", page.replace("<wbr>", ""), flags=re.DOTALL)
    spoken = re.findall(r'(?:alt|aria-label)="([^"]*)"', plain)
    return html.unescape(re.sub(r"<[^>]*>", " ", plain) + " ".join(spoken))


def test_the_list_has_the_words_of_the_messages() -> None:
    assert len(ENGLISH) > 400
    assert {"work", "point", "balls", "degrees", "uncertainty", "readings", "setup"} <= ENGLISH
    assert not ENGLISH & {"die", "was", "in", "modul", "parameter"}
    assert english_in("Lauf 3: the work point", "point") == {"the", "work"}
    ball = tomllib.loads('[balls]\nname = "ball 3"\nuncertainty = 1.0')
    assert phrases(ball) == ["ball 3"]
    assert english_in("Kugel ball 3, uncertainty of ball 4", *phrases(ball)) == {"uncertainty", "ball"}


def german_result(result: ResultSet) -> ResultSet:
    """A result with everything that one can print: refusals of every kind, effects, budget, days."""
    source = CovarianceSource(
        CovarianceKind.POOLED_BY_DAY,
        dof=15,
        linear_axes=True,
        taken_as_known=tuple(TakenAsKnown),
        selection="Auswahl",
    )
    others = (
        "bar-xy work point x",
        "tip z",
        "module A2 tilt u",
        "ball 3 radius",
        "height 1",
        "laser cosine error",
    )
    refused = [
        Refusal((f"EX{number}",), Reason(kind, others, u=1.5, unit="µm", size="100 µrad"))
        for number, kind in enumerate(ReasonKind)
        if kind is not ReasonKind.NOT_SEPARATED
    ]
    refused += [
        Refusal(
            ("EXX", "EYY"),
            Reason(
                ReasonKind.NOT_SEPARATED, others,
                Advice(kind, ("EXX(0)", "C1"), ("where X counts its positioning error from",), count=3, run=2),
            ),
        )
        for kind in AdviceKind
        if kind is not AdviceKind.OWN_WORDS
    ]  # fmt: skip
    evaluation = GERMAN("evaluation.framework", readings=covariance_sentence(source, GERMAN))
    budgeted: ResultSet = page_fill.with_budget(result)
    return replace(
        budgeted,
        evaluation=evaluation,
        refused=tuple(map(refused_parameters, refused)),
        effects=(ModelEffect("EXX:reversal", "µm", 3.0, 0.2, 20, 5, 6.0, 0.4), ModelEffect("EYY:reversal")),
        tolerances=abs(result.estimate) + result.u,
    )


@pytest.fixture(scope="module")
def german_record(make_record: Callable[..., CertificateRecord], campaign: Campaign) -> CertificateRecord:
    laboratory: LaboratoryFile = read_laboratory(LABORATORY)
    bar = campaign.artefact.scale_bar
    assert bar is not None
    own = replace(
        campaign,
        probe=replace(campaign.probe, model="Taster"),
        artefact=replace(campaign.artefact, id="Kugelplatte", scale_bar=replace(bar, certificate="Schein 1")),
    )
    made = make_record(13, language="de", maps=1)
    assert made.results is not None
    (result,) = map(german_result, made.results)
    grounds = [
        Ground(kind, 3, subject, 7.0, 5.0, "µm") for kind in GroundKind for subject in ("", "EXX", "EXX, EYY")
    ]
    grounds += [
        Ground(GroundKind.INSTRUMENTS, 3, subject, 7.0, 5.0, IN_U, several)
        for subject, several in (("EXX", None), ("", ("EXX", "EYY")), ("", None))
    ]
    identity = CertificateIdentity("K-1", date(2026, 3, 3), "samba", "Maßstab")
    record = certificate_record(laboratory, own, 1, [result], identity, made.volumetric)
    return replace(
        record, accepted=tuple(AcceptedGround(ground.kind, (ground,), "geprüft") for ground in grounds)
    )


@pytest.mark.parametrize("rule", RULES)
def test_a_german_certificate_with_all_that_can_stand_on_it_has_no_english_word(
    german_record: CertificateRecord, rule: str
) -> None:
    assert german_record.results is not None
    (result,) = german_record.results
    freedoms = dict.fromkeys(result.names, 15.0)
    conformity = statement_of(
        result, rule, GERMAN, campaign="M", freedoms=freedoms, process={result.names[0]: 5.0}
    )
    page = read_aloud(certificate_html(replace(german_record, conformity=conformity)))
    assert len(words(page)) > 500
    assert english_in(page, *OWN, *phrases(tomllib.loads(LABORATORY.read_text()))) == set()


def test_the_texts_of_the_digital_certificate_neither(german_record: CertificateRecord) -> None:
    xml = dcc_xml(replace(german_record, country="DE", dcc_version="3.3.0")).decode()
    said = " ".join(re.findall(r'<dcc:content lang="de">([^<]*)<', xml))
    assert len(words(said)) > 200
    assert english_in(said, *OWN, *phrases(tomllib.loads(LABORATORY.read_text()))) == set()


@pytest.mark.parametrize(
    "example",
    [
        "r-test",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("ball-bar", "tilting-table", "tracked-robot")
        ),
    ],
)
def test_a_german_certificate_of_an_example_has_no_english_word_but_the_users(
    example: str, tmp_path: Path
) -> None:
    campaign = read_campaign(EXAMPLES / example)
    assert isinstance(campaign, Campaign)
    stated = tmp_path / "laboratory.toml"
    stated.write_text(
        re.sub(
            r"(?m)^instruments = .*$",
            'instruments = "Schein 1 des Vorführlaboratoriums"',
            LABORATORY.read_text(),
        )
    )
    accept = dict.fromkeys((GroundKind.UNITS,), "geprüft") if example == "tilting-table" else {}
    accept = dict.fromkeys((GroundKind.LACK_OF_FIT,), "geprüft") if example == "tracked-robot" else accept
    with Database(tmp_path / "c.duckdb", threads=1) as db:
        import_campaign(db, campaign)
        run = campaign.runs[-1].run
        uncertainty(db, UncertaintyRequest(campaign.name, run, method="guf"))
        request = CertificateRequest(
            campaign.name, run, laboratory=stated, out=tmp_path / "c.pdf", draft=True, accept=accept
        )
        issue(db, request)
    reader = pypdf.PdfReader(io.BytesIO((tmp_path / "c.pdf").read_bytes()))
    page = re.sub(r"[-\u2010]\n", "", "\n".join(sheet.extract_text() for sheet in reader.pages))
    assert len(words(page)) > 150
    written = [tomllib.loads(path.read_text()) for path in (EXAMPLES / example / "campaign.toml", stated)]
    assert english_in(page, *OWN, *phrases(written)) == set()
