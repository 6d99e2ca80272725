"""Reads a digital certificate by PyDCC (Siemens and PTB) and prints what that says of it as JSON.

Run by a Python that has PyDCC, with the file as argument. Two things of PyDCC are taken out: its download of schemas,
for want of a network, and its check of signatures, whose library knows no OpenSSL of today (our XML bears none).
"""

from __future__ import annotations

import json
import sys
from unittest.mock import MagicMock

for name in ("certvalidator", "dcc.dcc_xml_validator", "requests"):
    sys.modules[name] = MagicMock()


def main(path: str) -> None:
    """Print what PyDCC reads of a file."""
    from dcc.dcc import DCC

    certificate = DCC(path)
    print(
        json.dumps(
            {
                "number": certificate.uid(),
                "version": certificate.version(),
                "laboratory": certificate.calibration_laboratory_name(),
                "day": f"{certificate.calibration_date():%Y-%m-%d}",
                "language": certificate.mandatory_language(),
                "replaces": certificate.has_previous_report(),
                "results": certificate.get_calibration_results("name", certificate.mandatory_language()),
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1])
