"""Draws a volumetric map as slices through the workspace, at the rotary axes' zero."""

from __future__ import annotations

from pathlib import Path

from monitor.reporting.figures.volumetric import volumetric_slices
from monitor.workflow.figure_files import make_folder, save_figure
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.error_map import VolumetricMap, at_pose


def map_figures(answer: VolumetricAnswer, mapped: VolumetricMap, folder: Path) -> tuple[str, ...]:
    """The slices with arrows; the files. Raises InputError where there is nothing to draw."""
    drawn = at_pose(mapped)
    worst = answer.worst
    figure = volumetric_slices(
        drawn.readings_mm,
        drawn.vectors_um,
        drawn.u_um * answer.k,
        names=drawn.axes,
        title=f"{answer.campaign}, run {answer.run}: at worst {worst.error_um:.1f} µm "
        f"± {worst.expanded_um:.1f} µm, RMS {answer.rms.error_um:.1f} µm",
        note=f"Rotary axes at zero. Colour: length of the error; arrows: its part in the slice; numbers: expanded "
        f"uncertainty (k = {answer.k:.2f}, p = {answer.p:g}). "
        f"The title is about all {answer.region.rotary_poses} rotary poses of the plan.",
    )
    make_folder(folder)
    return tuple(save_figure(figure, folder, "volumetric-error"))
