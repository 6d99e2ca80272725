"""A file that ends within its last number is refused; what a whole file may look like is read."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from monitor.exceptions import CampaignError
from monitor.readers import read_campaign
from monitor.readers.faults import Faults
from monitor.readers.tables.csv_table import parse_csv
from monitor.readers.tables.cut_files import is_cut

EXAMPLES = Path(__file__).parents[2] / "examples"
ROWS = "".join(f"{number},{number / 3:.2f}\n" for number in range(1, 9))


@pytest.mark.parametrize(
    ("folder", "name", "characters"),
    [
        ("files-as-they-come", "bar-xy.bar", 3),
        ("files-as-they-come", "r-test.csv", 3),
        ("files-of-a-plate", "tracker.txt", 3),
        ("files-of-a-plate", "tracker-poses.csv", 2),
        ("r-test", "probings.csv", 1),
    ],
)
def test_a_file_that_ends_within_its_last_number_is_refused(
    tmp_path: Path, folder: str, name: str, characters: int
) -> None:
    """Read, 9.97 um came in as 9 um and a position of 200 mm as 20 mm."""
    shutil.copytree(EXAMPLES / folder, tmp_path / folder)
    path = tmp_path / folder / name
    whole = path.read_bytes().rstrip()
    path.write_bytes(whole)
    assert len(read_campaign(tmp_path / folder).probings) > 0  # the end of a line may be missing
    path.write_bytes(whole[:-characters])
    with pytest.raises(
        CampaignError, match=f"{name}, line [0-9]+: the last number is shorter than those above it"
    ):
        read_campaign(tmp_path / folder)


@pytest.mark.parametrize(
    ("last", "cut"),
    [
        ("9,3.00", False), ("9,3.0", True), ("9,3.", True), ("9,3", True), ("9,-3.5", True), ("9,3.000", False),
        ("9,3.0\n", False), ("9,ok", False), ("end of log", False),
    ],
)  # fmt: skip
def test_the_last_number_is_compared_with_those_above(last: str, cut: bool) -> None:
    assert is_cut(ROWS + last) is cut


def test_numbers_without_trailing_zeros_and_whole_numbers_are_no_signs() -> None:
    assert not is_cut("".join(f"{number},{number / 8:g}\n" for number in range(1, 30)) + "9,3")
    assert not is_cut("".join(f"{number},{10 + number}\n" for number in range(1, 30)) + "9,3")
    # Two columns of whole numbers, one line a row: the comma separates them.
    assert not is_cut("".join("1,79\n" for _ in range(30)) + "2,8")


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [",", ";"])
def test_a_table_of_a_campaign_is_looked_at_as_it_is_written(mark: str, ends: str) -> None:
    """Windows ends its lines otherwise, and what semicolons separate is written anew before it is read."""
    table = ("a,b\n" + ROWS).replace(",", mark).replace("\n", ends)
    for last, reads in (("9,3.00", True), ("9,3.0", False)):
        faults = Faults(["t.csv"])
        assert (parse_csv("t.csv", table + last.replace(",", mark), faults) is not None) is reads
        assert [fault.line for fault in faults.sorted()] == ([] if reads else [10])


def test_a_decimal_comma_counts_where_something_else_separates() -> None:
    assert is_cut(ROWS.replace(",", ";").replace(".", ",") + "9;3,0")
