"""The machine as a serial chain: topology string, ISO 230-1 terms, tip-to-target vector and its Jacobian."""

from monitor.machine.chain import ChainPose, Orientation, evaluate, evaluate_with_sides, orientation
from monitor.machine.frames import MachineFrame, frame_of, machine_frame
from monitor.machine.gravity import axis_frames, gravity_in_joint_frames
from monitor.machine.inverse import refuse_untouchable, touching_positions, travel_slopes
from monitor.machine.terms import COMPONENTS, LOCATION, MOTION, Term, parse_term
from monitor.machine.topology import Chain, Joint, chain_of_axes, parse_topology

__all__ = [
    "COMPONENTS",
    "LOCATION",
    "MOTION",
    "Chain",
    "ChainPose",
    "Joint",
    "MachineFrame",
    "Orientation",
    "Term",
    "axis_frames",
    "chain_of_axes",
    "evaluate",
    "evaluate_with_sides",
    "frame_of",
    "gravity_in_joint_frames",
    "machine_frame",
    "orientation",
    "parse_term",
    "parse_topology",
    "refuse_untouchable",
    "touching_positions",
    "travel_slopes",
]
