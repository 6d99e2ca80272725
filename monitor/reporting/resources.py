"""Finds templates and fonts: packed inside ``monitor`` when installed, at the checkout's top otherwise."""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

#: The project's own fonts: family, weight, file. DejaVu Sans 2.37 covers Latin, Greek and Cyrillic, Armenian,
#: Georgian, Arabic and mathematical signs; not Chinese, Japanese, Korean, Thai, the scripts of India or Hebrew marks.
FONT_FILES = (("DejaVu Sans", 400, "DejaVuSans.ttf"), ("DejaVu Sans", 700, "DejaVuSans-Bold.ttf"))


def report_folder() -> Traversable:
    """Return the folder that holds the templates, style sheets and ``fonts/``."""
    try:
        return resources.files("monitor.reports")
    except ModuleNotFoundError:
        return Path(__file__).resolve().parents[2] / "reports"


def report_text(name: str) -> str:
    """Return a template or style sheet as text."""
    return report_folder().joinpath(name).read_text(encoding="utf-8")


def font_bytes(file: str) -> bytes:
    """Return the bytes of a font of the project."""
    return report_folder().joinpath("fonts", file).read_bytes()
