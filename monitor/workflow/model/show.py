"""List the models, and show one."""

from __future__ import annotations

from monitor.exceptions import BusyError, StoreError
from monitor.methods import CurveMethod, methods
from monitor.store import Database, StoredModel, curve_names, list_models
from monitor.workflow.model.answer import ModelsAnswer, ShowModelAnswer, model_version
from monitor.workflow.model.request import ShowModelRequest
from monitor.workflow.model.subjects import subjects_of
from monitor.workflow.models import resolve


def list_all_models(db: Database) -> ModelsAnswer:
    """All models with their versions; the methods' own are made where they are not there yet and may be stored."""
    curves = bool(curve_names(db))
    for method in methods().values():
        if curves or not isinstance(method, CurveMethod):
            try:
                resolve(db, method.name)
            except BusyError:
                raise
            except StoreError:
                break  # whoever may only read sees those that were stored
    return ModelsAnswer(tuple(model_version(model) for model in list_models(db)))


def show_model(db: Database, request: ShowModelRequest) -> ShowModelAnswer:
    """A model, its added effects in words, and its base effects on every machine or curve. Raises NotFoundError."""
    return shown(db, resolve(db, request.name))


def shown(db: Database, model: StoredModel) -> ShowModelAnswer:
    """A stored version with its base and its effects in words."""
    subjects = subjects_of(db, model)
    return ShowModelAnswer(
        model_version(model),
        subjects.base(),
        subjects.meaning(model.effects),
        subjects.refers_to(model.effects),
    )
