"""Files of settings that no parser of TOML takes are refused in words, by whichever reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from monitor.cli import configuration
from monitor.exceptions import InputError
from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.toml_text import toml_tables
from monitor.web.laboratory_form import texts_of_file
from monitor.web.users import read_users
from monitor.workflow.health.mail import read_mail_settings

READERS: tuple[Callable[[Path], object], ...] = (
    configuration.read,
    read_laboratory,
    read_mail_settings,
    read_users,
    lambda path: texts_of_file(path.read_bytes()),
)
# The first is a ValueError of Python's own, since 3.11; of the second the parser calls itself too often.
BROKEN = {
    b"a = " + b"1" * 5000: "this is not TOML: Exceeds the limit",
    b"a = " + b"[" * 3000: "nested too deeply",
    b"a = 1\nb = \xff": "line 2: byte 0xff is not UTF-8; save the file as UTF-8 text",
    b"a = 1\nb": "line 2: this is not TOML: Expected",
}


@pytest.mark.parametrize("content", BROKEN, ids=list(BROKEN.values()))
@pytest.mark.parametrize("read", READERS, ids=("configuration", "laboratory", "mail", "users", "form"))
def test_what_is_no_toml_is_refused_in_words(
    tmp_path: Path, read: Callable[[Path], object], content: bytes
) -> None:
    file = tmp_path / "settings.toml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=BROKEN[content]):
        read(file)


def test_a_sound_file_is_read_with_its_mark_of_a_byte_order() -> None:
    assert toml_tables("a.toml", b'\xef\xbb\xbf[a]\nb = "\xc3\xa4"\n') == {"a": {"b": "ä"}}


@pytest.mark.parametrize("read", READERS[:4], ids=("configuration", "laboratory", "mail", "users"))
def test_a_file_that_is_none_or_too_large_is_refused(tmp_path: Path, read: Callable[[Path], object]) -> None:
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * (2**20 + 1))
    with pytest.raises(InputError, match=r"large\.toml cannot be read: it is larger than 1 MiB"):
        read(large)
    with pytest.raises(InputError, match=r"gone\.toml cannot be read: No such file"):
        read(tmp_path / "gone.toml")
