"""Effects that are ticked are added together: one version of the model, and one step of the error."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

CURVE = "load-cell"


@pytest.fixture
def own(imported: Path, serve: Any, tmp_path: Path) -> Any:
    """A server of a copy of the database that the test may write to."""
    copy = tmp_path / "own.duckdb"
    shutil.copyfile(imported, copy)
    return serve(copy, False)


def test_ticked_effects_are_one_version_by_rank(own: Any) -> None:
    form = {"proof": own.proof(), "once": "1", "campaign": CURVE, "to": "curve@1", "latest": "curve@1"}
    # By rank as numbers: the tenth is not before the second.
    answer = own.client.post(
        "/model/add", data={**form, "ticked-10": "load_N:sin1", "ticked-2": "load_N:poly2"}
    )
    assert answer.status_code == 303
    assert "load_N:poly2, load_N:sin1 were added" in own.client.get(answer.headers["location"]).text
    versions = [model for model in own.ask("models")[1]["models"] if model["name"] == "curve"]
    assert [version["added"] for version in versions] == [[], ["load_N:poly2", "load_N:sin1"]]


def test_without_a_tick_nothing_is_made_and_it_is_said(own: Any) -> None:
    form = {"proof": own.proof(), "once": "1", "campaign": CURVE, "to": "curve@1"}
    page = own.sent("/model/add", data=form)
    assert page.status_code == 400
    assert "no effect is ticked" in page.text
    assert len([model for model in own.ask("models")[1]["models"] if model["name"] == "curve"]) == 1


def test_after_a_change_of_the_model_the_first_page_can_be_brought_up_to_it(own: Any) -> None:
    """The fleet has numbers of the newest version alone: whoever adds an effect emptied it and was not told."""
    form = {"proof": own.proof(), "once": "c", "campaign": "hidden-spindle-growth", "to": "samba"}
    text = own.sent("/model/add", data={**form, "effect": "EZC1:const@warmup"}).text
    assert "✓ EZC1:const@warmup was added: the model is now samba@2" in text
    assert re.search(r'action="/fleet/identify".*?identify every campaign with it', text, re.DOTALL)
    for address in (
        {"campaign": "hidden-spindle-growth"},
        {"campaign": CURVE, "changed": "1"},
    ):
        assert "identify every campaign with it" not in own.client.get("/model", params=address).text
