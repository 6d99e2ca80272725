"""Uploads of the pages: workbooks of Excel, what is torn or lacking, and addresses that lack a part."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_a_workbook_of_excel_is_imported_and_refused_at_its_cells(
    imported: Path, serve: Any, tmp_path: Path
) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    served = serve(copy, False)
    folder = EXAMPLES / "nothing-hidden"

    def upload(cell: tuple[int, int] | None, with_toml: bool = True) -> Any:
        workbook = openpyxl.Workbook()
        workbook.remove(workbook.active)
        for name in ("runs", "probings"):
            sheet = workbook.create_sheet(name)
            with (folder / f"{name}.csv").open(encoding="utf-8") as stream:
                for row in csv.reader(stream):
                    sheet.append(row)
        if cell is not None:
            workbook["probings"].cell(*cell, value="much")
        packed = io.BytesIO()
        workbook.save(packed)
        files = [("file", ("campaign.xlsx", packed.getvalue()))]
        if with_toml:
            files.append(("file", ("campaign.toml", (folder / "campaign.toml").read_bytes())))
        return served.client.post("/import", data={"proof": served.proof()}, files=files)

    with (folder / "probings.csv").open(encoding="utf-8") as stream:
        column = next(csv.reader(stream)).index("x_mm") + 1
    refused = upload((7, column))
    assert refused.status_code == 422
    assert re.search(r"campaign\.xlsx.*(row|line) 7.*x_mm.*much", refused.text), refused.text[-3000:]
    alone = upload(None, with_toml=False)
    assert alone.status_code == 400
    assert "choose both files together" in alone.text
    answer = upload(None)
    assert answer.status_code == 200
    assert "nothing-hidden: imported" in answer.text


def test_an_address_that_lacks_a_part_is_refused_as_a_page(local: Any) -> None:
    for address, sentence in (
        ("/machine", "'name': field required"),
        ("/?first=abc", "'first': input should be"),
    ):
        answer = local.client.get(address)
        assert answer.status_code == 400
        assert "text/html" in answer.headers["content-type"]
        assert sentence in answer.text.replace("&#39;", "'")


def test_an_upload_is_refused_without_a_folder_of_the_server(local: Any) -> None:
    proof = {"proof": local.proof()}
    files = [("file", ("campaign.toml", (EXAMPLES / "five-days/campaign.toml").read_bytes()))]
    lacking = local.client.post("/import", data=proof, files=files)
    assert lacking.status_code == 422
    assert "the upload was refused" in lacking.text
    assert str(lacking.text).count("tmp") == 0
    torn = local.client.post("/import", data=proof, files=[("file", ("c.zip", b"hello"))])
    assert "c.zip is no zip that can be read; pack the folder again" in torn.text
