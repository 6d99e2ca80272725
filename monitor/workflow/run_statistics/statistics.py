"""First statistics of a campaign: pooled and total covariance, Bartlett and ANOVA, parameter by parameter and
probed coordinate by probed coordinate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from monitor.documents import to_document
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.records import Array, Campaign
from monitor.reporting.messages import none_determined
from monitor.statistics import AnalysisOfVariance, FalseDiscoveries, GroupTest, Homogeneity, Pooling
from monitor.store import (
    Database,
    StoredIdentification,
    find_selection,
    load_identification,
    save_analysis,
)
from monitor.units import Unit
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.figure_files import make_folder
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import resolve_for
from monitor.workflow.run_statistics.answer import (
    GroupCorrelation,
    NoVarianceComponents,
    ParameterStatistics,
    StatisticsAnswer,
    VarianceComponents,
)
from monitor.workflow.run_statistics.columns import campaign_columns, group_labels, selected
from monitor.workflow.run_statistics.coordinates import coordinate_statistics, probed
from monitor.workflow.run_statistics.matrix_files import write_matrices
from monitor.workflow.run_statistics.pooling import pooled_by_group
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.session_drift import session_drift
from monitor.workflow.run_statistics.tests import SEED, components, finite, normal_scatter, vector_tests
from monitor.workflow.selections.select import group


def _matrix(identification: StoredIdentification, runs: list[int]) -> tuple[list[str], list[Unit], Array]:
    """Names, display units and values (R, p), in these, of the parameters that have a number in every run.

    Raises DataError where none has.
    """
    by_run = {run.run: run for run in identification.runs}
    values = np.array([by_run[run].estimate for run in runs])
    complete = np.isfinite(values).all(axis=0)
    if not complete.any():
        raise DataError(none_determined(identification.parameters))
    units = [unit for unit, finite in zip(identification.units, complete, strict=True) if finite]
    names = [name for name, finite in zip(identification.parameters, complete, strict=True) if finite]
    return names, units, values[:, complete] / np.array([unit.factor for unit in units])


#: The keys of p-values and false discovery rates.
_TESTS = (
    "bartlett_p",
    "levene_p",
    "anova_p",
    "welch_p",
    "brown_forsythe_p",
    "kruskal_p",
    "anova_q",
    "bartlett_q",
)


def _p_values(tests: Homogeneity | None, index: int) -> Mapping[str, float | None]:
    """p-values and false discovery rates of one parameter; None where a test was not made."""

    def p_value(test: AnalysisOfVariance | GroupTest | None) -> float | None:
        return None if test is None else finite(test.p_value[index])

    def q_value(discoveries: FalseDiscoveries | None) -> float | None:
        return None if discoveries is None else finite(discoveries.q_value[index])

    if tests is None:
        return dict.fromkeys(_TESTS)
    return {
        "bartlett_p": p_value(tests.bartlett),
        "levene_p": p_value(tests.levene),
        "anova_p": p_value(tests.anova),
        "welch_p": p_value(tests.welch),
        "brown_forsythe_p": p_value(tests.brown_forsythe),
        "kruskal_p": p_value(tests.kruskal),
        "anova_q": q_value(tests.mean_discoveries),
        "bartlett_q": q_value(tests.bartlett_discoveries),
    }


def _parameter(
    pooled: Pooling,
    tests: Homogeneity | None,
    index: int,
    unit: str,
    normality_p: float | None,
    variances: VarianceComponents | NoVarianceComponents,
) -> ParameterStatistics:
    return ParameterStatistics(
        unit=unit,
        n=pooled.n,
        mean=float(pooled.mean[index]),
        u_all=float(pooled.u_all[index]),
        u_pooled=float(pooled.u_pooled[index]),
        u_by_day={label: finite(pooled.u_by_group[j, index]) for j, label in enumerate(pooled.labels)},
        mean_by_day={label: float(pooled.mean_by_group[j, index]) for j, label in enumerate(pooled.labels)},
        dof_all=pooled.dof_all,
        dof_pooled=pooled.dof_pooled,
        **_p_values(tests, index),
        normality_p=normality_p,
        components=variances,
    )


def _identified(db: Database, campaign: Campaign, model: str | None) -> StoredIdentification:
    """The identification of every run of a campaign; computed where it is not stored yet."""
    stored = resolve_for(db, model, campaign.method, campaign.machine.id)
    try:
        identification = load_identification(db, campaign.name, stored.name, stored.version)
        if len(identification.runs) == len(campaign.runs):
            return identification
    except NotFoundError:
        pass
    # Loaded where something is identified: the solvers of all methods take longer to load than statistics.
    from monitor.workflow.identify.identify import identify
    from monitor.workflow.identify.request import IdentifyRequest

    identify(db, IdentifyRequest(campaign.name, model))
    return load_identification(db, campaign.name, stored.name, stored.version)


def _groups(db: Database, campaign: Campaign, by: str) -> list[str]:
    """The group of every run: by a column, or by whether a stored selection holds it."""
    columns = campaign_columns(campaign)
    if by in columns:
        return group_labels(columns, by)
    try:
        selection = find_selection(db, by, campaign.name)
    except NotFoundError:
        # Refuse with the columns that there are, of which there are more than selections.
        return group_labels(columns, by)
    return [by if run.run in selection.runs else f"not {by}" for run in campaign.runs]


def _taken(db: Database, campaign: Campaign, request: StatisticsRequest) -> npt.NDArray[np.bool_]:
    """Which runs take part: those of a stored selection for which the condition holds."""
    select = request.select
    meets = selected(campaign_columns(campaign), request.where, len(campaign.runs))
    stored = None if select is None else group(db, select, campaign.name)
    if stored is None and select not in (None, campaign.name):
        raise InputError(
            f"--select {select}: that is another campaign; name {campaign.name} or a selection of it"
        )
    if stored is not None and stored.campaign != campaign.name:
        raise InputError(
            f"--select {select}: that selection is of campaign {stored.campaign}, not {campaign.name}"
        )
    return meets if stored is None else meets & np.array([run.run in stored.runs for run in campaign.runs])


def stats(db: Database, request: StatisticsRequest) -> StatisticsAnswer:
    """Compute and store statistics of a campaign's runs.

    Identifies the campaign first where that has not been done. Raises InputError for a column, condition or selection
    that the runs do not have, DataError for fewer than two runs.
    """
    campaign = machine_campaign(db, request.campaign, "stats", lambda method: method.statistics)
    labels = _groups(db, campaign, request.by)
    taken = _taken(db, campaign, request)
    runs = [run.run for run, take in zip(campaign.runs, taken, strict=True) if take]
    groups = [label for label, take in zip(labels, taken, strict=True) if take]
    if len(runs) < 2:
        raise DataError(
            f"statistics need at least two runs, but {len(runs)} of campaign {campaign.name} are chosen"
        )
    if request.figures is not None:
        make_folder(request.figures)  # a folder that cannot be made leaves no result behind
    identification = _identified(db, campaign, request.model)
    names, units, values = _matrix(identification, runs)
    pooled, tests = pooled_by_group(values, groups, names)
    normal, variances = normal_scatter(values, groups), components(values, groups)
    answer = StatisticsAnswer(
        campaign=campaign.name,
        machine=campaign.machine.id,
        by=request.by,
        where=request.where,
        select=request.select,
        groups={label: int(count) for label, count in zip(pooled.labels, pooled.counts, strict=True)},
        parameters={
            name: _parameter(pooled, tests, index, units[index].name, normal[index], variances[index])
            for index, name in enumerate(names)
        },
        vector=vector_tests(values, groups),
        drift=session_drift(campaign, identification, runs),
        coordinates=coordinate_statistics(campaign, runs, groups),
        parameter_order=tuple(names),
        correlation_all=pooled.covariance_all.correlation,
        correlation_pooled=pooled.covariance_pooled.correlation,
        correlation_by_group={
            label: GroupCorrelation(covariance.dof, covariance.correlation)
            for label, covariance in zip(pooled.labels, pooled.covariance_by_group, strict=True)
            if covariance is not None
        },
        degrees_of_freedom_all=pooled.dof_all,
        degrees_of_freedom_pooled=pooled.dof_pooled,
        seed=SEED,
        refers_to={
            name: identification.refers_to[name] for name in names if name in identification.refers_to
        },
    )
    save_analysis(
        db, "statistics", to_document(answer), method=f"by {request.by}", campaign=campaign.name,
        model=identification.model, model_version=identification.model_version, seed=SEED,
        repeated=False,
    )  # fmt: skip
    answer = replace(answer, copied_readings=copied_readings(db, campaign))
    if request.matrices is not None:
        of_parameters = write_matrices(request.matrices, "parameters", pooled, [unit.name for unit in units])
        of_coordinates = _coordinate_matrices(request.matrices, campaign, runs, groups)
        answer = replace(answer, matrices=(*of_parameters, *of_coordinates))
    if request.figures is not None:
        # The drawing library takes longer to load than most commands to run.
        from monitor.workflow.run_statistics.figures import statistics_figure

        drawings = statistics_figure(answer, campaign, identification, request.figures)
        answer = replace(answer, figures=drawings)
    return answer


def _coordinate_matrices(folder: Path, campaign: Campaign, runs: list[int], groups: list[str]) -> list[str]:
    readings = probed(campaign, runs)
    if not isinstance(readings, tuple):
        return []
    names, values = readings
    pooled = pooled_by_group(1e3 * values, groups, names)[0]
    return write_matrices(folder, "coordinates", pooled, ["µm"] * len(names))
