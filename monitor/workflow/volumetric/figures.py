"""Draws a volumetric map as slices through the workspace, at the rotary axes' zero."""

from __future__ import annotations

from pathlib import Path

from monitor.reporting.figures import titles
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
        title=titles.map_title(
            answer.campaign, answer.run, (worst.error_um, worst.expanded_um), answer.rms.error_um
        ),
        note=titles.map_note(
            answer.k, answer.p, answer.region.rotary_poses if answer.has_rotary_axes else None
        ),
    )
    make_folder(folder)
    return tuple(save_figure(figure, folder, "volumetric-error"))
