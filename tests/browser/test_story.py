"""The stories of the pages in a real browser: Debian's Chromium, driven by Playwright (``make pages``).

Somebody who has never seen them gets from "it does not fit" to "spindle growth, added, error at the noise floor";
uploads a bad folder and sees its faults; goes round by keyboard alone. Every page is kept as a picture in
``pages-output/``: 1440 and 390 pixels wide, light and dark. No page may be wider than the window, lack a chart, or
break the policy with a script.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="make pages installs it")

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
PICTURES = Path(os.environ.get("PAGES_OUTPUT", ROOT / "pages-output"))
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
#: Three dimensions without a graphics card; a browser in a container has no sandbox of its own.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
#: What plotly.js does that the policy forbids and that nothing depends on: style attributes of its notifications, and
#: the style sheet of its maps.
HARMLESS = ("Applying inline style violates", "Canvas2D: Multiple readback")
PATIENCE_S = 120.0
PAGES = {
    "fleet": "/",
    "machine": "/machine?name=HU40-T&parameter=EB0C&campaign=five-days",
    "campaigns": "/campaigns",
    "campaign": "/campaign?name=five-days&first=EB0C&second=EA0B",
    "model": "/model?campaign=hidden-spindle-growth&effect=EZC1%3Aconst%40warmup",
    "curve": "/model?campaign=load-cell",
    "import": "/import",
    "certificates": "/certificates",
    "audit": "/audit",
    "interface": "/interface",
}


@dataclass(frozen=True)
class Site:
    """A browser and the address of a server."""

    browser: Any
    address: str


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    if CHROMIUM is None:
        pytest.skip("there is no chromium; make pages installs Debian's")
    database = tmp_path_factory.mktemp("pages") / "monitor.duckdb"
    monitor = [sys.executable, "-m", "monitor.cli", "--db", str(database)]
    folders = [
        str(EXAMPLES / name) for name in ("five-days", "hidden-spindle-growth", "tilting-table", "load-cell")
    ]
    subprocess.run([*monitor, "import", *folders], check=True, capture_output=True)
    server = subprocess.Popen([*monitor, "serve", "--port", "0"], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    address = server.stdout.readline().split(" at ")[1].split("/ ;")[0]
    try:
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            yield Site(browser, address)
            browser.close()
    finally:
        server.terminate()
        server.wait()
        server.stdout.close()


class Visit:
    """A window with what its console said."""

    def __init__(self, site: Site, width: int = 1440, scheme: str = "light") -> None:
        self.address = site.address
        self.context = site.browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.context.set_default_timeout(1000 * PATIENCE_S)
        self.page = self.context.new_page()
        self.said: list[str] = []
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))

    def open(self, path: str) -> Any:
        """Load a page and wait until nothing is being computed and every chart is drawn."""
        answer = self.page.goto(f"{self.address}{path}")
        self.settle()
        return answer

    def settle(self) -> None:
        """Wait until nothing is being computed and every chart is drawn."""
        end = time.monotonic() + PATIENCE_S
        while not self._is_settled():
            assert time.monotonic() < end, "the page is still not complete"
            self.page.wait_for_timeout(200)

    def _is_settled(self) -> bool:
        # Not wait_for_function: it looks again by eval, which the policy of the pages forbids.
        try:
            return bool(
                self.page.evaluate(
                    "document.readyState === 'complete' && document.querySelector('.waiting') === null && "
                    "document.querySelectorAll('.canvas').length === "
                    "document.querySelectorAll('.canvas[data-drawn]').length"
                )
            )
        except playwright.Error:  # the page loads itself again just now
            return False

    def faults(self) -> list[str]:
        """What the console said that it should not."""
        return [
            text
            for text in self.said
            if text.startswith("error") and not any(part in text for part in HARMLESS)
        ]

    def __enter__(self) -> Visit:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()


def test_story_it_does_not_fit_spindle_growth_added_error_at_the_noise_floor(site: Site) -> None:
    with Visit(site) as visit:
        page = visit.page
        visit.open("/campaigns")
        row = page.locator("tr", has_text="hidden-spindle-growth")
        row.get_by_role("link", name="model against measurement").click()
        visit.settle()
        assert "does not fit: something is missing" in page.locator("#verdict").inner_text()
        effect = page.locator(".effect").first
        assert "EZC1:const@warmup" in effect.inner_text()
        assert "spindle" in effect.inner_text()
        assert "6.14" in effect.inner_text()
        effect.get_by_role("link", name="see what it explains").click()
        visit.settle()
        names = page.evaluate("document.getElementById('chart-scene').data.map((trace) => trace.name)")
        assert "with EZC1:const@warmup" in names
        lengths = [_arrow(page)]
        page.locator("#magnification").focus()
        page.keyboard.press("ArrowRight")
        lengths.append(_arrow(page))
        assert lengths[1] == pytest.approx(2.5 * lengths[0], rel=1e-6)  # from 20 to 50 mm for a micrometre
        effect.get_by_role("button", name="add").click()
        visit.settle()
        assert "EZC1:const@warmup was added: the model is now samba@2" in page.locator(".done").inner_text()
        assert "explains the measurement" in page.locator("#verdict").inner_text()
        steps = page.evaluate("document.getElementById('chart-falling').data[0].y")
        assert steps[0] == pytest.approx(1.007, abs=0.002)
        assert steps[1] == pytest.approx(0.899, abs=0.002)
        page.screenshot(path=_picture("story-added"), full_page=True)
        page.get_by_role("button", name="undo: take EZC1:const@warmup out").click()
        visit.settle()
        assert "does not fit" in page.locator("#verdict").inner_text()
        assert visit.faults() == []


def _arrow(page: Any) -> float:
    """Length of the first arrow of the scene in mm."""
    length = page.evaluate(
        """() => { const data = document.getElementById('chart-scene').data;
        const line = data.find((trace) => trace.name === 'left by the model');
        return Math.hypot(line.x[1] - line.x[0], line.y[1] - line.y[0], line.z[1] - line.z[0]); }"""
    )
    return float(length)


def test_story_a_bad_folder_shows_its_faults_and_the_good_one_goes_in(site: Site, tmp_path: Path) -> None:
    folder = EXAMPLES / "nothing-hidden"
    bad, good = tmp_path / "bad.zip", tmp_path / "good.zip"
    for target, runs in ((bad, b"run,started_at\n1,yesterday\n"), (good, (folder / "runs.csv").read_bytes())):
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for path in folder.iterdir():
                content = runs if path.name == "runs.csv" else path.read_bytes()
                archive.writestr(f"nothing-hidden/{path.name}", content)
        target.write_bytes(packed.getvalue())
    with Visit(site) as visit:
        visit.open("/import")
        visit.page.locator('input[type="file"]').first.set_input_files(bad)
        visit.page.get_by_role("button", name="import", exact=True).click()
        visit.settle()
        assert "was refused, nothing of it was kept" in visit.page.locator(".refusal").inner_text()
        assert "runs.csv, line 2" in visit.page.locator(".refusal").inner_text()
        visit.page.screenshot(path=_picture("story-refused"), full_page=True)
        visit.page.locator('input[type="file"]').first.set_input_files(good)
        visit.page.get_by_role("button", name="import", exact=True).click()
        visit.settle()
        assert "nothing-hidden: imported, 20 runs" in visit.page.locator(".done").inner_text()


def test_a_page_works_by_keyboard_alone(site: Site) -> None:
    with Visit(site) as visit:
        visit.open("/campaigns")
        visit.page.keyboard.press("Tab")
        assert visit.page.evaluate("document.activeElement.className") == "skip"
        reached = set()
        for _ in range(60):
            visit.page.keyboard.press("Tab")
            reached.add(visit.page.evaluate("document.activeElement.textContent.trim()"))
        assert {"Fleet", "Import", "five-days", "everything as CSV"} <= reached


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1440, 390])
@pytest.mark.parametrize("name", PAGES)
def test_every_page_is_whole(site: Site, name: str, width: int, scheme: str) -> None:
    with Visit(site, width, scheme) as visit:
        answer = visit.open(PAGES[name])
        assert answer.status == 200
        visit.page.screenshot(path=_picture(f"{name}-{width}-{scheme}"), full_page=True)
        assert visit.faults() == []
        assert visit.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        assert visit.page.locator("h1").count() == 1
        assert visit.page.locator("label:not(:has(input, select))").count() == 0


def _picture(name: str) -> str:
    PICTURES.mkdir(exist_ok=True)
    return str(PICTURES / f"{name}.png")
