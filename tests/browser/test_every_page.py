"""Every page in a real browser: whole and readable to everybody; a picture of each is kept.

Pictures are in ``pages-output/``: 1440 and 390 pixels wide, light and dark. axe-core looks for what keeps people out
who cannot see, or cannot use a mouse (WCAG 2.2, levels A and AA, and its best practices).
"""

from __future__ import annotations

import pytest

from tests.browser.visits import PAGES, Site, Visit, picture


@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (390, "dark")])
@pytest.mark.parametrize("name", PAGES)
def test_every_page_is_whole_and_open_to_everybody(site: Site, name: str, width: int, scheme: str) -> None:
    """Wide and light, narrow and dark; then in the other scheme, without loading it again."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="make pages installs it")
    with Visit(site, width, scheme) as visit:
        answer = visit.open(PAGES[name])
        assert answer.status == 200
        assert visit.page.locator("h1").count() == 1
        assert visit.page.locator("label:not(:has(input, select, textarea))").count() == 0
        for shown in (scheme, "dark" if scheme == "light" else "light"):
            visit.page.emulate_media(color_scheme=shown)
            visit.settle()
            visit.page.screenshot(path=picture(f"{name}-{width}-{shown}"), full_page=True)
            assert visit.faults() == []
            assert visit.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
            results = axe.Axe().run(visit.page)
            found_by_axe = [
                f"{rule['id']}: {node['target']}"
                for rule in results.response["violations"]
                for node in rule["nodes"]
            ]
            assert found_by_axe == []
