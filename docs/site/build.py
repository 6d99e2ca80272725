"""Builds the manual into ``manual-output/``, where ``index.html`` opens without a server or a network.

Sources are prepared in ``build/manual``: the pages of ``docs/``, what is made from the program (verbs, documents,
views, Python names, catalogue), the measured validation report and the pictures of the tutorial. Sphinx then has to be
content with every reference (``-W -n``), and no page may ask for anything from a network.
"""

# ruff: noqa: E402 -- the path comes first

from __future__ import annotations

import re
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

SITE = Path(__file__).resolve().parent
CHECKOUT = SITE.parents[1]
sys.path[:0] = [str(SITE), str(CHECKOUT / "tests"), str(CHECKOUT)]

import configuration
import documents
import effects_catalogue
import pictures
import python_names
import sources
import validation
import verbs
import views
from sphinx.cmd.build import build_main

OUT = CHECKOUT / "manual-output"
PREPARED = CHECKOUT / "build" / "manual"
GENERATED: dict[str, Callable[[], str]] = {
    "reference/verbs.md": verbs.page,
    "reference/configuration.md": configuration.page,
    "reference/python.md": python_names.page,
    "reference/documents.md": documents.page,
    "reference/views.md": views.page,
    "reference/effects.md": effects_catalogue.page,
    "reference/validation.md": validation.page,
}
#: What a browser would load by itself from another computer. Links that a reader follows are no such thing.
FOREIGN = re.compile(
    r"""<(?:script|img|iframe|source|audio|video|embed)\b[^>]*\bsrc\s*=\s*["']?(?:https?:)?//"""
    r"""|<link\b(?![^>]*rel\s*=\s*["']?(?:canonical|next|prev|index|search))[^>]*\bhref\s*=\s*["']?(?:https?:)?//"""
    r"""|@import\s+(?:url\()?["']?(?:https?:)?//|url\(\s*["']?(?:https?:)?//""",
    re.IGNORECASE,
)


def main(arguments: Sequence[str] = ()) -> int:
    """Build the manual; the exit status is that of Sphinx, or 1 where a page would load something from a network."""
    shutil.rmtree(PREPARED, ignore_errors=True)
    (PREPARED / "reference").mkdir(parents=True)
    sources.copy_pages(PREPARED)
    steps = {name: (lambda name=name, page=page: _write(name, page())) for name, page in GENERATED.items()}
    for name, step in {**steps, "pictures": lambda: pictures.draw(PREPARED / "images")}.items():
        begin = time.monotonic()
        step()
        print(f"{name}: {time.monotonic() - begin:.1f} s")
    shutil.rmtree(OUT, ignore_errors=True)
    status = build_main(
        ["-W", "--keep-going", "-n", "-q", "-b", "html", "-c", str(SITE), "-d", str(PREPARED.with_name("doctrees")),
         *arguments, str(PREPARED), str(OUT)]
    )  # fmt: skip
    if status == 0:
        status = _offline()
        print(f"the manual is in {OUT.relative_to(CHECKOUT)}/index.html")
    return status


def _write(name: str, text: str) -> None:
    (PREPARED / name).write_text(sources.with_links(text), encoding="utf-8")


def _offline() -> int:
    """Name every page, style sheet and script that would load something from a network."""
    foreign = [
        f"{path.relative_to(OUT)}: {match[0]}"
        for path in sorted(OUT.rglob("*"))
        if path.suffix in (".html", ".css", ".svg")
        for match in FOREIGN.finditer(path.read_text(encoding="utf-8", errors="replace"))
    ]
    for line in foreign:
        print(f"would be loaded from a network: {line}", file=sys.stderr)
    return 1 if foreign else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
