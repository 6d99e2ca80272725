"""Models: versions by name, each with its parent and what was added or taken away."""

from __future__ import annotations

import pytest

from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database, list_models, load_model, model_history, save_model

BASE = ("EA0B", "EC0B", "EXX:poly1")


def test_version_tells_what_was_added_and_removed(db: Database) -> None:
    save_model(db, "samba", BASE)
    model = save_model(
        db, "samba", ("EA0B", "EXX:poly1", "EZC1:const@warmup"), parent=("samba", 1), note="grows when warm"
    )
    assert (model.version, model.parent) == (2, ("samba", 1))
    assert (model.added, model.removed) == (("EZC1:const@warmup",), ("EC0B",))
    assert load_model(db, "samba") == model
    assert load_model(db, "samba", 1).effects == BASE


def test_base_model_has_added_nothing(db: Database) -> None:
    model = save_model(db, "samba", BASE)
    assert (model.parent, model.added, model.removed) == (None, (), ())


def test_same_effects_again_are_the_same_version(db: Database) -> None:
    first = save_model(db, "samba", BASE)
    assert save_model(db, "samba", BASE) == first
    assert len(list_models(db)) == 1
    assert db.rows("SELECT count(*) FROM audit") == [(1,)]


def test_history_goes_back_to_the_base_across_names(db: Database) -> None:
    save_model(db, "samba", BASE)
    save_model(db, "warm", (*BASE, "EZC1:const@warmup"), parent=("samba", 1))
    save_model(db, "warm", (*BASE, "EZC1:const@warmup", "EXX:reversal"), parent=("warm", 1))
    history = model_history(db, "warm")
    assert [(model.name, model.version) for model in history] == [("samba", 1), ("warm", 1), ("warm", 2)]
    assert [model.added for model in history] == [(), ("EZC1:const@warmup",), ("EXX:reversal",)]


def test_unknown_model_or_version_lists_what_is_there(db: Database) -> None:
    with pytest.raises(NotFoundError, match="there is no model 'samba'; there is none yet"):
        load_model(db, "samba")
    save_model(db, "samba", BASE)
    with pytest.raises(NotFoundError, match="there is no model 'x'; there are samba"):
        load_model(db, "x")
    with pytest.raises(NotFoundError, match="model 'samba' has no version 2; it has 1 to 1"):
        load_model(db, "samba", 2)
    with pytest.raises(NotFoundError, match="there is no model 'old'"):
        save_model(db, "new", BASE, parent=("old", 1))


def test_name_and_effects_are_checked(db: Database) -> None:
    with pytest.raises(InputError, match="a model needs a name"):
        save_model(db, " ", BASE)
    with pytest.raises(InputError, match="the model m lists an effect twice: EA0B"):
        save_model(db, "m", ("EA0B", "EA0B"))
