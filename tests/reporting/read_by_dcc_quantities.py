"""Reads a digital certificate by PTB's dccQuantities and dcc-json-toolkit and prints what they say of it as JSON.

Run by a Python that has both, with the file and the folder of PTB's schemas as arguments; dccQuantities computes in
.NET, here Mono. Their download of schemas is answered by that folder, for want of a network. dccQuantities 3.0.4 knows
no uncertainty of a list but an expanded one: standard uncertainties are read by the toolkit, and taken out of what
dccQuantities gets.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

#: The release for which dccQuantities writes; it is loaded with the package, and nothing is written here.
_LOADED_AT_START = "3.4.0-rc.2"
_SIGNATURE = """<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="http://www.w3.org/2000/09/xmldsig#">
<xs:element name="Signature" type="xs:anyType"/></xs:schema>"""


def main(path: str, schemas: Path) -> None:
    """Print what both read of a file."""
    os.environ |= {"PYTHONNET_RUNTIME": "mono", "LC_ALL": "en_US.UTF-8"}
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        for release in ("3.3.0", _LOADED_AT_START):
            kept = Path(folder, "DccJsonToolkit", release)
            kept.mkdir(parents=True)
            for schema in schemas.glob("*.xsd"):
                shutil.copy(schema, kept)
            shutil.copy(schemas / "dcc-3.3.0.xsd", kept / "dcc.xsd")
            (kept / "xmldsig-core-schema.xsd").write_text(_SIGNATURE)
        print(json.dumps(_read(path)))


def _read(path: str) -> dict[str, Any]:
    from dcc_json_toolkit import DccSchema, DccSourceContent

    schema, source = DccSchema("3.3.0"), DccSourceContent(path)
    faults = [str(fault) for fault in schema.validate_dcc(source)]
    if faults:
        return {"faults": faults}
    return {
        "faults": faults,
        "quantities": [_quantity(one) for one in schema.extract_elements(source, "dcc:quantity")],
    }


def _quantity(found: dict[str, Any]) -> dict[str, Any]:
    from dcc_quantities import DccQuantityType

    content = found.get("si:realListXMLList") or found["si:real"]
    stated = {}
    for name in [name for name in content if name.startswith("si:measurementUncertainty")]:
        if "si:expandedMU" not in content[name]:
            stated[name] = content.pop(name)
    quantity = DccQuantityType.from_dcc_data(found)
    return {
        "ref_type": quantity.ref_type,
        "values": list(map(float, quantity.data.values)),
        "u": list(map(float, quantity.data.uncertainties)),
        "stated": stated,
    }


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
