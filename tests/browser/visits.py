"""A server of a database of the examples and a browser that visits it: what the stories of the pages share.

No page may be wider than the window, lack a chart, or break the policy with a script.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

try:
    from playwright import sync_api as playwright
except ImportError:  # make pages installs it
    playwright = None

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
PICTURES = Path(os.environ.get("PAGES_OUTPUT", ROOT / "pages-output"))
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
#: Three dimensions without a graphics card; a browser in a container has no sandbox of its own.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
#: What Chromium says of plotly.js that is no fault.
HARMLESS = ("Canvas2D: Multiple readback",)
PATIENCE_S = 120.0
#: Every page at its most: with an effect tried, two runs compared, a form with faults.
PAGES = {
    "fleet": "/",
    "machine": "/machine?name=HU40-T&parameter=EB0C&campaign=five-days",
    "campaigns": "/campaigns",
    "campaign": "/campaign?name=five-days&first=EB0C&second=EA0B&trials=1",
    "model": "/model?campaign=hidden-spindle-growth&effect=EZC1%3Aconst%40warmup",
    "curve": "/model?campaign=load-cell",
    "map": "/map?campaign=five-days&run=20&minus=1&points=3",
    "plan": "/plan?campaign=five-days&keep=1&keep=2&keep=3&keep=4&keep=5&keep=6&keep=8",
    "periods": "/machine/periods?name=HU40-T&since_1=2026-03-02&until_1=2026-03-03"
    "&since_2=2026-03-05&until_2=2026-03-09",
    "certificate": "/certificate/new?campaign=five-days&run=20",
    "reports": "/reports?week=2026-W10&machine=TILT-500",
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


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A browser and a server of five campaigns of three machines and a curve."""
    if playwright is None:
        pytest.skip("there is no playwright; make pages installs it")
    if CHROMIUM is None:
        pytest.skip("there is no chromium; make pages installs Debian's")
    database = tmp_path_factory.mktemp("pages") / "monitor.duckdb"
    monitor = [sys.executable, "-m", "monitor", "--db", str(database)]
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

    def drawn(self, key: str) -> list[str]:
        """Names of the traces of a chart."""
        names = self.page.evaluate(
            f"document.getElementById('chart-{key}').data.map((trace) => trace.name || '')"
        )
        return [str(name) for name in names]

    def __enter__(self) -> Visit:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()


def picture(name: str) -> str:
    """Where the picture of a page is kept."""
    PICTURES.mkdir(exist_ok=True)
    return str(PICTURES / f"{name}.png")
