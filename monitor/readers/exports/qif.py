"""Results of a coordinate measuring machine as QIF 3 (ISO 23952): measured spheres and points with their names.

Every ``...FeatureMeasurement`` with a ``Location`` is a row: ``target`` (the name of its item, else its number), ``x``,
``y``, ``z``, ``nominal_x`` ... where the document has the nominal, and ``diameter``. Lengths are in the primary unit of
``FileUnits``.

The document is read by lxml without document types, entities or network, and no deeper and larger than libxml2 allows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_units import ForeignUnit, decimal_of, foreign_unit

#: Largest document in bytes; as a tree it takes some ten times that.
LARGEST_XML = 16 * 1024**2
#: A factor to metres that differs from its unit's by more than this part is another unit's; some digits are cut.
SAME_UNIT = 1e-6
_NAMESPACE = "qifstandards.org"
_LETTERS = "xyz"
_FACTS = ("Author", "Organization", "ApplicationName")


@dataclass(frozen=True)
class _Document:
    """A document: its root, the unit of its lengths, and the items and nominals of features by their numbers."""

    root: Any
    unit: str | None
    items: Mapping[str, Any]
    nominals: Mapping[str, Any]


def read(file: ExportFile, settings: None, faults: Faults) -> Export | None:
    """Read the measured features that have a location; None with the faults noted."""
    root = _root(file, faults)
    if root is None:
        return None
    before = len(faults)
    items, nominals = (
        {node.get("id"): node for node in _ending(root, name)} for name in ("FeatureItem", "FeatureNominal")
    )
    document = _Document(root, _unit(file.name, root, faults), items, nominals)
    rows: list[dict[str, str]] = []
    lines: list[int] = []
    for node in _ending(root, "FeatureMeasurement"):
        row = _row(file.name, document, node, faults)
        if row is not None:
            rows.append(row)
            lines.append(int(node.sourceline or 0))
        if len(faults) > before + 20:
            return None
    if not rows:
        faults.add(
            file.name,
            None,
            None,
            "the document has no measured feature with a location; export results, not the plan",
        )
    return None if len(faults) > before else _export(document, rows, lines)


def _row(name: str, document: _Document, node: Any, faults: Faults) -> dict[str, str] | None:
    """Return the cells of a measured feature; None where it has no location."""
    location = _child(node, "Location")
    if location is None:
        return None
    feature = document.items.get(_text(node, "FeatureItemId"))
    label = _text(feature, "FeatureName") or f"feature {node.get('id') or node.sourceline}"
    row = {"target": label, **_numbers(name, location, "", label, faults)}
    wanted = _child(document.nominals.get(_text(feature, "FeatureNominalId")), "Location")
    if wanted is not None:
        row |= _numbers(name, wanted, "nominal_", label, faults)
    if diameter := _text(node, "Diameter"):
        row["diameter"] = diameter
    other = location.get("linearUnit")
    if other is not None and foreign_unit(other) != foreign_unit(document.unit or ""):
        faults.add(
            name, location.sourceline, label,
            f"the location is in {quoted(other)}, the document in {document.unit}; export in one unit",
        )  # fmt: skip
    return row


def _export(document: _Document, rows: list[dict[str, str]], lines: list[int]) -> Export:
    keys = [key for key in rows[0] if all(key in row for row in rows)]
    columns = {key: [row[key] for row in rows] for key in keys}
    units = {} if document.unit is None else dict.fromkeys(set(keys) - {"target"}, document.unit)
    label, count = Counter(columns["target"]).most_common(1)[0]
    notes = (f"{quoted(label)} is measured {count} times",) if count > 1 else ()
    facts = [Fact(name, text) for name in _FACTS if (text := _first(document.root, name))]
    layout = f"XML, QIF {document.root.get('versionQIF') or '3'}"
    return Export(columns, units, lines, layout, tuple(facts), _started(document.root), notes)


def _root(file: ExportFile, faults: Faults) -> Any:
    """Return the root of the document; None with the fault noted."""
    try:
        from lxml import etree
    except ImportError:
        faults.add(file.name, None, None, "QIF needs lxml: pip install 'machine-health-monitor[qif]'")
        return None
    if not file.content.strip():
        faults.add(file.name, 1, None, "the file is empty; export the measurement again")
        return None
    if len(file.content) > LARGEST_XML:
        faults.add(
            file.name,
            None,
            None,
            f"the document is larger than {LARGEST_XML // 2**20} MiB; export fewer features",
        )
        return None
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, dtd_validation=False, huge_tree=False,
        remove_comments=True, remove_pis=True,
    )  # fmt: skip
    try:
        root = etree.fromstring(file.content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        faults.add(
            file.name,
            line,
            None,
            f"this is no XML: {str(error)[:120]}; the file is cut, or no QIF: export it again",
        )
        return None
    if root.getroottree().docinfo.doctype:
        faults.add(
            file.name, 1, None, "the document declares a document type, which QIF has not; export it again"
        )
        return None
    if _local(root) != "QIFDocument" or _NAMESPACE not in str(root.tag):
        faults.add(
            file.name,
            root.sourceline,
            None,
            f"the document is a {quoted(_local(root))} and no QIFDocument of {_NAMESPACE}",
        )
        return None
    return root


def _unit(name: str, root: Any, faults: Faults) -> str | None:
    """Return the primary unit of lengths by its name; None where the document states none."""
    for units in _ending(root, "PrimaryUnits"):
        linear = _child(units, "LinearUnit")
        if linear is None:
            continue
        text = _text(linear, "UnitName") or _text(linear, "SIUnitName")
        unit = foreign_unit(text)
        if unit is None:
            faults.add(
                name, linear.sourceline, "LinearUnit", f"{quoted(text)} is no unit of lengths; export in mm"
            )
        elif factor := _text(_child(linear, "UnitConversion"), "Factor"):
            _check_factor(name, linear, unit, factor, faults)
        return text
    return None


def _check_factor(name: str, linear: Any, unit: ForeignUnit, factor: str, faults: Faults) -> None:
    """Note a factor to metres that is not that of the unit by its name: one of the two is wrong."""
    metres, stated = float(unit.factor) / 1000.0, decimal_of(factor)
    if stated is None or abs(float(stated) / metres - 1.0) > SAME_UNIT:
        faults.add(
            name,
            linear.sourceline,
            "LinearUnit",
            f"the unit is called {unit.name}, which is {metres:g} m, and the factor to metres is {quoted(factor)}; "
            "export in mm",
        )


def _numbers(name: str, node: Any, prefix: str, label: str, faults: Faults) -> dict[str, str]:
    cells = (node.text or "").split()
    if len(cells) != len(_LETTERS) or any(decimal_of(cell) is None for cell in cells):
        faults.add(
            name,
            node.sourceline,
            label,
            f"{quoted((node.text or '').strip())} is not x, y and z; export it again",
        )
        return {}
    return {f"{prefix}{letter}": cell for letter, cell in zip(_LETTERS, cells, strict=True)}


def _started(root: Any) -> str | None:
    return _first(root, "InspectionStart") or _first(root, "DateTime")


def _ending(root: Any, name: str) -> Iterator[Any]:
    """Yield the elements whose name ends so, in the order of the document."""
    for node in root.iter():
        if _local(node).endswith(name):
            yield node


def _first(root: Any, name: str) -> str | None:
    return next(
        (node.text.strip() for node in root.iter() if _local(node) == name and (node.text or "").strip()),
        None,
    )


def _child(node: Any, name: str) -> Any:
    if node is None:
        return None
    return next((child for child in node if _local(child) == name), None)


def _text(node: Any, name: str) -> str:
    child = _child(node, name)
    return "" if child is None else (child.text or "").strip()


def _local(node: Any) -> str:
    """Return the name of an element without its namespace; entity references have none."""
    return node.tag.rpartition("}")[2] if isinstance(node.tag, str) else ""


EXPORT = ExportFormat(
    "qif", "results of a coordinate measuring machine as QIF 3; columns target, x, y, z, nominal_x ...", read,
    suffixes=(".qif",),
)  # fmt: skip
