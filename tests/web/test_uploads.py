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
        return served.sent("/import", data={"proof": served.proof()}, files=files)

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
        ("/machine", "it lacks 'name'"),
        ("/?first=abc", "'first': input should be"),
    ):
        answer = local.client.get(address)
        assert answer.status_code == 400
        assert "text/html" in answer.headers["content-type"]
        assert sentence in answer.text.replace("&#39;", "'")


def test_an_upload_is_refused_without_a_folder_of_the_server(local: Any) -> None:
    proof = {"proof": local.proof()}
    files = [("file", ("campaign.toml", (EXAMPLES / "five-days/campaign.toml").read_bytes()))]
    lacking = local.sent("/import", data=proof, files=files)
    assert lacking.status_code == 422
    assert "the upload was refused" in lacking.text
    assert str(lacking.text).count("tmp") == 0
    torn = local.sent("/import", data=proof, files=[("file", ("c.zip", b"hello"))])
    assert "c.zip is no zip that can be read; pack the folder again" in torn.text


def _exports() -> tuple[list[tuple[str, tuple[str, bytes]]], bytes]:
    folder = EXAMPLES / "files-as-they-come"
    files = [
        ("file", (path.name, path.read_bytes()))
        for path in sorted(folder.iterdir())
        if path.suffix not in (".md", ".toml")
    ]
    return files, (folder / "mapping.toml").read_bytes()


def test_files_of_instruments_are_looked_at_with_their_mapping_and_then_imported(
    imported: Path, serve: Any, tmp_path: Path
) -> None:
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    served = serve(copy, False)
    files, mapping = _exports()

    def sent(button: str, mapping: bytes = mapping) -> Any:
        fields = {"proof": served.proof(), "campaign": "week-12", "button": button}
        both = [*files, ("mapping", ("shop.toml", mapping))]
        return served.sent("/import", data=fields, files=both)

    before = served.db.rows("SELECT count(*) FROM campaign")
    looked = sent("look")
    assert looked.status_code == 200, looked.text[-2000:]
    assert "Looked at, nothing was stored: week-12, 1 run, 806 probings" in looked.text
    text = re.sub(r"<[^>]+>|\s+", " ", looked.text)
    assert "r-test.csv: table (Windows-1252" in text
    assert "decimal comma), setup r-test, run 1, 25 rows" in text
    assert looked.text.count('class="card understood"') == len(files)
    assert served.db.rows("SELECT count(*) FROM campaign") == before
    wrong = sent("look", mapping.replace(b"[[exports]]", b"[[nothing]]"))
    assert wrong.status_code in (400, 422)
    assert str(tmp_path) not in wrong.text
    assert "/tmp" not in wrong.text
    stored = sent("")
    assert "✓ week-12: imported, 1 run, 806 probings" in re.sub(r"\s+", " ", stored.text)
    assert served.db.rows("SELECT count(*) FROM campaign") == [(before[0][0] + 1,)]


def test_a_mapping_without_files_is_refused(local: Any) -> None:
    answer = local.sent(
        "/import", data={"proof": local.proof()}, files=[("mapping", ("mapping.toml", _exports()[1]))]
    )
    assert answer.status_code == 400
    assert "choose the files of the instruments beside the mapping" in answer.text
