"""What setups state of one quantity, which has to agree: within a setup, and among setups of one instrument.

The scale of an instrument is one unknown of all its setups, and so is the length of a bar: stated otherwise in one of
them, or forgotten, it would count as another one, as well known again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from monitor.readers.faults import quoted
from monitor.readers.setups.scale_key import SCALE_UNCERTAINTY
from monitor.readers.toml_table import Table
from monitor.records import Setup


@dataclass(frozen=True)
class Stated:
    """A quantity that a setup may state to an uncertainty (``key``) or as known, by the name of its unknown."""

    name: str
    key: str


SCALE = Stated("scale", SCALE_UNCERTAINTY)
LENGTH = Stated("length", "length_standard_uncertainty_um")
DIRECTION = Stated("direction", "direction_standard_uncertainty_urad")


def check_one_statement(table: Table, known_names: Sequence[str]) -> None:
    """Note a fault where a setup states a standard uncertainty of what it states as known."""
    for stated in (SCALE, LENGTH, DIRECTION):
        if stated.key in table.data and stated.name in known_names:
            table.fault(
                stated.key,
                f"the {stated.name} is stated with an uncertainty and as known, which is without one; take "
                f"{quoted(stated.name)} out of known, so that the uncertainty counts, or leave this key out where the "
                f"{stated.name} holds exactly",
            )


def check_agreement(setups: Sequence[tuple[Table, Setup]], takes_scale: Sequence[str]) -> None:
    """Note a fault of every setup that states the scale of its instrument, or the length of its bar, otherwise than the
    first one of that instrument; ``takes_scale`` are the kinds of readings that a scale acts on."""
    first: dict[tuple[Stated, str, float | None], tuple[Table, Setup]] = {}
    for table, setup in setups:
        for stated, length in _of_instrument(setup, takes_scale):
            other = first.setdefault((stated, setup.instrument or "", length), (table, setup))[0]
            own_words, other_words = _in_words(stated, table), _in_words(stated, other)
            if own_words != other_words:
                what = "scale" if length is None else f"length of {length:g} mm"
                table.fault(
                    "known" if own_words == "known" else stated.key,
                    f"the {what} of {quoted(setup.instrument)} is one unknown of all its setups; it is "
                    f"{own_words} here and {other_words} in setup {quoted(other.data['id'])}; write "
                    "the same in each, or name another instrument where it is another one",
                )
            elif stated.key in table.data and table.data.get("certificate") != other.data.get("certificate"):
                _fault_of_certificate(table, other, setup, stated)


def _fault_of_certificate(table: Table, other: Table, setup: Setup, stated: Stated) -> None:
    """Note that two setups state one calibrated quantity by different certificates: two calibrations are two values."""
    own_words, other_words = (
        f"by certificate {quoted(each.data['certificate'])}" if "certificate" in each.data else "without one"
        for each in (table, other)
    )
    table.fault(
        "certificate",
        f"the {stated.name} of {quoted(setup.instrument)} is calibrated {own_words} here and {other_words} in setup "
        f"{quoted(other.data['id'])}; one instrument has one calibration in a campaign: write the one that held "
        "in each, or name the instrument otherwise where it was calibrated anew between them or is another one",
    )


def _of_instrument(setup: Setup, takes_scale: Sequence[str]) -> Iterator[tuple[Stated, float | None]]:
    """What a setup has in common with others of its instrument: the scale, and a bar its length (mm)."""
    if setup.instrument and setup.reading in takes_scale:
        yield SCALE, None
    if setup.instrument and setup.length is not None:
        yield LENGTH, setup.length


def _in_words(stated: Stated, table: Table) -> str:
    """How a setup states a quantity."""
    if stated.name in table.data.get("known", ()):
        return "known"
    value = table.data.get(stated.key)
    unit = stated.key.rpartition("uncertainty_")[2].replace("um", "µm").replace("_per_", "/")
    return "without an uncertainty" if value is None else f"known to {float(value):g} {unit}"
