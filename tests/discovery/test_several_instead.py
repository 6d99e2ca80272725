"""Several effects of the catalogue in place of one error of free shape, in campaigns of the challenge, whose generator
shares no code with the package."""

from __future__ import annotations

from pathlib import Path

import pytest
from by_path import load

from monitor.readers import read_campaign

CHALLENGE = Path(__file__).resolve().parents[1] / "challenge" / "generate.py"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "hidden"),
    [
        # Before: an unknown shape of EXB and the play of X alone; all of it in an unknown shape of EBB.
        (147, ("EBB:harmonic2", "ECC:harmonic1", "EXX:reversal", "EZZ:reversal")),
        pytest.param(101, ("ECB:harmonic3", "EXC:harmonic1", "EZZ:cyclic20mm"), marks=pytest.mark.all_seeds),
    ],
)
def test_two_errors_of_turning_axes_are_not_one_of_free_shape(tmp_path, explained, number, hidden):
    generate = load("challenge_generate", CHALLENGE)
    generate.write(tmp_path, number, 1, generate.SEED)
    told = explained(read_campaign(tmp_path / "campaigns" / f"{number:04d}")).missing
    named = {name for effect in told for name in (effect.effect, *(rival.effect for rival in effect.rivals))}
    assert set(hidden) <= named
    assert not [name for name in named if "free" in name]
