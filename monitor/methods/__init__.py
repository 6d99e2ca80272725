"""Calibration methods, one folder each, what each of them can do, and the least-squares solver that they share.

``methods()`` has all of them, ``campaign_method(campaign)`` is the one that a campaign was measured by. What several
methods share is in ``chain`` (any machine); a new method is a new folder, found by looking through this package.
"""

from monitor.methods.method import (
    AnglePlan,
    ChainMethod,
    CurveMethod,
    InstrumentPlan,
    Method,
    Stepwise,
    TouchPlan,
    Unable,
)
from monitor.methods.registry import campaign_method, method_named, methods, require
from monitor.methods.rehearsal import Able, Rehearsal

__all__ = [
    "Able",
    "AnglePlan",
    "ChainMethod",
    "CurveMethod",
    "InstrumentPlan",
    "Method",
    "Rehearsal",
    "Stepwise",
    "TouchPlan",
    "Unable",
    "campaign_method",
    "method_named",
    "methods",
    "require",
]
