"""The stories of the pages in a real browser: Debian's Chromium, driven by Playwright (``make pages``).

Somebody who has never seen them gets from "it does not fit" to "spindle growth, added, error at the noise floor";
uploads a bad folder and sees its faults; chooses a plan; issues a certificate and amends it.
"""

from __future__ import annotations

import io
import zipfile
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from tests.browser.visits import EXAMPLES, Site, Visit, picture

#: How far the drawn spindle is from where its figure says, in mm.
MOVED = """() => { const drawn = document.getElementById('chart-scene').data.find((trace) => trace.meta === 'C1');
  const figure = document.querySelector('figure[data-key="scene"] script.figure');
  const still = JSON.parse(figure.textContent).data.find((trace) => trace.meta === 'C1');
  return Math.max(...drawn.z.map((z, index) => z === null ? 0 : Math.abs(z - still.z[index]))); }"""


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
        # Pointing at it is enough, by mouse or by keyboard: its arrows come and go, and its axis lights up.
        assert "explained by EZC1:const@warmup" not in visit.drawn("scene")
        effect.hover()
        page.locator("#scene-effect", has_text="Orange: what EZC1:const@warmup explains").wait_for()
        assert "explained by EZC1:const@warmup" in visit.drawn("scene")
        assert _lit(page) == ["C1"]
        # It swings along Z with the spindle, and stands where it stood.
        page.wait_for_function("Number(document.getElementById('chart-scene').dataset.swung || 0) >= 3")
        assert "C1 shifts along Z and the tool" in page.locator("#scene-effect").inner_text()
        page.wait_for_function(f"() => ({MOVED})() === 0")
        page.mouse.move(5, 5)
        assert "explained by EZC1:const@warmup" not in visit.drawn("scene")
        effect.focus()
        page.wait_for_timeout(300)
        assert "explained by EZC1:const@warmup" in visit.drawn("scene")
        page.screenshot(path=picture("story-pointed-at"), full_page=True)
        effect.get_by_role("link", name="see what it explains").click()
        visit.settle()
        assert {"explained by EZC1:const@warmup", "left with EZC1:const@warmup"} <= set(visit.drawn("scene"))
        lengths = [_arrow(page)]
        page.locator("#magnification").focus()
        page.keyboard.press("ArrowRight")
        lengths.append(_arrow(page))
        assert lengths[1] == pytest.approx(2.0 * lengths[0], rel=1e-6)  # from 50 to 100 mm for a micrometre
        effect.get_by_role("button", name="add").click()
        visit.settle()
        assert "EZC1:const@warmup was added: the model is now samba@2" in page.locator(".done").inner_text()
        assert "explains the measurement" in page.locator("#verdict").inner_text()
        steps = page.evaluate("document.getElementById('chart-falling').data[0].y")
        assert steps[0] == pytest.approx(1.007, abs=0.002)
        assert steps[1] == pytest.approx(0.899, abs=0.002)
        page.screenshot(path=picture("story-added"), full_page=True)
        page.get_by_role("button", name="undo: take EZC1:const@warmup out").click()
        visit.settle()
        assert "does not fit" in page.locator("#verdict").inner_text()
        assert visit.faults() == []


#: Whether an element stands in the window whole, without scrolling.
IN_SIGHT = """(element) => { const box = element.getBoundingClientRect();
  return box.top >= 0 && box.bottom <= window.innerHeight && box.left >= 0 && box.right <= window.innerWidth; }"""
#: Words of the page down to an element, of what is drawn in the window.
WORDS_BEFORE = """(element) => { const end = element.getBoundingClientRect().bottom; const words = [];
  const texts = document.createTreeWalker(document.querySelector('main'), NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const parent = texts.currentNode.parentElement;
    if (parent.closest('script, select, svg, datalist') || !parent.checkVisibility()) { continue; }
    if (parent.getBoundingClientRect().top > end) { continue; }
    words.push(...texts.currentNode.data.split(/\\s+/).filter(Boolean));
  }
  return words.length; }"""


def test_story_the_next_step_is_in_sight_and_takes_two_clicks(site: Site) -> None:
    """From the list of campaigns: one click to the answer, one that adds the effect; nothing is scrolled to."""
    with Visit(site) as visit:
        page = visit.page
        visit.open("/campaigns")
        row = page.locator("tr", has_text="hidden-spindle-growth")
        row.get_by_role("link", name="model against measurement").click()
        visit.settle()
        add = page.locator(".effect").first.get_by_role("button", name="add to the model")
        for part in (
            page.locator("#verdict"),
            page.locator("#answer"),
            page.locator(".effect h3").first,
            add,
        ):
            assert part.evaluate(IN_SIGHT)
        # At 200 words a minute some twenty seconds.
        assert add.evaluate(WORDS_BEFORE) < 200
        add.click()
        visit.settle()
        assert page.locator("#verdict").evaluate(IN_SIGHT)
        assert "explains the measurement" in page.locator("#verdict").inner_text()
        page.get_by_role("button", name="undo: take EZC1:const@warmup out").click()
        visit.settle()
        assert visit.faults() == []


def test_story_the_log_in_ends_while_somebody_types(site: Site) -> None:
    """Another session than that of the form: what was typed is shown again, and sent at a button."""
    with Visit(site) as visit:
        page = visit.page
        visit.open("/machine?name=HU40-T")
        page.locator('input[name="text"]').fill("belt changed")
        page.locator('input[name="at"]').fill("2026-03-04T07:00:00Z")
        page.locator('input[name="kind"]').fill("note")
        visit.context.clear_cookies()
        page.get_by_role("button", name="record the event").click()
        assert "What you filled in is here" in page.locator("main").inner_text()
        assert "belt changed" in page.locator("main").inner_text()
        page.get_by_role("button", name="send it").dblclick()
        page.wait_for_url(
            "**/machine?**"
        )  # the form's own page is complete too while its answer is under way
        visit.settle()
        assert page.locator("li", has_text="note, belt changed").count() == 1


def test_story_an_event_is_entered_on_the_chart(site: Site) -> None:
    """A click between two days takes their time by the shop's clock, with its offset; a drag zooms and takes none, and
    a double click, which takes the zoom back, none either."""
    with Visit(site) as visit:
        page = visit.page
        visit.open("/machine?name=HU40-T&parameter=EB0C&campaign=five-days")
        pad = page.locator("#chart-trend .nsewdrag").first
        box = pad.bounding_box()
        assert box is not None
        at = page.locator('input[name="at"]')
        page.mouse.move(box["x"] + 200, box["y"] + 60)
        page.mouse.down()
        page.mouse.move(box["x"] + 900, box["y"] + 60, steps=4)
        page.mouse.up()
        assert at.input_value() == ""
        pad.scroll_into_view_if_needed()
        box = pad.bounding_box()
        assert box is not None
        shown = "document.getElementById('chart-trend')._fullLayout.xaxis.range"
        zoomed = page.evaluate(shown)
        page.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        page.wait_for_timeout(1000)
        assert at.input_value() == ""
        ends = page.evaluate(shown)
        assert ends[0] < zoomed[0]
        assert ends[1] > zoomed[1]
        page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        page.wait_for_timeout(1000)
        taken = at.input_value()
        assert taken.endswith("-05:00")
        first, last = (datetime.fromisoformat(end.replace(" ", "T")[:19]) for end in ends)
        off = datetime.fromisoformat(taken).replace(tzinfo=None) - (first + (last - first) / 2)
        assert abs(off) < 0.02 * (last - first)
        assert page.evaluate("document.activeElement.name") == "text"
        assert visit.faults() == []


def test_story_who_asked_for_less_motion_sees_where_it_moves_and_no_motion(site: Site) -> None:
    with Visit(site) as visit:
        page = visit.page
        page.emulate_media(reduced_motion="reduce")
        visit.open("/model?campaign=hidden-spindle-growth")
        visit.settle()
        page.locator(".effect").first.hover()
        page.locator("#scene-effect", has_text="C1 shifts along Z").wait_for()
        page.wait_for_timeout(1500)
        assert page.evaluate("document.getElementById('chart-scene').dataset.swung || 0") == 0
        assert page.evaluate(
            "document.getElementById('chart-scene').data.some((trace) => trace.line && trace.line.dash === 'dash')"
        )
        assert visit.faults() == []


def _lit(page: Any) -> list[str]:
    """Axes of the machine that are drawn thick."""
    names = page.evaluate(
        "document.getElementById('chart-scene').data"
        ".filter((trace) => trace.meta && trace.line && trace.line.width === 9)"
        ".map((trace) => trace.meta)"
    )
    return sorted(set(map(str, names)))


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
        visit.page.screenshot(path=picture("story-refused"), full_page=True)
        visit.page.locator('input[type="file"]').first.set_input_files(good)
        visit.page.get_by_role("button", name="import", exact=True).click()
        visit.settle()
        assert "nothing-hidden: imported, 20 runs" in visit.page.locator(".done").inner_text()
        # Back to it from the campaign, and forward again: Chromium would say ERR_CACHE_MISS of the answer to a form.
        visit.page.get_by_role("link", name="open it").click()
        visit.settle()
        visit.page.go_back()
        assert "nothing-hidden: imported, 20 runs" in visit.page.locator(".done").inner_text()
        visit.page.go_forward()
        assert "nothing-hidden" in visit.page.locator("h1").inner_text()


def test_story_the_residual_follows_the_time_of_day_until_the_effect_is_tried(site: Site) -> None:
    with Visit(site) as visit:
        visit.open("/model?campaign=hidden-spindle-growth")
        visit.page.locator('select[name="driver"]').select_option("time_of_day / h")
        visit.page.locator("form", has=visit.page.locator('select[name="driver"]')).get_by_role(
            "button"
        ).click()
        visit.settle()
        before = _along_z(visit.page, "left by the model")
        visit.page.locator("#scene-controls select[name=effect]").select_option("EZC1:const@warmup")
        visit.page.get_by_role("button", name="try it").click()
        visit.settle()
        after = _along_z(visit.page, "with EZC1:const@warmup")
        assert max(map(abs, before)) > 1.0
        assert max(map(abs, after)) < 0.4
        assert visit.faults() == []


def _along_z(page: Any, name: str) -> list[float]:
    means = page.evaluate(
        "document.getElementById('chart-driver').data.filter((trace) => trace.yaxis === 'y3')"
        f".find((trace) => trace.name === '{name}').y"
    )
    return [float(mean) for mean in means]


def test_story_a_certificate_is_refused_at_its_box_previewed_issued_and_amended(site: Site) -> None:
    with Visit(site) as visit:
        page = visit.page
        visit.open("/certificates")
        page.locator('form[action="/certificate/new"] input[name="campaign"]').fill("five-days")
        page.get_by_role("button", name="fill in the form").click()
        page.locator('select[name="run"]').select_option("20")
        page.locator('input[type="file"]').set_input_files(EXAMPLES / "laboratory.toml")
        page.get_by_role("button", name="fill in", exact=True).click()
        contact = page.locator('input[name="customer.contact"]')
        assert contact.input_value() == "quality@example.org"
        contact.fill("")
        page.get_by_role("button", name="issue", exact=True).click()
        assert "1 item is missing" in page.locator(".refusal").inner_text()
        assert "customer, contact" in page.locator('[id="customer.contact"] .fault').inner_text()
        assert page.locator('[aria-invalid="true"]').count() == 1
        page.screenshot(path=picture("story-certificate-refused"), full_page=True)
        contact.fill("quality@example.org")
        page.get_by_role("button", name="preview").click()
        assert "nothing was issued" in page.locator("#outcome").inner_text()
        # Left and gone back to, what was typed is still there.
        page.get_by_role("link", name="Fleet").click()
        page.go_back()
        assert "nothing was issued" in page.locator("#outcome").inner_text()
        assert contact.input_value() == "quality@example.org"
        page.get_by_role("button", name="issue", exact=True).click()
        assert "is issued" in page.locator("#outcome").inner_text()
        visit.open("/certificates")
        page.get_by_role("link", name="amend").first.click()
        page.locator('input[name="reason"]').fill("the customer has moved")
        page.locator('input[type="file"]').set_input_files(EXAMPLES / "laboratory.toml")
        page.get_by_role("button", name="fill in", exact=True).click()
        assert page.locator('input[name="reason"]').input_value() == "the customer has moved"
        page.get_by_role("button", name="issue the amendment").click()
        assert "is issued" in page.locator("#outcome").inner_text()
        visit.open("/certificates")
        assert "amended: the customer has moved" in page.locator("main").inner_text()
        # The refusals of forms are answers with a status that the console names.
        assert [fault for fault in visit.faults() if "400" not in fault] == []


def test_story_what_changed_over_the_strokes_and_a_quicker_plan(site: Site) -> None:
    with Visit(site) as visit:
        page = visit.page
        visit.open("/campaign?name=five-days")
        page.get_by_role("link", name="volumetric error").click()
        visit.settle()
        page.locator('select[name="minus"]').select_option("1")
        page.locator('select[name="points"]').select_option("3")
        page.get_by_role("button", name="show").click()
        visit.settle()
        assert "From run 1 to run 20 the error changed by" in page.locator("#worst").inner_text()
        page.get_by_role("link", name="plan", exact=True).click()
        visit.settle()
        page.locator('input[name="u_EB0C"]').fill("5")
        page.get_by_role("button", name="find the quickest plan").click()
        visit.settle()
        minutes = float(page.locator("#proposed").inner_text().split(", ")[-1].removesuffix(" min"))
        assert minutes < 65.0
        assert visit.faults() == []
