"""What a model contains: effects written ``term:shape@driver``, and the catalogue of them with words."""

from monitor.effects.context import Context, InstrumentRows, ReadBy, context_of, positions_of
from monitor.effects.effect import (
    ArtefactEffect,
    Basis,
    ChainEffect,
    Effect,
    InstrumentEffect,
    ParsedEffect,
    TurnEffect,
    parse_effect,
    with_time_constant,
)

__all__ = [
    "ArtefactEffect",
    "Basis",
    "ChainEffect",
    "Context",
    "Effect",
    "InstrumentEffect",
    "InstrumentRows",
    "ParsedEffect",
    "ReadBy",
    "TurnEffect",
    "context_of",
    "parse_effect",
    "positions_of",
    "with_time_constant",
]
