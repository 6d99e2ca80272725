"""Prepares the sources of the manual: the pages of ``docs/`` with links that hold in the site.

A page of the repository may lead to files outside of ``docs/``. Those that the manual has as pages are linked there;
of all others the path in the repository is printed. A bare ``docs/NAME.md`` in a text becomes a link.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"
#: Pages that stand outside of ``docs/``, and their names in the manual.
FROM_OUTSIDE = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}

_LINK = re.compile(r"(?<!!)\[(?P<text>[^\]]*)\]\((?P<target>[^)\s#]*)(?P<anchor>#[^)\s]*)?\)")
_BARE = re.compile(r"(?<![\w/\[`*-])(?<!\]\()docs/(?P<name>[a-z-]+\.md)(?!\]|\)\]|`)")
# A page has one title; where a file has several, all but the first go a level down.
_TITLE = re.compile(r"^# ", re.MULTILINE)
_HEADING = re.compile(r"^(?=#{1,5} )", re.MULTILINE)
_FENCE = re.compile(r"(^```.*?^```[ \t]*$)", re.MULTILINE | re.DOTALL)
_NOT_RUN = re.compile(r"^<!-- not run: (?P<why>.*?) -->$", re.MULTILINE)


def copy_pages(out: Path) -> None:
    """Write every page and picture of ``docs/``, and those from outside, into ``out``.

    Raises ValueError for a link to a file that is not there.
    """
    shutil.copytree(DOCS / "images", out / "images", dirs_exist_ok=True)
    pages = {path: path.name for path in sorted(DOCS.glob("*.md"))}
    pages |= {CHECKOUT / path: name for path, name in FROM_OUTSIDE.items()}
    for path, name in pages.items():
        (out / name).write_text(manual_text(path), encoding="utf-8")


def with_links(text: str) -> str:
    """Return a generated text of ``reference/`` in which a bare ``docs/NAME.md`` is a link."""
    return _BARE.sub(lambda bare: f"[{bare['name']}](../{bare['name']})", text)


def manual_text(path: Path) -> str:
    """Return the text of a page of the repository as the manual has it."""
    parts = _FENCE.split(path.read_text(encoding="utf-8"))
    # Of the parts every second one is a fenced block, which stays as it is.
    prose = [_prose(part, path) for part in parts[::2]]
    if sum(len(_TITLE.findall(part)) for part in prose) > 1:
        title, _, rest = prose[0].partition("\n")
        prose = [f"{title}\n{_HEADING.sub('#', rest)}", *(_HEADING.sub("#", part) for part in prose[1:])]
    return "".join(part + fence for part, fence in zip(prose, [*parts[1::2], ""], strict=True))


def _prose(text: str, path: Path) -> str:
    linked = _LINK.sub(lambda link: _link(link, path), text)
    linked = _BARE.sub(lambda bare: f"[{bare['name']}]({bare['name']})", linked)
    return _NOT_RUN.sub(lambda note: f"*The tests do not run this block: {note['why']}.*", linked)


def _link(link: re.Match[str], path: Path) -> str:
    target = link["target"]
    if not target or "://" in target or target.startswith("mailto:"):
        return link[0]
    meant = (path.parent / target).resolve()
    if meant.parent == DOCS or meant.is_relative_to(DOCS / "images"):
        return f"[{link['text']}]({meant.relative_to(DOCS)}{link['anchor'] or ''})"
    if meant.is_relative_to(DOCS / "reference"):  # made by this build; Sphinx looks whether it is there
        return link[0]
    inside = meant.relative_to(CHECKOUT)
    if str(inside) in FROM_OUTSIDE:
        return f"[{link['text']}]({FROM_OUTSIDE[str(inside)]}{link['anchor'] or ''})"
    if not meant.exists():
        raise ValueError(f"{path.relative_to(CHECKOUT)} leads to {target}, which is not in the repository")
    return f"{link['text']} (`{inside}` in the repository)"
