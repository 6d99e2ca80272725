"""Shop-floor names against the tables of ISO 230-1:2012 (3.7) and ISO 10791-1, typed by hand."""

import pytest

from monitor.reporting.plain_names import plain_name


@pytest.mark.parametrize(
    ("symbol", "name"),
    [
        # C0Y: squareness of Y to X; B0Z: of Z to X; A0Z: of Z to Y; the same planes stated for the other axis.
        ("EC0Y", "squareness X-Y"),
        ("EC0X", "squareness X-Y"),
        ("EB0Z", "squareness X-Z"),
        ("EA0Z", "squareness Y-Z"),
        ("EA0Y", "squareness Y-Z"),
        # A0C: of C to Y; B0C: of C to X; A0B: of B to Z; C0B: of B to X; B0A: of A to Z; C0A: of A to Y.
        ("EA0C", "squareness of axis C to Y"),
        ("EB0C", "squareness of axis C to X"),
        ("EA0B", "squareness of axis B to Z"),
        ("EC0B", "squareness of axis B to X"),
        ("EB0A", "squareness of axis A to Z"),
        ("EC0A", "squareness of axis A to Y"),
        ("EA0C1", "squareness of spindle C1 to Y"),
        # No squareness: positions, zeros, error motions and names that are no symbol stay as a table has them.
        ("EX0C", "position in X of axis C"),
        ("EC0C", "zero angle of axis C"),
        ("EXX", "positioning gain of axis X"),
        ("volumetric", "volumetric"),
    ],
)
def test_names_of_the_shop_floor(symbol: str, name: str) -> None:
    assert plain_name(symbol) == name
