"""The Python interface: the same answers as the command line's, as tables with units, refusals that help."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pytest

import monitor as mm
from monitor.cli import main
from monitor.exceptions import CampaignError, DataError, EffectError, InputError, NotFoundError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
HIDDEN = "hidden-spindle-growth"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("api") / "shop.duckdb"
    with mm.open(path, new=True) as db:
        answer = db.add(EXAMPLES / "five-days", EXAMPLES / HIDDEN)
    assert answer.table()["campaign"].tolist() == ["five-days", HIDDEN]
    return path


@pytest.fixture
def db(path: Path) -> Iterator[mm.Database]:
    with mm.open(path) as opened:
        yield opened


def test_machines_campaigns_runs_and_readings_are_tables(db: mm.Database) -> None:
    assert db.machines()["machine"].tolist() == ["HU40-T"]
    assert db.campaigns()["campaign"].tolist() == ["five-days", HIDDEN]
    campaign = db.campaign("five-days")
    assert repr(campaign) == "Campaign('five-days') of HU40-T, method samba"
    runs = campaign.runs()
    assert runs.index.tolist() == list(range(1, 21))
    assert runs.attrs["units"]["ambient_degC"] == "°C"
    readings = campaign.readings()
    # Against the file itself.
    lines = (EXAMPLES / "five-days/probings.csv").read_text("utf-8").splitlines()
    assert len(readings) == len(lines) - 1
    first = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert readings["x_mm"][0] == float(first["x_mm"])
    assert readings.attrs["units"]["b_deg"] == "°"
    assert "mm" in readings.attrs["meanings"]["x_mm"]


def test_parameters_are_those_that_the_command_line_prints(
    db: mm.Database, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = db.campaign("five-days").parameters()
    rows = db.campaign("five-days").parameters(wide=False)
    db.close()
    assert main(["--db", str(path), "identify", "five-days", "--json"]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    for run in runs:
        for name, estimate in run["parameters"].items():
            assert table.loc[run["run"], name] == estimate["value"]
            assert table.loc[run["run"], f"u({name})"] == estimate["u"]
            assert table.attrs["units"][name] == estimate["unit"]
    assert len(rows) == sum(len(run["parameters"]) for run in runs)


@pytest.mark.slow
def test_the_missing_effect_is_named_drawn_and_added(db: mm.Database, tmp_path: Path) -> None:
    campaign = db.campaign(HIDDEN)
    answer = campaign.explain()
    assert answer.missing[0].effect == "EZC1:const@warmup"
    assert answer.table()["effect"].tolist() == ["EZC1:const@warmup"]
    assert answer.to_dict()["missing"][0]["effect"] == "EZC1:const@warmup"
    pictures = answer.plot()
    assert "missing-effects.svg" in pictures.names
    assert {path.name for path in pictures.save(tmp_path / "drawn")} == set(pictures)
    assert campaign.compare()._repr_html_().count("<svg") == 1
    assert "The model lacks EZC1:const@warmup" in repr(answer)
    # One effect has more columns than a notebook is wide: a line each, with its whole sentences.
    assert max(len(line) for line in repr(answer).splitlines()) < 200
    lines = re.findall(r"<tr>.*?</tr>", answer._repr_html_(), re.DOTALL)
    assert {len(re.findall("<t[hd]>", line)) for line in lines} == {2}
    assert answer.table()["remedy"][0] in answer._repr_html_()
    added = campaign.add("EZC1:const@warmup", "warm")
    before, after = (version.heldout_rms_um for version in added.history)
    assert after < before
    assert campaign.explain("warm").missing == ()


def test_several_effects_are_added_in_one_version(db: mm.Database) -> None:
    campaign = db.campaign("five-days")
    version = campaign.add(["EXX:reversal", "EYY:reversal"], "plays").content.model.version
    assert version.effects == ("EXX:reversal", "EYY:reversal")
    with pytest.raises(InputError, match="name an effect to add, or several"):
        campaign.add([])


def test_answers_of_all_kinds_are_tables(db: mm.Database) -> None:
    campaign = db.campaign("five-days")
    u = campaign.uncertainty(method="guf").table()
    assert u.loc["EXX", "unit"] == "µm/m"
    assert (u["expanded"] > u["u"]).all()
    assert u.attrs["correlation"].shape == (13, 13)
    assert "slope_per_year" in db.trend("HU40-T").table().columns
    assert len(db.fleet(top=0).table()) == 13
    assert "u_pooled" in campaign.statistics().table().columns
    assert campaign.compare().table().index.size > 0
    assert len(db.models().table()) > 0
    assert len(db.ask("plan", campaign="five-days").to_dict()) > 0


def test_an_answer_is_shown_with_its_numbers(db: mm.Database) -> None:
    """In a shell every column that has something; the table itself keeps its columns."""
    trend = db.trend("HU40-T")
    text, columns = repr(trend), list(trend.table().columns)
    assert "..." not in text
    assert "latest_u" in text
    assert columns[-1].startswith("why")
    empty = [name for name in columns if trend.table()[name].isna().all()]
    assert empty
    assert not any(f" {name} " in text for name in empty)


@pytest.mark.slow
def test_an_answer_without_rows_is_its_sentence(db: mm.Database) -> None:
    nothing = db.campaign("five-days").explain()
    assert nothing.missing == ()
    assert "DataFrame" not in repr(nothing)
    assert "EB0C stepped by 15.2 µrad at run 13. Nothing else is missing that this plan can see." in repr(
        nothing
    )
    page = nothing._repr_html_()
    assert "<table" not in page
    assert "<svg" in page


def test_sql_reads_and_never_writes(db: mm.Database, tmp_path: Path) -> None:
    days = db.sql(
        "SELECT day, count(*) AS n FROM v_runs WHERE campaign = 'five-days' GROUP BY day ORDER BY day"
    )
    assert days["n"].tolist() == [4, 4, 4, 4, 4]
    file = tmp_path / "x.csv"
    for query in (
        "DROP TABLE run", "DELETE FROM run", "CREATE TABLE t (i INT)", "SET threads = 1", "SELECT 1; SELECT 2", "",
        f"COPY (SELECT 1) TO '{file}'", f"ATTACH '{tmp_path / 'b.duckdb'}' AS b",
        f"EXPLAIN ANALYZE COPY (SELECT 1) TO '{file}'", "EXPLAIN ANALYZE DELETE FROM run", "INSTALL httpfs",
        "PRAGMA force_checkpoint", "EXPORT DATABASE 'x'", "BEGIN", "SELEC 1",
    ):  # fmt: skip
        with pytest.raises(
            InputError, match=r"a query may only read|type one query|no SQL that DuckDB understands"
        ):
            db.sql(query)
    with pytest.raises(InputError, match=r"the query cannot be answered: .*v_nothing"):
        db.sql("SELECT * FROM v_nothing")
    assert not file.exists()
    # Moments with a zone: DuckDB's Python would ask for a library that is not installed.
    moments = db.sql(
        "SELECT t AS moment, n FROM (VALUES (TIMESTAMPTZ '2026-03-01 12:00:00+02', 2),"
        " (TIMESTAMPTZ '2026-03-01 09:30:00+00', 1)) AS v(t, n) ORDER BY n -- the later last"
    )
    assert [moment.to_pydatetime() for moment in moments["moment"]] == [
        datetime(2026, 3, 1, hour, minute, tzinfo=UTC) for hour, minute in ((9, 30), (10, 0))
    ]
    assert len(db.sql("SELECT now()")) == 1
    with pytest.raises(InputError, match=r"the column l holds moments with a time zone inside a TIMESTAMP"):
        db.sql("SELECT [now()] AS l")
    # The connection still writes after a query that failed.
    assert len(db.sql("SELECT * FROM v_runs", limit=3)) == 3
    assert (
        db.ask("event", machine="HU40-T", text="looked at", at=datetime(2026, 3, 4, tzinfo=UTC)).to_dict()
        is not None
    )


def test_wrong_names_are_answered_with_the_right_ones(db: mm.Database, tmp_path: Path) -> None:
    with pytest.raises(
        NotFoundError, match=r"^there is no campaign 'five-day'; did you mean 'five-days'\? there are "
    ):
        db.campaign("five-day")
    with pytest.raises(
        InputError, match=r"^there is no option 'reliabilty'; did you mean 'reliability'\? there are "
    ):
        db.trend("HU40-T", reliabilty=0.9)
    with pytest.raises(
        InputError, match=r"^there is no question 'trends'; did you mean 'trend'\? there are add effect, "
    ):
        db.ask("trends")
    with pytest.raises(NotFoundError, match=r"open\('.*none.duckdb', new=True\) makes one$"):
        mm.open(tmp_path / "none.duckdb")
    with pytest.raises(AttributeError, match=r"ExplainAnswer has no 'effects'; it has "):
        _ = db.campaign(HIDDEN).explain().effects
    with pytest.raises(AttributeError, match=r"module 'monitor' has no attribute 'opem'; it has Answer, "):
        _ = mm.opem  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=r"^there is no option 'peak'; did you mean 'peak_um'\? there are "):
        mm.simulate(tmp_path / "rehearsal", effect="EXX:reversal", peak=8.0)
    # Options of the command line are arguments here.
    with pytest.raises(
        InputError, match=r"^p 1.5: a coverage probability lies between 0.5 and 0.9999; 0.95 is usual$"
    ):
        db.campaign("five-days").uncertainty(p=1.5)
    with pytest.raises(InputError, match=r"^holds_for week: choose run, day or campaign$"):
        db.campaign("five-days").uncertainty(holds_for="week")
    with pytest.raises(InputError, match=r"^peak_um 8 needs effect, the effect that has it$"):
        mm.simulate(tmp_path / "rehearsal", peak_um=8.0)
    assert set(mm.__all__) <= set(dir(mm))
    with pytest.raises(CampaignError, match=r"campaign.toml: the file is missing"):
        mm.read(tmp_path)
    assert mm.read(EXAMPLES / "five-days").name == "five-days"


def test_simulate_writes_a_folder_that_is_read(tmp_path: Path) -> None:
    answer = mm.simulate(tmp_path / "rehearsal", effect="EXX:reversal", peak_um=8.0, seed=3)
    assert answer.runs == 20
    assert mm.read(tmp_path / "rehearsal").name == "rehearsal"


@pytest.mark.parametrize(
    ("topology", "errors", "expected"),
    [
        ("w C B X b Z Y (C1) t", {"EC0Y": 20.0, "EXX:poly1": 30.0}, {"EC0Y": 20.0, "EXX": 30.0, "EA0B": 0.0}),
        ("w C A Y b X Z (C1) t", {"EC0A": 12.0}, {"EC0A": 12.0, "EB0A": 0.0, "EXX": 0.0}),
        ("w Y b X Z C B (C1) t", {"EA0B": -5.0, "EC0X": 40.0}, {"EA0B": -5.0, "EC0X": 40.0, "EA0C": 0.0}),
    ],
)
def test_errors_of_a_simulated_machine_are_identified(
    topology: str, errors: dict[str, float], expected: dict[str, float], tmp_path: Path
) -> None:
    """Within 4 standard uncertainties of the mean of 12 runs, and for gains that of the bar (3.9 µm/m), drawn once."""
    made = mm.simulate(tmp_path / "made", topology, errors=errors, days=3, seed=5)
    assert made.runs == 12
    with mm.open(tmp_path / "s.duckdb", new=True) as db:
        db.add(made.folder)
        table = db.campaign("made").parameters()
        for name, size in expected.items():
            u = np.hypot(table[name].std() / np.sqrt(12.0), 3.9 if name == "EXX" else 0.0)
            assert abs(table[name].mean() - size) < 4.0 * u + 1e-9, name


def test_campaigns_like_one_of_yours_are_written(tmp_path: Path) -> None:
    answer = mm.simulate(
        tmp_path / "shop", like=EXAMPLES / "tilting-table", machines=("M1", "M2"), start="2026-01-12", months=2,
        drifts=[("EY0A", 0.5, "M2")], events=[("2026-02-01", "EB0C", 9.0)], effect="EXX:reversal", peak_um=6.0,
        steady=True,
    )  # fmt: skip
    assert [Path(folder).name for folder in answer.folders] == [
        "M1-2026-01", "M1-2026-02", "M2-2026-01", "M2-2026-02"
    ]  # fmt: skip
    for wrong, said in (
        ({"machines": "M1"}, 'like needs start, such as start="2026-01-12"'),
        ({"start": "2026-01-12"}, r"like needs machines, such as machines=\(\"M1\", \"M2\"\)"),
        ({"machines": "M1", "start": "12 May"}, "start='12 May': write a day as 2026-03-05"),
        ({"machines": "M1", "start": 2026}, "start is a day, such as '2026-03-05', not 2026"),
        (
            {"machines": "M1", "start": "2026-01-12", "month": 3},
            "there is no option 'month'; did you mean 'months'",
        ),
        ({"machines": "M1", "start": "2026-01-12", "months": 0}, "months 0: 1 or more"),
        (
            {"machines": ("M1", "m1"), "start": "2026-01-12"},
            "that differ in capital letters alone are one folder",
        ),
        ({"topology": "w b X t"}, "leave out topology and errors"),
    ):
        with pytest.raises(InputError, match=said):
            mm.simulate(tmp_path / "x", like=EXAMPLES / "tilting-table", **wrong)
    assert not (tmp_path / "x").exists()


def test_a_simulated_machine_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="'w X b Y Z t' has no rotary axis"):
        mm.simulate(tmp_path / "a", "w X b Y Z t")
    with pytest.raises(InputError, match="'EBB:harmonic2' has 2 coefficients, not 1"):
        mm.simulate(tmp_path / "a", "w C B X b Z Y (C1) t", errors={"EBB:harmonic2": 3.0})
    with pytest.raises(
        InputError, match="the method 'tracker' has no plan of its own for any machine; samba has"
    ):
        mm.simulate(tmp_path / "a", "w C B X b Z Y (C1) t", method="tracker")
    with pytest.raises(InputError, match="days = 0: a campaign has 1 to 366 days"):
        mm.simulate(tmp_path / "a", "w C B X b Z Y (C1) t", days=0)
    for size, said in (
        (math.nan, r"^errors\['EC0B'\] is a number or several, such as 20\.0 or \[0\.0, 100\.0\], not nan$"),
        (-math.inf, r"^errors\['EC0B'\] is a number or several, .* not -inf$"),
        (1e6, r"EC0B = 1e\+06: an error is a number of at most 100000 µm"),
    ):
        with pytest.raises(InputError, match=said):
            mm.simulate(tmp_path / "a", "w C B X b Z Y (C1) t", errors={"EC0B": size})
    with pytest.raises(InputError, match="errors needs topology"):
        mm.simulate(tmp_path / "a", errors={"EC0B": 1.0})
    assert not (tmp_path / "a").exists()


def test_the_kinematic_model_alone_agrees_with_a_chain_multiplied_by_hand() -> None:
    """w B X b Z t with the table's squareness and the gain of X, by rotation matrices written here."""
    machine = mm.Machine("w B X b Z Y t")
    x, b, tool, target = 120.0, np.deg2rad(30.0), np.array([0.0, 0.0, -150.0]), np.array([10.0, 20.0, 30.0])
    tilt, gain = 40e-6, 15e-6

    def turn_x(angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])

    def turn_y(angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])

    def vector(tilted: float, stretched: float) -> np.ndarray:
        # The bed carries X (with its gain), X carries B (tilted about X), B carries the work. The table moves against
        # the sense of the reading, so that the tool moves with it as seen from the work.
        origin = np.array([-x * (1.0 + stretched), 0.0, 0.0])
        work = turn_x(tilted) @ turn_y(-b)
        return work.T @ (tool - origin) - target

    deviation = machine.deviation(
        {"EA0B": 40.0, "EXX:poly1": 15.0}, X=x, B=30.0, tool=tuple(tool), target=tuple(target)
    )
    by_hand = (vector(tilt, gain) - vector(0.0, 0.0)) * 1e3
    np.testing.assert_allclose(deviation[0], by_hand, atol=1e-6)
    np.testing.assert_allclose(
        machine.vector(X=x, B=30.0, tool=tuple(tool))[0], vector(0, 0) + target, atol=1e-12
    )


@pytest.mark.parametrize(
    ("size", "x", "name"),
    [
        (20.0, "left", "X"),
        ("twenty", 1.0, r"errors\['EC0Y'\]"),
        (20.0, [[1.0, 2.0], [3.0]], "X"),
        (math.nan, 1.0, r"errors\['EC0Y'\]"),
        (20.0, math.inf, "X"),
        (20.0, [[1.0]], "X"),
    ],
)
def test_what_is_no_number_is_named(size: float, x: float, name: str) -> None:
    with pytest.raises(InputError, match=f"^{name} is a number or several"):
        mm.Machine("w C A Y b X Z t").deviation({"EC0Y": size}, X=x)


def test_the_kinematic_model_refuses_what_the_chain_does_not_have() -> None:
    machine = mm.Machine("w C B X b Z Y (C1) t")
    assert machine.deviation({"EC0B": 20.0}, X=[0.0, 100.0], B=30.0).shape == (2, 3)
    with pytest.raises(InputError, match=r"^there is no axis A in "):
        machine.vector(A=[0.0])
    with pytest.raises(EffectError, match=r"'EC0A' is no geometric error"):
        machine.deviation({"EC0A": 1.0}, X=0.0)
    with pytest.raises(
        InputError, match=r"^every axis needs the same number of readings; there are X 2, B 3$"
    ):
        machine.vector(X=[0.0, 1.0], B=[0.0, 1.0, 2.0])
    with pytest.raises(InputError, match=r"^'EXX:poly1' has 1 coefficients, not 2$"):
        machine.deviation({"EXX:poly1": [1.0, 2.0]}, X=0.0)


def test_importing_the_package_loads_no_library() -> None:
    code = "import monitor, sys; print(sorted({'numpy', 'duckdb', 'pandas'} & set(sys.modules)))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout == "[]\n"


@pytest.mark.parametrize(
    "since", ["2012-03-05", "2012-03-05T07:00:00+00:00", date(2012, 3, 5), datetime(2012, 3, 5)]
)
def test_a_moment_is_a_text_a_day_or_a_time(db: mm.Database, since: object) -> None:
    """A text ended in a TypeError, a time without an offset too."""
    assert db.trend("HU40-T", since=since).machine == "HU40-T"


def test_what_is_no_moment_is_refused(db: mm.Database) -> None:
    for since in ("yesterday", 5):
        with pytest.raises(InputError, match=r"since.*a day or a time"):
            db.trend("HU40-T", since=since)
