"""Requests about models."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.exceptions import InputError

#: Effects that are added at once; a step of the search adds a handful.
MOST_AT_ONCE = 100


@dataclass(frozen=True)
class ShowModelRequest:
    """Show a model, or a version of it: ``NAME@2``."""

    name: str


@dataclass(frozen=True)
class AddEffectRequest:
    """Make a version of the model ``to`` with one more effect, under another name with ``new_name``.

    ``beside`` are further effects of the same version: of two that take each other's part neither shows what it is
    worth alone. ``campaign`` is where the error before and after is shown; with None it is that on which the model was
    last used. Raises InputError for more effects than a campaign could tell apart.
    """

    effect: str
    to: str
    new_name: str | None = None
    note: str = ""
    campaign: str | None = None
    beside: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.beside) >= MOST_AT_ONCE:
            raise InputError(f"{MOST_AT_ONCE} effects at most are added at once, not {len(self.beside) + 1}")

    @property
    def effects(self) -> tuple[str, ...]:
        """All effects that are added."""
        return (self.effect, *self.beside)


@dataclass(frozen=True)
class RemoveEffectRequest:
    """Make a version of the model ``model`` without one of its added effects."""

    effect: str
    model: str
    new_name: str | None = None


@dataclass(frozen=True)
class UseModelRequest:
    """Follow a ``machine`` by a ``model``, a version of it or its latest, for a ``reason`` that is stored.

    Raises InputError for a blank reason.
    """

    model: str
    machine: str
    reason: str

    def __post_init__(self) -> None:
        if not self.reason.strip():
            raise InputError(f"say why {self.machine} is followed by another model: --reason TEXT")
