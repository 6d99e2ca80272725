"""The method ``l-shape``: readings of angle and straightness sensors along three linear axes."""

from __future__ import annotations

from monitor.readers.method_rules import MethodRules

RULES = MethodRules("l-shape")
