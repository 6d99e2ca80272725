"""The residual vectors of a campaign in three dimensions, and the error as it falls from version to version."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from monitor.web.charts.chart import Chart, Trace, axis, in_template
from monitor.web.charts.machine import machine_traces, motion_of

if TYPE_CHECKING:
    from monitor.reporting.health.comparison import ResidualAgainst
    from monitor.workflow.explain.compare_answer import CompareAnswer
    from monitor.workflow.explain.explain_answer import MachineMissing
    from monitor.workflow.explain.residual_vectors import ResidualsAnswer
    from monitor.workflow.explain.residuals_by_driver import ResidualsByDriverAnswer
    from monitor.workflow.explain.version_answer import CurveVersion, MachineVersion

#: Steps of the magnification slider: 1 µm is drawn as so many millimetres.
MAGNIFICATIONS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
#: From where the machine is looked at; the middle is lowered, so that the axes below it stay in the picture.
CAMERA = {"eye": {"x": 1.17, "y": -1.6, "z": 0.77}, "center": {"x": 0.0, "y": 0.0, "z": -0.09}}
#: More rotary poses than this are no list that anybody chooses from.
MOST_POSES = 80


def scene_chart(residuals: ResidualsAnswer) -> Chart:
    """Show the machine and the probed places; the script adds the arrows, and changes size, run, pose and effect."""
    frame = {
        name: axis(
            f"{name[0].upper()} / mm",
            nticks=5,
            backgroundcolor="rgba(0,0,0,0)",
            showbackground=False,
            showspikes=False,
        )
        for name in ("xaxis", "yaxis", "zaxis")
    }
    return Chart(
        key="scene",
        says=f"{len(residuals.run)} residuals of {residuals.campaign} at the probed places, model {residuals.model}",
        traces=machine_traces(residuals),
        layout={
            "scene": {**frame, "aspectmode": "data", "camera": CAMERA},
            "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
            "uirevision": "scene",
            "showlegend": True,
            "legend": {"orientation": "h", "y": 1.0, "yanchor": "top", "x": 0.0, "bgcolor": "@paper"},
        },
        height=620,
    )


def scene_vectors(residuals: ResidualsAnswer) -> Mapping[str, Any]:
    """Return the places and vectors for the script; probings that were left out are marked."""
    return {
        "run": residuals.run,
        "pose": residuals.pose,
        "target": residuals.target,
        "place": residuals.place_mm,
        "residual": residuals.residual_um,
        "left_out": residuals.left_out,
        "tried": None if residuals.effect is None else explained_vectors(residuals),
    }


def explained_vectors(residuals: ResidualsAnswer) -> Mapping[str, Any]:
    """Return what an effect explains of every residual and what it leaves, for the script."""
    motion = motion_of(residuals)
    return {
        "motion": None if motion is None else asdict(motion),
        "effect": residuals.effect,
        "axis": residuals.effect_axis,
        "explained": residuals.explained_um,
        "remaining": residuals.with_effect_um,
    }


def first_magnification(residuals: ResidualsAnswer) -> int:
    """Return the step of the slider at which the longer arrows, means of runs, take a quarter of what was probed."""
    places, in_fit = np.array(residuals.place_mm), ~np.array(residuals.left_out)
    span = float((places.max(axis=0) - places.min(axis=0)).max())
    keys = np.column_stack([np.array(residuals.pose), np.round(places)])[in_fit]
    _, group, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, group.ravel(), np.array(residuals.residual_um)[in_fit])
    lengths = np.linalg.norm(sums / counts[:, None], axis=1)
    wanted = 0.25 * span / max(float(np.quantile(lengths, 0.9)), 1e-6)
    return int(np.argmin(np.abs(np.log(np.array(MAGNIFICATIONS) / max(wanted, 1e-6)))))


def pose_names(residuals: ResidualsAnswer) -> list[str]:
    """Return the rotary poses as people choose among them; none where every probing has a pose of its own."""
    if not 1 < len(residuals.poses) <= MOST_POSES:
        return []
    return [", ".join(f"{name} {value:g}°" for name, value in pose.items()) for pose in residuals.poses]


def driver_chart(answer: ResidualsByDriverAnswer) -> Chart:
    """Show the residual along X, Y and Z against a driver: single probings, means of groups with U (k = 2)."""
    traces: list[Trace] = []
    layout: dict[str, Any] = {"xaxis": axis(answer.driver.replace("_", " "), anchor="y3")}
    for index, (name, against) in enumerate(answer.along.items()):
        row = "" if index == 0 else str(index + 1)
        traces.append(
            {
                "type": "scatter", "mode": "markers", "name": "single probings", "x": against.at,
                "y": against.before_um, "yaxis": f"y{row}", "showlegend": index == 0, "legendgroup": "single",
                "marker": {"color": "@mid", "size": 3, "opacity": 0.5}, "hoverinfo": "skip",
            }
        )  # fmt: skip
        traces.append(_means(against, f"y{row}", "left by the model", "@blue", "circle", first=index == 0))
        if answer.effect is not None:
            traces.append(
                _means(against, f"y{row}", f"with {answer.effect}", "@orange", "diamond", first=index == 0)
            )
        layout[f"yaxis{row}"] = axis(f"{name} / µm", domain=[0.7 - 0.35 * index, 1.0 - 0.35 * index])
    return Chart(
        key="driver",
        says=f"residual along X, Y and Z against {answer.driver.replace('_', ' ')}, means with U (k = 2), in µm",
        traces=traces, layout=layout, height=520,
    )  # fmt: skip


def _means(
    against: ResidualAgainst, yaxis: str, title: str, colour: str, marker: str, *, first: bool
) -> Trace:
    """The means of the groups, with the tried effect where the title's colour is not the model's own."""
    groups = against.groups
    after = colour == "@orange"
    return {
        "type": "scatter", "mode": "lines+markers", "name": title, "yaxis": yaxis, "showlegend": first,
        "legendgroup": title, "x": [group.at for group in groups],
        "y": [group.after_um if after else group.before_um for group in groups],
        "error_y": {
            "type": "data", "thickness": 1.5, "width": 3, "color": colour,
            "array": [2.0 * ((group.u_after_um if after else group.u_before_um) or 0.0) for group in groups],
        },
        "line": {"color": colour, "width": 1.5}, "marker": {"color": colour, "symbol": marker, "size": 7},
        "hovertemplate": "%{x:.4g}: %{y:.2f} µm<extra>" + in_template(title) + "</extra>",
    }  # fmt: skip


def failing_charts(answer: CompareAnswer) -> list[Chart]:
    """Show where the model fails: the RMS by target, axis and run, beside what is expected."""
    # Loaded where it is met: whoever opens the first page waits for what is loaded before.
    from monitor.workflow.explain.compare_answer import MachinePart

    comparison = answer.comparison
    expected = comparison.expected_rms_um
    charts = []
    for name, parts in comparison.by.items():
        shown = {
            label: part
            for label, part in parts.items()
            if isinstance(part, MachinePart) and part.rms_um > 0.005
        }
        if len(shown) < 2 or name not in ("target", "axis", "run"):
            continue
        lines = [] if expected is None else [_level(expected)]
        said = "" if expected is None else f"; dashed: {expected:.2f} µm are expected"
        charts.append(
            Chart(
                key=f"by-{name}",
                says=f"RMS of the residual by {name} in µm{said}",
                traces=[
                    {
                        "type": "bar", "x": list(shown), "y": [part.rms_um for part in shown.values()],
                        "marker": {"color": "@blue"}, "hovertemplate": "%{x}: %{y:.2f} µm<extra></extra>",
                    }
                ],
                layout={
                    "xaxis": axis(name, type="category"), "yaxis": axis("RMS / µm", rangemode="tozero"),
                    "shapes": lines,
                },
                height=260,
            )
        )  # fmt: skip
    return charts


def ranking_chart(missing: Sequence[MachineMissing]) -> Chart:
    """Show the missing effects by size, the strongest evidence first."""
    names = [f"{effect.rank}. {effect.effect}" for effect in missing]
    return Chart(
        key="ranking",
        says="missing effects by rank with their peak displacement in µm",
        traces=[
            {
                "type": "bar", "orientation": "h", "y": names, "x": [effect.peak_um for effect in missing],
                "marker": {"color": "@orange"}, "hovertemplate": "%{y}: %{x:.2f} %{customdata} at most<extra></extra>",
                "customdata": ["µm" if effect.peak_urad is None else "µrad" for effect in missing],
            }
        ],
        layout={
            "yaxis": axis("", autorange="reversed"), "xaxis": axis("peak displacement / µm", rangemode="tozero"),
            "margin": {"l": 160, "r": 16, "t": 8, "b": 44},
        },
        height=110 + 34 * len(names),
    )  # fmt: skip


def falling_chart(
    steps: Sequence[MachineVersion | CurveVersion], proposed: MachineMissing | None, expected_um: float | None
) -> Chart | None:
    """Show the error of each version, on the fitted runs and on held-out ones, down to what the readings' noise leaves
    (``expected_um``); None for curves."""
    from monitor.workflow.explain.version_answer import MachineVersion

    versions = [step for step in steps if isinstance(step, MachineVersion)]
    if not versions:
        return None
    names = [step.model for step in versions]
    fitted = [step.rms_um for step in versions]
    held_out = [step.heldout_rms_um for step in versions]
    traces: list[Trace] = [
        _steps(names, fitted, "RMS on all runs", "@blue", "circle"),
        _steps(names, held_out, "RMS on what was held out", "@orange", "diamond"),
    ]
    if proposed is not None:
        label = f"with {proposed.effect}"
        traces.append(
            {
                "type": "scatter", "mode": "markers+lines", "name": "if the best effect is added",
                "x": [names[-1], label], "y": [fitted[-1], proposed.rms_after_um],
                "line": {"color": "@teal", "dash": "dot", "shape": "hv"},
                "marker": {"color": "@teal", "symbol": "square", "size": 10},
            }
        )  # fmt: skip
    lines = [] if expected_um is None else [_level(expected_um, "noise floor")]
    labels = names if proposed is None else [*names, f"with {proposed.effect}"]
    every = [*fitted, *held_out, expected_um, None if proposed is None else proposed.rms_after_um]
    return Chart(
        key="falling",
        says="RMS of the residual by version in µm; the noise floor is what the readings' uncertainty leaves",
        traces=traces,
        layout={
            # Half a step beside the first and the last: their names are whole.
            "xaxis": axis("", type="category", range=[-0.5, len(labels) - 0.5]),
            "yaxis": axis("RMS / µm", range=_falling_range([value for value in every if value is not None])),
            "shapes": lines,
        },
        height=340,
    )  # fmt: skip


def _falling_range(values: Sequence[float]) -> list[float]:
    """From zero, or where all steps lie far above it from a little below the lowest: the steps are looked at."""
    low, high = min(values), max(values)
    return [
        0.0 if low < 0.5 * high else low - 0.5 * (high - low) - 0.02 * high,
        high + 0.1 * (high - low) + 0.02 * high,
    ]


def _steps(names: list[str], values: Sequence[float | None], title: str, colour: str, marker: str) -> Trace:
    return {
        "type": "scatter", "mode": "lines+markers", "name": title, "x": names, "y": list(values),
        "line": {"shape": "hv", "color": colour, "width": 2}, "marker": {"size": 9, "color": colour, "symbol": marker},
        "hovertemplate": "%{x}: %{y:.2f} µm<extra>" + in_template(title) + "</extra>",
    }  # fmt: skip


def _level(value: float, name: str = "") -> Any:
    line: dict[str, Any] = {
        "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": value, "y1": value,
        "line": {"color": "@orange", "dash": "longdash", "width": 1.5},
    }  # fmt: skip
    if name:
        font = {"size": 11, "color": "@ink"}
        line["label"] = {
            "text": f"{name} {value:.2f} µm", "textposition": "start", "yanchor": "top", "font": font,
        }  # fmt: skip
    return line
