"""ISO 230-1 symbols in words."""

from __future__ import annotations

import pytest

from monitor.reporting.symbols import describe


@pytest.mark.parametrize(
    ("symbol", "words"),
    [
        ("EA0B", "orientation about X of axis B"),
        ("EB0Z", "orientation about Y of axis Z"),
        ("EB0B", "zero angle of axis B"),
        ("EX0C", "position in X of axis C"),
        ("EA0J2", "orientation about X of axis J2"),
        ("EX0J4", "position in X of axis J4"),
        ("EAJ2:gear", "turn about X of axis J2 (gear)"),
        ("EA0DEC", "orientation about X of axis DEC"),
        ("EA0ALT", "orientation about X of axis ALT"),
        ("EX0AZ", "position in X of axis AZ"),
        ("ECDEC:const", "turn about Z of axis DEC (const)"),
        ("EXEL:poly1", "displacement in X of axis EL (poly1)"),
        ("EY0C1", "position in Y of spindle C1"),
        ("EXX", "positioning gain of axis X"),
        ("EXX:poly1", "positioning gain of axis X"),
        ("EXX:cyclic20mm", "positioning error of axis X (cyclic20mm)"),
        ("EXX:poly1@x_axis_degC", "positioning error of axis X (poly1@x_axis_degC)"),
        ("EYX:poly2", "straightness error in Y of axis X (poly2)"),
        (
            "EXX:sawtooth84.34mm(-157.25)",
            "positioning error of axis X (step of teeth of 84.34 mm, one at −157.25 mm)",
        ),
        ("EXX:step(-12.5)", "positioning error of axis X (step at −12.5 mm towards higher readings)"),
        (
            "EYX:step8mm(-60,110).110mm",
            "straightness error in Y of axis X (step over 8 mm about 110 mm, towards higher readings)",
        ),
        ("EXX:step(-60,110)", "positioning error of axis X (step(-60,110))"),
        ("EAX", "roll of axis X"),
        ("EBX", "tilt about Y of axis X"),
        ("EBB:harmonic2", "angular positioning error of axis B (harmonic2)"),
        ("EAB", "tilt about X of axis B"),
        ("EZC1:const@warmup", "axial displacement of spindle C1 (const@warmup)"),
        ("EXC", "displacement in X of axis C"),
        ("ball:2:moved", "ball:2:moved"),
        ("EXX(-88)", "positioning error of axis X at -88 mm"),
        ("EYX(22)", "straightness error in Y of axis X at 22 mm"),
        ("EX0C(75)", "position in X of axis C at 75°"),
        ("ECC(75)", "angular positioning error of axis C at 75°"),
        ("shape(W7)", "deviation of point W7 along its normal"),
    ],
)
def test_iso_230_1_symbol_in_words(symbol: str, words: str) -> None:
    assert describe(symbol) == words
