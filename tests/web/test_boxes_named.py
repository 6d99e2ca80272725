"""A form that is refused names every box that is wrong, at once and by the words beside it."""

from __future__ import annotations

import html
import shutil
from pathlib import Path
from typing import Any

import pytest

from monitor.store import Database
from monitor.web.faults import by_field
from monitor.workflow.intake.importing import ImportRequest, import_folders
from tests.web.test_pages import looked_at

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_two_periods_name_the_box_that_is_wrong_and_show_what_was_compared(local: Any) -> None:
    """A link with German days was computed beside empty boxes; half a link had no word of what it lacks."""
    looked_at(local, "/machine?name=HU40-T")

    def asked(**days: str) -> str:
        return str(
            html.unescape(local.client.get("/machine/periods", params={"name": "HU40-T", **days}).text)
        )

    german = {
        "since_1": "02.03.2026",
        "until_1": "03.03.2026",
        "since_2": "05.03.2026",
        "until_2": "06.03.2026",
    }
    page = asked(**german)
    assert 'name="since_1" value="2026-03-02"' in page
    assert "Earlier: 2026-03-02 to 2026-03-03 (8 runs on 2 days). Later: 2026-03-05 to 2026-03-06" in page
    half = asked(**{**german, "since_1": "abc", "until_2": ""})
    assert (
        "'earlier: from' is a day, such as 2026-03-02 or 02.03.2026, not 'abc'; 'later: to, whole day' is empty"
        in half
    )
    assert 'name="until_1" value="2026-03-03"' in half
    assert "the earlier period ends on 2026-03-01, before its first day 2026-03-02" in asked(
        **{**german, "until_1": "2026-03-01"}
    )
    assert 'role="alert"' not in asked()


def test_a_certificate_is_refused_for_its_grounds_and_its_boxes_at_once(serve: Any, tmp_path: Path) -> None:
    """Of an empty form only the ground was told, with an option of the command line."""
    folder = tmp_path / "rehearsal"
    shutil.copytree(EXAMPLES / "five-days", folder)
    text = (folder / "campaign.toml").read_text("utf-8")
    (folder / "campaign.toml").write_text(text.replace("[machine]", "[machine]\nvirtual = true", 1), "utf-8")
    with Database(tmp_path / "own.duckdb", threads=1) as db:
        import_folders(db, ImportRequest([folder]))
    own = serve(tmp_path / "own.duckdb", False)
    form = {"proof": own.proof(), "campaign": "five-days", "run": "20", "button": "issue"}
    unchosen = own.sent("/certificate/new", data={**form, "run": ""}).text
    assert "<strong>choose the run that is certified</strong>" in unchosen
    assert '<select name="run" aria-invalid="true">' in unchosen
    page = own.sent("/certificate/new", data=form)
    assert page.status_code == 422
    assert "the certificate is refused: simulated speaks against it and" in page.text
    assert "--" not in page.text.partition("<main")[2].replace("<!--", "")
    at_box = page.text[page.text.index('<div id="accept.simulated">') :].partition("</div>")[0]
    assert 'aria-invalid="true"' in at_box
    assert "✗ the readings were simulated" in at_box
    for box in ("laboratory.name", "customer.name", "authorised_by.0.name"):
        assert 'class="fault"' in page.text[page.text.index(f'<div id="{box}">') :].partition("</div>")[0]
    needless = {**form, "accept.simulated": "a rehearsal", "accept.units": "known"}
    at_box = own.sent("/certificate/new", data=needless).text.partition('<div id="accept.units">')[2]
    assert "✗ units: there is nothing to accept" in at_box.partition("</div>")[0]


@pytest.mark.parametrize(
    ("question", "document", "says"),
    [
        ("trend", {"machine": "HU40-T", "reliability": 7}, "'reliability' 7: a probability lies between 0 and 1"),
        ("trend", {"machine": "HU40-T", "parameter": "EXX", "volumetric_limit_um": 5.0},
         "'volumetric_limit_um' needs all parameters; leave out 'parameter'"),
    ],
)  # fmt: skip
def test_the_interface_names_fields_and_no_options(
    local: Any, question: str, document: dict[str, Any], says: str
) -> None:
    status, answer = local.ask(question, document)
    assert (status, answer["error"]) == (400, says)
    assert by_field("--other 7: no field; --level-of", {"level"}) == "--other 7: no field; --level-of"


def test_a_file_that_is_no_certificate_is_called_by_its_own_name(local: Any) -> None:
    files = [("file", ("../..\\Prüfbericht 7.pdf", b"hello"))]
    page = local.sent("/certificates/verify", data={"proof": local.proof()}, files=files).text
    assert "Prüfbericht 7.pdf" in page
    assert "certificate.pdf" not in page.partition("<main")[2].partition("<table")[0]
