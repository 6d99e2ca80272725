"""What ``monitor plan`` prints for a plan of table angles."""

from __future__ import annotations

from typing import Any

from monitor.cli import output


def tables(found: dict[str, Any]) -> None:
    """The present plan, the worth of one more angle, the proposed plan."""
    present, proposed, table = found["present"], found["proposed"], found["table"]
    output.say(f"{found['campaign']}: {_size(present, table)}")
    output.say(f"proposed: {_size(proposed, table)}")
    rows = []
    groups = dict.fromkeys(name.partition("(")[0] for name in present["parameters"])
    for group in groups:
        now, then = _largest(present, group), _largest(proposed, group)
        unit = next(
            one["unit"] for name, one in present["parameters"].items() if name.partition("(")[0] == group
        )
        rows.append([group, unit, now, then])
    stated = found["stated_uncertainty_um"]
    output.table(
        f"largest expected standard uncertainty of one run, {stated:g} µm a probing",
        ["of", "unit", "u", "u proposed"],
        rows,
        text_columns=2,
    )
    axis = f"{table.lower()}_deg"
    output.table(
        f"one more angle of {table}: expanded uncertainty of the shape, k = {found['k']:g}",
        [f"{table} / °", "largest / µm", "median / µm", "unseen", "points beyond the nodes"],
        [
            [f"{one[axis]:g}", _u(one["largest_expanded_shape_um"]), _u(one["median_expanded_shape_um"]),
             str(one["unseen_dimensions"]), str(one["points_beyond_nodes"])]
            for one in found["angles"]
        ],
        text_columns=1,
    )  # fmt: skip
    chosen = ", ".join(f"{angle:g}°" for angle in found["next_angles_deg"])
    output.say(f"probe next at {table} = {chosen}")


def _largest(plan: dict[str, Any], group: str) -> str:
    values = [one["u"] for name, one in plan["parameters"].items() if name.partition("(")[0] == group]
    if any(value is None for value in values):
        return "none"
    return _u(max(values))


def _size(plan: dict[str, Any], table: str) -> str:
    angles = ", ".join(f"{angle:g}°" for angle in plan["angles_deg"])
    said = f"{table} at {angles}: {plan['probings']} probings"
    if plan["unseen_dimensions"]:
        return f"{said}, {plan['unseen_dimensions']} dimensions unseen: no full identification"
    largest, median = plan["largest_expanded_shape_um"], plan["median_expanded_shape_um"]
    return f"{said}, U of the shape at most {_u(largest)} µm, median {_u(median)} µm (k = 2)"


def _u(value: float | None) -> str:
    return "none" if value is None else f"{value:.2g}"
