"""By what the runs of a machine were measured: methods, instruments and their certificates, and what is calibrated.

An instrument or a scale bar with a stated uncertainty is off by the same in every campaign of one certificate
(``common_parts``). Identifications of before migration 17 do not say by how much.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.store.connection import Database
from monitor.store.past.machine_runs import RecordedRun

#: The migration since which an identification stores what runs have of calibrated quantities.
PARTS_SINCE = 17

# Every instrument that the setups of a campaign name; else the artefact with a scale bar, or the probe with a scale.
_NAMED = """
WITH described AS (SELECT campaign, artefact, probe FROM campaign WHERE campaign_id IN ({marks}))
SELECT DISTINCT campaign, setup ->> 'instrument' AS instrument, coalesce(setup ->> 'certificate', '') AS certificate,
       coalesce(setup ->> 'scale_uncertainty', setup ->> 'length_uncertainty') IS NOT NULL AS calibrated,
       true AS of_setup
FROM (SELECT campaign, unnest(CAST(artefact -> 'setups' AS JSON[])) AS setup FROM described)
WHERE setup ->> 'instrument' IS NOT NULL
UNION ALL
SELECT campaign, artefact ->> 'id', coalesce(artefact -> 'scale_bar' ->> 'certificate', ''), true, false
FROM described WHERE json_type(artefact -> 'scale_bar') = 'OBJECT'
UNION ALL
SELECT campaign, probe ->> 'id', coalesce(probe ->> 'certificate', ''), true, false
FROM described WHERE probe ->> 'scale_uncertainty' IS NOT NULL
ORDER BY ALL
"""

_BEFORE = """
SELECT campaign FROM identification JOIN campaign USING (campaign_id)
WHERE identification_id IN ({marks})
AND computed_at < (SELECT min(applied_at) FROM schema_migration WHERE number = ?)
AND NOT EXISTS (SELECT 1 FROM common_part AS part WHERE part.identification_id = identification.identification_id)
"""


@dataclass(frozen=True)
class Calibrations:
    """The instruments and artefacts of campaigns: ``certificates`` by campaign and instrument, those of its calibrated
    scales and lengths where it has any, "" where none is named, and ``unstored``: by campaign the calibrated ones
    (instrument, certificate) of which its identification, made by an older version, does not say what its runs have of
    them."""

    certificates: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    unstored: Mapping[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)


def measured_by(
    db: Database, runs: Sequence[RecordedRun], identified: Collection[int]
) -> tuple[npt.NDArray[np.str_], Calibrations]:
    """Return the method of every run (n,), with the instruments of its setups in brackets (``(ball bar)``), and how the
    instruments are calibrated; ``identified`` are the numbers of the identifications."""
    numbers = sorted({run.campaign_id for run in runs})
    named = db.rows(_NAMED.format(marks=_marks(numbers)), numbers) if numbers else []
    of_setups: dict[str, list[str]] = {}
    calibrated: dict[str, list[tuple[str, str]]] = {}
    stated: dict[str, dict[str, dict[bool, list[str]]]] = {}
    for campaign, instrument, certificate, is_calibrated, of_setup in named:
        if of_setup and instrument not in of_setups.setdefault(campaign, []):
            of_setups[campaign].append(instrument)
        of_instrument = stated.setdefault(campaign, {}).setdefault(instrument, {True: [], False: []})
        of_instrument[is_calibrated].append(certificate)
        if is_calibrated:
            calibrated.setdefault(campaign, []).append((instrument, certificate))
    brackets = {campaign: f" ({', '.join(instruments)})" for campaign, instruments in of_setups.items()}
    certificates = {
        name: {instrument: _certificate(*of.values()) for instrument, of in of_campaign.items()}
        for name, of_campaign in stated.items()
    }
    methods = np.array([run.method + brackets.get(run.campaign, "") for run in runs], dtype=np.str_)
    before = _identified_before(db, sorted(identified)) if calibrated else ()
    return methods, Calibrations(
        certificates, {name: tuple(calibrated[name]) for name in before if name in calibrated}
    )


def _certificate(of_calibrated: list[str], of_others: list[str]) -> str:
    """Return the certificates of what is calibrated of an instrument, of all its setups where nothing is: optics
    without a scale make no campaign one of another calibration."""
    return ", ".join(dict.fromkeys(filter(None, of_calibrated or of_others)))


def _identified_before(db: Database, numbers: list[int]) -> Iterable[str]:
    """Return the campaigns whose identifications were stored before their parts could be."""
    rows = db.rows(_BEFORE.format(marks=_marks(numbers)), [*numbers, PARTS_SINCE]) if numbers else []
    return [name for (name,) in rows]


def _marks(numbers: Collection[int]) -> str:
    """Constants, for which a key is looked up."""
    return ", ".join("?" * len(numbers))
