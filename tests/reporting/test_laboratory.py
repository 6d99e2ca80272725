"""The laboratory's TOML file: read as written, refused with every fault at once."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.reporting.certificate.laboratory import read_laboratory
from monitor.reporting.certificate.record import NotApplicable, Person


def written(folder: Path, text: str) -> Path:
    place = folder / "laboratory.toml"
    place.write_text(text, encoding="utf-8")
    return place


def test_every_key_arrives_where_it_belongs(tmp_path: Path) -> None:
    found = read_laboratory(
        written(
            tmp_path,
            """
            [laboratory]
            name = "Λ Laboratory"
            address = ["Road 1", "Town"]
            contact = "a@example.org"
            accreditation = "none"
            [item]
            received_on = 2026-03-01
            place = "hall 2"
            [traceability]
            probe = { not_applicable = "null indicator" }
            [statements]
            opinions = "None."
            [[authorised_by]]
            name = "A"
            function = "head"
            [[authorised_by]]
            name = "B"
            """,
        )
    )
    assert found.laboratory is not None
    assert (found.laboratory.name, found.laboratory.address) == ("Λ Laboratory", ("Road 1", "Town"))
    assert (found.accreditation, found.place, found.opinions) == ("none", "hall 2", "None.")
    assert found.received_on == date(2026, 3, 1)
    assert found.probe == NotApplicable("null indicator")
    assert found.authorised_by == (Person("A", "head"), Person("B", None))


def test_what_the_file_does_not_say_stays_unknown(tmp_path: Path) -> None:
    found = read_laboratory(written(tmp_path, ""))
    assert {name: getattr(found, name) for name in found.__dataclass_fields__} == dict.fromkeys(
        found.__dataclass_fields__
    )


@pytest.mark.parametrize(
    ("name", "made_up"), [("laboratory.toml", "made up"), ("laboratory-de.toml", "erfunden")]
)
def test_the_examples_answer_every_question(name: str, made_up: str) -> None:
    found = read_laboratory(Path(__file__).resolve().parents[2] / "examples" / name)
    # What the campaign knows (the machine, the bar's certificate) and what only some laboratories have.
    optional = {
        "accreditation", "accredited", "item_description", "item_identification", "mark", "scale_bar",
        "standards", "temperature", "dcc_version",
    }  # fmt: skip
    unanswered = {name for name in found.__dataclass_fields__ if getattr(found, name) is None}
    assert unanswered == optional
    assert found.laboratory is not None
    assert made_up in str(found.laboratory.name)


def test_all_faults_are_listed_together(tmp_path: Path) -> None:
    place = written(
        tmp_path,
        """
        authorised_by = "me"
        customers = 1
        statements = "none"
        [laboratory]
        nam = "x"
        language = "tlh"
        address = "one line"
        [customer]
        name = 3
        [item]
        received_on = "1 March"
        place = { not_applicable = "?" }
        """,
    )
    with pytest.raises(InputError, match=r"laboratory\.toml was refused:") as caught:
        read_laboratory(place)
    lines = [line.strip() for line in str(caught.value).splitlines()[1:]]
    assert lines == [
        "authorised_by is a list of persons: begin each with [[authorised_by]]",
        "there is no section [customers]; there are laboratory, accreditation, customer, item, method, traceability, "
        "standards, temperature, statements, "
        "authorised_by",
        "statements is a section: write [statements] and its keys below",
        "[laboratory] has no key nam; it has name, address, contact, accreditation, country, dcc_version, "
        "language, mark",
        "laboratory.language is one of de, en, but is 'tlh'",
        'laboratory.address is a list of lines, for example ["1 Example Road", "Town"], but is \'one line\'',
        "customer.name is a text in quotes, but is 3",
        "item.received_on is a date without quotes, for example 2026-03-02, but is '1 March'",
        "item.place always applies; not_applicable is no answer to it",
    ]


def test_a_moment_is_no_day_and_what_may_be_left_out_is_not_left_blank(tmp_path: Path) -> None:
    place = written(
        tmp_path,
        """
        [laboratory]
        accreditation = " "
        country = ""
        [item]
        received_on = 2026-03-01T08:00:00
        """,
    )
    with pytest.raises(InputError, match="was refused") as caught:
        read_laboratory(place)
    assert [line.strip() for line in str(caught.value).splitlines()[1:]] == [
        "laboratory.accreditation is blank; leave the line out where there is none",
        "laboratory.country is blank; leave the line out where there is none",
        "item.received_on is a date without quotes, for example 2026-03-02, but is 2026-03-01T08:00:00",
    ]


def test_a_file_that_cannot_be_read_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.toml cannot be read: No such file"):
        read_laboratory(tmp_path / "nowhere.toml")
    with pytest.raises(InputError, match="this is not TOML"):
        read_laboratory(written(tmp_path, "[laboratory"))
    place = tmp_path / "latin.toml"
    place.write_bytes(b'[laboratory]\nname = "M\xfcller"\n')
    with pytest.raises(InputError, match="line 2: byte 0xfc is not UTF-8; save the file as UTF-8 text"):
        read_laboratory(place)
