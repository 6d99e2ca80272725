"""SAMBA: scale and master balls artefact; balls touched at many indexations, a calibrated bar for the length.

The geometric errors, the balls' places and the stylus tip are found together (34 unknowns with 4 balls and a
bar on a five-axis machine), so nothing but the bar has to be calibrated. Source: A. Los, Uncertainty
estimation in indirect calibration of five-axis machine tools, Polytechnique Montréal 2017, chapters 3 and 4;
conventions as in docs/conventions.md.
"""

from __future__ import annotations

import numpy as np

from monitor.effects import ChainEffect, context_of
from monitor.exceptions import DataError
from monitor.methods.identification import Identification, Refusal, RunIdentification
from monitor.methods.least_squares import MEMBER_SHARE, Solution
from monitor.methods.model import Model, chain_of
from monitor.methods.shared_effects import shared_parameters
from monitor.methods.touch import Distance, TouchProblem, solve_touch
from monitor.records import Array, Campaign

NAME = "samba"
DEFAULT_MODEL = Model("samba")


def bar_length(campaign: Campaign) -> Array:
    """Length (R,) mm of the bar in every run, in the order of the runs' numbers.

    With an expansion coefficient and a reference temperature it follows ``ambient_degC``.
    """
    bar = campaign.artefact.scale_bar
    if bar is None:
        raise DataError(f"campaign {campaign.name} has no scale bar; samba needs [artefact.scale_bar]")
    runs = sorted(campaign.runs, key=lambda run: run.run)
    length = np.full(len(runs), bar.length)
    if bar.expansion_coefficient is not None and bar.reference_temperature is not None:
        ambient = np.array([run.conditions.get("ambient_degC", np.nan) for run in runs])
        warmer = np.where(np.isfinite(ambient), ambient - bar.reference_temperature, 0.0)
        length *= 1.0 + bar.expansion_coefficient * warmer
    return length


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> TouchProblem:
    """The least-squares problem of a campaign under a model.

    Every coordinate of a probing has the probe's stated standard uncertainty, the bar its own.
    """
    chain = chain_of(campaign.machine)
    bar = campaign.artefact.scale_bar
    if bar is None:
        raise DataError(f"campaign {campaign.name} has no scale bar; samba needs [artefact.scale_bar]")
    missing = [name for name in bar.balls if name not in campaign.probings.target]
    if missing and len(campaign.probings):
        raise DataError(
            f"campaign {campaign.name} never probed {' and '.join(missing)} of the scale bar; without the bar "
            "nothing gives the unit of length"
        )
    present = np.isin(
        [run.run for run in sorted(campaign.runs, key=lambda run: run.run)], campaign.probings.run
    )
    return TouchProblem(
        context=context_of(campaign, chain),
        base=model.base_of(chain),
        added=model.added_to(chain),
        sigma=np.full((len(campaign.probings), 3), campaign.probe.standard_uncertainty),
        distances=(Distance(bar.balls, bar_length(campaign)[present], bar.standard_uncertainty),),
        tip=campaign.probe.tip or (0.0, 0.0, 0.0),
    )


def _groups(null_space: Array, names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Unknowns that trade against each other: the blocks of the projector on the null space."""
    projector = null_space.T @ null_space
    # The same members as Solution.local_free refuses, so that no parameter stays without a number unnamed.
    member = np.abs(null_space).max(axis=0) >= MEMBER_SHARE
    size = np.sqrt(np.maximum(np.diag(projector), np.finfo(float).tiny))
    linked = (np.abs(projector) > MEMBER_SHARE * np.outer(size, size)) & np.outer(member, member)
    left = [int(place) for place in np.flatnonzero(member)]
    groups = []
    while left:
        group, front = {left[0]}, [left[0]]
        while front:
            place = front.pop()
            for other in np.flatnonzero(linked[place]):
                if int(other) not in group:
                    group.add(int(other))
                    front.append(int(other))
        left = [place for place in left if place not in group]
        groups.append(tuple(names[place] for place in sorted(group)))
    return groups


def refusals(problem: TouchProblem, null_space: Array, run: int) -> tuple[Refusal, ...]:
    """What one run cannot separate, by its null space, the reported parameters first, and why."""
    reported = problem.base_names
    found = []
    for group in _groups(null_space, problem.local_names):
        inside = tuple(name for name in group if name in reported)
        if not inside:
            continue
        others = [name for name in group if name not in inside]
        with_what = f"{' and '.join(inside)} cannot be told apart" if len(inside) > 1 else inside[0]
        if others:
            with_what += f"{' from' if len(inside) > 1 else ' cannot be told apart from'} {', '.join(others)}"
        found.append(Refusal(inside, f"with this plan {with_what}{_advice(problem, inside, run)}"))
    return tuple(found)


def _advice(problem: TouchProblem, parameters: tuple[str, ...], run: int) -> str:
    """What the plan kept still and would have to move."""
    rows = problem.context.run == run
    bar = sorted({name for distance in problem.distances for name in distance.between})
    missing = [name for name in bar if name not in problem.context.target[rows]]
    gains = {
        name
        for effect in problem.base
        if isinstance(effect, ChainEffect) and effect.is_gain
        for name in effect.parameters(problem.context)
    }
    if missing and gains.intersection(parameters):
        return f": run {run} did not probe {' and '.join(missing)} of the scale bar, the unit of length"
    still = []
    for place, joint in enumerate(problem.context.chain.joints):
        if joint.turns and np.ptp(problem.context.positions[rows, place]) == 0:
            still.append(joint)
    if not still:
        return "; probe more indexations"
    spindle = [joint for joint in still if joint.kind == "spindle"]
    if spindle and any(name.endswith(f"0{spindle[0].name}") for name in parameters):
        name = spindle[0].name
        return f": {name} stands at one angle throughout; probe also with {name} at 90, 180 and 270 degrees"
    return f": {', '.join(joint.name for joint in still)} stands at one angle throughout; index it too"


def identify(campaign: Campaign, model: Model = DEFAULT_MODEL) -> Identification:
    """The geometric errors of every run of a campaign, with the covariance of the probe and bar uncertainties.

    Raises DataError where a run has fewer readings than its unknowns need or the readings contradict the
    machine file, EffectError where the model names an effect that the machine or the data do not have.
    """
    problem = problem_of(campaign, model)
    for run in problem.runs:
        targets = campaign.probings.target[campaign.probings.run == run]
        readings = 3 * len(targets) + len(problem.distances)
        # A ball that this run left out is no unknown of it.
        unknowns = len(problem.local_names) - 3 * (len(problem.targets) - len(np.unique(targets)))
        if readings < unknowns:
            raise DataError(
                f"run {run} of campaign {campaign.name} has {readings} readings for {unknowns} unknowns; "
                "probe more balls or indexations"
            )
    solution = solve_touch(problem)
    return _result(campaign, model, problem, solution)


def _result(campaign: Campaign, model: Model, problem: TouchProblem, solution: Solution) -> Identification:
    count = len(problem.base_names)
    vectors = problem.vectors(solution.local, solution.common)
    runs = []
    for place, run in enumerate(problem.runs):
        residuals = vectors[problem.context.run == run]
        free = solution.local_free[place, :count]
        both = free[:, None] & free
        weighted = solution.last.residual[place]
        runs.append(
            RunIdentification(
                run=int(run),
                estimate=np.where(free, solution.local[place, :count], np.nan),
                covariance=np.where(both, solution.local_covariance[place, :count, :count], np.nan),
                unknowns=dict(
                    zip(problem.local_names[count:], map(float, solution.local[place, count:]), strict=True)
                ),
                refused=refusals(problem, solution.null_space[place], int(run)),
                residuals=residuals,
                rms=float(np.sqrt(np.mean(residuals**2))),
                chi_square=float(weighted @ weighted),
                degrees_of_freedom=residuals.size + len(problem.distances) - int(solution.rank[place]),
            )
        )
    shared = shared_parameters(problem, solution)
    return Identification(
        campaign=campaign.name,
        method=NAME,
        model=model.name,
        parameters=problem.base_names,
        units=tuple(effect.unit for effect in problem.base for _ in effect.parameters(problem.context)),
        runs=tuple(runs),
        added=shared.names,
        added_units=shared.units,
        added_estimate=shared.estimate,
        added_covariance=shared.covariance,
        added_refused=shared.refused,
        iterations=solution.iterations,
    )
