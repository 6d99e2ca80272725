"""Independent, exact simulator of calibration campaigns, for the tests only. See README.md."""

from .campaign import cooling, ramps, simulate
from .effects import Effect
from .folder import write_campaign
from .machine import SAMBA_PARAMETERS, SAMBA_TERMS, SimulatedMachine, hu40, wandering
from .plans import (
    Plan,
    Schedule,
    around_the_clock,
    cold_cold_plan,
    five_days_plan,
    indexed_plan,
    working_days,
)
from .touch import travel_signs

__all__ = [
    "SAMBA_PARAMETERS",
    "SAMBA_TERMS",
    "Effect",
    "Plan",
    "Schedule",
    "SimulatedMachine",
    "around_the_clock",
    "cold_cold_plan",
    "cooling",
    "five_days_plan",
    "hu40",
    "indexed_plan",
    "ramps",
    "simulate",
    "travel_signs",
    "wandering",
    "working_days",
    "write_campaign",
]
