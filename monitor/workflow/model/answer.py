"""Answers about models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

from monitor.documents import IN_UTC, INLINED
from monitor.store import StoredModel
from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion
from monitor.workflow.models import label, label_of


@dataclass(frozen=True)
class ModelVersion:
    """A version of a model; ``added`` and ``removed`` are against its parent."""

    model: str
    name: str
    version: int
    parent: str | None
    effects: tuple[str, ...]
    added: tuple[str, ...]
    removed: tuple[str, ...]
    note: str
    created_at: datetime = field(metadata=IN_UTC)


@dataclass(frozen=True)
class ModelsAnswer:
    """All versions of all models."""

    models: tuple[ModelVersion, ...]


@dataclass(frozen=True)
class ShowModelAnswer:
    """A version, its base effects by machine or curve, and what its added effects mean.

    ``refers_to`` says in words, by machine, what each of its effects, base and added, is stated relative to; a curve
    has none.
    """

    version: ModelVersion = field(metadata=INLINED)
    base: Mapping[str, tuple[str, ...]]
    meaning: Mapping[str, str]
    refers_to: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class ChangeModelAnswer:
    """A new version; ``history`` is the error of its line on a campaign, empty where it was compared with none.

    ``note_on_name`` says what the name without a version means from now on, where that changed.
    """

    model: ShowModelAnswer = field(metadata=INLINED)
    history: tuple[MachineVersion | CurveVersion, ...]
    note_on_name: str | None


@dataclass(frozen=True)
class UseModelAnswer:
    """The model that a machine is followed by from now on, and ``before``.

    ``identified`` are the campaigns of the method that were identified by it just now; ``failed`` could not be, with
    the reason, and have no part in its history.
    """

    machine: str
    method: str
    model: str
    before: str
    reason: str
    identified: tuple[str, ...]
    failed: Mapping[str, str]


@dataclass(frozen=True)
class AffectedAnswer:
    """What a change would make: version ``next_version`` of ``name``, which others already use where it is ``in_use``.

    ``changed`` are machines that are followed by the method's own model, and then by the new version; ``keep`` those
    for which a model was chosen.
    """

    name: str
    next_version: int
    in_use: bool
    changed: tuple[str, ...]
    keep: tuple[str, ...]


def model_version(stored: StoredModel) -> ModelVersion:
    """A stored version as people see it."""
    return ModelVersion(
        model=label(stored),
        name=stored.name,
        version=stored.version,
        parent=None if stored.parent is None else label_of(*stored.parent),
        effects=stored.effects,
        added=stored.added,
        removed=stored.removed,
        note=stored.note,
        created_at=stored.created_at,
    )
