"""What measured each run of a machine, as far as it makes a difference to a parameter.

Runs of one method with other instruments, or with another certificate of one, are off by something else each: what
differs between them may be theirs. A certificate counts for a parameter that rests on it, or where nothing is stored
of what a parameter has of that instrument.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.sources import CommonQuantity
from monitor.store import MachineHistory

#: A parameter rests on a calibration from this part of the u of a run on.
COUNTS = 0.1


def what_measured(
    history: MachineHistory,
    column: int | None = None,
    parts: Mapping[CommonQuantity, Array] = MappingProxyType({}),
) -> tuple[tuple[str, ...], npt.NDArray[np.intp]]:
    """Return what measured a parameter, in words, and the number (n,) of it of each run, in the order of their first;
    ``parts`` (n, p) are what all have of calibrated quantities. Of no ``column`` every certificate counts."""
    campaigns = set(history.campaign.tolist())
    certificates = [history.calibrations.certificates.get(name, {}) for name in campaigns]
    if len(set(history.measured_by.tolist())) == 1 and all(each == certificates[0] for each in certificates):
        return (str(history.measured_by[0]),), np.zeros(len(history.run), dtype=np.intp)
    described: dict[tuple[str, tuple[tuple[str, str], ...]], int] = {}
    of_campaign: dict[str, int] = {}
    by = np.empty(len(history.run), dtype=np.intp)
    for run, campaign in enumerate(history.campaign.tolist()):
        if campaign not in of_campaign:
            calibrated = tuple(sorted(_certificates(history, campaign, column, parts).items()))
            key = (str(history.measured_by[run]), calibrated)
            of_campaign[campaign] = described.setdefault(key, len(described))
        by[run] = of_campaign[campaign]
    return tuple(_named(name, dict(calibrated), described) for name, calibrated in described), by


def _certificates(
    history: MachineHistory, campaign: str, column: int | None, parts: Mapping[CommonQuantity, Array]
) -> dict[str, str]:
    """The certificates of the instruments of a campaign on which a parameter rests, all where none is named."""
    if column is None:
        return dict(history.calibrations.certificates.get(campaign, {}))
    runs = history.campaign == campaign
    u = history.u[runs, column]
    certificates = {}
    for instrument, certificate in history.calibrations.certificates.get(campaign, {}).items():
        of_it = [part[runs, column] for quantity, part in parts.items() if quantity.of == instrument]
        if not of_it or any(bool((np.abs(part) > COUNTS * u).any()) for part in of_it):
            certificates[instrument] = certificate
    return certificates


def _named(
    name: str, certificates: Mapping[str, str], every: Iterable[tuple[str, tuple[tuple[str, str], ...]]]
) -> str:
    """The instruments, with those of their certificates that others of the same instruments have not."""
    others = [dict(calibrated) for other, calibrated in every if other == name]
    apart = [of for of in certificates if len({each.get(of) for each in others}) > 1]
    calibrated = ", ".join(f"{of} {certificates[of] or 'without a certificate'}" for of in apart)
    return f"{name} with {calibrated}" if calibrated else name
