"""QIF against what its makers publish: the shipped sample is valid by their schema, and their samples are read."""

from __future__ import annotations

import tarfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

from monitor.readers.export import Export, ExportFile
from monitor.readers.exports import qif
from monitor.readers.faults import Faults

etree = pytest.importorskip("lxml.etree")

ROOT = Path(__file__).parents[2]
REFERENCES = ROOT / "tests" / "references" / "qif"
PLATE = ROOT / "examples" / "files-of-a-plate" / "plate.qif"
SPACE = "{http://qifstandards.org/xsd/qif3}"
SIGNATURE = """<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema"
  targetNamespace="http://www.w3.org/2000/09/xmldsig#"><xs:element name="Signature" type="xs:anyType"/></xs:schema>"""


@pytest.fixture(scope="module")
def schema(tmp_path_factory: pytest.TempPathFactory) -> object:
    """The schema of QIF 3.0.0; nothing is fetched."""
    folder = tmp_path_factory.mktemp("qif")
    with tarfile.open(REFERENCES / "schema.tar.xz") as archive:
        # Named on Python 3.11.4 and later alone; 3.14 takes it for itself.
        archive.extraction_filter = getattr(tarfile, "data_filter", (lambda member, path: member))
        archive.extractall(folder)
    signature = folder / "signature.xsd"
    signature.write_text(SIGNATURE, encoding="utf-8")

    class Local(etree.Resolver):  # type: ignore[misc]
        def resolve(self, url: str, public_id: str, context: object) -> object:
            return self.resolve_filename(str(signature), context) if "xmldsig" in url else None

    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(Local())
    return etree.XMLSchema(etree.parse(str(folder / "QIFDocument.xsd"), parser))


def read(content: bytes) -> tuple[Export | None, list[str]]:
    """What a document holds, and the messages of what is wrong with it."""
    faults = Faults(["a.qif"])
    export = qif.read(ExportFile("a.qif", content), None, faults)
    return export, [fault.message for fault in faults.sorted()]


def test_iso_23952_the_shipped_sample_is_valid_by_the_published_schema(schema) -> None:
    for path in (PLATE, *sorted(REFERENCES.glob("*.QIF"))):
        schema.assertValid(etree.parse(str(path)))
    broken = etree.fromstring(PLATE.read_bytes().replace(b"QPId", b"QPid"))
    assert not schema.validate(broken)


@pytest.mark.parametrize(("name", "count"), [("QIF_Results_Sample.QIF", 6), ("QIF_PTS_SAMPLE.QIF", 13)])
def test_published_results_are_read_as_another_parser_sees_them(name: str, count: int) -> None:
    content = (REFERENCES / name).read_bytes()
    export, messages = read(content)
    assert not messages
    assert export is not None
    root = ElementTree.fromstring(content)
    features = {node.get("id"): node for node in root.iter() if node.get("id")}
    wanted = [
        node
        for node in root.iter()
        if node.tag.endswith("FeatureMeasurement") and node.find(f"{SPACE}Location") is not None
    ]
    assert len(wanted) == count == len(export.columns["target"])
    for row, node in enumerate(wanted):
        item = features[node.findtext(f"{SPACE}FeatureItemId")]
        nominal = features[item.findtext(f"{SPACE}FeatureNominalId")]
        assert export.columns["target"][row] == item.findtext(f"{SPACE}FeatureName")
        for prefix, of in (("", node), ("nominal_", nominal)):
            place = [export.columns[f"{prefix}{letter}"][row] for letter in "xyz"]
            assert place == of.findtext(f"{SPACE}Location").split()
    assert set(export.units.values()) == {"mm"}


def test_a_unit_whose_factor_is_another_ones_is_refused() -> None:
    """Names of units are free text: one that is called mm and is 0.0254 m long was read as mm."""
    content = PLATE.read_bytes()
    for name, factor in ((b"mm", b"0.0254"), (b"inch", b"0.001"), (b"mm", b"1/1000")):
        other = content.replace(b"<UnitName>mm", b"<UnitName>" + name).replace(
            b">0.001<", b">" + factor + b"<"
        )
        export, messages = read(other)
        assert export is None
        assert len(messages) == 1
        assert messages[0].startswith(f"the unit is called {name.decode()}, which is ")
        assert messages[0].endswith(f"and the factor to metres is '{factor.decode()}'; export in mm")
    inches = content.replace(b"<UnitName>mm", b"<UnitName>inch").replace(b">0.001<", b">0.0254<")
    export, messages = read(inches)
    assert export is not None
    assert export.units["x"] == "inch"
