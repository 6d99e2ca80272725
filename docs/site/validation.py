"""The validation report: outside references with the digits reached (measured now), papers side by side, trials.

The comparisons are run by ``tests/references/digits.py``; tables of the papers and of the trials are taken from the pages
that hold their last results, so that no number stands twice.
"""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

import re
import statistics
from collections.abc import Iterator

from by_path import TESTS, load
from markdown import table
from sources import DOCS

HEAD = """# Validation report

For a metrologist who wants to know what stands behind a number of this program. Four kinds of evidence, strongest first:

1. **Certified and published values** of others, computed again now, while this page was made. *Digits* is NIST's log relative error: how many
   significant digits agree, 15 at most (what a double holds).
2. **Tables of the papers** whose methods are implemented, side by side with ours, departures included.
3. **Trials**: simulated campaigns with known truth, from simulators that share no code with the program; rates with their intervals.
4. **What was checked of documents** (PDF, signature, digital certificate), and by which tool: [reports and certificates](../reports-and-certificates.md#what-was-checked-and-by-what).

What all of this does not show stands under [limits](../limits.md).
"""
#: The section of a trial whose table says most; of the others it is the first.
MAIN_TABLE = {"trials-discovery.md": "One hidden effect"}
#: What a reader has to know of the references of a subject before the digits mean anything.
NOTES = {
    "NIST StRD, univariate": "Certified to 15 digits by NIST. The lower digits are limited by the doubles: the data of NumAcc3 "
    "and NumAcc4 are stored to fewer digits than they are printed with.",
    "NIST StRD, analysis of variance": "SmLs07 to 09 have values near 10¹² with scatter 0.1: as doubles they hold 4 digits of the "
    "answer; exact rational arithmetic on the doubles gives no more.",
    "NIST/SEMATECH e-Handbook": "Compared with values recomputed to full precision from the handbook's data; the handbook prints "
    "five to seven digits, which agree as far as its own rounding.",
    "GUM, JCGM 100:2008, annex H": "Compared with values recomputed from the published data by an independent computation; they "
    "agree with the printed ones within one unit of their last digit.",
    "GUM Supplement 1, JCGM 101:2008 (Monte Carlo, 500 000 trials)": "Exact values where the model has them, else a Monte Carlo of "
    "10⁷ trials. Of 500 000 trials u is good to 3 digits: more cannot be expected.",
    "GUM Supplement 2, JCGM 102:2011 (Monte Carlo, 400 000 trials)": "The reference is the exact value of the model that the clause "
    "states; the tables in print were not available for 9.2.",
    "Coverage factors, JCGM 102:2011, 6.5": "References of 8 digits, from quantiles of scipy; the sampled ones are stated with "
    "their standard error.",
    "JCGM 106:2012": "The tables print two or three decimals, and no more digits can agree; the last two are integrals by scipy.",
}


def page() -> str:
    """Return the page."""
    return "\n".join([HEAD, *_references(), *_papers(), *_trials(), _where()])


def _references() -> Iterator[str]:
    compared = load("digits", TESTS / "references" / "digits.py").everything()
    subjects = list(dict.fromkeys(row.subject for row in compared))
    yield "## Certified and published values\n"
    summary = []
    for subject in subjects:
        reached = [row.digits for row in compared if row.subject == subject]
        summary.append(
            (subject, str(len(reached)), f"{min(reached):.1f}", f"{statistics.median(reached):.1f}")
        )
    yield table(("reference", "quantities", "digits, least", "digits, median"), summary)
    for subject in subjects:
        yield f"### {subject}\n"
        if subject in NOTES:
            yield NOTES[subject] + "\n"
        rows = [
            (row.case, row.quantity.replace("_", " "), row.published, row.ours, f"{row.digits:.1f}")
            for row in compared
            if row.subject == subject
        ]
        yield table(("case", "quantity", "reference", "this program", "digits"), rows)


def _papers() -> Iterator[str]:
    yield """## Tables of the papers, side by side

Tests in `tests/methods` compute the numbers of these tables anew; the pages say what was departed from and why.
"""
    for title, name, heading in (
        ("Ibaraki, Iritani, Matsushita 2012: rotary probing, table 6", "rotary-probing.md", "Uncertainty"),
        (
            "Self-calibration of a free-form workpiece: figures 18 to 20, table 2",
            "free-form.md",
            "Uncertainty",
        ),
        ("Li et al. 2019: 21 errors from an L-shaped piece", "l-shape.md", "Against the source"),
    ):
        section = _section(name, heading)
        first, second = _tables(section)[0], section
        yield f"### {title}\n\n{first}\n"
        departures = [line for line in second.splitlines() if line.startswith("- ")]
        more = f" ({len(departures)} departures are explained there)" if departures else ""
        yield f"From [{name.removesuffix('.md')}](../{name}#{heading.lower().replace(' ', '-')}){more}.\n"
    yield """### Los 2017: SAMBA

The thesis prints correlations to two decimals (tables 5.3 and 7.4 to 7.6); as printed they are not positive semidefinite, and the columns of the gains are exchanged
in one of them. Its k_p = 6.52 and k_q = 3.13 (table 7.3) are those of 29 outputs. The tests hold both. The expected standard uncertainties of its
plan, computed independently of the project, stand in [conventions](../conventions.md#what-samba-identifies).
"""


def _trials() -> Iterator[str]:
    yield """## Trials with known truth

Of each trial one table; its page has all of them, what they mean, the commands that make them, seeds, dates and commits.
"""
    for path in sorted(DOCS.glob("trials-*.md")):
        text = path.read_text(encoding="utf-8")
        title = re.search(r"^# (.+)$", text, re.MULTILINE)
        assert title is not None
        made = sorted(set(re.findall(r"20\d\d-\d\d-\d\d|\d+ \w+ember 20\d\d", text)))
        shown = _tables(_section(path.name, MAIN_TABLE[path.name]) if path.name in MAIN_TABLE else text)[0]
        yield f"### {title[1]}\n\n{shown}\n\nFrom [{path.name}](../{path.name}); made {', '.join(made) or 'as it says'}.\n"


def _where() -> str:
    return """## How to make this page again

`make manual` in a checkout. The comparisons alone: `python tests/references/digits.py`. The references stand raw, with who, when and which version, in
`tests/references`; the trials are run by `make trials`.
"""


def _section(name: str, heading: str) -> str:
    """Return the part of a page under a heading. Raises ValueError where there is none."""
    parts = re.split(r"^## (.+)$", (DOCS / name).read_text(encoding="utf-8"), flags=re.MULTILINE)
    for title, text in zip(parts[1::2], parts[2::2], strict=True):
        if title == heading:
            return text
    raise ValueError(f"docs/{name} has no section '{heading}'")


def _tables(text: str) -> list[str]:
    return [match[0].rstrip() for match in re.finditer(r"(?:^\|.*\n?){3,}", text, re.MULTILINE)]
