"""New versions of models: with further effects, or without one."""

from __future__ import annotations

from monitor.exceptions import DataError, EffectError, InputError, NotFoundError
from monitor.methods import methods
from monitor.reporting import messages
from monitor.store import (
    Database,
    StoredModel,
    list_models,
    load_model,
    machine_models,
    machines_of_method,
    next_version,
    save_model,
)
from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion
from monitor.workflow.explain.versions import fitted_version
from monitor.workflow.model.answer import AffectedAnswer, ChangeModelAnswer
from monitor.workflow.model.request import AddEffectRequest, RemoveEffectRequest
from monitor.workflow.model.show import shown
from monitor.workflow.model.subjects import subjects_of
from monitor.workflow.models import label, resolve


def add_effect(db: Database, request: AddEffectRequest) -> ChangeModelAnswer:
    """Make a version with further effects, and fit its line to a campaign.

    Each effect must exist on one of the machines of the database, or for a curve in its ``campaign``, else in one of
    the curves of the database. Raises EffectError, NotFoundError.
    """
    version = _planned(db, request)
    try:
        # Fitted before it is stored: a campaign that is not there leaves no model behind, and nobody waits for the fit.
        steps = fitted_version(db, version, request.campaign)
    except NotFoundError:
        if request.campaign is not None:
            raise
        steps = ()
    except DataError as fault:
        # Where the model without the effect fits, the readings are in order and the message is not about them.
        parent = resolve(db, request.to)
        fitted_version(db, parent, request.campaign)
        raise EffectError(
            f"{' + '.join(request.effects)} could not be fitted: beside the effects of model {label(parent)} the "
            "readings do not determine it. Nothing was stored; `monitor explain` names the effects that they show, and "
            "--campaign takes the readings of another campaign"
        ) from fault
    model = version_with(db, request)
    return _changed(db, model, request.new_name, steps)


def affected(db: Database, request: AddEffectRequest) -> AffectedAnswer:
    """For whom adding an effect changes the model that is meant: for nobody under a new name.

    Nothing is written. Raises EffectError, InputError, NotFoundError.
    """
    parent = resolve(db, request.to)
    # What would be refused changes nothing for anybody.
    _planned(db, request)
    if request.new_name is not None and request.new_name != parent.name:
        return AffectedAnswer(request.new_name, 1, False, (), ())
    latest = load_model(db, parent.name)
    # Only a method's own model is taken by machines for which none was chosen.
    machines = machines_of_method(db, parent.name) if parent.name in methods() else ()
    with_choice = {choice.machine for choice in machine_models(db) if choice.method == parent.name}
    return AffectedAnswer(
        parent.name,
        latest.version + 1,
        True,
        tuple(machine for machine in machines if machine not in with_choice),
        tuple(machine for machine in machines if machine in with_choice),
    )


def remove_effect(db: Database, request: RemoveEffectRequest) -> ChangeModelAnswer:
    """Make a version without one of the added effects. Raises NotFoundError, InputError where it is not among them."""
    parent = resolve(db, request.model)
    if request.effect not in parent.effects:
        effects = ", ".join(parent.effects) or "none; the base effects cannot be taken out"
        raise InputError(f"model {label(parent)} has no added effect {request.effect}; it has {effects}")
    rest = tuple(effect for effect in parent.effects if effect != request.effect)
    name = _checked_name(request.new_name, parent)
    model = save_model(db, name, rest, parent=(parent.name, parent.version))
    return _changed(db, model, request.new_name, ())


def version_with(db: Database, request: AddEffectRequest) -> StoredModel:
    """The stored version with further effects; its parent is the one it was added to. Raises as ``add_effect``."""
    version = _planned(db, request)
    return save_model(db, version.name, version.effects, parent=version.parent, note=version.note)


def _planned(db: Database, request: AddEffectRequest) -> StoredModel:
    """The version with further effects as it would be stored."""
    parent = resolve(db, request.to)
    subjects = subjects_of(db, parent)
    texts = tuple(subjects.canonical(effect, request.campaign) for effect in request.effects)
    for text in texts:
        if text in parent.effects:
            raise InputError(
                f"model {label(parent)} has {text} already; add another effect, or take it out first"
            )
    name = request.new_name
    if name is not None and name != parent.name and name in {model.name for model in list_models(db)}:
        raise InputError(
            f"there is a model {name} already: add to it with --to {name}, or choose another name"
        )
    return next_version(
        db, _checked_name(name, parent), (*parent.effects, *texts), parent=(parent.name, parent.version),
        note=request.note,
    )  # fmt: skip


def _checked_name(name: str | None, parent: StoredModel) -> str:
    if name is None:
        return parent.name
    if "@" in name or not name.strip():
        raise InputError(f"'{name}' cannot name a model: leave out @, which separates name and version")
    return name


def _changed(
    db: Database, model: StoredModel, new_name: str | None, steps: tuple[MachineVersion | CurveVersion, ...]
) -> ChangeModelAnswer:
    """The answer, with a note for other users where the name without a version means another version from now on."""
    name, version = model.name, model.version
    note = None
    if version > 1 and new_name in (None, name):
        note = messages.name_means_another(name, label(model), version - 1)
    return ChangeModelAnswer(shown(db, model), steps, note)
