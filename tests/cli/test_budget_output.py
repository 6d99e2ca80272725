"""Parts of a budget are written in units that read."""

import pytest

from monitor.cli.budget_output import _contribution


@pytest.mark.parametrize(
    ("u", "unit", "words"),
    [
        (1.1e-6, "µm", "1.1 pm"),
        (4.24e-4, "µm/m", "0.42 nm/m"),
        (-3.0e-5, "µrad", "-30 prad"),
        (0.0012, "µm", "0.0012"),
        (2.5, "µrad", "2.5"),
        (0.0, "µm", "0"),
        (2e-5, "", "0.000020"),
    ],
)
def test_small_parts_are_written_with_their_own_prefix(u: float, unit: str, words: str) -> None:
    assert _contribution(u, unit) == words
