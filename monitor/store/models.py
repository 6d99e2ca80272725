"""Models and their versions: a list of effects, where it came from, and what was added or removed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from monitor import __version__
from monitor.exceptions import InputError, NotFoundError, did_you_mean
from monitor.store import audit
from monitor.store.bookkeeping import with_bookkeeping
from monitor.store.connection import Database, utc_now


@dataclass(frozen=True)
class StoredModel:
    """A version of a model; ``parent`` is a name and a version, None for a base model.

    ``added`` are the effects that the parent does not have, ``removed`` those of the parent that are gone.
    """

    name: str
    version: int
    parent: tuple[str, int] | None
    effects: tuple[str, ...]
    added: tuple[str, ...]
    removed: tuple[str, ...]
    note: str
    created_at: datetime


_SELECT = "SELECT model, version, parent, parent_version, effects, added, removed, note, created_at FROM model WHERE "


def next_version(
    db: Database,
    name: str,
    effects: Sequence[str],
    *,
    parent: tuple[str, int] | None = None,
    note: str = "",
) -> StoredModel:
    """Return the version that ``save_model`` would store: the next of its name, or the one that is there already.

    Raises InputError for an empty name or an effect listed twice, NotFoundError for an unknown parent.
    """
    if not name.strip():
        raise InputError("a model needs a name")
    twice = sorted({effect for effect in effects if list(effects).count(effect) > 1})
    if twice:
        raise InputError(f"the model {name} lists an effect twice: {', '.join(twice)}")
    versions = _select(db, "model = ? ORDER BY version DESC", [name])
    if versions and versions[0].effects == tuple(effects):
        return versions[0]
    before = load_model(db, *parent).effects if parent else ()
    return StoredModel(
        name,
        versions[0].version + 1 if versions else 1,
        parent,
        tuple(effects),
        tuple(effect for effect in effects if effect not in before) if parent else (),
        tuple(effect for effect in before if effect not in effects),
        note,
        utc_now(),
    )


def save_model(
    db: Database,
    name: str,
    effects: Sequence[str],
    *,
    parent: tuple[str, int] | None = None,
    note: str = "",
) -> StoredModel:
    """Store a model under the next version of its name; the same effects again are the version that is there.

    Raises as ``next_version``.
    """
    if not db.keeps_answers and parent is None:
        # The methods' own models are there wherever somebody reads.
        return next_version(db, name, effects, note=note)
    with db.transaction():
        model = next_version(db, name, effects, parent=parent, note=note)
        if _select(db, "model = ? AND version = ?", [name, model.version]):
            return model
        parent_name, parent_version = parent or (None, None)
        db.execute(
            "INSERT INTO model VALUES (?, ?, ?, ?, ?::VARCHAR[], ?::VARCHAR[], ?::VARCHAR[], ?, ?, ?)",
            [
                name,
                model.version,
                parent_name,
                parent_version,
                list(model.effects),
                list(model.added),
                list(model.removed),
                note,
                __version__,
                model.created_at,
            ],
        )
        key = model_key(name, model.version)
        audit.record(db, "save", "model", key, with_bookkeeping(db, "model", key, model_content(model)))
    return model


def load_model(db: Database, name: str, version: int | None = None) -> StoredModel:
    """A version of a model, the latest where none is named. Raises NotFoundError listing what is there."""
    versions = _select(db, "model = ? ORDER BY version DESC", [name])
    wanted = [model for model in versions if version is None or model.version == version]
    if wanted:
        return wanted[0]
    if versions:
        raise NotFoundError(f"model {name!r} has no version {version}; it has 1 to {versions[0].version}")
    names = [row[0] for row in db.rows("SELECT DISTINCT model FROM model ORDER BY model")]
    existing = (
        f"there are {', '.join(names)}" if names else "there is none yet; `monitor identify` makes the first"
    )
    raise NotFoundError(f"there is no model {name!r}; {did_you_mean(name, names)}{existing}")


def model_history(db: Database, name: str, version: int | None = None) -> tuple[StoredModel, ...]:
    """A version and its ancestors, the base model first. Raises NotFoundError."""
    line = [load_model(db, name, version)]
    while line[-1].parent is not None:
        line.append(load_model(db, *line[-1].parent))
    return tuple(reversed(line))


def last_used_campaign(db: Database, model: StoredModel) -> str | None:
    """The campaign on which a version or an ancestor of it was last used; None where none was."""
    line = {(version.name, version.version) for version in model_history(db, model.name, model.version)}
    rows = db.rows(
        "SELECT campaign, model, model_version FROM ("
        "SELECT campaign, model, model_version, computed_at FROM v_analyses WHERE campaign IS NOT NULL "
        "UNION ALL SELECT campaign, model, model_version, computed_at FROM v_identifications"
        ") ORDER BY computed_at DESC"
    )
    return next((str(campaign) for campaign, name, version in rows if (name, version) in line), None)


def list_models(db: Database) -> list[StoredModel]:
    """All versions of all models, in the order of names."""
    return _select(db, "true ORDER BY model, version", [])


def model_key(name: str, version: int) -> str:
    """The key of a version in the audit."""
    return f"{name} version {version}"


def model_content(model: StoredModel) -> str:
    """The hash of all that is stored of a version."""
    return audit.digest(
        model.name,
        model.version,
        model.parent,
        model.effects,
        model.added,
        model.removed,
        model.note,
        model.created_at,
    )


def _select(db: Database, condition: str, parameters: list[object]) -> list[StoredModel]:
    return [
        StoredModel(
            name,
            version,
            None if parent is None else (parent, parent_version),
            tuple(effects),
            tuple(added),
            tuple(removed),
            note,
            created_at,
        )
        for name, version, parent, parent_version, effects, added, removed, note, created_at in db.rows(
            _SELECT + condition, parameters
        )
    ]
