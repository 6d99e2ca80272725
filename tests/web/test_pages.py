"""The pages without a browser: what is rendered, and that the numbers behind it are what they say.

Stories in a real browser, pictures and accessibility: ``make pages``.
"""

from __future__ import annotations

import csv
import io
import re
import time
import zipfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats

from monitor.documents import from_document
from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.reporting.texts import languages
from monitor.web.charts.machine import machine_traces, motion_of
from monitor.web.charts.residuals import scene_vectors
from monitor.web.laboratory_form import box_of, groups, laboratory_file, texts_of_file
from monitor.web.words import with_u
from monitor.workflow.explain.residual_vectors import ResidualsAnswer
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.volumetric import map_run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGN = "hidden-spindle-growth"
EFFECT = "EZC1:const@warmup"


def looked_at(local: Any, address: str) -> str:
    """The page once nothing is being computed any more."""
    end = time.monotonic() + 120.0
    while True:
        answer = local.client.get(address)
        if 'class="waiting"' not in answer.text:
            assert answer.status_code == 200, answer.text[-2000:]
            return str(answer.text)
        assert time.monotonic() < end
        time.sleep(0.1)


@pytest.fixture(scope="module")
def residuals(local: Any) -> dict[str, Any]:
    status, answer = local.ask("residuals", {"campaign": CAMPAIGN, "effect": EFFECT})
    assert status == 200
    return dict(answer)


@pytest.fixture(scope="module")
def probings() -> list[dict[str, str]]:
    with (EXAMPLES / CAMPAIGN / "probings.csv").open() as stream:
        return list(csv.DictReader(stream))


def test_places_and_poses_are_those_of_the_file(
    residuals: dict[str, Any], probings: list[dict[str, str]]
) -> None:
    """In 'w C B X b Z Y (C1) t' X carries the workpiece: the tip is at minus its carriage's displacement."""
    assert [(axis["name"], axis["carries"], axis["kind"]) for axis in residuals["machine"]] == [
        ("X", "workpiece", "linear"), ("B", "workpiece", "rotary"), ("C", "workpiece", "rotary"),
        ("Z", "tool", "linear"), ("Y", "tool", "linear"), ("C1", "tool", "spindle"),
    ]  # fmt: skip
    readings = {(int(row["run"]), int(row["sequence"])): row for row in probings}
    for index in range(0, len(residuals["run"]), 97):
        row = readings[residuals["run"][index], residuals["sequence"][index]]
        assert np.abs(residuals["place_mm"][index]) == pytest.approx(
            np.abs([float(row[f"{axis}_mm"]) for axis in "xyz"]), abs=1e-6
        )
        pose = residuals["poses"][residuals["pose"][index]]
        assert pose == pytest.approx({axis: float(row[f"{axis.lower()}_deg"]) for axis in "BC"}, abs=0.005)
    assert len(residuals["poses"]) == len({(row["b_deg"], row["c_deg"]) for row in probings})


def test_what_an_effect_explains_is_what_it_takes_off_the_residual(residuals: dict[str, Any]) -> None:
    left, remaining, explained = (
        np.array(residuals[key]) for key in ("residual_um", "with_effect_um", "explained_um")
    )
    assert explained == pytest.approx(left - remaining, abs=2e-6)
    assert residuals["effect_axis"] == "C1"
    # The spindle grows along Z: 6.14 µm settled to nothing over the day, seen through the machine's own axes.
    rms = np.sqrt(np.mean(explained**2, axis=0))
    assert rms[2] > 5.0 * max(rms[0], rms[1])
    assert np.sqrt(np.mean(remaining**2)) < np.sqrt(np.mean(left**2))


@pytest.mark.parametrize(
    ("effect", "axis", "moved", "along", "words"),
    [
        ("EZC1:const@warmup", "C1", ("C1",), ("shift", 2), "C1 shifts along Z and the tool"),
        ("EB0C:const", "C", ("C",), ("turn", 1), "C turns about Y and the workpiece"),
        (
            "EAX:linear",
            "X",
            ("X", "B", "C"),
            ("turn", 0),
            "X turns about X, and with it B, C and the workpiece",
        ),
        ("EYY:linear", "Y", ("Y", "C1"), ("shift", 1), "Y shifts along Y, and with it C1 and the tool"),
    ],
)
def test_an_effect_moves_its_axis_and_what_that_carries(
    residuals: dict[str, Any],
    effect: str,
    axis: str,
    moved: tuple[str, ...],
    along: tuple[str, int],
    words: str,
) -> None:
    answer = from_document(ResidualsAnswer, {**residuals, "effect": effect, "effect_axis": axis})
    motion = motion_of(answer)
    assert motion is not None
    assert (motion.axes, motion.sentence) == (moved, words)
    for kind in ("shift", "turn"):
        directions = np.flatnonzero(getattr(motion, kind)).tolist()
        assert directions == ([along[1]] if kind == along[0] else [])
    assert (
        motion_of(from_document(ResidualsAnswer, {**residuals, "effect": "ball:scale", "effect_axis": None}))
        is None
    )


def test_residuals_by_driver_are_the_residuals_in_groups(local: Any, residuals: dict[str, Any]) -> None:
    asked = {"campaign": CAMPAIGN, "driver": "time_of_day / h"}
    status, answer = local.ask("residuals by driver", asked)
    assert status == 200
    kept = ~np.array(residuals["left_out"])
    for axis, name in enumerate("XYZ"):
        column = np.array(residuals["residual_um"])[kept, axis]
        parts = answer["along"][name]["groups"]
        counts, means = (np.array([part[key] for part in parts]) for key in ("n", "before_um"))
        assert counts.sum() == len(column)
        assert counts @ means == pytest.approx(column.sum(), abs=5e-4 * np.abs(counts @ np.abs(means)) + 1e-3)
    status, answer = local.ask("residuals by driver", {**asked, "driver": "time_of_day"})
    assert status == 400
    assert "did you mean 'time_of_day / h'?" in answer["error"]


def test_the_machine_is_drawn_as_its_topology_says(residuals: dict[str, Any]) -> None:
    """Every axis has a line along its direction; the arc of a rotary one lies across it, all at one distance."""
    answer = from_document(ResidualsAnswer, residuals)
    every = machine_traces(answer)
    traces = [trace for trace in every if trace["type"] == "scatter3d"]
    bodies = [trace for trace in every if trace["type"] == "mesh3d"]
    # The table is what the workpiece is clamped to, and the spindle has its nose.
    assert [body["meta"] for body in bodies] == ["C", "C1"]
    for body in bodies:
        axis = next(axis for axis in answer.machine if axis.name == body["meta"])
        line = next(trace for trace in traces if trace["meta"] == axis.name)
        points = np.array([body[name] for name in "xyz"])
        corners = np.array([body[name] for name in "ijk"])
        assert 0 <= corners.min() <= corners.max() == points.shape[1] - 1
        # A surface about the axis: the middle of its corners lies on it.
        from_line = points.mean(axis=1) - np.array([line[name][0] for name in "xyz"])
        assert np.linalg.norm(np.cross(from_line, axis.direction)) == pytest.approx(0.0, abs=0.05)
    for axis in answer.machine:
        own = [
            np.array([trace[name] for name in "xyz"]) for trace in traces if trace.get("meta") == axis.name
        ]
        assert len(own) == (1 if axis.kind == "linear" else 2)
        along = own[0][:, 1] - own[0][:, 0]
        assert np.cross(along / np.linalg.norm(along), axis.direction) == pytest.approx(np.zeros(3), abs=1e-4)
        if axis.kind != "linear":
            arc = own[1][:, :40]
            assert np.ptp(np.array(axis.direction) @ arc) == pytest.approx(0.0, abs=0.01)
            from_axis = np.linalg.norm(np.cross((arc - own[0][:, [0]]).T, axis.direction), axis=1)
            assert np.ptp(from_axis) == pytest.approx(0.0, abs=0.01)
            # It turns by the right hand.
            turn = np.cross((arc[:, 0] - own[0][:, 0]), (arc[:, 5] - own[0][:, 0]))
            assert turn @ np.array(axis.direction) > 0.0
    shown = scene_vectors(answer)
    assert shown["tried"]["axis"] == "C1"
    assert len(shown["place"]) == len(answer.run)


@pytest.mark.slow
def test_the_model_page_draws_the_machine_and_offers_run_pose_driver_and_effect(local: Any) -> None:
    text = looked_at(local, f"/model?campaign={CAMPAIGN}&effect=EZC1%3Aconst%40warmup")
    assert "does not fit" in text
    assert f'data-effect="{EFFECT}" tabindex="0"' in text
    for element in ('id="scene-run"', 'id="scene-pose"', 'id="magnification"', 'name="driver"'):
        assert element in text
    assert '"meta": "C1"' in text
    assert '"meta": "B"' in text
    answer = local.client.get(
        f"/model/explained?campaign={CAMPAIGN}&model=samba&effect=EZC1%3Aconst%40warmup"
    )
    assert answer.status_code in (200, 202)
    if answer.status_code == 200:
        assert set(answer.json()) == {"effect", "axis", "explained", "motion", "remaining"}


def test_two_periods_differ_as_numpy_says(local: Any) -> None:
    """Means of days, and u by the pooled scatter of the days (the third day helps), both of equally many runs."""
    assert local.ask("identify", {"campaign": CAMPAIGN})[0] == 200
    status, values = local.ask("values", {"machine": "HU40-T"})
    assert status == 200
    days: dict[str, list[float]] = defaultdict(list)
    for at, value, warming in zip(
        values["started_at"], values["parameters"]["EB0C"]["values"], values["warm_up"], strict=True
    ):
        assert not warming
        days[at[:10]].append(value)
    names = sorted(days)
    means = np.array([np.mean(days[name]) for name in names])
    first, last = means[:2], means[3:]
    assert len(means) == 5
    asked = {
        "machine": "HU40-T",
        "earlier": {"since": f"{names[0]}T00:00:00Z", "until": f"{names[2]}T00:00:00Z"},
        "later": {"since": f"{names[3]}T00:00:00Z", "until": f"{names[4]}T23:59:59Z"},
    }
    status, answer = local.ask("periods", asked)
    assert status == 200
    of = answer["parameters"]["EB0C"]
    assert of["difference"] == pytest.approx(last.mean() - first.mean(), rel=1e-9)
    # A single day between them scatters about its own mean and adds nothing: two degrees of freedom.
    pooled = np.sqrt((np.ptp(first) ** 2 + np.ptp(last) ** 2) / 2.0 / 2.0)
    assert of["u"] >= pooled * (1.0 - 1e-9)
    assert of["k"] == pytest.approx(4.303, abs=0.001) or of["u"] > pooled
    status, refusal = local.ask("periods", {**asked, "later": asked["earlier"]})
    assert (status, "overlap" in refusal["error"]) == (400, True)
    text = looked_at(
        local,
        f"/machine/periods?name=HU40-T&since_1={names[0]}&until_1={names[1]}&since_2={names[3]}&until_2={names[4]}",
    )
    assert f"Earlier: {names[0]} to {names[1]} (8 runs on 2 days). Later: {names[3]} to {names[4]}" in text


def test_downloads_of_a_machine_hold_that_machine(local: Any) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    workbook = openpyxl.load_workbook(
        io.BytesIO(local.client.get("/export?format=xlsx&machine=HU40-T").content), read_only=True
    )
    assert "runs" in workbook.sheetnames
    packed = zipfile.ZipFile(io.BytesIO(local.client.get("/export?format=csv&machine=HU40-T").content))
    name = next(name for name in packed.namelist() if name.endswith("v_runs.csv"))
    rows = list(csv.DictReader(io.TextIOWrapper(packed.open(name))))
    assert len(rows) == 20
    assert {row["machine"] for row in rows} == {"HU40-T"}
    assert local.client.get("/export?format=parquet&machine=nobody").status_code == 404


def test_the_fleet_filters_by_state_and_date(local: Any) -> None:
    assert "HU40-T" in looked_at(local, "/?since=2026-01-01")
    assert "measured last in this period" in looked_at(local, "/?until=2020-01-01")


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("/?since={}", "since"),
        ("/?until={}", "until"),
        ("/machine?name=HU40-T&until={}", "until"),
        ("/machine/values.csv?name=HU40-T&since={}", "since"),
    ],
)
def test_a_day_is_read_as_a_german_writes_it_or_refused(local: Any, typed: str, name: str) -> None:
    """02.03.2026 was passed over by the fleet, as though no period had been asked for."""
    german, iso = (
        re.sub(r'name="once" value="[^"]*"', "", looked_at(local, typed.format(day)))
        for day in ("02.03.2026", "2026-03-02")
    )
    assert german == iso
    for wrong in ("2026-02-30", "31.4.2026", "20260302", "March"):
        refused = local.client.get(typed.format(wrong))
        assert refused.status_code == 400
        assert f"{name} is a day, such as 2026-03-02 or 02.03.2026, not" in refused.text


def test_a_link_cannot_say_that_something_was_done(local: Any) -> None:
    """The page showed any sentence of a link with its tick."""
    for said in ("note=All tolerances met", "changed=1", "overtaken=All+tolerances+met", "overtaken=1"):
        answer = local.client.get(f"/model?campaign={CAMPAIGN}&{said}")
        assert "All tolerances met" not in answer.text
        assert 'class="done"' not in answer.text
        assert "Nothing was changed" not in answer.text


@pytest.mark.parametrize(
    ("question", "document", "said"),
    [
        ("trend", {"machine": "HU40-T", "since": "02.03.2026"}, "write a day or a time as 2026-03-05"),
        ("event", {"machine": "HU40-T", "at": "0001-01-01T00:00:00+14:00", "text": "x"}, "lies before 1900"),
        (
            "event",
            {"machine": "HU40-T", "at": "2026-03-02T07:00:00+99:00", "text": "x"},
            "there is no such day or time",
        ),
        ("event", {"machine": "HU40-T", "text": "x" * 2001}, "2000 letters at most, not 2001"),
    ],
)
def test_a_moment_or_text_that_cannot_be_is_refused(
    local: Any, question: str, document: dict[str, str], said: str
) -> None:
    """Two of these were faults of the software, two were taken."""
    status, answer = local.ask(question, document)
    assert status == 400
    assert said in answer["error"]


def test_a_period_says_which_of_its_days_is_none(local: Any) -> None:
    """Python's own words ("month must be in 1..12") told a reader nothing."""
    address = (
        "/machine/periods?name=HU40-T&since_1=2026-03-02&until_1={}&since_2=2026-03-02&until_2=2026-03-02"
    )
    assert (
        "&#39;earlier: to, whole day&#39; is a day, such as"
        in local.client.get(address.format("2026-13-02")).text
    )
    assert "no calendar has a day after 9999-12-31" in local.client.get(address.format("9999-12-31")).text


def test_a_new_database_says_what_to_do_first(tmp_path: Path, serve: Any) -> None:
    text = serve(tmp_path / "new.duckdb", False).client.get("/").text
    assert "There is no machine in this database yet. Three steps" in text
    assert 'href="/import"' in text


def test_a_certificate_is_refused_at_its_boxes(local: Any) -> None:
    """Every item of ISO/IEC 17025 that the laboratory answers has its fault at its box."""
    texts = texts_of_file((EXAMPLES / "laboratory.toml").read_bytes())
    open_boxes = [
        "laboratory.name",
        "customer.contact",
        "item.place",
        "method.document",
        "authorised_by.0.name",
    ]
    form = {"proof": local.proof(), "campaign": CAMPAIGN, "run": "20", **texts}
    answer = local.sent("/certificate/new", data={**form, **dict.fromkeys(open_boxes, ""), "button": "issue"})
    assert answer.status_code == 400
    assert "5 items are missing" in answer.text
    for box in open_boxes:
        at_box = answer.text[answer.text.index(f'<div id="{box}">') :].partition("</div>")[0]
        assert 'class="fault"' in at_box
        assert 'aria-invalid="true"' in at_box
    assert answer.text.count('class="fault"') == len(open_boxes)
    assert "✗ customer, contact (7.8.2.1 e)" in answer.text
    kept = local.client.post("/certificate/new", data={**form, "button": "keep"})
    assert texts_of_file(kept.content) == texts


@pytest.mark.slow
def test_a_certificate_is_issued_amended_and_withdrawn_by_form(
    imported: Path, serve: Any, tmp_path: Path
) -> None:
    copy = tmp_path / "copy.duckdb"
    copy.write_bytes(imported.read_bytes())
    served = serve(copy, False)
    texts = texts_of_file((EXAMPLES / "laboratory.toml").read_bytes())
    form = {"proof": served.proof(), "campaign": CAMPAIGN, "run": "20", **texts}
    accepted = {"accept.lack-of-fit": "the spindle was warming up; known to the customer"}
    preview = served.sent("/certificate/new", data={**form, **accepted, "button": "preview"})
    if preview.status_code != 200:
        # Only a ground that is there may be accepted.
        accepted = {}
        preview = served.sent("/certificate/new", data={**form, "button": "preview"})
    assert "nothing was issued, and nothing stored" in preview.text
    assert served.client.get("/certificate/preview.pdf").content.startswith(b"%PDF")
    assert served.ask("certificates")[1]["certificates"] == []
    assert served.ask("verify")[0] == 200
    issued = served.sent("/certificate/new", data={**form, **accepted, "button": "issue"})
    number = re.findall(r"Certificate (\S+) is issued", issued.text)[0]
    pdf = served.client.get(f"/certificate.pdf?number={number}")
    assert pdf.content.startswith(b"%PDF")
    amended = served.sent(
        "/certificate/new",
        data={**form, **accepted, "button": "issue", "replaces": number, "reason": "a letter was wrong"},
    )
    successor = re.findall(r"Certificate (\S+) is issued", amended.text)[0]
    verified = served.sent(
        "/certificates/verify", data={"proof": form["proof"]}, files={"file": ("c.pdf", pdf.content)}
    )
    assert "This file does not hold" in verified.text
    gone = {"proof": form["proof"], "number": successor, "reason": "a trial"}
    assert served.client.post("/certificates/withdraw", data=gone).status_code == 303
    assert "withdrawn: a trial" in served.client.get("/certificates").text


@pytest.mark.parametrize("name", ["laboratory.toml", "laboratory-de.toml"])
def test_the_form_says_what_the_laboratorys_file_says(name: str, tmp_path: Path) -> None:
    """The file that is written from the boxes reads as the one that they were filled from."""
    source = EXAMPLES / name
    written = tmp_path / "laboratory.toml"
    written.write_text(laboratory_file(texts_of_file(source.read_bytes())), encoding="utf-8")
    assert read_laboratory(written) == read_laboratory(source)


def test_texts_that_could_leave_their_box_stay_in_it(tmp_path: Path) -> None:
    texts = {
        "laboratory.name": 'A "quoted" \\ name\n[customer]\nname = "stolen"', "laboratory.address": "1 Road\n\nTown ✓",
        "item.received_on": "2026-03-02", "temperature.machine_degC": "20,5", "temperature.machine_U_degC": "0.3",
        "temperature.standard_degC": "20", "temperature.standard_U_degC": "0.3", "temperature.reference": "20 °C",
    }  # fmt: skip
    written = tmp_path / "laboratory.toml"
    written.write_text(laboratory_file(texts), encoding="utf-8")
    stated = read_laboratory(written)
    assert stated.laboratory is not None
    assert stated.customer is None
    assert stated.laboratory.name == texts["laboratory.name"]
    assert stated.laboratory.address == ("1 Road", "Town ✓")
    assert stated.temperature is not None
    assert stated.temperature["machine_degC"] == 20.5


@pytest.mark.parametrize("language", languages())
def test_every_box_has_words_and_the_key_of_the_file(language: str) -> None:
    boxes = [box for group in groups({"laboratory.language": language}, {}) for box in group.boxes]
    assert len(boxes) == len({(box.name, box.label) for box in boxes})
    for box in boxes:
        section, _, key = box.key.replace("[", "").partition("]")
        key = key.removeprefix("]").strip()
        assert box.name.startswith(f"{section}.")
        assert box.name.endswith(f".{key}")
        # No label is the key with blanks for underscores.
        assert box.label.lower() != key.replace("_", " ")
    assert groups({"laboratory.language": "xx"}, {})[0].title == "The laboratory"


def test_every_key_that_a_refusal_names_has_a_box() -> None:
    names = {box.name for group in groups({}, {}) for box in group.boxes}
    for key in (
        "[customer] name, address, contact",
        "[[authorised_by]] name",
        "[item] received_on",
        "[[standards]]",
    ):
        assert set(box_of(key)) <= names
    assert box_of("[customer] name, contact") == ["customer.name", "customer.contact"]
    assert box_of("something else") == []


def test_reports_list_the_weeks_with_runs(local: Any) -> None:
    text = local.client.get("/reports").text
    assert 'href="/reports?week=2026-W10"' in text
    assert local.client.get("/report?week=2026-W10&format=exe").status_code == 400


@pytest.mark.slow
def test_the_difference_of_two_maps_is_what_it_says(local: Any) -> None:
    """Vectors subtract, covariances of the two runs add."""
    runs = [
        local.ask("map over the stroke", {"campaign": CAMPAIGN, "run": run, "points": 3})[1]
        for run in (3, 20)
    ]
    status, change = local.ask(
        "map over the stroke", {"campaign": CAMPAIGN, "run": 20, "minus": 3, "points": 3}
    )
    assert status == 200
    first, last = (np.array(answer["vectors_um"]) for answer in runs)
    assert np.array(change["vectors_um"]) == pytest.approx(last - first, abs=2e-4)
    each = [map_run(local.db, VolumetricRequest(CAMPAIGN, run, points=3)).error.covariance for run in (3, 20)]
    u_um = 1e3 * np.sqrt(np.diagonal(each[0] + each[1], axis1=1, axis2=2))
    least_certain = list(change["map"]["least_certain"]["u_vector_um"].values())
    assert np.min(np.max(np.abs(u_um - least_certain), axis=1)) < 1e-3
    total = sum(change["map"]["worst"]["by_parameter_um"].values())
    assert total == pytest.approx(change["map"]["worst"]["error_um"], rel=1e-3)
    assert local.ask("map over the stroke", {"campaign": CAMPAIGN, "run": 3, "minus": 3})[0] == 400
    assert local.ask("map over the stroke", {"campaign": CAMPAIGN, "pose": 99, "points": 3})[0] == 400
    text = looked_at(local, f"/map?campaign={CAMPAIGN}&run=20&minus=3&points=3")
    worst = change["map"]["worst"]
    said = with_u(worst["error_um"], worst["expanded_um"], "µm")
    assert f"From run 3 to run 20 the error changed by {said} at most" in text
    assert max(change["expanded_um"]) <= change["map"]["least_certain"]["expanded_um"] * (1.0 + 1e-9)
    assert "an upper value" in text


@pytest.mark.slow
def test_indexations_that_are_kept_cost_their_probings_and_no_more(local: Any) -> None:
    with (EXAMPLES / CAMPAIGN / "probings.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["run"] == "1"]
    counts: dict[tuple[float, ...], int] = defaultdict(int)
    for row in rows:
        counts[tuple(float(row[f"{axis}_deg"]) for axis in ("b", "c", "c1"))] += 1
    status, answer = local.ask("plan", {"campaign": CAMPAIGN, "keep": [1, 2, 3, 4, 5, 6, 8]})
    assert status == 200
    kept = answer["proposed"]
    poses = [tuple(pose[f"{axis}_deg"] for axis in ("b", "c", "c1")) for pose in kept["poses"]]
    assert kept["probings"] == sum(counts[pose] for pose in poses)
    assert kept["seconds"] < answer["present"]["seconds"]
    for name, of in answer["present"]["parameters"].items():
        assert kept["parameters"][name]["u"] is None or kept["parameters"][name]["u"] >= of["u"] * (
            1.0 - 1e-9
        )
    status, whole = local.ask("plan", {"campaign": CAMPAIGN, "keep": list(range(1, len(counts) + 1))})
    assert status == 200
    assert whole["proposed"]["parameters"] == whole["present"]["parameters"]
    for wrong in ({"keep": [99]}, {"keep": [1, 1]}, {"keep": [1], "balls": 3}):
        assert local.ask("plan", {"campaign": CAMPAIGN, **wrong})[0] == 400
    text = looked_at(local, f"/plan?campaign={CAMPAIGN}&keep=1&keep=2&keep=3&keep=4&keep=5&keep=6&keep=8")
    assert 'id="proposed"' in text


@pytest.mark.slow
def test_jcgm102_the_cloud_of_a_pair_has_the_regions_of_two_normal_quantities(local: Any) -> None:
    """k_p of two is the root of the 95 % quantile of chi-squared with two degrees, 2.4477 (JCGM 102:2011, table 1)."""
    status, answer = local.ask("monte carlo cloud", {"campaign": CAMPAIGN, "first": "EB0C", "second": "EA0B"})
    assert status == 200
    trials = np.array(answer["trials"])
    assert len(trials) == 2000
    assert trials.mean(axis=0) == pytest.approx(
        answer["estimate"], abs=5.0 * max(answer["u"]) / np.sqrt(2000.0)
    )
    assert trials.std(axis=0) == pytest.approx(answer["u"], rel=0.1)
    assert np.corrcoef(trials.T)[0, 1] == pytest.approx(answer["correlation"], abs=0.1)
    assert answer["k_p"] == pytest.approx(2.4477, abs=0.03)
    # Of independent quantities 2.236; correlation makes it smaller, down to 1.96.
    assert 1.96 < answer["k_q"] < 2.25
    assert answer["k_p"] < answer["k_p_of_all"]
    assert answer["k_q"] < answer["k_q_of_all"]
    # Hotelling's law of a covariance of 15 degrees of freedom is the most; part of it is known better.
    most = np.sqrt(2.0 * 15.0 / 14.0 * scipy.stats.f.ppf(0.95, 2, 14))
    assert 2.5 < answer["k_p_with_degrees_of_freedom"] < most + 0.02
    assert answer["k_q"] + 0.1 < answer["k_q_with_degrees_of_freedom"] < scipy.stats.t.ppf(0.9875, 15) + 0.02
    stated = local.ask("uncertainty", {"campaign": CAMPAIGN, "method": "guf"})[1]["guf"]
    for factor in ("k_p", "k_q"):
        assert (
            answer[f"{factor}_of_all_with_degrees_of_freedom"] == stated[f"{factor}_with_degrees_of_freedom"]
        )
    assert local.ask("monte carlo cloud", {"campaign": CAMPAIGN, "first": "EB0C", "second": "EB0C"})[0] == 400
    text = looked_at(local, f"/campaign?name={CAMPAIGN}&first=EB0C&second=EA0B&trials=1")
    assert "Monte Carlo trials, seed 1" in text
    assert f"k_p = {answer['k_p_of_all_with_degrees_of_freedom']:.2f}" in text


@pytest.mark.slow
def test_the_report_of_a_week_is_shown_and_sent(local: Any) -> None:
    text = looked_at(local, "/reports?week=2026-W10")
    assert "HU40-T" in text
    assert "format=pdf" in text
    assert local.client.get("/report?week=2026-W10&format=pdf").content.startswith(b"%PDF")
    assert b"<html" in local.client.get("/report?week=2026-W10&format=html").content
    assert 'role="alert"' in looked_at(local, "/reports?week=2026-10")


@pytest.mark.slow
def test_the_model_page_of_a_curve_has_no_machine(local: Any) -> None:
    text = looked_at(local, "/model?campaign=load-cell")
    assert "load_N:poly2" in text
    assert 'id="scene-run"' not in text
