"""The method ``free-form``: points of an unknown workpiece, with the surface normal at each."""

from __future__ import annotations

from monitor.readers.method_rules import MethodRules

RULES = MethodRules(
    "free-form",
    needs_self_calibration=True,
    plain_columns=("normal_x", "normal_y", "normal_z"),
)
