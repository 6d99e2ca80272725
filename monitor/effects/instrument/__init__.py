"""Errors of instruments, one file a kind of instrument: beams, bars, probes, and zeros that drift."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from monitor.effects.context import InstrumentRows
from monitor.effects.instrument_change import InstrumentChange
from monitor.effects.registry import built_in, parse
from monitor.exceptions import EffectError

__all__ = ["HEADS", "InstrumentChange", "changes_of", "parse_instrument"]

#: What the texts of these changes begin with, before a colon; no term of a chain is called so.
HEADS = ("instrument",)


def parse_instrument(body: str) -> InstrumentChange:
    """Return the change that a text names. Raises EffectError, listing what there is, for an unknown one."""
    change: InstrumentChange | None = parse(body, __name__)
    if change is None:
        raise EffectError(
            f"there is no effect '{body}' of an instrument; after instrument: and the id of a setup there are "
            ":scale, :cosine and :dead_path@... (laser), :length (bar), :lobing2 and :lobing3 (probe, sphere), "
            ":expansion@... and :expansion(X=120,Y=80)@... (points of a plate, held there), "
            ":drift@... (lengths) and :tilt@... (angles), as in "
            "instrument:laser-x:scale"
        )
    return change


def changes_of(instruments: InstrumentRows, drivers: Iterable[str]) -> Iterator[str]:
    """Yield every change that the setups of a campaign may have, as it is written.

    What holds for all setups of an instrument is asked of these together where there are several.
    """
    drivers = tuple(drivers)
    for kind in built_in(__name__):
        assert issubclass(kind, InstrumentChange)
        yield from _of_kind(kind, instruments, drivers)


def _of_kind(
    kind: type[InstrumentChange], instruments: InstrumentRows, drivers: tuple[str, ...]
) -> Iterator[str]:
    """One change of all setups that may have it, by itself and with each driver."""
    able = [setup for setup in instruments.setups if setup.kind in kind.kinds]
    counts = Counter(setup.instrument for setup in able if setup.instrument and kind.of_instruments)
    several = [name for name, count in counts.items() if count > 1]
    single = [setup.id for setup in able if setup.instrument not in several]
    if not kind.needs_driver:
        names = [setup.id for setup in able] if kind.also_single else single
        yield from (f"instrument:{name}:{kind.word}" for name in (*names, *several))
    if kind.needs_driver or kind.of_instruments:
        for driver in drivers:
            yield from (f"instrument:{name}:{kind.word}@{driver}" for name in (*single, *several))
