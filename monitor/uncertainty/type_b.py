"""Type B sources as covariance across all inputs of one run, and as trials (JCGM 100:2008, 4.3; JCGM 101:2008, 6.4).

A source is one or several independent values of its law, each of which shifts all readings of the run together; so
its covariance is that of a few columns, whatever the number of readings. First order in the source: the product of
two sources (of the uncertainties of an expansion coefficient, 1e-6 1/K, and of a temperature, 1 K) is neglected, 1
µm/m beside 11.5 µm/m for steel.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np

from monitor.exceptions import InputError
from monitor.methods.bar_temperature import bar_temperature
from monitor.records import Array, Campaign
from monitor.row_files import runs_in
from monitor.sources import HALF_WIDTHS, Law, Quantity, Sharing, Source
from monitor.uncertainty.marginals import Arcsine, Marginal, Normal, Rectangular, StudentT, Triangular
from monitor.uncertainty.monte_carlo.sampling import JointDistribution
from monitor.uncertainty.parts import Estimated, OutputContribution
from monitor.uncertainty.roots import covariance_root
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.touched_run import TouchedRun
from monitor.uncertainty.source_rows import Groups, Scene, names_of_values, rows_of

_STANDARD = (Quantity.STANDARD_TEMPERATURE, Quantity.STANDARD_EXPANSION)
#: More independent values than this are drawn in the rank of their covariance, which the normal law alone allows.
_MOST_COLUMNS = 400


@dataclass(frozen=True)
class SourceColumns:
    """A source and what one standard deviation of each of its q values does to the inputs (N, q) of a run.

    ``values`` (q) name them by what they are of (target, pose, angle, node), in every run alike; None where they are
    those of the covariance of this run alone.
    """

    source: Source
    columns: Array
    values: tuple[Hashable, ...] | None = None

    def contribution(self, rows: Array) -> OutputContribution:
        """Its line of the budget; ``rows`` (m, N) is the sensitivity of the outputs."""
        moved = rows @ self.columns
        dof = self.source.degrees_of_freedom
        return OutputContribution(
            self.source.name, moved @ moved.T, math.inf if dof is None else dof, Estimated.SCALE
        )

    @property
    def law_factor(self) -> float:
        """The standard deviation of what is drawn over the standard uncertainty: more than 1 for Student's t alone
        (JCGM 101:2008, 6.4.9)."""
        dof = self.source.degrees_of_freedom
        if self.source.law is not Law.STUDENT or dof is None:
            return 1.0
        return math.sqrt(dof / (dof - 2.0))

    @property
    def distribution(self) -> JointDistribution:
        """The joint distribution of its values, each of standard uncertainty 1."""
        count = self.columns.shape[1]
        names = tuple(f"{self.source.name} {number}" for number in range(1, count + 1))
        student = self.source.law is Law.STUDENT and self.source.degrees_of_freedom is not None
        return JointDistribution(
            names,
            ("1",) * count,
            (self._marginal(),) * count,
            np.eye(count),
            "t" if student else "gaussian",
            float(self.source.degrees_of_freedom or math.inf) if student else math.inf,
        )

    def _marginal(self) -> Marginal:
        half = HALF_WIDTHS.get(self.source.law, 1.0)
        if self.source.law is Law.RECTANGULAR:
            return Rectangular(-half, half)
        if self.source.law is Law.TRIANGULAR:
            return Triangular(-half, half)
        if self.source.law is Law.ARCSINE:
            return Arcsine(-half, half)
        if self.source.law is Law.STUDENT:
            return StudentT(0.0, 1.0, float(self.source.degrees_of_freedom or math.inf))
        return Normal(0.0, 1.0)


def source_columns(
    run: MeasuredRun, unknowns: Array, campaign: Campaign, number: int, sources: Sequence[Source]
) -> tuple[SourceColumns, ...]:
    """What the sources do to the inputs of run ``number`` at its ``unknowns`` (p,).

    Raises InputError for a source that the campaign or its method cannot have, EffectError for an effect that the
    machine does not have.
    """
    if not sources:
        return ()
    pose = run.problem.evaluated(unknowns[None], run.common, jacobian=True)
    assert pose.by_error is not None
    scene = Scene(run, campaign, pose.by_error, pose.by_tip)
    return tuple(_columns(scene, number, source) for source in sources)


def _columns(scene: Scene, number: int, source: Source) -> SourceColumns:
    """What its values do to the inputs of run ``number``."""
    run = scene.run
    calibrated = len(run.calibrated[0])
    if source.quantity in _STANDARD:
        growth = _strain(scene.campaign, number, source) * run.problem.standard_lengths
        if not np.any(run.problem.standard_lengths):
            raise InputError(
                f"source '{source.name}': no calibrated length gives this campaign its unit of length, so "
                f"{source.quantity.value} does nothing; leave it out"
            )
        columns = np.concatenate([np.zeros(len(run.reading_names)), growth])[:, None]
        return SourceColumns(source, columns * source.u, ((),))
    rows, groups = rows_of(scene, source)
    if source.shared_by is Sharing.PROBING:
        groups = scene.alike(np.arange(scene.rows))
    names = names_of_values(scene, source, rows.shape[2])
    spread, values = _by_group(_as_readings(run, scene.by_error, rows), groups, names)
    columns = np.concatenate([spread, np.zeros((calibrated, spread.shape[1]))]) * source.u
    if source.law is Law.NORMAL and columns.shape[1] > _MOST_COLUMNS:
        return SourceColumns(source, covariance_root(columns @ columns.T).root)
    return SourceColumns(source, columns, values)


def _by_group(rows: Array, groups: Groups, names: tuple[Hashable, ...]) -> tuple[Array, tuple[Hashable, ...]]:
    """Columns (n d, G q) and their names: rows (n, d, q) of a group share its q values, which have ``names``."""
    count, width, values = rows.shape
    number = {group: index for index, group in enumerate(sorted(set(groups)))}
    spread = np.zeros((count, width, len(number), values))
    spread[np.arange(count), :, [number[group] for group in groups]] = rows
    columns = spread.reshape(count * width, -1)
    acts = np.any(columns != 0.0, axis=0)
    all_names = [(*group, name) for group in number for name in names]
    return np.asarray(columns[:, acts]), tuple(compress(all_names, acts))


def _as_readings(run: MeasuredRun, by_error: Array, rows: Array) -> Array:
    """What changes of the rows' numbers (n, d, q) are as changes of the run's readings.

    Readings of a touched ball are those of the linear axes: the shortest move that does the same to the row.
    """
    if not isinstance(run, TouchedRun):
        return rows
    return np.asarray(np.linalg.pinv(run.by_reading(by_error)) @ rows)


def _strain(campaign: Campaign, number: int, source: Source) -> float:
    """The strain of the measurement standard for a source of size 1. Raises InputError where it cannot be known."""
    bar = campaign.artefact.scale_bar
    stated = None if bar is None else bar.expansion_coefficient
    if source.quantity is Quantity.STANDARD_TEMPERATURE:
        given_twice = stated is not None and source.expansion_coefficient not in (None, stated)
        if given_twice:
            raise InputError(
                f"source '{source.name}': the bar has expansion_coefficient_per_K = {stated:g} in [artefact.scale_bar] "
                f"already, not {source.expansion_coefficient:g}; state it once"
            )
        alpha = source.expansion_coefficient if stated is None else stated
        if alpha is None:
            raise InputError(
                f"source '{source.name}': a kelvin acts by the expansion coefficient of the standard; write "
                "expansion_coefficient_per_K in [artefact.scale_bar] or beside the source"
            )
        return alpha
    if source.temperature_offset is not None:
        return source.temperature_offset
    temperature = bar_temperature(campaign, next(run for run in campaign.runs if run.run == number))
    if bar is None or bar.reference_temperature is None or temperature is None:
        raise InputError(
            f"source '{source.name}': how much an expansion coefficient does needs the distance from the reference "
            "temperature; write reference_temperature_degC in [artefact.scale_bar] and bar_degC or ambient_degC in "
            f"{runs_in(campaign)}, or temperature_offset_K beside the source"
        )
    return temperature.degrees - bar.reference_temperature
