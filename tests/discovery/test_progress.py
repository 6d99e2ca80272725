"""How far a search is, as whoever waits hears it: forwards within a round, and to the end where no other one comes."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.discovery.search.rounds import in_rounds
from monitor.methods import campaign_method
from monitor.progress import listening, saying, told, within
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.request import ExplainRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


class Searched:
    """Rounds of which the given one stands, each half done once."""

    def __init__(self, stands: int) -> None:
        self.stands, self.count = stands, 0

    def round(self) -> int:
        self.count += 1
        told(0.5)
        return self.count

    def judged(self, current: int) -> int | None:
        return current if current == self.stands else None


def test_a_part_counts_within_the_whole() -> None:
    heard: list[float] = []
    with listening(heard.append):
        with within(0.2, 0.6):
            told(0.0)
            told(0.5)
            with within(0.5, 1.0):
                told(1.0)
        told(0.7)
    assert heard == pytest.approx([0.2, 0.4, 0.6, 0.7])
    with within(0.2, 0.6):
        told(0.5)
    assert len(heard) == 4


def test_what_is_done_is_said_until_it_is_over() -> None:
    said: list[str] = []
    with listening(lambda share: None, said.append):
        # A part of the work that tells its share within the whole is heard by the same listener.
        with within(0.2, 0.6), saying("compiling"):
            assert said == ["compiling"]
        with pytest.raises(ValueError, match="broken"), saying("again"):
            raise ValueError("broken")
    with saying("to nobody"):
        pass
    assert said == ["compiling", "", "again", ""]


@pytest.mark.parametrize("rounds", [1, 2, 3])
def test_every_round_counts_as_the_last_until_another_begins(rounds: int) -> None:
    heard: list[float] = []
    with listening(heard.append):
        assert in_rounds(Searched(rounds), 5) == (rounds, True)
    of_each = [heard[start : start + 4] for start in range(0, len(heard), 4)]
    assert len(of_each) == rounds
    assert all(sorted(shares) == shares and shares[-1] == pytest.approx(0.95) for shares in of_each)
    # The second round takes back half, the third a third.
    assert [shares[0] for shares in of_each] == pytest.approx([0.06, 0.505, 0.06 + 0.89 * 2 / 3][:rounds])


def test_who_waits_for_an_explanation_hears_more_than_its_beginning(tmp_path: Path) -> None:
    campaign = read_campaign(EXAMPLES / "r-test")
    assert campaign_method(campaign).name == "instruments"
    heard: list[float] = []
    with Database(tmp_path / "x.duckdb") as db, listening(heard.append):
        import_campaign(db, campaign)
        explain(db, ExplainRequest(campaign.name))
    assert heard[0] < 0.1
    assert len(set(heard)) >= 4
    assert max(heard) == pytest.approx(0.95)
