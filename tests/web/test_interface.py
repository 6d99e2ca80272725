"""The HTTP interface: the documents of the contract in and out, refusals in plain sentences with the right status."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import zipfile
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.web.access import FILES, NOT_OFFERED, offered, path_fields, taken_fields
from monitor.web.openapi import openapi
from monitor.workflow.contract import QUESTIONS

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_every_question_is_offered_or_says_why_not(local: Any) -> None:
    assert set(offered()) | set(NOT_OFFERED) == set(QUESTIONS)
    listed = local.client.get("/api/v1").json()["questions"]
    assert list(listed) == list(offered())
    for question in NOT_OFFERED:
        assert local.client.post(f"/api/v1/{question}", json={}).status_code == 404


def test_the_answer_is_what_the_command_prints(imported: Path, local: Any, tmp_path: Path) -> None:
    """Keys and numbers of another process, which reads a copy of the same database through the command line."""
    status, compared = local.ask("compare", {"campaign": "hidden-spindle-growth"})
    assert status == 200
    copy = tmp_path / "copy.duckdb"
    local.db.execute("CHECKPOINT")
    copy.write_bytes(imported.read_bytes())
    command = [
        sys.executable,
        "-m",
        "monitor",
        "--db",
        str(copy),
        "compare",
        "hidden-spindle-growth",
        "--json",
    ]
    printed = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    assert compared == printed


def _references(value: Any) -> list[str]:
    if isinstance(value, dict):
        own = [value["$ref"]] if "$ref" in value else []
        return own + [name for element in value.values() for name in _references(element)]
    return [name for element in value for name in _references(element)] if isinstance(value, list) else []


def test_openapi_describes_every_question_and_all_its_records(local: Any) -> None:
    document = local.client.get("/api/v1/openapi.json").json()
    assert document == json.loads(json.dumps(openapi()))
    assert len(document["paths"]) == len(offered())
    names = {f"#/components/schemas/{name}" for name in document["components"]["schemas"]}
    assert set(_references(document)) <= names


def _accepts(schema: dict[str, Any], value: Any, definitions: dict[str, Any]) -> bool:
    """Whether a value has the keys and types of a schema: a small reader of the parts of JSON Schema that are used."""
    if "$ref" in schema:
        return _accepts(definitions[schema["$ref"].rpartition("/")[2]], value, definitions)
    if "anyOf" in schema:
        return any(_accepts(member, value, definitions) for member in schema["anyOf"])
    if "allOf" in schema:
        return all(_accepts(member, value, definitions) for member in schema["allOf"])
    if "enum" in schema:
        return value in schema["enum"]
    kinds = {
        "object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "boolean": bool,
        "null": type(None),
    }  # fmt: skip
    wanted = schema.get("type")
    names = wanted if isinstance(wanted, list) else [wanted] if wanted else []
    if names and not any(isinstance(value, kinds[name]) for name in names):
        return False
    if isinstance(value, dict):
        return all(key in value for key in schema.get("required", [])) and all(
            _accepts(
                schema.get("properties", {}).get(key, schema.get("additionalProperties") or {}),
                element,
                definitions,
            )
            for key, element in value.items()
        )
    if isinstance(value, list) and "items" in schema:
        return all(_accepts(schema["items"], element, definitions) for element in value)
    return True


@pytest.mark.parametrize(
    ("question", "document"),
    [
        ("campaigns", {}),
        ("machines", {}),
        ("runs", {"campaign": "hidden-spindle-growth"}),
        ("identify", {"campaign": "hidden-spindle-growth", "run": 3}),
        ("values", {"machine": "HU40-T"}),
        ("residuals", {"campaign": "hidden-spindle-growth"}),
        ("compare", {"campaign": "load-cell"}),
        ("models", {}),
        ("audit", {"last": 5}),
        ("certificates", {}),
    ],
)
def test_an_answer_fits_the_schema_that_describes_it(
    local: Any, question: str, document: dict[str, Any]
) -> None:
    status, answer = local.ask(question, document)
    assert status == 200
    described = openapi()
    schema = described["paths"][f"/api/v1/{question}"]["post"]["responses"]["200"]["content"][
        "application/json"
    ]["schema"]
    assert _accepts(schema, answer, described["components"]["schemas"])
    assert not _accepts(schema, {}, described["components"]["schemas"])


@pytest.mark.parametrize(
    ("question", "document", "status", "words"),
    [
        ("compare", {"campaign": "nowhere"}, 404, "nowhere"),
        ("compare", {"campagne": "five-days"}, 400, "did you mean 'campaign'"),
        ("compare", {}, 400, "'campaign' is missing"),
        ("compare", {"campaign": 5}, 400, "'campaign'"),
        ("compare", {"campaign": "hidden-spindle-growth", "figures": "/tmp"}, 400, "takes no 'figures'"),
        ("trend", {"machine": "HU40-T", "reliability": 2}, 400, "between 0 and 1"),
        ("values", {"machine": "HU40-T", "since": 1772434800}, 400, "'since' is the number 1772434800: write a day or"),
        ("values", {"machine": "HU40-T", "until": "1772434800"}, 400, "write a day or a time as 2026-03-05"),
        ("trend", {"machine": "HU40-T", "reference": [1, 2.5]}, 400, "'reference' is the number 1: write a day or a"),
        ("map", {"campaign": "hidden-spindle-growth", "before": 1e9}, 400, "'before' is the number 1000000000.0"),
        ("event", {"machine": "HU40-T", "text": "x", "at": True}, 400, "'at' is True: write a day or a time as text"),
        ("periods", {"machine": "HU40-T", "earlier": {"since": 0, "until": []}, "later": {}}, 400, "'since' is the"),
        ("map", {"campaign": "hidden-spindle-growth", "p": 1e-300}, 400, "a coverage probability lies between"),
        ("plan", {"campaign": "hidden-spindle-growth", "p": 1e-300}, 400, "a coverage probability lies between"),
        ("model history", {"model": "samba@9"}, 404, "samba"),
        ("add effect", {"effect": "nonsense", "to": "samba"}, 400, "nonsense"),
        ("residuals", {"campaign": "load-cell"}, 400, "curve"),
        ("map", {"campaign": "hidden-spindle-growth", "compensation": "x"}, 400, "there are positioning-csv"),
        ("uncertainty", {"campaign": "hidden-spindle-growth", "cluster": "10.0.0.1:1"}, 400, "takes no 'cluster'"),
        ("sql", {"query": "DROP TABLE run"}, 400, "may only read"),
        ("sql", {"query": "SELECT * FROM read_text('/etc/passwd')"}, 400, "cannot be answered"),
        ("sql", {"query": "SELECT * FROM '/etc/passwd'"}, 400, "cannot be answered"),
        ("sql", {"query": "SET enable_external_access = true"}, 400, "may only read"),
    ],
)  # fmt: skip
def test_a_fault_of_the_user_is_a_sentence_and_no_server_error(
    local: Any, question: str, document: dict[str, Any], status: int, words: str
) -> None:
    answered, answer = local.ask(question, document)
    assert answered == status
    assert words in str(answer["error"])


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"{", "no JSON"),
        (b"[]", "must be an object"),
        (b'{"campaign": "\\ud800"}', "no JSON document in UTF-8"),
        (b'{"campaign": "\\u0000"}', ""),
        (b"\xff\xfe", "no JSON"),
        (b"[" * 20_000, "no JSON"),
        (b'{"campaign": "hidden-spindle-growth", "run": 99999999999999999999999999}', ""),
        (b'{"campaign": "hidden-spindle-growth", "run": -1}', ""),
        (b'{"campaign": "hidden-spindle-growth", "run": NaN}', ""),
    ],
)
def test_a_broken_document_is_refused(local: Any, body: bytes, words: str) -> None:
    answer = local.client.post("/api/v1/identify", content=body, headers={"Content-Type": "application/json"})
    assert 400 <= answer.status_code < 500
    assert words in answer.json()["error"]


JUNK: list[Any] = [None, "", "\x00'; --", -1, 1e308, [], {}, [[["x"]]], "2026-99-99", True]
#: They take their time, or a file; with a field more or less they are asked elsewhere.
SLOW = {"report", "export", "backup", "verify", "identify all"}


@pytest.mark.parametrize("question", [name for name in offered() if name not in SLOW])
def test_junk_in_any_field_is_no_server_error(local: Any, question: str) -> None:
    if FILES.get(question) is not None and FILES[question].upload is not None:
        pytest.skip("takes a file, and is tested with files")
    for field in taken_fields(question):
        for junk in JUNK:
            status, answer = local.ask(question, {field: junk})
            assert status < 500, (question, field, junk, answer)


def test_no_field_of_a_question_names_a_file_of_the_server() -> None:
    for question in offered():
        kind = QUESTIONS[question].request
        assert not path_fields(kind) & set(taken_fields(question))


def test_the_residuals_have_the_root_mean_square_that_compare_and_explain_state(local: Any) -> None:
    campaign = "hidden-spindle-growth"
    _, residuals = local.ask("residuals", {"campaign": campaign, "effect": "EZC1:const@warmup"})
    _, compared = local.ask("compare", {"campaign": campaign})
    weighed = ~np.array(residuals["left_out"])
    rms = [
        np.sqrt(np.mean(np.square(np.array(residuals[key])[weighed])))
        for key in ("residual_um", "with_effect_um")
    ]
    assert rms[0] == pytest.approx(compared["rms_um"], rel=1e-5)
    assert rms[1] == pytest.approx(0.899, abs=5e-4)  # README: 1.01 -> 0.90 µm
    rows = local.db.rows(
        "SELECT DISTINCT run, sequence FROM v_probings WHERE campaign = ? ORDER BY ALL", [campaign]
    )
    assert sorted(zip(residuals["run"], residuals["sequence"], strict=True)) == rows


def test_the_values_are_those_of_the_view_that_people_query(local: Any) -> None:
    assert local.ask("identify", {"campaign": "hidden-spindle-growth"})[0] == 200
    _, values = local.ask("values", {"machine": "HU40-T", "parameter": "EB0C"})
    query = (
        "SELECT run, value, u FROM v_parameters WHERE campaign = 'hidden-spindle-growth' AND model = 'samba' "
        "AND parameter = 'EB0C' ORDER BY run"
    )
    expected = [row for row in local.db.rows(query) if row[1] is not None]
    rows = [row for row, name in enumerate(values["campaign"]) if name == "hidden-spindle-growth"]
    series = values["parameters"]["EB0C"]
    shown = [(values["run"][row], series["values"][row], series["u"][row]) for row in rows]
    assert [row[0] for row in shown] == [row[0] for row in expected]
    assert np.array(shown) == pytest.approx(np.array(expected), rel=1e-12)
    _, later = local.ask("values", {"machine": "HU40-T", "since": values["started_at"][3]})
    assert later["started_at"] == values["started_at"][3:]
    _, earlier = local.ask("values", {"machine": "HU40-T", "until": values["started_at"][3]})
    assert earlier["started_at"] == values["started_at"][:3]


def test_every_key_takes_a_moment_with_and_without_its_offset(local: Any) -> None:
    """By UTC, by another offset and by the clock of the shop, five hours behind: the same moment."""
    assert local.ask("identify", {"campaign": "hidden-spindle-growth"})[0] == 200
    _, values = local.ask("values", {"machine": "HU40-T"})
    local_start = datetime.fromisoformat(values["started_at"][3])
    written = [
        local_start.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        local_start.astimezone(timezone(timedelta(hours=1))).isoformat(),
        local_start.replace(tzinfo=None).isoformat(),
        f"{local_start:%Y-%m-%d %H:%M:%S}",
    ]
    for moment in written:
        for question, key in (("values", "since"), ("trend", "since")):
            status, answer = local.ask(question, {"machine": "HU40-T", "parameter": "EB0C", key: moment})
            assert status == 200, answer
            runs = answer["runs"] if question == "trend" else len(answer["started_at"])
            assert runs == len(values["started_at"]) - 3


@pytest.mark.slow
def test_a_moment_before_which_runs_count_is_read_as_any_other(local: Any) -> None:
    asked = {"campaign": "hidden-spindle-growth", "method": "guf"}
    runs = local.ask("runs", {"campaign": "hidden-spindle-growth"})[1]["runs"]
    by_the_shop, by_utc = runs[4]["started_at_local"], runs[4]["started_at"]
    answers = [local.ask("uncertainty", {**asked, "before": moment}) for moment in (by_the_shop, by_utc)]
    assert by_utc.endswith("Z")
    assert answers[0][0] == 200, answers
    assert answers[0] == answers[1]


def zipped(folder: Path, replaced: dict[str, bytes] | None = None) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for path in sorted(folder.iterdir()):
            content = (replaced or {}).get(path.name, path.read_bytes())
            archive.writestr(f"{folder.name}/{path.name}", content)
    return packed.getvalue()


def test_a_folder_is_imported_as_a_zip_and_a_bad_one_is_refused_with_every_fault(local: Any) -> None:
    bad = zipped(EXAMPLES / "hidden-reversal-x", {"runs.csv": b"run,started_at\n1,yesterday\n"})
    answer = local.client.post("/api/v1/import", files={"file": ("bad.zip", bad)})
    assert answer.status_code == 422
    assert "nothing of it was kept" in answer.json()["error"]
    assert not answer.json()["error"].startswith(".")
    assert all("runs.csv" in fault or "probings.csv" in fault for fault in answer.json()["faults"])
    assert "/served" not in answer.text  # no path of the server
    good = local.client.post(
        "/api/v1/import", files={"file": ("x.zip", zipped(EXAMPLES / "hidden-reversal-x"))}
    )
    assert good.status_code == 200
    assert [row["state"] for row in good.json()["imported"]] == ["imported"]
    ((actor,),) = local.db.rows("SELECT actor FROM audit ORDER BY entry DESC LIMIT 1")
    assert actor == local.db.actor


def test_an_export_is_a_zip_of_every_table(local: Any) -> None:
    answer = local.client.post("/api/v1/export", json={"format": "csv"})
    assert answer.status_code == 200
    names = zipfile.ZipFile(io.BytesIO(answer.content)).namelist()
    assert "v_parameters.csv" in names
    assert "run.csv" in names
