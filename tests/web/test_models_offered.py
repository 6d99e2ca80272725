"""The models that the page of a campaign offers: those of its method, whatever others are stored."""

from __future__ import annotations

from monitor.store import Database, save_model
from monitor.web.pages.model import _of_method
from monitor.workflow.model.show import list_all_models


def test_only_models_that_descend_from_the_methods_own_are_offered() -> None:
    with Database(":memory:", threads=1) as db:
        list_all_models(db)
        save_model(db, "samba", ("EXX:reversal",), parent=("samba", 1))
        save_model(db, "mine", ("EXX:reversal", "EZC1:const@warmup"), parent=("samba", 2))
        save_model(db, "theirs", ("EXX:reversal",), parent=("tracker", 1))
        versions = list_all_models(db).models
    assert {"samba", "mine", "tracker", "theirs"} <= {version.name for version in versions}
    assert [version.model for version in _of_method(versions, "samba", "")] == ["mine", "samba", "samba@2"]
    # What is shown can be chosen again, whatever it is.
    assert "theirs" in [version.model for version in _of_method(versions, "samba", "theirs")]
