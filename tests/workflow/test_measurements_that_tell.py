"""Errors of an axis that do the same at every pose of a plan of instruments: `explain` names what `plan` would."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.explain.measurements import _Search
from monitor.workflow.explain.ties import Tie, TieBreak
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

TOOL = (0.0, 0.0, -80.0)


@dataclass(frozen=True)
class _Missing:
    """What the search reads of a missing effect."""

    effect: str
    coinciding: tuple[str, ...]
    ties: tuple[Tie, ...]


@pytest.fixture(scope="module")
def lathe(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Lasers there and back along Z, X and Y, which stand on each other in this order, with a tool of one length: a
    tilt of X moves the tip like a displacement, wherever it stands."""
    axes = tuple(SimulatedAxis(name, "linear", way) for name, way in WAYS.items())
    chain = SimulatedChain(axes, work=(SimulatedAxis("C", "rotary", WAYS["Z"], sign=-1),))
    rng, text, rows = np.random.default_rng(4), "", []
    for name in "XYZ":
        text += laser(name, TOOL, u_um=0.3, name=f"laser-{name}")
        for place in [*range(0, 401, 50), *range(400, -1, -50)]:
            readings = {**dict.fromkeys("XYZC", 0.0), name: float(place)}
            rows.append(
                {"setup": f"laser-{name}", **readings, "reading_um": 1e3 * place + rng.normal(0.0, 0.3)}
            )
    campaign = read_campaign(chain.write(Path(tmp_path_factory.mktemp("lathe")) / "lathe", text, rows))
    assert isinstance(campaign, Campaign)
    return campaign


def _tie_of(campaign: Campaign, effect: str, rival: str, *, alike: bool) -> Tie:
    """The tie with a rival that more poses were said to tell, once the plan is asked."""
    said = Tie((rival,), TieBreak.MORE_POSES, axes=("X",))
    search = _Search(campaign_method(campaign).plan, campaign, Model("instruments", ()))
    missing = search.of_missing(_Missing(effect, (rival,) if alike else (), (said,)))
    (tie,) = missing.ties
    return tie


def test_a_tilt_and_a_displacement_at_one_length_of_the_tool_are_told_by_an_angle(lathe: Campaign) -> None:
    """Was: more poses over the whole range of X, after which the tie stood as before."""
    tie = _tie_of(lathe, "EBX:reversal", "EXX:reversal", alike=True)
    assert tie.broken_by is TieBreak.INSTRUMENT
    assert tie.axes == ()
    assert tie.measurement is not None
    assert tie.measurement.reading in ("angle", "level")


def test_what_no_test_tells_is_said_to_be_told_by_none(lathe: Campaign) -> None:
    """Run-out of C once a turn in X and in Y: together they shift what turns with C, as its place does."""
    tie = _tie_of(lathe, "EXC:harmonic1", "EYC:harmonic1", alike=True)
    assert tie.broken_by is TieBreak.NO_POSES
    assert tie.measurement is None


def test_what_poses_may_tell_is_still_told_by_poses(lathe: Campaign) -> None:
    assert _tie_of(lathe, "EBX:reversal", "EXX:reversal", alike=False).broken_by is TieBreak.MORE_POSES
