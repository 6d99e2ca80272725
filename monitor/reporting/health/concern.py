"""Which parameter makes the state of a machine, or is nearest to make it: advice, card and picture are of it.

Where the limit of the volumetric error is the one that binds, that is the parameter which adds most to the worst error
of the map: its own distance from a tolerance, which it need not have, says nothing of that limit.
"""

from __future__ import annotations

from collections.abc import Sequence

from monitor.reporting.health.records import (
    MachineHealth,
    MapShare,
    ParameterHealth,
    State,
    VolumetricMap,
    is_due,
)

#: A drift is spoken of below this probability of seeing it where there is none.
DRIFT_P = 0.05
#: A probability to be out of tolerance that is worth a word beside that of the volumetric error.
_WORTH_A_WORD = 0.01
#: Parameters that are named of a volumetric error: a machine is rarely mended in more steps at a time.
_SHARES_NAMED = 3
#: A parameter is named with the largest one where it adds at least so much of what that adds.
_LEAST_SHARE = 0.2


def volumetric_binds(
    state: State, parameters: Sequence[ParameterHealth], error_map: VolumetricMap | None
) -> bool:
    """Return whether a machine's alarm comes from the limit of its volumetric error more than from any tolerance."""
    if state not in (State.OUT_OF_TOLERANCE, State.MAY_BE_OUT_OF_TOLERANCE):
        return False
    if error_map is None or not error_map.probability_out:
        return False
    return all((parameter.probability_out or 0.0) < error_map.probability_out for parameter in parameters)


def binding_shares(health: MachineHealth) -> tuple[MapShare, ...]:
    """Return what adds most to the volumetric error where its limit binds, the largest first; else nothing.

    What shortens the worst error is no part of it: without it the error would be longer.
    """
    if health.map is None or not volumetric_binds(health.state, health.parameters, health.map):
        return ()
    return largest_shares(health.map)


def largest_shares(error_map: VolumetricMap) -> tuple[MapShare, ...]:
    """Return the parameters that add most to the worst error of a map, the largest first."""
    shares = [share for share in error_map.by_parameter or () if share.error_um > 0.0]
    return tuple(share for share in shares if share.error_um >= _LEAST_SHARE * shares[0].error_um)[
        :_SHARES_NAMED
    ]


def likeliest_out(health: MachineHealth) -> ParameterHealth | None:
    """Return the parameter that is likeliest to be out of tolerance, of two that are it as surely the one further
    beyond; None where only the volumetric error can be."""
    likeliest = max(health.parameters, key=_urgency, default=None)
    if likeliest is None or not volumetric_binds(health.state, health.parameters, health.map):
        return likeliest
    return likeliest if (likeliest.probability_out or 0.0) > _WORTH_A_WORD else None


def out_of_tolerance(health: MachineHealth) -> tuple[ParameterHealth, ...]:
    """Return the parameters that are more likely beyond their tolerance than within it, the most urgent first."""
    out = (parameter for parameter in health.parameters if (parameter.probability_out or 0.0) > 0.5)
    return tuple(sorted(out, key=_urgency, reverse=True))


def drifting_without_limit(parameters: Sequence[ParameterHealth]) -> list[ParameterHealth]:
    """Return the parameters with a drift and no tolerance to hold it against, the surest drift first."""
    free = [
        parameter for parameter in parameters if parameter.tolerance is None and parameter.drift is not None
    ]
    return sorted(free, key=_doubt)


def concern(health: MachineHealth) -> ParameterHealth | None:
    """Return the parameter that makes a machine's state, or is nearest to make it; None where none is known to."""
    parameters = health.parameters
    if is_due(health):
        named = [each for each in parameters if each.name == health.due]
        if named:
            return named[0]
    if volumetric_binds(health.state, parameters, health.map):
        by_name = {parameter.name: parameter for parameter in parameters}
        shares = [by_name[share.parameter] for share in binding_shares(health) if share.parameter in by_name]
        return shares[0] if shares else None
    if health.state is State.DRIFTS:
        return next(iter(drifting_without_limit(parameters)), None)
    if health.state is State.CHANGED:
        noted = [change.at for change in health.changes if change.counts]
        changed = [parameter for parameter in parameters if any(at in parameter.changed_at for at in noted)]
        if changed:
            return changed[0]
    return max(parameters, key=_urgency, default=None)


def _urgency(parameter: ParameterHealth) -> tuple[float, float, float]:
    """A drift that reaches its limit counts before one that does not, after the probability to be out already."""
    out, drift = parameter.probability_out or 0.0, parameter.drift
    reaches = parameter.reaches_soon and drift is not None and drift.p_value < DRIFT_P
    used = abs(parameter.estimate) / parameter.tolerance if parameter.tolerance else 0.0
    return (out if out > _WORTH_A_WORD else 0.0), float(reaches), used


def _doubt(parameter: ParameterHealth) -> tuple[float, float]:
    """The p-value of a drift; of two that are too small to tell apart, the steeper for its uncertainty is the surer."""
    assert parameter.drift is not None
    u = parameter.drift.u_per_year
    return parameter.drift.p_value, -abs(parameter.drift.per_year) / u if u else 0.0
