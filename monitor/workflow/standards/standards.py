"""What the standards of machine tools report of the rows of a campaign, with uncertainties."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np

from monitor.approach import ONE_TARGET, ONE_TARGET_RAD
from monitor.documents import Said
from monitor.exceptions import DataError, InputError, NotFoundError, did_you_mean
from monitor.methods import campaign_method
from monitor.methods.method import StandardTests
from monitor.methods.standard_test import (
    AxisTest,
    CircleTest,
    InterpolationTest,
    PartTest,
    RotationTest,
    StandardTestRows,
)
from monitor.reporting.standard_tests import (
    AXIS_FIGURES,
    FewRunsEachWay,
    LengthWithoutUncertainty,
    OneRevolution,
    OneSenseOfRotation,
    OneSideApproached,
    ScaleTakenAsExact,
    circle_figure,
    rotation_figure,
)
from monitor.statistics.standards.circles import Circles, circles
from monitor.statistics.standards.positioning import USUAL_RUNS, AxisFigures, Positioning, positioning
from monitor.statistics.standards.rotation import ErrorMotion, error_motion
from monitor.store import Database
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.figure_files import make_folder, save_figure
from monitor.workflow.measured import machine_campaign
from monitor.workflow.standards.answer import StandardFigure, StandardsAnswer, StandardTest, TargetFigures
from monitor.workflow.standards.paths_and_parts import (
    INTERPOLATION,
    interpolation_answer,
    interpolation_files,
    part_answer,
    part_files,
)
from monitor.workflow.standards.request import StandardsRequest


def standards(db: Database, request: StandardsRequest) -> StandardsAnswer:
    """Evaluate every setup of a campaign that a standard evaluates; nothing is stored.

    Raises NotFoundError for a campaign or setup that is not there, DataError where no setup is such a test.
    """
    campaign = machine_campaign(db, request.campaign, "standards", lambda method: method.standards)
    ability = campaign_method(campaign).standards
    assert isinstance(ability, StandardTests)
    names = [setup.id for setup in campaign.artefact.setups]
    if request.setup is not None and request.setup not in names:
        raise NotFoundError(
            f"campaign {campaign.name} has no setup '{request.setup}'; {did_you_mean(request.setup, names)}"
            f"there are {', '.join(names)}"
        )
    method = campaign_method(campaign)
    problem = method.problem_of(campaign, method.own_model)
    wanted = [name for name in names if request.setup in (None, name)]
    of_wanted = [test for test in ability.tests(problem) if set(test.setup.split(", ")) <= set(wanted)]
    if not of_wanted:
        raise DataError(
            f"no setup of {', '.join(wanted)} is a test of ISO 230-2, -4, -6, -7 or ISO 10791-6, -7: a displacement "
            "along a travel, an angle about the one axis that turns, a distance swung by two linear axes, sensors that "
            "stand still around the one axis that turns, a point or a bar that linear axes keep to while a rotary one "
            "turns, or points of a part whose targets are known"
        )
    folder = None if request.figures is None else make_folder(request.figures)
    tests: list[StandardTest] = []
    files: list[str] = []
    for number, test in enumerate(of_wanted):
        try:
            answer, drawn = _evaluated(test, np.random.default_rng([request.seed, number]), folder)
        except InputError as error:
            raise DataError(f"setup {test.setup}, run {test.run}: {error}") from error
        tests.append(answer)
        files += drawn
    if request.csv is not None:
        files.append(_written(request.csv, tests))
    evaluated_setups = {name for test in tests for name in test.setup.split(", ")}
    left_out = tuple(name for name in wanted if name not in evaluated_setups)
    copied = copied_readings(db, campaign)
    return StandardsAnswer(campaign.name, request.seed, tuple(tests), left_out, tuple(files), copied)


def _evaluated(
    test: StandardTestRows, rng: np.random.Generator, folder: Path | None
) -> tuple[StandardTest, list[str]]:
    """The figures of a test, and the files of its plot where a folder is given."""
    files: list[str] = []
    if isinstance(test, RotationTest):
        motion = error_motion(
            test.angle, test.deviation, about_circle=test.about_circle, tolerance=ONE_TARGET_RAD,
            u_reading=test.u_reading, rng=rng,
        )  # fmt: skip
        answer = _rotation_answer(test, motion)
        files = [] if folder is None else _rotation_figure(test, motion, folder)
    elif isinstance(test, AxisTest):
        axis = _positioning(test, rng)
        answer = _axis_answer(test, axis)
        files = [] if folder is None else _axis_figure(test, axis, answer, folder)
    elif isinstance(test, CircleTest):
        circle = circles(
            test.angle, test.deviation, u_reading=test.u_reading, u_radius=test.u_radius, rng=rng
        )
        answer = _circle_answer(test, circle)
        files = [] if folder is None else _circle_figure(test, circle, answer, folder)
    elif isinstance(test, InterpolationTest):
        answer = interpolation_answer(test, rng)
        files = [] if folder is None else interpolation_files(test, answer, folder)
    else:
        assert isinstance(test, PartTest)
        answer = part_answer(test, rng)
        files = [] if folder is None else part_files(test, folder)
    return answer, files


def _positioning(test: AxisTest, rng: np.random.Generator) -> Positioning:
    return positioning(
        test.position,
        test.deviation,
        tolerance=ONE_TARGET_RAD if test.angular else ONE_TARGET,
        u_reading=test.u_reading,
        u_gain=test.u_gain,
        rng=rng,
    )


def _axis_answer(test: AxisTest, evaluated: Positioning) -> StandardTest:
    unit = MICRORADIAN if test.angular else MICROMETRE
    show = unit.to_display
    show_position = DEGREE.to_display if test.angular else float
    diagonal = len(test.axes) > 1
    standard = "ISO 230-6:2002, clause 3" if diagonal else "ISO 230-2:2014, clause 3"
    figures = tuple(
        StandardFigure(
            *AXIS_FIGURES[field.name],
            standard,
            show(getattr(evaluated.figures, field.name)),
            show(evaluated.u[field.name]),
            unit.name,
        )
        for field in fields(AxisFigures)
    )
    targets = tuple(
        TargetFigures(
            position=show_position(float(position)),
            mean_forward=show(float(evaluated.mean[0, index])),
            mean_backward=show(float(evaluated.mean[1, index])),
            s_forward=show(float(evaluated.deviation[0, index])),
            s_backward=show(float(evaluated.deviation[1, index])),
            reversal=show(float(evaluated.mean[0, index] - evaluated.mean[1, index])),
            runs_forward=int(evaluated.runs[0, index]),
            runs_backward=int(evaluated.runs[1, index]),
        )
        for index, position in enumerate(evaluated.targets)
    )
    return StandardTest(
        test.setup,
        test.run,
        "diagonal" if diagonal else "positioning",
        " ".join(test.axes),
        unit.name,
        figures,
        targets,
        tuple(_notes(test, evaluated)),
    )


def _notes(test: AxisTest, evaluated: Positioning) -> Iterator[Said]:
    """What the standard asks for and the plan does not have, and what u does not hold."""
    fewest = int(evaluated.runs.min())
    if fewest == 0:
        yield OneSideApproached()
    if fewest < USUAL_RUNS:
        yield FewRunsEachWay(fewest, USUAL_RUNS)
    if test.exact_scale:
        yield ScaleTakenAsExact(test.exact_scale)


def _circle_answer(test: CircleTest, circle: Circles) -> StandardTest:
    um, plane = MICROMETRE.to_display, "".join(test.plane)
    standard = INTERPOLATION if test.simultaneous else "ISO 230-4:2005, clause 3"

    def figure(kind: str, value: float, u: str, way: int = 1) -> StandardFigure:
        symbol, name = circle_figure(kind, plane, way)
        return StandardFigure(symbol, name, standard, um(value), um(circle.u[u]), MICROMETRE.name)

    figures = [
        figure(kind, values[way], f"{u}{way}", way)
        for way in circle.circular
        for kind, values, u in (
            ("circular", circle.circular, "G"),
            ("minimum_zone", circle.minimum_zone, "G"),
            ("largest", circle.largest, "Fmax"),
            ("smallest", circle.smallest, "Fmin"),
        )
    ]
    notes: list[Said] = []
    if len(circle.circular) == 2:
        figures += [figure("both", circle.both, "G"), figure("hysteresis", circle.hysteresis, "H")]
    else:
        notes.append(OneSenseOfRotation())
    if np.isnan(test.u_radius):
        notes.append(LengthWithoutUncertainty())
    of = " ".join(test.axes) if test.simultaneous else plane
    return StandardTest(test.setup, test.run, "circle", of, MICROMETRE.name, tuple(figures), (), tuple(notes))


def _rotation_answer(test: RotationTest, evaluated: ErrorMotion) -> StandardTest:
    unit = MICRORADIAN if test.angular else MICROMETRE
    show = unit.to_display
    kind = "tilt" if test.angular else "radial" if test.about_circle else "axial"
    figures = tuple(
        StandardFigure(
            *rotation_figure(name, test.error, kind),
            "ISO 230-7:2015, clause 3",
            show(getattr(evaluated, name)),
            show(evaluated.u[name]),
            unit.name,
        )
        for name in ("total", "synchronous", "asynchronous")
    )
    notes: tuple[Said, ...] = () if evaluated.revolutions > 1 else (OneRevolution(),)
    return StandardTest(test.setup, test.run, "rotation", test.axis, unit.name, figures, (), notes)


def _rotation_figure(test: RotationTest, evaluated: ErrorMotion, folder: Path) -> list[str]:
    from monitor.reporting.figures.standards import rotation_figure as drawn

    unit = MICRORADIAN if test.angular else MICROMETRE
    figure = drawn(
        evaluated.angles,
        evaluated.synchronous_at / unit.factor,
        unit=unit.name,
        title=f"{test.setup}, run {test.run}, {test.error}: synchronous "
        f"{unit.to_display(evaluated.synchronous):.1f} {unit.name}",
    )
    return save_figure(figure, folder, f"{test.setup.replace(', ', '+')}-{test.run}-{test.error}")


def _axis_figure(test: AxisTest, evaluated: Positioning, answer: StandardTest, folder: Path) -> list[str]:
    from monitor.reporting.figures.standards import positioning_figure

    unit = MICRORADIAN if test.angular else MICROMETRE
    position_factor = DEGREE.factor if test.angular else 1.0
    accuracy = next(figure for figure in answer.figures if figure.symbol == "A")
    reversal = next(figure for figure in answer.figures if figure.symbol == "B")
    figure = positioning_figure(
        evaluated.targets / position_factor,
        evaluated.mean / unit.factor,
        evaluated.deviation / unit.factor,
        axis=answer.of,
        units=("°" if test.angular else "mm", unit.name),
        title=f"{test.setup}, run {test.run}: A = {accuracy.value:.1f} {unit.name}, "
        f"B = {reversal.value:.1f} {unit.name}",
    )
    return save_figure(figure, folder, f"{test.setup}-{test.run}")


def _circle_figure(test: CircleTest, circle: Circles, answer: StandardTest, folder: Path) -> list[str]:
    from monitor.reporting.figures.standards import circle_figure as drawn_circle

    um = 1.0 / MICROMETRE.factor
    text = ", ".join(
        f"{figure.symbol} = {figure.value:.1f} µm"
        for figure in answer.figures
        if figure.symbol.startswith(("G(", "H", "G_")) and "zone" not in figure.symbol
    )
    figure = drawn_circle(
        circle.angle,
        circle.radial * um,
        circle.sense,
        plane=test.plane,
        title=f"{test.setup}, run {test.run}: {text}",
    )
    return save_figure(figure, folder, f"{test.setup}-{test.run}")


def _written(path: Path, tests: list[StandardTest]) -> str:
    """Write one line a figure. Raises InputError where the file cannot be written."""
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(
                ["setup", "run", "test", "of", "symbol", "name", "standard", "value", "u", "unit"]
            )
            for test in tests:
                for figure in test.figures:
                    cells = ["" if np.isnan(number) else repr(number) for number in (figure.value, figure.u)]
                    head = [
                        test.setup,
                        test.run,
                        test.test,
                        test.of,
                        figure.symbol,
                        figure.name,
                        figure.standard,
                    ]
                    writer.writerow([*head, *cells, figure.unit])
    except OSError as error:
        raise InputError(f"the file {path} cannot be written: {error.strerror or error}") from error
    return str(path)
