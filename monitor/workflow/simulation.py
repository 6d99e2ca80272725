"""A virtual campaign folder, to rehearse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from monitor.exceptions import InputError
from monitor.methods.samba.virtual import virtual_campaign
from monitor.methods.tracker.virtual import virtual_robot
from monitor.readers import write_campaign
from monitor.units import MICROMETRE


def simulate(
    out: Path, effect: str | None, peak_um: float, noise_um: float | None, seed: int, robot: bool = False
) -> dict[str, Any]:
    """Write a campaign folder named after ``out``; its hidden effect has the peak displacement ``peak_um``.

    A machine tool touched by ``samba`` (noise of 1 µm where none is given), or a ``robot`` tracked (20 µm).
    """
    make = virtual_robot if robot else virtual_campaign
    noise_um = (20.0 if robot else 1.0) if noise_um is None else noise_um
    if noise_um <= 0 or not np.isfinite(noise_um):
        raise InputError(f"--noise {noise_um}: the noise of a reading must be above 0 µm")
    if not np.isfinite(peak_um) or peak_um <= 0:
        raise InputError(f"--peak {peak_um}: the peak must be a number of µm above 0")
    if seed < 0:
        raise InputError(f"--seed {seed}: a seed is a whole number from 0 on")
    campaign = make(
        out.resolve().name,
        np.random.default_rng(seed),
        effect=effect,
        peak=MICROMETRE.to_internal(peak_um),
        noise=MICROMETRE.to_internal(noise_um),
    )
    write_campaign(campaign, out)
    touches = len(campaign.probings) // len(campaign.runs)
    hidden = f"{effect} with a peak of {peak_um:g} µm is hidden" if effect else "nothing is hidden"
    runs = f"{len(campaign.runs)} run{'s' if len(campaign.runs) > 1 else ''}"
    return {
        "folder": str(out),
        "campaign": campaign.name,
        "effect": effect,
        "peak_um": peak_um if effect else None,
        "noise_um": noise_um,
        "seed": seed,
        "runs": len(campaign.runs),
        "probings": len(campaign.probings),
        "message": f"{out}: {runs} of {touches} probings; {hidden}",
    }
