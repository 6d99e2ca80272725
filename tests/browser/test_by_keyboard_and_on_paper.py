"""Pages by keyboard alone, and on paper.

In a file of their own: a file stays with one worker, so these run beside those of ``test_every_page.py``.
"""

from __future__ import annotations

import io
import unicodedata

import pytest

from tests.browser.visits import PAGES, Site, Visit

pypdf = pytest.importorskip("pypdf")

#: What a page lets one press or fill in, as an expression of the browser; charts have controls of their own.
REACHABLE = (
    "[...document.querySelectorAll('main a[href], main button, main input, main select, main textarea, main summary')]"
    ".filter((element) => element.checkVisibility() && element.type !== 'hidden' && !element.closest('.canvas'))"
)


@pytest.mark.parametrize("name", ["machine", "model", "certificate"])
def test_a_page_works_by_keyboard_alone(site: Site, name: str) -> None:
    """Everything that can be pressed or filled in is reached by Tab, and one sees where one is."""
    with Visit(site) as visit:
        visit.open(PAGES[name])
        visit.page.keyboard.press("Tab")
        assert visit.page.evaluate("document.activeElement.className") == "skip"
        wanted = visit.page.evaluate(f"{REACHABLE}.length")
        reached = set()
        for _ in range(3 * wanted + 60):
            visit.page.keyboard.press("Tab")
            at = visit.page.evaluate(
                f"[{REACHABLE}.indexOf(document.activeElement), getComputedStyle(document.activeElement).outlineStyle]"
            )
            if at[0] >= 0:
                reached.add(at[0])
                assert at[1] != "none"
        assert reached == set(range(wanted))


#: What a page tells of the widths of its charts when it is printed.
WIDTHS_ON_PAPER = """() => {
  window.chartWidths = () => [...document.querySelectorAll(".js-plotly-plot .main-svg:first-child")]
    .map((drawing) => Number(drawing.getAttribute("width")));
  window.addEventListener("beforeprint", () => { window.onPaper = window.chartWidths(); });
}"""


@pytest.mark.parametrize("name", ["machine", "model", "campaign", "map"])
def test_a_page_prints_without_its_forms(site: Site, name: str) -> None:
    with Visit(site) as visit:
        visit.open(PAGES[name])
        visit.page.evaluate(WIDTHS_ON_PAPER)
        on_screen = visit.page.evaluate("window.chartWidths()")
        printed = visit.page.pdf(format="A4", print_background=False)
        # A4 less margins of 1 cm is 718 pixels wide: a chart that is wider loses its right side. Then it is as it was.
        assert max(visit.page.evaluate("window.onPaper"), default=0) <= 718
        visit.page.wait_for_function(
            "String(window.chartWidths()) === '" + ",".join(map(str, on_screen)) + "'"
        )
        text = "\n".join(page.extract_text() for page in pypdf.PdfReader(io.BytesIO(printed)).pages)
        text = unicodedata.normalize("NFKC", text)  # ligatures of the font
        assert visit.page.locator("h1").inner_text().split()[0] in text
        for word in ("show\n", "record the event", "log out"):
            assert word not in text
