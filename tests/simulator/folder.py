"""Write a simulated campaign as a campaign folder, format 1: campaign.toml, runs.csv, probings.csv."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from .campaign import SimulatedMachine
from .plans import Plan, Schedule


def write_campaign(
    folder: Path,
    name: str,
    plan: Plan,
    machine: SimulatedMachine,
    schedule: Schedule,
    campaign: dict[str, object],
    machine_id: str = "HU40-T",
    method: str = "samba",
    decimals: int = 6,
) -> Path:
    """Write what `simulate` returned into `folder` (made if missing) and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["format = 1", f'campaign = "{name}"', f'method = "{method}"', ""]
    lines += ["[machine]", f'id = "{machine_id}"', f'topology = "{machine.topology}"', "", "[machine.axes]"]
    lines += [f"{axis} = {{ sign = {int(sign)} }}" for axis, sign in machine.signs.items()]
    lines += ["", "[probe]", 'id = "probe-1"', 'model = "touch-trigger probe"']
    lines += [
        f"standard_uncertainty_um = {plan.probe_uncertainty_um}",
        "",
        "[artefact]",
        'id = "simulated balls"',
    ]
    for ball, point in plan.balls.items():
        lines += ["", "[[artefact.balls]]", f'id = "{ball}"', f"nominal_mm = {[float(p) for p in point]}"]
        lines += [f"diameter_mm = {plan.ball_diameter_mm}"]
    if plan.bar is not None:
        lines += ["", "[artefact.scale_bar]", f'balls = ["{plan.bar[0]}", "{plan.bar[1]}"]']
        lines += [f"length_mm = {plan.bar_length_mm}", f"standard_uncertainty_mm = {plan.bar_uncertainty_mm}"]
        lines += ['certificate = "simulated"']
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")

    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(["run", "started_at", "day", "warm_up", "ambient_degC"])
        rows = zip(schedule.started_at, schedule.day, schedule.warm_up, schedule.ambient_degC, strict=True)
        for k, (start, day, warm, ambient) in enumerate(rows, 1):
            out.writerow([k, start.isoformat(), day, str(warm).lower(), f"{ambient:.2f}"])

    columns: dict[str, np.ndarray] = campaign["columns"]  # type: ignore[assignment]
    channels: dict[str, np.ndarray] = campaign["channels"]  # type: ignore[assignment]
    text = [[str(v) for v in campaign["run"]], [str(v) for v in campaign["sequence"]]]  # type: ignore[attr-defined]
    text += [[f"{v:.1f}" for v in campaign["time_s"]], list(campaign["target"])]  # type: ignore[attr-defined, call-overload]
    for column, values in columns.items():
        text.append([f"{v:.{decimals}f}" if column.endswith("_mm") else f"{v:.9g}" for v in values])
    text += [[f"{v:.3f}" for v in values] for values in channels.values()]
    with (folder / "probings.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(["run", "sequence", "time_s", "target", *columns, *channels])
        out.writerows(zip(*text, strict=True))
    return folder
