"""What ``monitor plan`` prints for a plan of table angles."""

from __future__ import annotations

from monitor.cli import output
from monitor.workflow.plan.answer import AngleParameter, AnglePlanAnswer, AnglesOfTable


def tables(answer: AnglePlanAnswer) -> None:
    """The present plan, the worth of one more angle, the proposed plan."""
    table = answer.table
    output.say(f"{answer.campaign}: {_size(answer.present, table)}")
    output.say(f"proposed: {_size(answer.proposed, table)}")
    present, proposed = _by_group(answer.present), _by_group(answer.proposed)
    output.table(
        f"largest expected standard uncertainty of one run, {answer.stated_uncertainty_um:g} µm a probing",
        ["of", "unit", "u", "u proposed"],
        [
            [group, parameters[0].unit, _largest(parameters), _largest(proposed[group])]
            for group, parameters in present.items()
        ],
        text_columns=2,
    )
    output.table(
        f"one more angle of {table}: expanded uncertainty of the shape, k = {answer.k:g}",
        [f"{table} / °", "largest / µm", "median / µm", "unseen", "points beyond the nodes"],
        [
            [
                *(f"{degrees:g}" for degrees in plan.angle.values()),
                _uncertainty(plan.shape.largest_expanded_shape_um),
                _uncertainty(plan.shape.median_expanded_shape_um),
                str(plan.unseen_dimensions),
                str(plan.shape.points_beyond_nodes),
            ]
            for plan in answer.angles
        ],
        text_columns=1,
    )
    angles = ", ".join(f"{degrees:g}°" for degrees in answer.next_angles_deg)
    output.say(f"probe next at {table} = {angles}")


def _by_group(plan: AnglesOfTable) -> dict[str, list[AngleParameter]]:
    """The parameters by what stands before the bracket: ``EXX(110)`` belongs to ``EXX``."""
    groups: dict[str, list[AngleParameter]] = {}
    for name, parameter in plan.parameters.items():
        groups.setdefault(name.partition("(")[0], []).append(parameter)
    return groups


def _largest(parameters: list[AngleParameter]) -> str:
    """The largest standard uncertainty; none where one of them has no number."""
    numbers = [parameter.u for parameter in parameters if parameter.u is not None]
    return _uncertainty(max(numbers) if len(numbers) == len(parameters) else None)


def _size(plan: AnglesOfTable, table: str) -> str:
    angles = ", ".join(f"{angle:g}°" for angle in plan.angles_deg)
    size = f"{table} at {angles}: {plan.probings} probings"
    if plan.unseen_dimensions:
        return f"{size}, {plan.unseen_dimensions} dimensions unseen: no full identification"
    largest = _uncertainty(plan.shape.largest_expanded_shape_um)
    median = _uncertainty(plan.shape.median_expanded_shape_um)
    return f"{size}, U of the shape at most {largest} µm, median {median} µm (k = 2)"


def _uncertainty(value: float | None) -> str:
    return "none" if value is None else f"{value:.2g}"
