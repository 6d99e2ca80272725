"""What speaks against a certificate of a run although its uncertainty could be evaluated; stored with the evaluation.

Limits, each with its reason; over all examples and labelled campaigns they refuse nothing that is good (the largest
value there is named): docs/reports-and-certificates.md has the table.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from monitor.discovery import RobustFit
from monitor.effects import ChainEffect
from monitor.methods import campaign_method
from monitor.methods.bar_temperature import bar_temperature
from monitor.methods.instruments.mistaken_axes import STATED_WITHIN
from monitor.methods.method import Instruments
from monitor.readers.doubts.doubts import (
    AIR_RANGE,
    LARGEST_BAR_DIFFERENCE,
    bar_difference,
    implausible_temperatures,
)
from monitor.readers.doubts.unit_doubts import off_places, runs_in_units
from monitor.records import Campaign, Run
from monitor.reporting.certificate.grounds import IN_U, SEVERAL, Ground, GroundKind
from monitor.units import MICROMETRE
from monitor.workflow.identify.notes import TOO_SMALL
from monitor.workflow.instruments.against_others import against_others
from monitor.workflow.instruments.instruments import disagreement, limit_of

#: The residuals over what the stated uncertainties leave. Up to three a probe's statement may be wrong, and lack of fit
#: has its line in the budget; from five on 96 % of their variance has no known source. Largest of a complete model:
#: 1.6; with hidden effects: 3.4 (tracked-robot).
MOST_TIMES = 5.0
#: mm/m. A steel scale 30 K off 20 °C comes to 0.35; what is more is no property of an axis, but a wrong length. Largest
#: in the examples: 0.07.
LARGEST_GAIN = 1e-3
#: mm/m. What all axes have in common and the bar has not: steel scales 30 K warmer than the bar was taken for. Above it
#: the gains agree to a share of 20 % only where the bar is another length than stated. Largest in the
#: examples: 0.028.
LARGEST_COMMON_GAIN, COMMON_WITHIN = 3.5e-4, 0.2
#: rad. Axes of machines given by letters are set up to tenths of a milliradian at worst; 5 mrad are 2.5 mm over 500 mm.
#: Joints of a chain with lengths are mastered to degrees. Largest in the examples: 0.06 mrad, of the robot 8 mrad.
LARGEST_ANGLE, LARGEST_MASTERING = 5e-3, float(np.deg2rad(5.0))
#: mm. An axis of a machine given by letters lies where the machine file's coordinates put it, to some tenths. Largest
#: in the examples: 0.11. Of a chain with lengths `identify` compares each with its own.
LARGEST_OFFSET = 5.0
#: Chance makes such an E_n between instruments in at most so many right campaigns. As for a model that is refuted.
DISAGREE = 1e-3


def grounds_of(campaign: Campaign, robust: RobustFit, run: int) -> tuple[Ground, ...]:
    """Return every ground against a certificate of a run: ``robust`` is the model fitted to the whole campaign."""
    (measured,) = (each for each in campaign.runs if each.run == run)
    units = tuple(_units(campaign, run))
    in_units, is_whole = {unit.run for unit in units}, off_places(campaign) is not None
    return (
        # A run in another unit has readings that contradict the rest: not one of them is the mistake.
        *units,
        *(ground for ground in _gross_readings(robust) if not is_whole and ground.run not in in_units),
        *_lack_of_fit(robust, run),
        *_implausible(campaign, robust, run),
        *_common_gain(campaign, robust, run),
        *_work_points(robust, run),
        *_instruments(campaign, robust, run),
        *_exact_scales(campaign, robust, run),
        *_scale_bar(campaign, run),
        *_temperature(campaign, measured),
    )


def _gross_readings(robust: RobustFit) -> Iterator[Ground]:
    """Of any run: the covariance of the readings is pooled over all of them."""
    for reading in robust.gross:
        size = MICROMETRE.to_display(abs(reading.size))
        subject = f"{reading.sequence} ({reading.target})"
        yield Ground(GroundKind.GROSS_READINGS, reading.run, subject, size, None, MICROMETRE.name)


def _units(campaign: Campaign, run: int) -> Iterator[Ground]:
    """Lengths that look as if they were in another unit than mm, of the whole campaign or of any run."""
    off = off_places(campaign)
    if off is not None and off.unit is not None:
        columns = ", ".join(f"{axis.lower()}_mm" for axis in off.axes)
        yield Ground(GroundKind.UNITS, run, columns, off.ratio, None, off.unit.name)
    for odd in runs_in_units(campaign):
        yield Ground(GroundKind.UNITS, odd.run, ", ".join(odd.columns), odd.ratio, None, odd.unit.name)


def _lack_of_fit(robust: RobustFit, run: int) -> Iterator[Ground]:
    """Residuals that contradict the stated uncertainties: too large for the model, or too small for the unit."""
    fit = robust.fit
    index = int(np.flatnonzero(fit.problem.runs == run)[0])
    weighted = fit.solution.last.residual[index]
    rows = (fit.problem.context.run == run) & ~fit.left_out
    freedom = int(rows.sum()) * len(fit.problem.components) + len(fit.problem.extra_names)
    freedom -= int(fit.solution.rank[index])
    if freedom < 1:
        return
    times = float(np.sqrt(weighted @ weighted / freedom))
    if times > MOST_TIMES:
        yield Ground(GroundKind.LACK_OF_FIT, run, "", times, MOST_TIMES)
    elif times < TOO_SMALL:
        yield Ground(GroundKind.UNITS, run, "", times, TOO_SMALL)


def _implausible(campaign: Campaign, robust: RobustFit, run: int) -> Iterator[Ground]:
    """Gains, angles and offsets that are none of a machine, by what the run determines for certain."""
    problem, solution = robust.fit.problem, robust.fit.solution
    index = int(np.flatnonzero(problem.runs == run)[0])
    has_lengths = bool(campaign.machine.chain)
    for effect, columns in zip(problem.base, problem.base_columns, strict=True):
        if not isinstance(effect, ChainEffect) or not solution.local_free[index, columns.start]:
            continue
        if effect.is_gain:
            limit = LARGEST_GAIN
        elif effect.text != effect.term.symbol:
            continue
        elif effect.term.is_rotation:
            limit = LARGEST_MASTERING if has_lengths else LARGEST_ANGLE
        else:
            limit = np.inf if has_lengths else LARGEST_OFFSET
        value = float(solution.local[index, columns.start])
        if abs(value) > limit:
            unit, name = effect.unit, problem.base_names[columns.start]
            size, most = unit.to_display(value), unit.to_display(limit)
            yield Ground(GroundKind.IMPLAUSIBLE, run, name, size, most, unit.name)


def _common_gain(campaign: Campaign, robust: RobustFit, run: int) -> Iterator[Ground]:
    """Gains of three axes that are off together by far more than they differ: of a bar of another length.

    Gains that are none of a machine one by one are told each.
    """
    if campaign.artefact.scale_bar is None:
        return
    problem, solution = robust.fit.problem, robust.fit.solution
    index = int(np.flatnonzero(problem.runs == run)[0])
    gains = {
        problem.base_names[columns.start]: (float(solution.local[index, columns.start]), effect.unit)
        for effect, columns in zip(problem.base, problem.base_columns, strict=True)
        if isinstance(effect, ChainEffect) and effect.is_gain and solution.local_free[index, columns.start]
    }
    values = np.array([value for value, _ in gains.values()])
    if len(values) < 3 or np.abs(values).max() > LARGEST_GAIN:
        return
    common = float(np.mean(values))
    if abs(common) > LARGEST_COMMON_GAIN and np.ptp(values) < COMMON_WITHIN * abs(common):
        unit = next(unit for _, unit in gains.values())
        size, most = unit.to_display(common), unit.to_display(LARGEST_COMMON_GAIN)
        yield Ground(GroundKind.IMPLAUSIBLE, run, SEVERAL.join(gains), size, most, unit.name)


def _work_points(robust: RobustFit, run: int) -> Iterator[Ground]:
    """Points of setups that the readings put elsewhere than the file: the axes moved otherwise than it says."""
    problem = robust.fit.problem
    index = int(np.flatnonzero(problem.runs == run)[0])
    for point in problem.displaced(robust.fit.solution.local[index]):
        yield Ground(GroundKind.WORK_POINT, run, point.setup, point.distance, STATED_WITHIN, "mm")


def _instruments(campaign: Campaign, robust: RobustFit, run: int) -> Iterator[Ground]:
    """The setup that contradicts all others, and the worst disagreement of two instruments, that chance does not
    explain: one was read, placed or stated otherwise than the file says, and the joint fit lies between. Setups whose
    readings scatter far less than stated: they were in another unit."""
    ability = campaign_method(campaign).instruments
    problem, solution = robust.fit.problem, robust.fit.solution
    beside = against_others(problem, solution, ability, run, DISAGREE)
    if beside is not None:
        names = tuple(suspect.name for suspect in beside.suspects)
        subject, several = (names[0], None) if len(names) == 1 else ("", names or None)
        yield Ground(GroundKind.INSTRUMENTS, run, subject, beside.size, beside.limit, IN_U, several)
    if isinstance(ability, Instruments):
        for scatter in ability.scatters(problem, solution, run):
            if scatter.times < TOO_SMALL and scatter.p < DISAGREE:
                yield Ground(GroundKind.UNITS, run, scatter.setup, scatter.times, TOO_SMALL)
    apart = disagreement(problem, solution, ability, run, DISAGREE)
    if apart is not None:
        subject = f"{apart.parameter}: {apart.first}, {apart.second}"
        limit = limit_of(apart.comparisons, DISAGREE, apart.degrees_of_freedom)
        yield Ground(GroundKind.INSTRUMENTS, run, subject, apart.e_n, limit)


def _exact_scales(campaign: Campaign, robust: RobustFit, run: int) -> Iterator[Ground]:
    """Instruments that bring the unit of length, and nobody says how well: 1 K of air is 1 µm/m in every gain."""
    for stated in campaign_method(campaign).as_stated(robust.fit.problem):
        names = stated.moved.get("scale")
        if names:
            yield Ground(GroundKind.SCALE, run, f"{stated.name} ({', '.join(names)})")


def _scale_bar(campaign: Campaign, run: int) -> Iterator[Ground]:
    difference = bar_difference(campaign)
    if difference is not None and abs(difference) > LARGEST_BAR_DIFFERENCE:
        bar = campaign.artefact.scale_bar
        assert bar is not None
        yield Ground(GroundKind.SCALE_BAR, run, "-".join(bar.balls), difference, LARGEST_BAR_DIFFERENCE, "mm")


def _temperature(campaign: Campaign, run: Run) -> Iterator[Ground]:
    """A bar gives the unit of length: without a temperature nobody can say how long it was (11.5 µm/m for 1 K). One
    that no place has is printed as a condition, and corrects a length by millimetres where an expansion is stated."""
    for name, value in implausible_temperatures(campaign, run.run).items():
        yield Ground(GroundKind.TEMPERATURE, run.run, name, value, AIR_RANGE[value > 0.0], "°C")
    bar = campaign.artefact.scale_bar
    if bar is None:
        return
    if bar_temperature(campaign, run) is None:
        yield Ground(GroundKind.TEMPERATURE, run.run, "-".join(bar.balls))
