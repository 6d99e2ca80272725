"""Models and their versions: resolve a name, add an effect, take one out, show what is there.

A model is the complete set of base effects of the method (free in every run) and the effects added to it
(shared by all runs of a campaign). ``samba`` exists from the start; ``samba@2`` names a version.
"""

from __future__ import annotations

from typing import Any

from monitor.effects import parse_effect
from monitor.effects.curve import inputs_of, parse_curve_effect
from monitor.effects.curve_words import describe_curve
from monitor.effects.words import describe
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.machine import Chain
from monitor.methods import ChainMethod, CurveMethod, methods
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.model import Model, chain_of
from monitor.store import (
    Database,
    StoredModel,
    curve_names,
    described_machines,
    list_models,
    load_curve,
    load_model,
    save_model,
)

Document = dict[str, Any]


def resolve(db: Database, name: str | None, method: str = "") -> StoredModel:
    """The stored model of a name, ``NAME`` (its latest version) or ``NAME@VERSION``; the method's own by default."""
    wanted, _, version = (name or method).partition("@")
    if version and not version.isdigit():
        raise InputError(f"model '{name}': after @ comes the number of a version, for example {wanted}@1")
    try:
        return load_model(db, wanted, int(version) if version else None)
    except NotFoundError as error:
        own = methods()
        if wanted in own and not version.strip("1"):
            # The method's own model needs nobody to make it.
            return save_model(db, wanted, (), note="the method's own model")
        if list_models(db).empty:
            if wanted in own:
                raise NotFoundError(f"model '{wanted}' has no version {version}; it has 1") from error
            raise NotFoundError(f"there is no model '{wanted}'; there are {', '.join(own)}") from error
        raise


def label(model: StoredModel) -> str:
    """How a version is called: the name alone for the first, ``name@2`` for the second."""
    return model.name if model.version == 1 else f"{model.name}@{model.version}"


def as_model(stored: StoredModel) -> Model:
    """The model as the methods take it."""
    return Model(label(stored), added=stored.effects)


def _document(stored: StoredModel) -> Document:
    return {
        "model": label(stored),
        "name": stored.name,
        "version": stored.version,
        "parent": None if stored.parent is None else _label_of(stored.parent),
        "effects": list(stored.effects),
        "added": list(stored.added),
        "removed": list(stored.removed),
        "note": stored.note,
        "created_at": stored.created_at.isoformat() + "Z",
    }


def _label_of(parent: tuple[str, int]) -> str:
    name, version = parent
    return name if version == 1 else f"{name}@{version}"


def list_(db: Database) -> Document:
    """All models with their versions."""
    curves = bool(curve_names(db))
    for method in methods().values():
        if curves or not isinstance(method, CurveMethod):
            resolve(db, method.name)
    frame = list_models(db)
    return {
        "models": [
            _document(load_model(db, str(name), int(version)))
            for name, version in zip(frame["model"], frame["version"], strict=True)
        ]
    }


def show(db: Database, name: str) -> Document:
    """A model, its added effects in words, and its base effects on every machine that is there."""
    stored = resolve(db, name)
    method = _method_of(db, stored)
    if isinstance(method, CurveMethod):
        return {**_document(stored), **_curve_words(db, stored)}
    base: dict[str, list[str]] = {}
    words: dict[str, str] = {}
    for machine in described_machines(db):
        chain = chain_of(machine)
        try:
            base[machine.id] = list(_base_of(method, chain))
        except DataError:
            # A method that this machine cannot be calibrated by has no base on it.
            continue
        for text in stored.effects:
            try:
                words.setdefault(text, describe(parse_effect(text, chain)).meaning)
            except InputError:
                continue
    return {**_document(stored), "base": base, "meaning": words}


def add(
    db: Database, effect: str, to: str, as_: str | None = None, note: str = "", campaign: str | None = None
) -> StoredModel:
    """A new version with one more effect; its parent is the old one.

    The effect must exist on one of the machines that are there, or for a curve in its ``campaign``, else in one of
    the curves that are there. Raises EffectError, NotFoundError.
    """
    parent = resolve(db, to)
    method = _method_of(db, parent)
    if isinstance(method, CurveMethod):
        text = _known_to_curves(db, method, effect, campaign)
    else:
        text = _known(db, effect)
        if _is_base(db, text, method):
            raise InputError(f"{text} is free in every run already, whatever the model; add another effect")
    if text in parent.effects:
        raise InputError(
            f"model {label(parent)} has {text} already; add another effect, or take it out first"
        )
    if as_ is not None and as_ != parent.name and as_ in set(list_models(db)["model"]):
        raise InputError(f"there is a model {as_} already: add to it with --to {as_}, or choose another name")
    return save_model(
        db, _name(as_, parent), (*parent.effects, text), parent=(parent.name, parent.version), note=note
    )


def remove(db: Database, effect: str, from_: str, as_: str | None = None) -> StoredModel:
    """A new version without one of the added effects."""
    parent = resolve(db, from_)
    if effect not in parent.effects:
        there = ", ".join(parent.effects) or "none; the base effects cannot be taken out"
        raise InputError(f"model {label(parent)} has no added effect {effect}; it has {there}")
    left = tuple(text for text in parent.effects if text != effect)
    return save_model(db, _name(as_, parent), left, parent=(parent.name, parent.version))


def _name(as_: str | None, parent: StoredModel) -> str:
    if as_ is None:
        return parent.name
    if "@" in as_ or not as_.strip():
        raise InputError(f"'{as_}' cannot name a model: leave out @, which separates name and version")
    return as_


def _known_to_curves(db: Database, method: CurveMethod, effect: str, campaign: str | None) -> str:
    """The effect in its own words, if the curve named, or any curve, has its columns and not the effect itself."""
    names = curve_names(db) if campaign is None else (campaign,)
    if not names:
        raise NotFoundError("there is no curve yet that could have an effect; import a campaign of one first")
    fault: InputError | None = None
    for name in names:
        curve = load_curve(db, name)
        try:
            text = parse_curve_effect(effect, inputs_of(curve)).text
            method.problem_of(curve, Model(name, added=(text,)))
            return text
        except InputError as error:
            fault = fault or error
    assert fault is not None
    raise fault


def _curve_words(db: Database, stored: StoredModel) -> Document:
    """The base of every curve, and what the added effects mean for the first that has them."""
    base: dict[str, list[str]] = {}
    words: dict[str, str] = {}
    for name in curve_names(db):
        curve = load_curve(db, name)
        base[name] = [curve.base]
        for text in stored.effects:
            try:
                found = parse_curve_effect(text, inputs_of(curve))
            except InputError:
                continue
            unit = curve.units.get(found.column, "")
            clock = found.column == curve.time
            words.setdefault(text, describe_curve(found, curve.response, unit, clock=clock).meaning)
    return {"base": base, "meaning": words}


def _method_of(db: Database, stored: StoredModel) -> ChainMethod | CurveMethod | None:
    """The method that a model descends from; None for a model that was made from none."""
    while stored.parent is not None:
        stored = load_model(db, *stored.parent)
    return methods().get(stored.name)


def _base_of(method: ChainMethod | None, chain: Chain) -> tuple[str, ...]:
    """The effects that are free in every run of a method; those of the complete model for no method."""
    return (base_effects if method is None else method.base_effects)(chain)


def _is_base(db: Database, effect: str, method: ChainMethod | None) -> bool:
    """Whether an effect is a base effect of a method on every machine that it can calibrate."""
    found = []
    for chain in _chains(db):
        try:
            found.append(effect in _base_of(method, chain))
        except DataError:
            continue
    return bool(found) and all(found)


def _chains(db: Database) -> tuple[Chain, ...]:
    """The different chains of the machines that are there."""
    return tuple(dict.fromkeys(chain_of(machine) for machine in described_machines(db)))


def _known(db: Database, effect: str) -> str:
    """The effect in its own words, if any machine has it."""
    chains = _chains(db)
    if not chains:
        raise NotFoundError("there is no machine yet that could have an effect; import a campaign first")
    fault: InputError | None = None
    for chain in chains:
        try:
            return parse_effect(effect, chain).text
        except InputError as error:
            fault = fault or error
    assert fault is not None
    raise fault
