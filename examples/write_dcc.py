"""A Digital Calibration Certificate (PTB DCC 3.3.0, D-SI 2.2.1) from numbers of one's own: no campaign, no database.

    python examples/write_dcc.py certificate.dcc.xml

The writer needs a record with every item of ISO/IEC 17025:2017, 7.8.2.1 and 7.8.4.1; what is missing it names. The two
offsets below, their uncertainties and their correlation are made up.
"""

from __future__ import annotations

import sys
from datetime import date
from pathlib import Path

from monitor.reporting.certificate.dcc import dcc_xml
from monitor.reporting.certificate.record import (
    CertificateRecord,
    Condition,
    Item,
    MethodUsed,
    NotApplicable,
    Party,
    Person,
    Reference,
)
from monitor.reporting.certificate.results import CoverageFactors, JointEstimate, ResultStatements, result_set
from monitor.units import MICROMETRE, MICRORADIAN

# Estimates and covariance in mm and rad; U and the regions follow from k_q and k_p (JCGM 102:2011, 6.5).
POSITION_MM, TILT_RAD = 12.4e-3, -31.0e-6
U_POSITION_MM, U_TILT_RAD, CORRELATION = 0.8e-3, 2.1e-6, 0.35
BETWEEN = CORRELATION * U_POSITION_MM * U_TILT_RAD

RESULT = result_set(
    JointEstimate(
        ["EX0C", "EB0C"],
        [MICROMETRE, MICRORADIAN],
        [POSITION_MM, TILT_RAD],
        [[U_POSITION_MM**2, BETWEEN], [BETWEEN, U_TILT_RAD**2]],
    ),
    CoverageFactors(
        p=0.95,
        k_p=2.45,  # root of the chi-square quantile, 2 dimensions
        k_q=2.24,  # two intervals at once (Bonferroni)
        rank=2,
    ),
    ResultStatements(
        state="as found",
        evaluation="GUM uncertainty framework, JCGM 102:2011 clause 6",
        descriptions={"EX0C": "position in X of axis C", "EB0C": "orientation about Y of axis C"},
    ),
)

RECORD = CertificateRecord(
    title="Calibration certificate",
    laboratory=Party("Made-up Laboratory", ("1 Example Road", "00000 Nowhere"), "laboratory@example.org"),
    country="XX",  # ISO 3166-1, two letters
    dcc_version="3.3.0",  # or 3.2.1
    place="hall 1",
    number="K-2026-0042",
    customer=Party("Made-up Customer", ("2 Example Street", "00000 Nowhere"), "quality@example.org"),
    method=MethodUsed(
        "circular test", "procedure 7, edition 2", "offset and tilt of one axis", "own-software 1.4"
    ),
    item=Item("rotary table RT-320", "serial number 4711", "in working order"),
    received_on=date(2026, 3, 2),
    performed_on=(date(2026, 3, 4), date(2026, 3, 4)),
    issued_on=date(2026, 3, 9),
    sampling=NotApplicable("no sampling took place"),
    relates_only="The results relate only to the item calibrated.",
    results=(RESULT,),
    deviations="None.",
    authorised_by=(Person("A. Example", "head of the laboratory"),),
    external_results="None.",
    reproduction="Not to be reproduced except in full.",
    conditions=(Condition("ambient temperature", "20.3 °C"),),
    traceability="Lengths are traceable to the ball bar named below.",
    references=(Reference("ball bar 150 mm", "certificate BB-2026-17"),),
    adjustment="No adjustment took place.",
    conformity=NotApplicable("not asked for"),
    opinions=NotApplicable("none"),
)

if __name__ == "__main__":
    place = Path(sys.argv[1] if len(sys.argv) > 1 else "certificate.dcc.xml")
    place.write_bytes(dcc_xml(RECORD))
    print(place)
