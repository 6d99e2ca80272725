"""Where the covariance of the readings comes from, as a sentence in each language."""

from __future__ import annotations

import pytest

from monitor.documents import from_document, to_document
from monitor.reporting.covariance_source import (
    CovarianceKind,
    CovarianceSource,
    TakenAsKnown,
    covariance_sentence,
)
from monitor.reporting.texts import texts_of

SOURCES = [
    (
        CovarianceSource(CovarianceKind.POOLED_BY_DAY, 20, 15),
        "repeated runs, pooled by day, 15 degrees of freedom",
        "Wiederholungsläufe, tageweise zusammengefasst, 15 Freiheitsgrade",
    ),
    (
        CovarianceSource(CovarianceKind.ALL_RUNS, 12, 11, selection="warm"),
        "selection warm: all 12 runs, 11 degrees of freedom",
        "Auswahl warm: alle 12 Läufe, 11 Freiheitsgrade",
    ),
    (
        CovarianceSource(CovarianceKind.STATED_BY_PROBE, u_um=1.0),
        "the probe's stated standard uncertainty of 1 µm; too few repeated runs of one plan",
        "angegebene Standardmessunsicherheit des Messtasters von 1 µm; zu wenige Wiederholungsläufe desselben "
        "Messplans",
    ),
    (
        CovarianceSource(CovarianceKind.STATED_BY_PROBE, u_um=1.0, for_the_run=True),
        "the probe's stated standard uncertainty of 1 µm: an uncertainty of the run itself was asked for",
        "angegebene Standardmessunsicherheit des Messtasters von 1 µm: gefragt war nach der Unsicherheit des Laufs "
        "selbst",
    ),
    (
        CovarianceSource(CovarianceKind.REPEATABILITY, u_um=1.834),
        "the repeatability of 1.8 µm, which exceeds the probe's statement; too few runs for more",
        "Wiederholbarkeit von 1,8 µm, die die Angabe für den Messtaster überschreitet; zu wenige Läufe für mehr",
    ),
    (
        CovarianceSource(CovarianceKind.ALL_RUNS, 9, 8, taken_as_known=tuple(TakenAsKnown)),
        "all 9 runs, 8 degrees of freedom; errors of the linear axes and the stylus tip are no part of u: the "
        "method takes them as known",
        "alle 9 Läufe, 8 Freiheitsgrade; nicht in u enthalten sind Abweichungen von Linearachsen und Tasterspitze: "
        "das Verfahren nimmt sie als bekannt an",
    ),
    (
        CovarianceSource(
            CovarianceKind.ALL_RUNS, 9, 8, linear_axes=True, taken_as_known=(TakenAsKnown.STYLUS_TIP,)
        ),
        "all 9 runs, 8 degrees of freedom; and the errors of the linear axes as stated; errors of the stylus tip are "
        "no part of u: the method takes them as known",
        "alle 9 Läufe, 8 Freiheitsgrade; dazu die angegebenen Abweichungen der Linearachsen; nicht in u enthalten sind "
        "Abweichungen von Tasterspitze: das Verfahren nimmt sie als bekannt an",
    ),
]


@pytest.mark.parametrize(("source", "english", "german"), SOURCES)
def test_a_source_is_said_in_each_language(source: CovarianceSource, english: str, german: str) -> None:
    assert covariance_sentence(source) == english
    assert covariance_sentence(source, texts_of("de")) == german


@pytest.mark.parametrize("source", [source for source, _, _ in SOURCES])
def test_a_source_is_restored_from_its_document(source: CovarianceSource) -> None:
    assert from_document(CovarianceSource, to_document(source)) == source
