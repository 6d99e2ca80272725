"""What people read: numbers with their uncertainty's digits, tables that are never cut, plain text on pipes."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from monitor.cli import output

ANSI = "\x1b"


@pytest.mark.parametrize(
    ("value", "u", "shown"),
    [
        (3.14159, 2.0, "3.1"),
        (-97.2694, 0.28, "-97.27"),
        (12.3, 0.0996, "12.30"),
        (12.3, 0.0994, "12.300"),
        (1234.5, 123.0, "1234"),
        (5.0, 9.96, "5"),
        (5.0, None, "5"),
        (5.0, float("inf"), "5"),
        (5.0, 0.0, "5"),
        (None, 1.0, "-"),
    ],
)
def test_gum_7_2_6_value_to_the_place_of_the_second_digit(
    value: float | None, u: float | None, shown: str
) -> None:
    assert output.rounded(value, u) == shown


@pytest.mark.parametrize(
    ("u", "shown"),
    [
        (2.0, "2.0"),
        (0.7, "0.70"),
        (0.03, "0.030"),
        (2.049, "2.0"),
        (0.996, "1.0"),
        (9.96, "10"),
        (25.4, "25"),
        (None, "-"),
    ],
)
def test_gum_7_2_6_uncertainty_with_two_digits(u: float | None, shown: str) -> None:
    assert output.two_digits(u) == shown


@pytest.mark.parametrize(
    ("p", "shown"), [(0.5, "0.5000"), (9.9e-5, "< 0.0001"), (0.0, "< 0.0001"), (None, "-")]
)
def test_probabilities(p: float | None, shown: str) -> None:
    assert output.probability(p) == shown


def test_a_listing_shows_moments_to_the_second_and_every_kind_of_value(
    capsys: pytest.CaptureFixture[str],
) -> None:
    row = {
        "at": "2026-03-02T13:37:06.421766Z",
        "yes": True,
        "bar": 304.98923,
        "runs": [1, 2],
        "of": {"a": 1.5},
        "no": None,
    }
    output.listing([row], "nothing")
    shown = capsys.readouterr().out.splitlines()[1]
    assert re.split("  +", shown) == ["2026-03-02 13:37:06Z", "yes", "304.98923", "1, 2", "a 1.5"]
    output.listing([], "nothing")
    assert capsys.readouterr().out == "nothing\n"


VERBS = [
    ["campaigns"], ["runs", "cold-cold"], ["identify", "five-days"], ["identify", "cold-cold"], ["stats", "five-days"],
    ["uncertainty", "five-days", "--method", "guf"], ["compare", "hidden-reversal-x"], ["model", "list"],
    ["model", "show", "samba"],
    ["effects"], ["audit"], ["verify"], ["event", "HU40-T"], ["certificate", "show"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", VERBS, ids=" ".join)
def test_tables_and_sentences_are_plain_lines_without_trailing_blanks(
    typed: Any, filled: Path, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = typed(*arguments, db=filled)
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.endswith("\n")
    assert ANSI not in answer.out
    for line in answer.out.splitlines():
        assert line == line.rstrip()
    if arguments[0] not in ("audit", "identify", "verify"):
        # What the environment says of windows and colours changes nothing on a pipe.
        for name, value in (
            ("COLUMNS", "40"),
            ("FORCE_COLOR", "1"),
            ("TERM", "xterm-256color"),
            ("LINES", "5"),
        ):
            monkeypatch.setenv(name, value)
        assert typed(*arguments, db=filled).out == answer.out


def test_identify_table_for_people(typed: Any, filled: Path) -> None:
    lines = typed("identify", "five-days", db=filled).out.splitlines()
    assert lines[0] == "five-days, model samba (the last 6 of 20 runs; --json has all)"
    assert lines[1].split() == [
        "parameter",
        "unit",
        "relative",
        "to",
        *(word for run in range(15, 21) for word in ("run", str(run))),
        "u",
    ]
    assert len(lines) == 2 + 13 + 1
    for line in lines[2:15]:
        assert re.fullmatch(r"E\w+ +µ\S+ +(machine|axis \w+( itself)?)( +-?\d+\.\d+){6} +\d+\.\d+", line)
        values = line.split()[-7:]
        # Every value ends at the place of the second digit of its uncertainty.
        assert {len(value.partition(".")[2]) for value in values} == {len(values[-1].partition(".")[2])}


def test_identify_says_once_why_there_is_no_number(typed: Any, filled: Path) -> None:
    out = typed("identify", "cold-cold", db=filled).out
    assert out.count("no number: with this plan EX0C1 cannot be told apart") == 1
    assert not re.search(r"^E[XY]0C1 ", out, re.MULTILINE)


def test_stats_names_the_step_of_day_4(typed: Any, filled: Path) -> None:
    out = typed("stats", "five-days", db=filled).out
    assert out.startswith("five-days, runs by day (1: 4, 2: 4, 3: 4, 4: 4, 5: 4)\n")
    assert re.search(r"^EB0C +µrad +axis B +28\.2 +7\.7 +1\.3 .*< 0\.0001", out, re.MULTILINE)
    assert re.search(r"^the groups differ in .*EB0C", out, re.MULTILINE)


def test_uncertainty_says_where_the_covariance_is_from_and_what_k_2_would_hold(
    typed: Any, filled: Path
) -> None:
    out = typed("uncertainty", "five-days", "--run", 20, "--method", "guf", db=filled).out
    assert "readings: repeated runs, pooled by day, 15 degrees of freedom\n" in out
    assert "all 13 together with p = 0.95" in out
    assert re.search(r"k = 2 each would hold all 13 with only \d\d %", out)


def test_effects_can_be_searched_line_by_line(typed: Any) -> None:
    out = typed("effects", db=None).out.splitlines()
    assert len(out) == 2 + len(typed("effects", "--json").document["effects"])
    assert any(line.startswith("EXX:reversal ") and "X reverses" in line for line in out)
    assert "no effect says 'zzz'; try another word" in typed("effects", "zzz").out
    assert "no effect says 'backlsh'; did you mean 'backlash'? Else try" in typed("effects", "backlsh").out


# On a terminal and on pipes, as processes of their own.


@pytest.fixture
def terminal(environment: dict[str, str], tmp_path: Path) -> Callable[..., str]:
    """All that a verb writes to a terminal of so many columns."""

    def run(*arguments: object, columns: int = 80) -> str:
        leader, follower = pty.openpty()
        own = {**environment, "TERM": "xterm-256color", "COLUMNS": str(columns)}
        with subprocess.Popen(
            [sys.executable, "-m", "monitor", *(str(one) for one in arguments)],
            stdin=follower, stdout=follower, stderr=follower, env=own, cwd=tmp_path, close_fds=True,
        ) as process:  # fmt: skip
            os.close(follower)
            seen = b""
            # The last read of a terminal whose other end has gone fails with EIO.
            with contextlib.suppress(OSError):
                while part := os.read(leader, 65536):
                    seen += part
            process.wait(250)
        os.close(leader)
        return seen.decode()

    return run


def without_codes(text: str) -> str:
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text)


def test_a_terminal_gets_a_sign_of_life_that_goes_away(terminal: Any, filled: Path) -> None:
    seen = terminal("--db", filled, "compare", "five-days")
    assert "comparing" in seen
    assert "\x1b[1A" in seen or "\x1b[2K" in seen
    assert "by axis" in seen


@pytest.mark.slow
def test_a_monte_carlo_on_a_terminal_shows_how_far_it_is(terminal: Any, filled: Path) -> None:
    asked = ("uncertainty", "five-days", "--run", 20, "--method", "mcm", "--digits", 1)
    seen = without_codes(terminal("--db", filled, *asked))
    # A bar, the share, the time gone and the time left.
    shares = [
        int(share) for share in re.findall(r"propagating .* (\d+)% \d:\d\d:\d\d [-\d]:[-\d]+:[-\d]+", seen)
    ]
    assert shares
    assert shares == sorted(shares)
    assert "Monte Carlo" in seen


@pytest.mark.slow
def test_the_bar_of_what_is_told_behind_each_piece_is_full_at_the_end(terminal: Any, filled: Path) -> None:
    seen = without_codes(terminal("--db", filled, "identify", columns=120))
    counted = [
        (int(done), int(all_of))
        for done, all_of in re.findall(r"identifying, \S+ done .* (\d+)/(\d+) ", seen)
    ]
    assert counted
    assert counted[-1][0] == counted[-1][1]


def test_a_narrow_terminal_breaks_words_and_no_number(terminal: Any, filled: Path) -> None:
    shown = without_codes(terminal("--db", filled, "stats", "five-days", columns=40))
    row = r"E\w+ +µ\S+ +(?:machine|axis \w)(?: itself)? +-?[\d.]+ +[\d.]+ +[\d.]+ +0\.\d{4} +(?:0\.\d{4}|< 0\.0001)\s"
    assert len(re.findall(row, shown)) == 13
    worm = without_codes(terminal("effects", "worm", columns=70))
    for line in worm.splitlines():
        assert len(line.rstrip()) <= 70
    assert "EBB:harmonic1 " in worm


def test_pipes_get_no_progress(started: Any, filled: Path) -> None:
    process = started("--db", filled, "compare", "five-days", env={"FORCE_COLOR": "1", "TERM": "xterm"})
    out, err = process.communicate(timeout=250)
    assert (process.returncode, err) == (0, "")
    assert ANSI not in out


def test_json_goes_through_a_pipe_and_jq_alike(
    started: Any, environment: dict[str, str], filled: Path
) -> None:
    process = started("--db", filled, "runs", "five-days", "--json")
    count = "import json, sys; print(len(json.load(sys.stdin)['runs']))"
    found = subprocess.run(
        [sys.executable, "-c", count],
        stdin=process.stdout,
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    process.communicate()
    assert (process.returncode, found.stdout) == (0, "20\n")


@pytest.mark.parametrize("arguments", [["effects"], ["effects", "--json"], ["campaigns"]], ids=" ".join)
def test_a_reader_that_goes_away_is_no_fault(started: Any, filled: Path, arguments: list[str]) -> None:
    process = started("--db", filled, *arguments)
    process.stdout.close()
    err = process.stderr.read()
    process.wait(250)
    assert (process.returncode, err) == (0, "")
    process.stderr.close()


def test_a_full_disk_behind_the_pipe_is_told(started: Any) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with open("/dev/full", "w") as full:
        process = started("effects", stdout=full)
        _, err = process.communicate(timeout=250)
    assert process.returncode == 2
    assert err == "monitor: the output could not be written: No space left on device\n"


@pytest.mark.parametrize("encoding", ["ascii", "utf-8", pytest.param("latin-1", marks=pytest.mark.slow)])
def test_any_encoding_of_the_terminal_will_do(started: Any, encoding: str) -> None:
    process = started("effects", "backlash", env={"PYTHONIOENCODING": encoding}, encoding=encoding)
    out, err = process.communicate(timeout=250)
    assert (process.returncode, err) == (0, "")
    assert ("µm" in out) == (encoding != "ascii")
    process = started("effects", "backlash", "--json", env={"PYTHONIOENCODING": encoding}, encoding=encoding)
    assert "µm" in str(output.json.loads(process.communicate(timeout=250)[0]))


def test_the_installed_command_is_the_same(filled: Path, environment: dict[str, str]) -> None:
    command = shutil.which("monitor", path=str(Path(sys.executable).parent))
    if command is None:
        pytest.skip("the package is not installed here, only its checkout")
    done = subprocess.run(
        [command, "--db", str(filled), "campaigns"], capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0
    assert "five-days" in done.stdout
