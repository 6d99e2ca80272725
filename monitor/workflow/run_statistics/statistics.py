"""First statistics of a campaign: pooled and total covariance, Bartlett and ANOVA, parameter by parameter and
probed coordinate by probed coordinate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.methods import Unable, campaign_method, require
from monitor.records import Array, Campaign
from monitor.statistics import Homogeneity, Pooling, homogeneity, pool
from monitor.store import (
    Database,
    StoredIdentification,
    find_selection,
    load_campaign,
    load_identification,
    save_analysis,
)
from monitor.units import DEGREE
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.models import resolve
from monitor.workflow.run_statistics.columns import campaign_columns, group_labels, selected
from monitor.workflow.run_statistics.matrix_files import write_matrices
from monitor.workflow.run_statistics.session_drift import session_drift
from monitor.workflow.run_statistics.tests import SEED, components, histogram, normal_scatter, vector_tests
from monitor.workflow.selections import group

Document = dict[str, Any]


def _matrix(found: StoredIdentification, runs: list[int]) -> tuple[list[str], list[Any], Array]:
    by_run = {one.run: one for one in found.runs}
    values = np.array([by_run[run].estimate for run in runs])
    kept = np.isfinite(values).all(axis=0)
    units = [unit for unit, keep in zip(found.units, kept, strict=True) if keep]
    names = [name for name, keep in zip(found.parameters, kept, strict=True) if keep]
    return names, units, values[:, kept] / np.array([unit.factor for unit in units])


def coordinates(campaign: Campaign, runs: list[int]) -> tuple[list[str], Array] | None:
    """Names and values (R, 3 m), mm, of the probed coordinates; None where the runs' plans differ."""
    probings = campaign.probings
    linear = [axis for axis in ("X", "Y", "Z") if axis in probings.readings]
    turning = sorted(set(probings.readings) - set(linear))
    plan: list[tuple[Any, ...]] | None = None
    rows_of = []
    for run in runs:
        rows = np.flatnonzero(probings.run == run)
        rows = rows[np.argsort(probings.sequence[rows], kind="stable")]
        own = [
            (str(probings.target[row]), *(round(float(probings.readings[axis][row]), 6) for axis in turning))
            for row in rows
        ]
        if plan is not None and own != plan:
            return None
        plan = own
        rows_of.append(rows)
    assert plan is not None
    names = []
    for place, (target, *angles) in enumerate(plan, start=1):
        where = " ".join(
            f"{axis.lower()}={angle / DEGREE.factor:g}" for axis, angle in zip(turning, angles, strict=True)
        )
        names += [f"{place} ball {target} {where} {axis.lower()}" for axis in linear]
    values = np.array(
        [np.stack([probings.readings[axis][rows] for axis in linear], axis=1).ravel() for rows in rows_of]
    )
    return names, values


def _number(value: float) -> float | None:
    return None if not np.isfinite(value) else float(value)


def _parameter(pooled: Pooling, tests: Homogeneity | None, place: int, unit: str) -> Document:
    document: Document = {
        "unit": unit,
        "n": pooled.n,
        "mean": float(pooled.mean[place]),
        "u_all": float(pooled.u_all[place]),
        "u_pooled": float(pooled.u_pooled[place]),
        "u_by_day": {label: _number(pooled.u_by_group[j, place]) for j, label in enumerate(pooled.labels)},
        "mean_by_day": {
            label: float(pooled.mean_by_group[j, place]) for j, label in enumerate(pooled.labels)
        },
        "dof_all": pooled.dof_all,
        "dof_pooled": pooled.dof_pooled,
    }
    for name, test in (
        ("bartlett", tests and tests.bartlett),
        ("levene", tests and tests.levene),
        ("anova", tests and tests.anova),
        ("welch", tests and tests.welch),
        ("kruskal", tests and tests.kruskal),
    ):
        document[f"{name}_p"] = None if not test else _number(float(test.p_value[place]))
    document["anova_q"] = None if tests is None else _number(float(tests.anova_discoveries.q_value[place]))
    of_variances = None if tests is None else tests.bartlett_discoveries
    document["bartlett_q"] = None if of_variances is None else _number(float(of_variances.q_value[place]))
    return document


def _identified(db: Database, campaign: Campaign, model: str | None) -> StoredIdentification:
    """The identification of every run of a campaign; made where it is not there yet."""
    stored = resolve(db, model, campaign.method)
    try:
        found = load_identification(db, campaign.name, stored.name, stored.version)
        if len(found.runs) == len(campaign.runs):
            return found
    except NotFoundError:
        pass
    identify(db, IdentifyRequest(campaign.name, model))
    return load_identification(db, campaign.name, stored.name, stored.version)


def _groups(db: Database, campaign: Campaign, by: str) -> list[str]:
    """The group of every run: by a column, or by whether a stored selection holds it."""
    columns = campaign_columns(campaign)
    if by in columns:
        return group_labels(columns, by)
    try:
        chosen = find_selection(db, by, campaign.name)
    except NotFoundError:
        # Refuse with the columns that are there, of which there are more than selections.
        return group_labels(columns, by)
    return [by if run.run in chosen.runs else f"not {by}" for run in campaign.runs]


def _chosen(db: Database, campaign: Campaign, where: str | None, select: str | None) -> npt.NDArray[np.bool_]:
    """Which runs are taken: those of a stored selection for which the condition holds."""
    keep = selected(campaign_columns(campaign), where, len(campaign.runs))
    stored = None if select is None else group(db, select, campaign.name)
    if stored is None and select not in (None, campaign.name):
        raise InputError(
            f"--select {select}: that is another campaign; name {campaign.name} or a selection of it"
        )
    if stored is not None and stored.campaign != campaign.name:
        raise InputError(
            f"--select {select}: that selection is of campaign {stored.campaign}, not {campaign.name}"
        )
    return keep if stored is None else keep & np.array([run.run in stored.runs for run in campaign.runs])


def stats(
    db: Database,
    campaign: str,
    by: str = "day",
    where: str | None = None,
    model: str | None = None,
    select: str | None = None,
    matrices: Path | None = None,
) -> Document:
    """Statistics of a campaign's runs, grouped ``by`` a column or a stored selection, restricted to runs ``where`` a
    condition holds and to those of the stored selection ``select``. Covariance and correlation matrices of the
    parameters and of the probed coordinates go into CSV files in the folder ``matrices``.

    Identifies the campaign first where that has not been done. Raises InputError for a column, condition or selection
    that the runs do not have, DataError for fewer than two runs.
    """
    loaded = load_campaign(db, campaign)
    require(campaign_method(loaded).statistics, loaded, "stats")
    labels = _groups(db, loaded, by)
    keep = _chosen(db, loaded, where, select)
    runs = [run.run for run, kept in zip(loaded.runs, keep, strict=True) if kept]
    groups = [text for text, kept in zip(labels, keep, strict=True) if kept]
    if len(runs) < 2:
        raise DataError(
            f"statistics need at least two runs, but {len(runs)} of campaign {campaign} are chosen"
        )
    found = _identified(db, loaded, model)
    names, units, values = _matrix(found, runs)
    pooled, tests = _statistics(values, groups, names)
    parameters = {
        name: _parameter(pooled, tests, place, units[place].name) for place, name in enumerate(names)
    }
    normal, parts = normal_scatter(values, groups), components(values, groups)
    for place, name in enumerate(names):
        parameters[name] |= {"normality_p": normal[place], "components": parts[place]}
    document: Document = {
        "campaign": campaign,
        "machine": loaded.machine.id,
        "by": by,
        "where": where,
        "select": select,
        "groups": {label: int(count) for label, count in zip(pooled.labels, pooled.counts, strict=True)},
        "parameters": parameters,
        "vector": vector_tests(values, groups),
        "drift": session_drift(loaded, found, runs),
        "coordinates": _coordinates(loaded, runs, groups),
        "parameter_order": names,
        "correlation_all": _rows(pooled.covariance_all.correlation),
        "correlation_pooled": _rows(pooled.covariance_pooled.correlation),
        "correlation_by_group": {
            label: {"degrees_of_freedom": one.dof, "correlation": _rows(one.correlation)}
            for label, one in zip(pooled.labels, pooled.covariance_by_group, strict=True)
            if one is not None
        },
        "degrees_of_freedom_all": pooled.dof_all,
        "degrees_of_freedom_pooled": pooled.dof_pooled,
        "seed": SEED,
    }
    save_analysis(
        db, "statistics", document, method=f"by {by}", campaign=campaign,
        model=found.model, model_version=found.model_version, seed=SEED,
    )  # fmt: skip
    if matrices is not None:
        document["matrices"] = write_matrices(matrices, "parameters", pooled, [unit.name for unit in units])
        probed = _probed(loaded, runs)
        if not isinstance(probed, str):
            of_probed = _statistics(1e3 * probed[1], groups, probed[0])[0]
            document["matrices"] += write_matrices(
                matrices, "coordinates", of_probed, ["µm"] * len(probed[0])
            )
    return document


def _statistics(values: Array, groups: list[str], names: list[str]) -> tuple[Pooling, Homogeneity | None]:
    alike = len(set(groups)) < 2 or len(set(groups)) == len(groups)
    # Groups of one run each tell nothing apart: all runs are one group then.
    pooled = pool(values, ["all"] * len(groups) if len(set(groups)) == len(groups) else groups, names)
    return pooled, None if alike else homogeneity(values, groups, names)


def _probed(campaign: Campaign, runs: list[int]) -> tuple[list[str], Array] | str:
    """Names and values (R, 3 m), mm, of the probed coordinates, or why there are none."""
    comparable = campaign_method(campaign).coordinates
    if isinstance(comparable, Unable):
        return comparable.why
    return coordinates(campaign, runs) or "the runs do not follow one plan"


def _coordinates(campaign: Campaign, runs: list[int], groups: list[str]) -> Document:
    found = _probed(campaign, runs)
    if isinstance(found, str):
        return {
            "n": 0,
            "why": found,
            "bartlett_p": [],
            "anova_p": [],
            "histograms": {},
        }
    names, values = found
    pooled, tests = _statistics(values, groups, names)
    p_values: dict[str, list[float | None]] = {"bartlett": [], "anova": []}
    if tests is not None:
        p_values["anova"] = [_number(p) for p in tests.anova.p_value]
        p_values["bartlett"] = [] if tests.bartlett is None else [_number(p) for p in tests.bartlett.p_value]
    return {
        "n": len(names),
        "names": names,
        "u_all_um": (pooled.u_all * 1e3).tolist(),
        "u_pooled_um": (pooled.u_pooled * 1e3).tolist(),
        "u_by_day_um": {
            label: (u * 1e3).tolist()
            for label, u in zip(pooled.labels, pooled.u_by_group, strict=True)
            if np.isfinite(u).all()
        },
        "bartlett_p": p_values["bartlett"],
        "anova_p": p_values["anova"],
        "normality_p": normal_scatter(values, groups),
        "histograms": {name: histogram(values) for name, values in p_values.items() if values},
    }


def _rows(matrix: Array) -> list[list[float | None]]:
    return [[_number(value) for value in row] for row in matrix]
