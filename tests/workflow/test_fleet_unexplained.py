"""A machine whose latest stored comparison says that something is missing is named by the fleet until it is added."""

from __future__ import annotations

from pathlib import Path

from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.request import CompareRequest
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.model.change import add_effect
from monitor.workflow.model.request import AddEffectRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGN = "hidden-spindle-growth"


def test_named_from_the_comparison_until_the_effect_is_added(tmp_path: Path) -> None:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(EXAMPLES / CAMPAIGN))
        identify(db, IdentifyRequest(CAMPAIGN))
        # Nobody compared it: nothing is claimed.
        assert fleet(db, FleetRequest()).models_lacking is None
        compare(db, CompareRequest(CAMPAIGN))
        assert fleet(db, FleetRequest()).models_lacking == {"HU40-T": CAMPAIGN}
        add_effect(db, AddEffectRequest("EZC1:const@warmup", "samba", campaign=CAMPAIGN))
        identify(db, IdentifyRequest(CAMPAIGN))
        compare(db, CompareRequest(CAMPAIGN))
        assert fleet(db, FleetRequest()).models_lacking is None
        # Asked of a version by its name, the page of that version judges it.
        assert fleet(db, FleetRequest("samba@1")).models_lacking is None
