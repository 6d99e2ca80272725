"""The model that a machine is followed by: chosen with a reason, and its campaigns identified by it."""

from __future__ import annotations

from monitor.effects import parse_effect
from monitor.exceptions import EffectError, InputError, MonitorError, NotFoundError, did_you_mean
from monitor.methods import ChainMethod, methods
from monitor.methods.model import SHARED_BASE, chain_of
from monitor.store import (
    Database,
    StoredModel,
    described_machines,
    followed_by,
    load_campaign,
    machine_history,
    model_history,
    save_identification,
    save_machine_model,
)
from monitor.workflow.model.answer import UseModelAnswer
from monitor.workflow.model.request import UseModelRequest
from monitor.workflow.models import label, label_of, resolve


def use_model(db: Database, request: UseModelRequest) -> UseModelAnswer:
    """Follow a machine by a model from now on, and identify its campaigns by it.

    Trend, report, certificate, fleet and every other verb then take it where no --model is named. Raises NotFoundError
    for a machine or model that is not there, EffectError for an effect that the machine does not have, InputError
    without a reason.
    """
    model = resolve(db, request.model)
    method = _method_of(db, model)
    _check_effects(db, model, request.machine)
    before = followed_by(db, request.machine).get(method, (method, 1))
    with db.transaction():
        choice = save_machine_model(db, request.machine, method, (model.name, model.version), request.reason)
    finished, failed = [], {}
    history = machine_history(db, request.machine, model=model.name, version=model.version)
    if history.unidentified:
        # Loaded here: a list of models needs no solver.
        from monitor.workflow.identify.machine import identified
    for name in history.unidentified:
        campaign = load_campaign(db, name)
        if campaign.method != method:
            continue
        try:
            save_identification(db, identified(campaign, model)[1])
            finished.append(name)
        except MonitorError as error:
            # What cannot be identified stays out of the history, and is named with the reason.
            failed[name] = str(error)
    return UseModelAnswer(
        request.machine, method, label(model), label_of(*before), choice.reason, tuple(finished), failed
    )


def _method_of(db: Database, model: StoredModel) -> str:
    """The method that a model descends from. Raises InputError where it is none of a machine."""
    root = model_history(db, model.name, model.version)[0].name
    if not isinstance(methods().get(root), ChainMethod):
        raise InputError(
            f"model {label(model)} descends from '{root}', which measures no machine; a machine is followed by a model "
            f"of {', '.join(name for name, method in methods().items() if isinstance(method, ChainMethod))}"
        )
    return root


def _check_effects(db: Database, model: StoredModel, machine: str) -> None:
    described = {entry.id: entry for entry in described_machines(db)}
    if machine not in described:
        raise NotFoundError(
            f"there is no machine '{machine}'; {did_you_mean(machine, described)}"
            f"there are {', '.join(described) or 'none yet'}"
        )
    chain = chain_of(described[machine])
    for effect in model.effects:
        if effect == SHARED_BASE:
            raise InputError(
                f"model {label(model)} has one base for all runs of a campaign, so that there is nothing to follow "
                f"from run to run; choose a model without {SHARED_BASE}"
            )
        try:
            parse_effect(effect, chain)
        except EffectError as error:
            raise EffectError(f"machine {machine} cannot be followed by {label(model)}: {error}") from error
