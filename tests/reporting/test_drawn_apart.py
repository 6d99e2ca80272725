"""Drawings that are taken out of a page before it is laid out: the same dots on paper, the same words for a reader."""

from __future__ import annotations

import shutil
import subprocess
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import pytest
from pypdf import PdfReader

from monitor.reporting.pdf.drawn_apart import drawn_apart
from monitor.reporting.pdf.render import pdf_of
from monitor.reporting.svg.plot import Drawing, Panel

TITLE = 'EX0C & "others" <1>: µm over dates'


def _page() -> str:
    on = Drawing(104.0, 45.0, TITLE)
    panel = Panel(90.0, 60.0, 800.0, 300.0, (0.0, 10.0), (-5.0, 5.0))
    panel.frame(on, "day", "value / µm")
    on.text(0.0, 30.0, "two < three & bold", bold=True)
    on.dots("M200 200h0M400 220h0", "#1d4e7c", 12.0)
    return (
        f"<!doctype html><html lang='en'><head><title>a</title></head><body><p>before</p>{on.svg()}<p>between</p>"
        f"{on.svg()}<p>after</p></body></html>"
    )


def _pdf(html: str) -> bytes:
    return pdf_of(html, identifier="a", moment=datetime(2026, 3, 9, tzinfo=UTC))


def test_the_same_dots_stand_on_paper(tmp_path: Path) -> None:
    if shutil.which("pdftoppm") is None:
        pytest.skip("pdftoppm is not installed")
    pictures = []
    for name, html in (("inside", _page()), ("apart", drawn_apart(_page()))):
        (tmp_path / f"{name}.pdf").write_bytes(_pdf(html))
        subprocess.run(
            ["pdftoppm", "-r", "100", "-singlefile", tmp_path / f"{name}.pdf", tmp_path / name], check=True
        )
        pictures.append((tmp_path / f"{name}.ppm").read_bytes())
    assert pictures[0] == pictures[1]


def test_the_title_is_the_alternative_text() -> None:
    reader = PdfReader(BytesIO(_pdf(drawn_apart(_page()))))
    alternatives = [element["/Alt"] for element in _elements(reader.trailer["/Root"]["/StructTreeRoot"])]  # type: ignore[index]
    assert alternatives == [TITLE, TITLE]
    assert "<svg" not in drawn_apart(_page())


def _elements(parent: dict) -> list[dict]:  # type: ignore[type-arg]
    kids = parent.get("/K", [])
    kids = kids if isinstance(kids, list) else [kids]
    below = [kid.get_object() for kid in kids if not isinstance(kid, int)]
    own = [parent] if "/Alt" in parent else []
    return own + [element for kid in below if isinstance(kid, dict) for element in _elements(kid)]
