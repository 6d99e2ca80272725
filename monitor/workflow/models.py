"""Stored models by name: resolve ``NAME`` or ``NAME@VERSION``, and hand a version to the methods.

A model is the complete set of base effects of the method (free in every run) and the effects added to it
(shared by all runs of a campaign). ``samba`` exists from the start; ``samba@2`` names a version.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.exceptions import InputError, NotFoundError, did_you_mean
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, StoredModel, list_models, load_model, machine_model, save_model

if TYPE_CHECKING:
    from monitor.methods.model import Model


def resolve(db: Database, name: str | None, method: str = "") -> StoredModel:
    """The stored model of a name, ``NAME`` (its latest version) or ``NAME@VERSION``; the method's own by default."""
    model, _, version = (name or method).partition("@")
    if version and not version.isdigit():
        raise InputError(f"model '{name}': after @ comes the number of a version, for example {model}@1")
    try:
        return load_model(db, model, int(version) if version else None)
    except NotFoundError as error:
        # Loaded where nothing of that name is stored: a verb that reads needs no method.
        from monitor.methods import methods

        if model in methods() and not version.strip("1"):
            # The method's own model needs nobody to make it.
            return save_model(db, model, (), note="the method's own model")
        if not list_models(db):
            if model in methods():
                raise NotFoundError(f"model '{model}' has no version {version}; it has 1") from error
            hint = did_you_mean(model, methods())
            raise NotFoundError(
                f"there is no model '{model}'; {hint}there are {', '.join(methods())}"
            ) from error
        raise


def resolve_for(db: Database, name: str | None, method: str, machine: str | None) -> StoredModel:
    """The stored model of a name; without one that which the machine is followed by, else the method's own.

    Raises as ``resolve``.
    """
    choice = None if name is not None or machine is None else machine_model(db, machine, method)
    return resolve(db, name, method) if choice is None else load_model(db, choice.model, choice.version)


def subject_of(measured: Campaign | CurveCampaign) -> str | None:
    """The machine that a campaign was measured on; None for a curve."""
    return measured.machine.id if isinstance(measured, Campaign) else None


def label(model: StoredModel) -> str:
    """The name of a version: that of the model alone for the first, ``name@2`` for the second."""
    return label_of(model.name, model.version)


def label_of(name: str, version: int) -> str:
    """The name of a version of the model ``name``."""
    return name if version == 1 else f"{name}@{version}"


def as_model(stored: StoredModel) -> Model:
    """The model as the methods take it."""
    from monitor.methods.model import Model

    return Model(label(stored), added=stored.effects)
