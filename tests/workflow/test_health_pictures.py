"""The three pictures of a machine's page, and the refused imports, on campaigns with a hidden effect."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pypdf
import pytest
from by_path import TESTS, load

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.reporting.health.pictures import against_driver, error_steps, where_it_fails
from monitor.reporting.health.records import MachineHealth
from monitor.store import Database, import_campaign, record_refusal, refusals
from monitor.workflow.health.report import stored_health
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest

answers = load("answers", TESTS / "answers.py")
report = answers.report

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MADE = datetime.fromisoformat("2026-03-09T06:00:00+00:00")
#: What two machines hide, a switch and a function of an axis, and what the residual is drawn against.
HIDDEN = {
    "hidden-reversal-x": ("EXX:reversal", "direction of the last travel of X"),
    "hidden-b-indexing": ("EBB:harmonic2", "B / °"),
}


def folder_of(example: str, place: Path, machine: str) -> Path:
    """A copy of an example on a machine of its own."""
    folder = place / machine
    shutil.copytree(EXAMPLES / example, folder)
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    text = re.sub('campaign = ".*?"', f'campaign = "{machine}"', text, count=1).replace("HU40-T", machine, 1)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    place = tmp_path_factory.mktemp("pictures")
    with Database(place / "fleet.duckdb", threads=1) as db:
        for example in (*HIDDEN, "nothing-hidden"):
            import_campaign(db, read_campaign(folder_of(example, place, f"M-{example}")))
        yield db


@pytest.fixture(scope="module")
def made(fleet: Database, tmp_path_factory: pytest.TempPathFactory) -> dict:
    return report(fleet, "2026-W10", out=tmp_path_factory.mktemp("out"), made_at=MADE)


def page_of(db: Database, machine: str) -> MachineHealth:
    ((number,),) = db.rows(
        "SELECT max(analysis_id) FROM v_analyses WHERE kind = 'health' AND machine = ?", [machine]
    )
    return stored_health(db, number)


@pytest.mark.parametrize("example", HIDDEN)
def test_before_the_residual_follows_the_driver_and_after_it_does_not(
    fleet: Database, made: dict, example: str
) -> None:
    follows(fleet, example, *HIDDEN[example])


@pytest.mark.slow
def test_before_the_residual_follows_the_warm_up_and_after_it_does_not(tmp_path: Path) -> None:
    example = "hidden-spindle-growth"
    with Database(tmp_path / "fleet.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(folder_of(example, tmp_path, f"M-{example}")))
        report(db, "2026-W10", out=tmp_path / "out", made_at=MADE)
        follows(db, example, "EZC1:const@warmup", "warm-up, from its mean in the run")


def follows(db: Database, example: str, effect: str, driver: str) -> None:
    """Assert that what is left follows the driver under the old model and is noise under the one with the effect."""
    model = page_of(db, f"M-{example}").model
    assert model is not None
    assert model.against is not None
    assert model.missing[0].effect == effect
    assert (model.against.driver, model.against.along) == (driver, effect.partition(":")[0])
    groups = model.against.groups
    before = max(abs(one.before_um) for one in groups)
    assert before > 8.0 * max(one.u_before_um for one in groups if abs(one.before_um) == before)
    after = [(one.after_um, one.u_after_um) for one in groups]
    assert all(mean is not None and u is not None for mean, u in after)
    # Under the right model a group's mean is noise: ten groups within 4.5 standard uncertainties and 0.02 µm.
    assert all(abs(mean or 0.0) < 4.5 * (u or 0.0) + 0.02 for mean, u in after)
    assert sum(one.n for one in groups) == 16 * 62


def test_the_means_of_the_known_reversal_are_half_its_size_and_of_opposite_sign(
    fleet: Database, made: dict
) -> None:
    # `hidden-reversal-x` jumps by 4 µm of amplitude; balls, tip and gain that are free take up a part of it, but
    # what is left keeps the sign: towards + the tip is too far in +, and the other way round.
    model = page_of(fleet, "M-hidden-reversal-x").model
    assert model is not None
    assert model.against is not None
    towards = {one.at: one.before_um for one in model.against.groups}
    assert set(towards) == {-1.0, 1.0}
    assert towards[-1.0] < -1.0 < 1.0 < towards[1.0]


def test_the_residual_vectors_are_the_mean_of_the_stored_residuals(fleet: Database, made: dict) -> None:
    # Length does not depend on the frame: the stored residuals are in that of the last work axis.
    model = page_of(fleet, "M-hidden-b-indexing").model
    assert model is not None
    assert model.where is not None
    lengths = np.linalg.norm(model.where.residual_um, axis=1)
    rows = fleet.rows(
        "SELECT sqrt(avg(dx_um) ** 2 + avg(dy_um) ** 2 + avg(dz_um) ** 2) FROM v_residuals "
        "WHERE campaign = 'M-hidden-b-indexing' AND run <= 16 GROUP BY sequence"
    )
    assert len(lengths) == 62
    np.testing.assert_allclose(np.sort(lengths), np.sort([one for (one,) in rows]), atol=2e-3)


def test_where_nothing_is_missing_the_page_says_so_and_draws_nothing(fleet: Database, made: dict) -> None:
    model = page_of(fleet, "M-nothing-hidden").model
    assert model is not None
    assert (model.where, model.against, model.steps, model.missing) == (None, None, (), ())
    html = Path(made["files"][0]).read_text(encoding="utf-8")
    own = html[html.index(">M-nothing-hidden</h1>") :].partition("</section>")[0]
    assert "No picture: the model explains these measurements." in own
    # The map of the volumetric error is on every page.
    assert own.count('<svg class="plot"') == 1
    on_first_page = html[: html.index('<section class="machine"')].count('<svg class="plot"')
    assert on_first_page == len(HIDDEN)  # a picture of each that lacks something
    assert html.count('<svg class="plot"') == 3 * len(HIDDEN) + len(HIDDEN) + 1 + on_first_page


def test_the_same_pictures_stand_in_html_and_pdf_and_are_small(fleet: Database, made: dict) -> None:
    html = Path(made["files"][0]).read_text(encoding="utf-8")
    pictures = re.findall(r'<svg class="plot".*?</svg>', html, re.S)
    assert all(len(one) < 30_000 for one in pictures)
    for one in pictures:
        ElementTree.fromstring(one)
    pages = [" ".join(page.extract_text().split()) for page in pypdf.PdfReader(made["files"][1]).pages]
    begins = next(i for i, page in enumerate(pages) if "What the model lacks: EBB:harmonic2" in page)
    told = " ".join(pages[begins : begins + 3])
    for words in (
        "Where the model fails", "What is missing: EBB:harmonic2", "The error would fall from",
        "10\xa0000 times enlarged",
        "as the model is", "with what is missing added", "empty bar: if it is added",
    ):  # fmt: skip
        assert words.replace("\xa0", " ") in told.replace("\xa0", " ")
    assert "oval or doubly misaligned worm wheel" in told


def test_after_the_effect_was_added_the_page_shows_how_far_the_error_fell(
    fleet: Database, made: dict, tmp_path: Path, pdf_unread
) -> None:
    add_effect(fleet, AddEffectRequest("EXX:reversal", "samba", "samba-2"))
    machine = "M-hidden-reversal-x"
    options = ReportOptions(model="samba-2")
    with pdf_unread():
        found = report(fleet, "2026-W10", machine, tmp_path, options=options, made_at=MADE)
    model = page_of(fleet, machine).model
    assert model is not None
    assert model.where is None
    assert [one.what for one in model.steps] == ["samba: as it is", "samba-2: + EXX:reversal"]
    assert not any(one.proposed for one in model.steps)
    first, last = model.steps
    assert first.rms_um > 1.5 > 1.0 > last.rms_um > 0.8
    assert first.heldout_um is not None
    assert last.heldout_um is not None
    # Held-out error per degree of freedom: the noise floor of 1 µm, within 3 % of it.
    assert last.heldout_um == pytest.approx(model.stated_um, rel=0.03)
    assert "The error fell from 1.59 to 0.90 µm" in Path(found["files"][0]).read_text(encoding="utf-8")


def test_pictures_take_any_numbers_without_a_fault(fleet: Database, made: dict) -> None:
    import dataclasses

    model = page_of(fleet, "M-hidden-b-indexing").model
    assert model is not None
    assert model.where is not None
    assert model.against is not None
    still = dataclasses.replace(model.where, residual_um=tuple((0.0, 0.0, 0.0) for _ in model.where.place_mm))
    one = dataclasses.replace(model.against.groups[0], after_um=None, u_after_um=None)
    lonely = dataclasses.replace(
        model.against, groups=(one,), at=(one.at,), before_um=(one.before_um,), driver="<&>"
    )
    long = dataclasses.replace(model.steps[0], what="+ EXX:" + "x" * 90, heldout_um=None)
    many = dataclasses.replace(model, steps=(long,) * 30)
    for picture in (where_it_fails(still), against_driver(lonely), error_steps(many)):
        ElementTree.fromstring(picture)
        assert "nan" not in picture


def test_a_refused_import_stands_on_its_machines_page_or_on_the_first(
    fleet: Database, made: dict, tmp_path: Path, pdf_unread
) -> None:
    at = datetime.fromisoformat("2026-03-04T11:00:00+01:00")
    machine = "M-nothing-hidden"
    record_refusal(fleet, "/in/late", ["probings.csv, line 7: <bad>", "b", "c", "d"], machine=machine, at=at)
    record_refusal(fleet, "/in/unknown", ["campaign.toml: the file is missing"], at=at)
    record_refusal(fleet, "/in/next-week", ["x"], machine=machine, at=at.replace(day=9))
    with pdf_unread():
        found = report(fleet, "2026-W10", out=tmp_path, made_at=MADE)
    (elsewhere,) = found["refused_imports"]
    assert (elsewhere["folder"], elsewhere["machine"], elsewhere["imported_at"]) == (
        "/in/unknown",
        None,
        None,
    )
    (one,) = page_of(fleet, machine).quality.refused_imports
    assert (one.folder, one.fault_count) == ("/in/late", 4)
    row = next(row for row in found["machines"] if row["machine"] == machine)
    assert row["changed"] == "an import was refused on 2026-03-04"
    html = Path(found["files"][0]).read_text(encoding="utf-8")
    assert "probings.csv, line 7: &lt;bad&gt;; b; c; and 1 more fault" in html
    assert "/in/next-week" not in html
    first = html.partition('<section class="machine"')[0]
    assert "Refused imports of machines not known here" in first
    assert "/in/unknown" in first
    assert "/in/late" not in first


def test_a_refusal_that_was_settled_is_marked_and_no_longer_news(tmp_path: Path, pdf_unread) -> None:
    folder = folder_of("nothing-hidden", tmp_path, "M1")
    good = (folder / "runs.csv").read_bytes()
    with Database(tmp_path / "one.duckdb", threads=1) as db, pdf_unread():
        (folder / "runs.csv").write_bytes(good.replace(b"true", b"perhaps").replace(b"false", b"perhaps"))
        with pytest.raises(CampaignError, match="perhaps"):
            import_folders(db, ImportRequest([folder]))
        (refused,) = refusals(db)
        (folder / "runs.csv").write_bytes(good)
        import_folders(db, ImportRequest([folder]))
        week = f"{refused.at.isocalendar().year}-W{refused.at.isocalendar().week:02d}"
        found = report(db, week, out=tmp_path, made_at=refused.at.replace(tzinfo=UTC))
        assert "refused" not in found["machines"][0]["changed"]
        assert "Imported well on" in Path(found["files"][0]).read_text(encoding="utf-8")
        assert json.dumps(found)
