"""A CMM of three axes, and the setup of a part or plate whose stated places it measures."""

from __future__ import annotations

from tests.simulator.instruments import SimulatedAxis, SimulatedChain

CHAIN = SimulatedChain(
    (SimulatedAxis("Z", "linear", (0.0, 0.0, 1.0)),),
    (
        SimulatedAxis("Y", "linear", (0.0, 1.0, 0.0), sign=-1),
        SimulatedAxis("X", "linear", (1.0, 0.0, 0.0), sign=-1),
    ),
)
SETUP = """
[[setups]]
id = "cmm"
reading = "point"
instrument = "CMM"
standard_uncertainty_um = 1.5
scale_standard_uncertainty_um_per_m = 0.3
known = ["targets"]
"""
