"""Whatever stands in the three files, the answer is a campaign or a refusal with at least one fault."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given, settings, strategies as st

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.records import Campaign

EXAMPLE = Path(__file__).parents[2] / "examples" / "cold-cold"
FILES = ("campaign.toml", "runs.csv", "probings.csv")
SOUND = {name: (EXAMPLE / name).read_bytes() for name in FILES}
# Two runs of the example are enough, and quick.
SOUND["runs.csv"] = b"".join(SOUND["runs.csv"].splitlines(keepends=True)[:3])
SOUND["probings.csv"] = b"".join(SOUND["probings.csv"].splitlines(keepends=True)[:61])
PIECES = [
    *(
        b"",
        b",",
        b"\n",
        b"\r",
        b'"',
        b"nan",
        b"1e999",
        b"-",
        b"\x00",
        b"\xff",
        "\u2212".encode(),
        b"[",
        b"[[a]]\n",
    ),
    *(
        b"=",
        b"{",
        b".",
        b"'''",
        b'"""',
        b"9" * 5000,
        b"true",
        b"\\ud800",
        b"1,2,3\n",
        b"\xef\xbb\xbf",
        b"(",
        b"w b t",
    ),
]


def outcome(contents: dict[str, bytes]) -> Campaign | CampaignError:
    with tempfile.TemporaryDirectory() as around:
        for name, content in contents.items():
            (Path(around) / name).write_bytes(content)
        try:
            return read_campaign(Path(around))
        except CampaignError as error:
            str(error).encode("utf-8")  # raises where a message cannot be printed
            return error


def test_the_sound_folder_is_read():
    assert len(outcome(SOUND).probings) == 60


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(FILES), st.binary(max_size=400))
@example("campaign.toml", b"x = 0x" + b"f" * 5000)
@example("campaign.toml", b"machine = " + b"[" * 3000)
@example("campaign.toml", b"a." * 3000 + b"a = 1")
@example("probings.csv", b"run,sequence,time_s,target\n")
@example("runs.csv", b"\r\r\r,\n\x85\xe2\x80\xa8")
def test_any_bytes_in_any_file(name, content):
    assert isinstance(outcome({**SOUND, name: content}), CampaignError)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_any_small_damage_to_any_file(data):
    name = data.draw(st.sampled_from(FILES))
    sound = SOUND[name]
    start = data.draw(st.integers(0, len(sound)))
    length = data.draw(st.integers(0, 40))
    piece = data.draw(
        st.sampled_from(PIECES)
        | st.binary(max_size=10)
        | st.text(max_size=5).map(lambda t: t.encode("utf-8", "replace"))
    )
    result = outcome({**SOUND, name: sound[:start] + piece + sound[start + length :]})
    assert isinstance(result, Campaign | CampaignError)


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from(FILES[1:]),
    st.integers(0, 60),
    st.integers(0, 10),
    st.sampled_from(PIECES) | st.binary(max_size=10),
)
def test_any_cell(name, line, column, piece):
    lines = SOUND[name].split(b"\n")
    cells = lines[line % len(lines)].split(b",")
    cells[column % len(cells)] = piece
    lines[line % len(lines)] = b",".join(cells)
    assert isinstance(outcome({**SOUND, name: b"\n".join(lines)}), Campaign | CampaignError)


@pytest.mark.parametrize("name", FILES)
def test_every_truncation_at_a_line(name):
    lines = SOUND[name].splitlines(keepends=True)
    for kept in range(0, len(lines) // 2, 3):  # the second run, or the second half of the keys, is gone
        assert isinstance(outcome({**SOUND, name: b"".join(lines[:kept])}), CampaignError)
