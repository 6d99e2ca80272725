"""Reads ``[[sources]]``: Type B sources of uncertainty, of a campaign or in a file of their own."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

from monitor.exceptions import InputError, did_you_mean
from monitor.readers.axes import Axis
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.toml_lines import line_of, lines_of_keys
from monitor.readers.toml_table import Table, parse_toml
from monitor.sources import HALF_WIDTHS, QUANTITIES, Law, Quantity, QuantityRule, Sharing, Source
from monitor.units import Unit

#: What a quantity that stands elsewhere in the campaign is called, and where it stands.
_ELSEWHERE = {
    "bar_length": "the length of the bar has its line from [artefact.scale_bar] standard_uncertainty_mm",
    "probe": "the repeatability of the probe has its line from [probe] standard_uncertainty_um or the repeated runs",
    "probe_repeatability": "it has its line from [probe] standard_uncertainty_um or from the repeated runs",
    "bar_temperature": "write standard_temperature: the bar is the measurement standard",
    "bar_expansion": "write standard_expansion: the bar is the measurement standard",
}
Word = TypeVar("Word", Law, Sharing)
_LARGEST_SPACING_MM = 100_000.0
_LARGEST_EXPANSION_PER_K = 1e-3
_LARGEST_OFFSET_K = 200.0


def read_sources(top: Table, axes: Iterable[Axis] | None) -> tuple[Source, ...]:
    """Read the tables ``[[sources]]``; ``axes`` are those of the machine, None where they are not known.

    Whatever is wrong is noted among the faults, and that source is left out.
    """
    sources: dict[str, Source] = {}
    for table in top.tables("sources"):
        source = _source(table, None if axes is None else tuple(axes))
        if source is not None and source.name in sources:
            table.fault("name", f"{quoted(source.name)} is listed twice; give every source its own name")
        elif source is not None:
            sources[source.name] = source
    return tuple(sources.values())


def read_sources_file(path: Path) -> tuple[Source, ...]:
    """Read a file of ``[[sources]]`` alone. Raises InputError with all its faults."""
    faults = Faults([path.name])
    content = read_bytes(path.parent, path.name, LARGEST_TOML, faults)
    text = None if content is None else decode(path.name, content, faults)
    top = None if text is None else parse_toml(path.name, text, faults)
    sources: tuple[Source, ...] = ()
    if top is not None:
        sources = read_sources(top, None)
        if not sources and not len(faults):
            top.fault("sources", "the file has no source; write [[sources]] and its keys below")
        top.finish()
    if len(faults):
        listed = "\n".join(f"  {fault}" for fault in faults.sorted())
        raise InputError(f"{path} cannot be used:\n{listed}")
    return sources


def line_of_source(content: bytes, index: int) -> int | None:
    """The line of source number ``index`` (from 0) in the bytes of a file; None where it has none."""
    return line_of(("sources", index), lines_of_keys(content.decode("utf-8-sig", errors="replace")))


def line_of_tolerance(content: bytes, name: str) -> int | None:
    """The line of a limit in ``[machine.tolerances]`` in the bytes of a file; None where it has none."""
    return line_of(
        ("machine", "tolerances", name), lines_of_keys(content.decode("utf-8-sig", errors="replace"))
    )


def _source(table: Table, axes: tuple[Axis, ...] | None) -> Source | None:
    before = len(table.faults)
    name = table.text("name", required=True, example='"temperature of the bar"')
    quantity = _quantity(table)
    law = _word(table, "distribution", Law, Law.NORMAL)
    shared_by = _word(table, "shared_by", Sharing, Sharing.ALL_RUNS)
    dof = table.number("degrees_of_freedom", positive=True, unit="1", example="50")
    if quantity is None or law is None or shared_by is None:
        return None
    rule = QUANTITIES[quantity]
    size = _size(table, quantity, rule, law)
    axis = _axis(table, quantity, rule, axes)
    along = _along(table, rule)
    effect = _text(table, "effect", rule, '"EYX:poly2"')
    alpha = _number(table, "expansion_coefficient_per_K", rule, _LARGEST_EXPANSION_PER_K, "1/K", "11.5e-6")
    offset = _number(table, "temperature_offset_K", rule, _LARGEST_OFFSET_K, "K", "2.5")
    spacing = _spacing(table, rule)
    table.finish()
    if law is Law.STUDENT and (dof is None or dof <= 2.0):
        table.fault(
            "degrees_of_freedom",
            "a t distribution needs more than 2 of them; write for example degrees_of_freedom = 9",
        )
    if law in HALF_WIDTHS and dof is not None:
        table.fault(
            "degrees_of_freedom",
            f"a {law.value} distribution has limits that are taken as known; leave the key out, or write "
            'distribution = "normal" and a standard uncertainty',
        )
    if shared_by is Sharing.PROBING and not rule.by_probing:
        table.fault(
            "shared_by", f'{quantity.value} has one value in a run; write "all runs", "a day" or "a run"'
        )
    if len(table.faults) > before or name is None or size is None:
        return None
    internal, unit = size
    return _checked_unit(
        table,
        Source(
            name=name, quantity=quantity, size=internal, law=law, degrees_of_freedom=dof, shared_by=shared_by,
            axis=axis, along=along, effect=effect, expansion_coefficient=alpha, temperature_offset=offset,
            node_spacing=spacing,
        ),
        unit,
    )  # fmt: skip


def _checked_unit(table: Table, source: Source, unit: Unit) -> Source | None:
    """The source, unless the size of its effect is a length where the effect turns, or an angle where it shifts."""
    if unit == source.unit:
        return source
    suffix = next(s for s, u in QUANTITIES[source.quantity].suffixes.items() if u == source.unit)
    table.fault(
        "effect", f"{quoted(source.effect)} is stated in {source.unit.name}; end the key in _{suffix}"
    )
    return None


def _quantity(table: Table) -> Quantity | None:
    value = table.text("quantity", required=True, example='"standard_temperature"')
    if value is None:
        return None
    quantities = [quantity.value for quantity in Quantity]
    if value in quantities:
        return Quantity(value)
    if value in _ELSEWHERE:
        table.fault("quantity", f"{quoted(value)} is no quantity here: {_ELSEWHERE[value]}")
    else:
        table.fault(
            "quantity",
            f"{quoted(value)} is not known; {did_you_mean(value, quantities)}the quantities are {one_of(quantities)}",
        )
    return None


def _word(table: Table, key: str, kind: type[Word], default: Word) -> Word | None:
    value = table.text(key, example=f'"{default.value}"')
    if value is None:
        return None if key in table.data else default
    values = [word.value for word in kind]
    if value not in values:
        table.fault(
            key, f"{quoted(value)} is not known; {did_you_mean(value, values)}write one of {one_of(values)}"
        )
        return None
    return kind(value)


def _size(table: Table, quantity: Quantity, rule: QuantityRule, law: Law) -> tuple[float, Unit] | None:
    """The size in internal units and the unit of its key, whose stem says whether it is a standard uncertainty."""
    stem, other = (
        ("half_width", "standard_uncertainty")
        if law in HALF_WIDTHS
        else ("standard_uncertainty", "half_width")
    )
    keys = [f"{stem}_{suffix}" for suffix in rule.suffixes]
    values = {
        key: table.number(key, positive=True, largest=rule.largest, unit=unit.name, example="1.0")
        for key, unit in zip(keys, rule.suffixes.values(), strict=True)
    }
    present = [key for key in keys if key in table.data]
    # Asked for as well, so that one message says what would be right.
    wrong = [key for key in table.data if key.startswith((f"{other}_", f"{stem}_")) and key not in keys]
    for key in wrong:
        table.raw(key, required=False, example="")
        table.fault(key, f"the size of {quantity.value} with distribution {law.value} is {' or '.join(keys)}")
    if not present and not wrong:
        table.fault(None, f"the size is missing; write for example {keys[0]} = 1.0")
    if len(present) > 1:
        table.fault(present[1], f"{present[0]} stands there already; state the size once")
    if len(present) != 1 or values[present[0]] is None or wrong:
        return None
    unit = rule.suffixes[present[0].removeprefix(f"{stem}_")]
    return unit.to_internal(float(values[present[0]] or 0.0)), unit


def _asked(key: str, rule: QuantityRule) -> bool:
    """Whether the quantity has such a key; one that it does not have is refused by ``finish``."""
    return key in rule.required or key in rule.optional


def _number(
    table: Table, key: str, rule: QuantityRule, largest: float, unit: str, example: str
) -> float | None:
    if not _asked(key, rule):
        return None
    return table.number(key, required=key in rule.required, largest=largest, unit=unit, example=example)


def _text(table: Table, key: str, rule: QuantityRule, example: str) -> str | None:
    return table.text(key, required=key in rule.required, example=example) if _asked(key, rule) else None


def _axis(table: Table, quantity: Quantity, rule: QuantityRule, axes: tuple[Axis, ...] | None) -> str | None:
    linear = quantity.value.startswith("linear_")
    name = _text(table, "axis", rule, '"X"' if linear else '"C"')
    if name is None or axes is None:
        return name
    fitting = [axis.name for axis in axes if (axis.kind == "linear") == linear]
    if name not in fitting:
        what = "linear axes" if linear else "axes that turn"
        table.fault("axis", f"{quoted(name)} is none of the machine's {what}: {one_of(fitting)}")
        return None
    return name


def _along(table: Table, rule: QuantityRule) -> str | None:
    along = _text(table, "along", rule, '"Z"')
    if along is not None and along not in ("X", "Y", "Z"):
        table.fault("along", f"{quoted(along)} is no direction of the machine; write X, Y or Z")
        return None
    return along


def _spacing(table: Table, rule: QuantityRule) -> tuple[float, float] | None:
    if not _asked("node_spacing_mm", rule):
        return None
    spacing = table.numbers(
        "node_spacing_mm", 2, required=True, largest=_LARGEST_SPACING_MM, unit="mm", example="[20.0, 50.0]"
    )
    if spacing is None:
        return None
    if not 0.0 < spacing[0] <= spacing[1]:
        table.fault(
            "node_spacing_mm", f"{quoted(list(spacing))} must rise from above 0, such as [20.0, 50.0]"
        )
        return None
    return spacing[0], spacing[1]
