"""One file says what would be typed again and again; what is typed stands above it. Quiet verbs and completion."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from monitor.cli.configuration import configuration
from monitor.cli.moments import moment
from monitor.cli.parser import VERBS


@pytest.fixture(autouse=True)
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "no configuration"))
    monkeypatch.delenv("MONITOR_CONFIG", raising=False)


def configured(text: str, file: str = "monitor.toml") -> Path:
    Path(file).parent.mkdir(parents=True, exist_ok=True)
    Path(file).write_text(text, encoding="utf-8")
    return Path(file)


def test_init_writes_a_file_that_says_nothing_yet(typed: Any) -> None:
    assert typed("config", "init").status == 0
    shown = typed("config", "check", "--json").document
    assert Path(shown.pop("file")) == Path("monitor.toml").absolute()
    assert set(shown.values()) == {None}
    assert "is there already and is not written over" in typed("config", "init").err
    live = Path("monitor.toml").read_text(encoding="utf-8").replace("# language", "language")
    configured(live)
    assert typed("config", "show", "--json").document["language"] == "en"


def test_the_database_is_the_typed_the_environments_the_configurations(
    typed: Any, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copyfile(db, "shop.duckdb")
    configured('database = "../shop.duckdb"\n', "place/monitor.toml")
    monkeypatch.setenv("MONITOR_CONFIG", "place/monitor.toml")
    assert len(typed("campaigns", "--json").document["campaigns"]) == 3
    monkeypatch.setenv("MONITOR_DB", "other.duckdb")
    assert "there is no database other.duckdb" in typed("campaigns").err
    assert "there is no database typed.duckdb" in typed("--db", "typed.duckdb", "campaigns").err


def test_the_configuration_of_another_user_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Under the home of somebody else, as `sudo -u` leaves it: a fault of the software until 2026-11-26."""
    configured('language = "de"\n', str(tmp_path / "home" / "monitor" / "monitor.toml"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    assert configuration().language == "de"

    def forbidden(path: object, *_: object, **__: object) -> os.stat_result:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    with monkeypatch.context() as as_another:
        as_another.setattr(os, "stat", forbidden)
        assert configuration().language is None
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setattr("pwd.getpwuid", lambda number: {}[number])
    assert configuration().language is None


def test_laboratory_language_and_time_zone_are_used(typed: Any, db: Path, laboratory: Path) -> None:
    configured(f'laboratory = "{laboratory}"\nlanguage = "de"\ntime_zone = "Asia/Tokyo"\n')
    assert typed("certificate", "template", "--json").document["language"] == "de"
    assert moment("2026-03-05 07:00", "--at").isoformat() == "2026-03-05T07:00:00+09:00"
    issued = typed("certificate", "issue", "cold-cold", "--run", 3, "--draft", db=db)
    assert (issued.status, issued.err) == (0, "")


def test_without_a_laboratory_the_certificate_says_what_would_be_right(typed: Any, db: Path) -> None:
    answer = typed("certificate", "issue", "cold-cold", "--run", 3, db=db)
    assert answer.status == 2
    assert "--laboratory FILE says what the laboratory states; `monitor certificate template`" in answer.err
    assert "--mail FILE: name a file, or write one as mail" in typed("report", "--mail", db=db).err


def test_every_fault_of_the_file_is_told_at_once(typed: Any, db: Path) -> None:
    configured(
        'databse = "x"\nlanguage = "fr"\ntime_zone = "Mars/Olympus"\nmail = 3\nlaboratory = "no.toml"\n'
    )
    answer = typed("config", "check")
    assert (answer.status, answer.out) == (2, "")
    for words in (
        "there is no key databse; did you mean 'database'? there are database, laboratory, language, mail, time_zone",
        "language = 'fr': write de or en",
        "time_zone = 'Mars/Olympus': there is no such time zone",
        "mail is a text in quotes",
        "laboratory = 'no.toml': there is no file",
    ):
        assert words in answer.err
    assert "was refused" in typed("campaigns").err
    # What is typed needs no configuration.
    assert typed("campaigns", db=db).status == 0


def test_quiet_says_nothing_but_what_went_wrong(typed: Any, db: Path) -> None:
    answer = typed("campaigns", "--quiet", db=db)
    assert (answer.status, answer.out, answer.err) == (0, "", "")
    assert "there is no campaign 'nope'" in typed("runs", "nope", "--quiet", db=db).err
    assert "--quiet says nothing and --json says all" in typed("campaigns", "--quiet", "--json", db=db).err


def test_the_shell_completes_every_verb(typed: Any) -> None:
    script = typed("completion", "bash").out
    assert all(f"_shtab_monitor_{verb}_" in script for verb in VERBS)
    Path("script.sh").write_text(script, encoding="utf-8")
    bash = shutil.which("bash")
    if bash is not None:
        asked = (
            "source script.sh; COMP_WORDS=(monitor ex); COMP_CWORD=1; _shtab_monitor; echo ${COMPREPLY[@]}"
        )
        told = subprocess.run([bash, "-c", asked], capture_output=True, text=True, check=False)
        assert {"explain", "export"} <= set(told.stdout.split())
    assert "complete -c monitor" in typed("completion", "fish").out
    assert "#compdef monitor" in typed("completion", "zsh").out


@pytest.mark.slow
def test_tolerances_of_the_machine_type_hold_where_the_campaign_states_none(typed: Any, db: Path) -> None:
    assert "machine type" not in typed("trend", "HU40-T", db=db).out
    configured('[tolerances."hu40-t"]\nEB0C = 0.001\n[tolerances."*"]\nEA0B = 5\n')
    trend = typed("trend", "HU40-T", "--parameter", "EB0C", "--json", db=db).document
    assert any("limits are those of the machine type 'hu40-t'" in note for note in trend["notes"])
    fleet = typed("fleet", "--json", db=db).document
    assert fleet["tolerances_of_type"] == {"HU40-T": "hu40-t"}
    limits = {row["parameter"]: row["limit"] for row in fleet["table"]}
    assert (limits["EB0C"], limits["EA0B"]) == (0.001, None)
    assert "limits of HU40-T are those of the machine type 'hu40-t'" in typed("fleet", db=db).out


@pytest.mark.slow
def test_limits_of_parameters_that_the_machine_has_not_are_said_to_hold_nothing(typed: Any, db: Path) -> None:
    configured('[tolerances."*"]\nEB0C9 = 5\n')
    notes = typed("trend", "HU40-T", "--json", db=db).document["notes"]
    (note,) = (note for note in notes if "machine type" in note)
    assert note.startswith("no limit holds: the machine type '*' in the configuration limits EB0C9, of which")
    assert "did you mean 'EB0C'?" in note


@pytest.mark.slow
def test_a_limit_of_an_axis_that_the_machine_has_not_is_said_beside_those_that_hold(
    typed: Any, db: Path
) -> None:
    configured('[tolerances."HU40-T"]\nEA0B = 5\nEB0C9 = 5\n')
    assert "EB0C9 of the machine type 'HU40-T' in the configuration is of no parameter" in (
        said := typed("trend", "HU40-T", db=db).out
    )
    assert "did you mean 'EB0C'?" in said
    assert "HU40-T: the limit EB0C9 of the machine type 'HU40-T' in the" in typed("fleet", db=db).out
    configured('[tolerances."HU40-T"]\nEA0B = 5\nEXX = 5\n')
    assert "of no parameter" not in typed("trend", "HU40-T", db=db).out
    assert "limits_without_parameter" not in typed("fleet", "--json", db=db).document


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tolerances = 5", "tolerances are tables, one a machine type"),
        ("[tolerances.x]", "states no limit"),
        ("[tolerances.x]\nEC0Y = -1", "EC0Y = -1: a number above 0"),
        ("[tolerances.x]\nEC0Y = true", "EC0Y = True: a number above 0"),
        ("[tolerances.x]\nEC0Y = inf", "EC0Y = inf: a number above 0"),
        ("[tolerances.x]\nsquareness = 1", "squareness: no name of a term"),
        ('[tolerances."*"]\nEZ0a = 3', "EZ0a: axes are named by capital letters; did you mean EZ0A?"),
        ("[tolerances.x]\nECOY = 3", "ECOY: this has the letter O where a zero stands; did you mean 'EC0Y'?"),
        ("[tolerance.x]\nEC0Y = 1", "did you mean 'tolerances'?"),
        (
            '[tolerances.x]\n"EXX:reversl" = 5',
            "EXX:reversl: there is no shape 'reversl'; did you mean 'reversal'?",
        ),
        ('[tolerances.x]\n"EXX:lag@warmupp" = 5', "no driver '@warmupp'; did you mean 'warmup'?"),
        ('[tolerances.x]\n"size:poly1" = 5', "is no geometric error"),
    ],
)
def test_faults_of_tolerances_are_named(typed: Any, text: str, message: str) -> None:
    configured(text)
    answer = typed("config", "check")
    assert (answer.status, answer.out) == (2, "")
    assert message in answer.err


@pytest.mark.parametrize("term", ["EXOP", '"EXOT:reversal"', "ECO1"])
def test_an_axis_whose_name_begins_with_the_letter_o_may_have_limits(typed: Any, term: str) -> None:
    configured(f"[tolerances.x]\n{term} = 5")
    assert typed("config", "check").status == 0


def test_every_wrong_limit_of_every_table_is_named(typed: Any) -> None:
    """The first of a table alone was."""
    configured(
        '[tolerances.a]\nEC0Y = -1\nsquareness = 1\nEB0C = "x"\n[tolerances.b]\n[tolerances.c]\nEXX = 0\n'
    )
    err = typed("config", "check").err
    for words in (
        '[tolerances."a"] EC0Y = -1: a number above 0',
        '[tolerances."a"] squareness: no name of a term',
        "[tolerances.\"a\"] EB0C = 'x': a number above 0",
        '[tolerances."b"] states no limit',
        '[tolerances."c"] EXX = 0: a number above 0',
    ):
        assert words in err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[tolerances.a]\nEC0Y = 20,0 # from the control\nEB0C = 1.5\nEXX = -3,25\nEYY = 4,5",
            "line 2: 20,0 has a decimal comma, and TOML has decimal points: write 20.0; so have lines 4, 5",
        ),
        (
            "[tolerances.a]\nEC0Y = 20,0\n",
            "line 2: 20,0 has a decimal comma, and TOML has decimal points: write 20.0\n",
        ),
        ("[tolerances.a]\nEC0Y = twenty", "line 2: this is not TOML at character 8: Invalid value"),
        ("[tolerances.a]\nEC0Y = [1", "line 2: this is not TOML: Unclosed array"),
    ],
)
def test_what_is_no_toml_is_said_with_its_line(typed: Any, text: str, message: str) -> None:
    configured(text)
    answer = typed("config", "check")
    assert answer.status == 2
    assert message in answer.err


def test_one_machine_type_in_two_spellings_is_refused(typed: Any) -> None:
    """The later one counted, and with it the verdict."""
    configured('[tolerances."MILL"]\nEX0A = 5.5\n[tolerances."mill"]\nEX0A = 70.5\n')
    answer = typed("config", "check")
    assert answer.status == 2
    assert '[tolerances."MILL"] and [tolerances."mill"] are one type; write one of them' in answer.err


def test_a_machine_type_may_limit_an_effect(typed: Any) -> None:
    # Of machines with any axes: a second X, a joint of a robot, a pitch that looks like a coefficient.
    names = (
        "EXX:reversal",
        "EXX1:windup40mm",
        "EBB:harmonic2.cos",
        "ECJ1:harmonic1.cos",
        "EXX:cyclic2.5mm.cos",
    )
    configured('[tolerances."*"]\n' + "".join(f'"{name}" = 5.0\n' for name in names))
    assert typed("config", "check").status == 0


def test_an_empty_file_is_no_database_for_a_verb_that_reads(typed: Any) -> None:
    Path("full.duckdb").write_bytes(b"")
    answer = typed("--db", "full.duckdb", "campaigns")
    assert (answer.status, answer.out) == (2, "")
    assert "full.duckdb is an empty file, as a full disk leaves one" in answer.err
    assert Path("full.duckdb").stat().st_size == 0


@pytest.mark.parametrize("name", ["x.csv", "md:shop", "x.sqlite", ":memory:"])
def test_a_name_that_is_no_database_is_refused_by_check(typed: Any, name: str) -> None:
    """It passed here, and every verb refused it."""
    configured(f'database = "{name}"')
    assert typed("config", "check").status == 2
    said = typed("config", "check").err
    assert f"database = '{name}': " in said
    assert "name a file such as" in said or "name one, for example" in said


def test_a_file_in_latin_1_is_told_with_its_line(typed: Any) -> None:
    Path("monitor.toml").write_bytes('# one\nmail = "M\xfcller.toml"\n'.encode("latin-1"))
    assert (
        "monitor.toml, line 2: byte 0xfc is not UTF-8; save the file as UTF-8 text"
        in typed("config", "check").err
    )
