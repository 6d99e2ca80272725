"""The figures of axes that move together (ISO 10791-6) and of a part that the machine cut (ISO 10791-7)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from monitor.documents import Said
from monitor.methods.standard_test import InterpolationTest, PartTest
from monitor.reporting.standard_tests import (
    FewPoints,
    NoDatum,
    NoProfile,
    OneSenseOfTurning,
    ScaleTakenAsExact,
    followed_figure,
    part_figure,
)
from monitor.statistics.standards.interpolation import followed
from monitor.statistics.standards.parts import (
    FROM_SCALE,
    Element,
    FormFigure,
    FormKind,
    forms,
    part_figures,
    plan_of,
)
from monitor.statistics.standards.profiles import Profile, profile_of
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN
from monitor.workflow.figure_files import save_figure
from monitor.workflow.standards.answer import StandardFigure, StandardTest

#: The editions that literature cites; no text of them was at hand, so no clause is cited.
INTERPOLATION, PART = "ISO 10791-6:2014", "ISO 10791-7"


def interpolation_answer(test: InterpolationTest, rng: np.random.Generator) -> StandardTest:
    """The ranges of the deviations in every direction, of all rows and of each sense."""
    um = MICROMETRE.to_display
    axis = test.rotary[0]
    figures: list[StandardFigure] = []
    senses = 0
    for direction, deviation in test.deviations.items():
        ranges = followed(test.angle, deviation, u_reading=test.u_reading, rng=rng)
        senses = int(np.isfinite(ranges.forward)) + int(np.isfinite(ranges.backward))
        for rows in ("whole", "forward", "backward") if senses == 2 else ("whole",):
            figures.append(
                StandardFigure(
                    *followed_figure(rows, direction, axis),
                    INTERPOLATION,
                    um(getattr(ranges, rows)),
                    um(ranges.u[rows]),
                    MICROMETRE.name,
                )
            )
    notes: tuple[Said, ...] = () if senses == 2 else (OneSenseOfTurning(axis),)
    return StandardTest(
        test.setup, test.run, "interpolation", " ".join(test.axes), MICROMETRE.name, tuple(figures), (), notes
    )


def part_answer(test: PartTest, rng: np.random.Generator) -> StandardTest:
    """Forms, orientations and places of the elements of a part."""
    measures = list(part_figures(_elements(test), u_reading=test.u_reading, u_scale=test.u_scale, rng=rng))
    profiles = _profiles(test)
    for name, profile in profiles.items():
        measures += profile.figures(name, test.u_reading, test.u_scale, rng)
    figures = []
    for figure in measures:
        unit = MICRORADIAN if figure.kind is FormKind.HALF_ANGLE else MICROMETRE
        figures.append(
            StandardFigure(
                *part_figure(figure.kind, figure.element, figure.datum),
                PART,
                unit.to_display(figure.value),
                unit.to_display(figure.u),
                unit.name,
            )
        )
    of_part = [*(feature.name for feature in test.features), *(path.name for path in test.paths)]
    names = ", ".join(of_part or test.short)
    notes = tuple(_notes(test, measures, profiles))
    return StandardTest(test.setup, test.run, "part", names, MICROMETRE.name, tuple(figures), (), notes)


def _notes(test: PartTest, measures: Sequence[FormFigure], profiles: Mapping[str, Profile]) -> Iterator[Said]:
    """What figures are missing of a part, and what u does not hold."""
    circles = sum(feature.kind == "circle" for feature in test.features)
    coaxial = sum(figure.kind is FormKind.CONCENTRICITY for figure in measures)
    has_side = circles < len(test.features)
    if circles > 1 + coaxial and not has_side:
        yield NoDatum()
    without = tuple(path.name for path in test.paths if path.name not in profiles)
    if without:
        yield NoProfile(without)
    if test.short:
        yield FewPoints(tuple(test.short), tuple(test.short.values()), *test.needed)
    if test.exact_scale and any(figure.kind in FROM_SCALE for figure in measures):
        yield ScaleTakenAsExact(test.exact_scale)


def _profiles(test: PartTest) -> dict[str, Profile]:
    """The profiles and faces of a part by the names of their paths, without those that show none."""
    fitted = {path.name: profile_of(path.measured, path.nominal, path.axes) for path in test.paths}
    with_heights = {path.name for path in test.paths if path.has_heights}
    return {
        name: profile
        for name, profile in fitted.items()
        if profile is not None and (not profile.is_face or name in with_heights)
    }


def interpolation_files(test: InterpolationTest, answer: StandardTest, folder: Path) -> list[str]:
    """Draw the deviations over the angle of the first rotary axis; return the names of the files."""
    from monitor.reporting.figures.standards import followed_figure as drawn

    um = 1.0 / MICROMETRE.factor
    whole = [figure for figure in answer.figures if figure.symbol in test.deviations]
    figure = drawn(
        test.angle / DEGREE.factor,
        {name: um * deviation for name, deviation in test.deviations.items()},
        axis=test.rotary[0],
        title=f"{test.setup}, run {test.run}, {' '.join(test.axes)}: "
        + ", ".join(f"{figure.symbol} {figure.value:.1f}" for figure in whole)
        + f" {MICROMETRE.name}",
    )
    return save_figure(figure, folder, f"{test.setup}-{test.run}-{'-'.join(test.axes)}")


def part_files(test: PartTest, folder: Path) -> list[str]:
    """Draw the outline of a part with magnified deviations; return the names of the files."""
    from monitor.reporting.figures.standards import part_figure as drawn

    elements, profiles = _elements(test), _profiles(test)
    if not elements and not profiles:
        return []
    flat = plan_of(elements, test.paths[0].axes[0] if test.paths else np.zeros(3))
    shapes = [(form.name, form.places, form.across, form.deviation) for form in forms(elements, flat)]
    for path in test.paths:
        if path.name in profiles and not profiles[path.name].is_face:
            profile = profiles[path.name]
            shapes.append((path.name, path.nominal @ flat, profile.outward @ flat, profile.deviation))
    if not shapes:
        return []
    figure = drawn(shapes, title=f"{test.setup}, run {test.run}")
    return save_figure(figure, folder, f"{test.setup}-{test.run}-part")


def _elements(test: PartTest) -> list[Element]:
    return [
        Element(
            name=feature.name,
            is_circle=feature.kind == "circle",
            measured=feature.measured,
            nominal=feature.nominal,
            centre=feature.centre,
            normal=feature.normal,
            radius=feature.radius,
            of_cone=feature.turning,
        )
        for feature in test.features
    ]
