"""Writes a campaign as a folder of format 1, so that reading it gives the same numbers to the last bit."""

from __future__ import annotations

import csv
import io
import math
import shutil
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from monitor.exceptions import CampaignError, InputError
from monitor.readers.axes import axes_of, axes_of_machine
from monitor.readers.campaign.probings_file import SETUP
from monitor.readers.campaign_toml import campaign_toml
from monitor.readers.registry import read_campaign
from monitor.readers.tables.decimals import decimal_in
from monitor.records import Campaign

FIRST_OF_RUNS = ("run", "started_at", "day", "warm_up", "ambient_degC")
FIRST_OF_PROBINGS = ("run", "sequence", "time_s", "target")


def write_campaign(campaign: Campaign, folder: Path) -> Path:
    """Write ``campaign.toml``, ``runs.csv`` and ``probings.csv`` into a new folder; returns the folder.

    What was written is read back before the folder appears, so a campaign that the reader would refuse is
    refused here, and nothing is written half. Raises CampaignError for such a campaign, InputError if the
    folder is there already or cannot be made. ``campaign.files`` is not used: the records are what is written.

    An angle is written as the shortest decimal of degrees that reads back as the same double of radians.
    Where none exists the nearest is written, which reads back one bit off (2.2e-16 of itself): 9 % of
    20 000 arbitrary angles, none of 20 000 that came from decimals of degrees.
    """
    folder = Path(folder)
    if folder.exists() or folder.is_symlink():
        raise InputError(f"{folder} is there already; give a folder that does not exist yet")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{folder.name[:50]}-", dir=folder.parent) as around:
            draft = Path(around) / "campaign"
            draft.mkdir()
            for name, text in _texts(campaign).items():
                (draft / name).write_bytes(text.encode("utf-8"))
            try:
                read_campaign(draft)
            except CampaignError as error:
                raise CampaignError(str(folder), error.faults) from None
            shutil.move(draft, folder)
    except UnicodeEncodeError as error:
        raise InputError(
            f"{folder} cannot be written: a name holds half a character ({error.reason})"
        ) from error
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror or error}") from error
    return folder


def _texts(campaign: Campaign) -> dict[str, str]:
    return {
        "campaign.toml": campaign_toml(campaign),
        "runs.csv": _csv(_runs(campaign)),
        "probings.csv": _csv(_probings(campaign)),
    }


def _csv(rows: Iterable[Iterable[str]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def _runs(campaign: Campaign) -> Iterable[list[str]]:
    names = dict.fromkeys(name for run in campaign.runs for name in run.conditions)
    further = [name for name in names if name not in FIRST_OF_RUNS]
    yield [*FIRST_OF_RUNS, *further]
    for run in campaign.runs:
        conditions = [run.conditions.get(name, math.nan) for name in (FIRST_OF_RUNS[-1], *further)]
        yield [
            str(run.run),
            run.started_at.isoformat(),
            str(run.day),
            "true" if run.warm_up else "false",
            *map(_number, conditions),
        ]


def _probings(campaign: Campaign) -> Iterable[list[str]]:
    probings = campaign.probings
    axes = axes_of_machine(campaign.machine)
    if not axes:
        wrong = axes_of(campaign.machine.topology)[1]
        raise InputError(f"topology '{campaign.machine.topology}' cannot be parsed: {wrong}")
    missing = [axis.name for axis in axes if axis.name not in probings.readings]
    if missing:
        raise InputError(f"the probings hold no readings of axis {', '.join(missing)}")
    in_order = sorted(axes, key=lambda axis: (("linear", "rotary", "spindle").index(axis.kind), axis.name))
    setups = campaign.artefact.setups
    channels = {name: values for name, values in probings.channels.items() if not setups or name != SETUP}
    first = (*FIRST_OF_PROBINGS[:3], SETUP, FIRST_OF_PROBINGS[3]) if setups else FIRST_OF_PROBINGS
    yield [*first, *(axis.column for axis in in_order), *channels]
    columns = [
        map(str, probings.run.tolist()),
        map(str, probings.sequence.tolist()),
        map(_number, probings.time.tolist()),
        *([[setups[int(number) - 1].id for number in probings.channels[SETUP]]] if setups else []),
        probings.target.tolist(),
    ]
    for axis in in_order:
        write = cache(decimal_in(axis.unit))
        columns.append(map(write, probings.readings[axis.name].tolist()))
    columns += [map(_number, values.tolist()) for values in channels.values()]
    yield from (list(row) for row in zip(*columns, strict=True))


def _number(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))
