"""What a geometric error refers to, and location errors in the frame of the machine.

A location error of the chain is stated relative to the axis before it in its branch; ISO 230-1:2012, 3.7 and
ISO 230-7:2015 state orientation and position of an axis in the coordinate system of the machine. Both are the same
only for the axis next to the bed. To first order the machine's are sums of the chain's: rotations add up along the
branch, and a rotation before an axis shifts it by its lever, the distance of the axes' origins at all zero.

The directions of the machine are those of its linear axes. Where a linear axis is the first to carry the workpiece the
chain is stated in its frame already. Where a rotary axis is, as on ``w C A b X Y Z t``, a method may have fixed the
frame to that axis and found where the linear axes lie: the first linear axis from the bed then is a direction of the
machine, the next one lies in the plane of both, and what turns them against the chain's frame is taken off every axis.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.exceptions import EffectError
from monitor.machine.terms import COMPONENTS, LOCATION, Term, parse_term
from monitor.machine.topology import Chain, Joint
from monitor.records import Array, FrameKind, FrameOfReference
from monitor.units import MICROMETRE

#: The symbol at the head of a parameter's name: ``EXX`` of ``EXX:poly2``, ``EXX(-110)`` and ``EXX@warmup``.
_SYMBOL = re.compile(r"E[XYZABC][^:(@.]+")


@dataclass(frozen=True, eq=False)
class MachineFrame:
    """Location errors in the machine frame as a linear function of parameters: ``names`` (r) and ``matrix`` (r, m).

    ``matrix`` turns the m parameters into the r location errors, both in their display units (µm and µrad); ``units``
    are those of the rows.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    matrix: Array


def term_of(parameter: str, chain: Chain) -> Term | None:
    """Return the term that a parameter belongs to; None for one of the artefact, the tip or a shape."""
    symbol = _SYMBOL.match(parameter)
    if symbol is None:
        return None
    try:
        return parse_term(symbol.group(), chain)
    except EffectError:
        return None


def frame_of(parameter: str, chain: Chain) -> FrameOfReference | None:
    """Return the frame in which a parameter of a chain is stated; None for one that is no error of the chain.

    An error motion is stated in the frame of its own axis: how far that strays from its nominal motion.
    """
    term = term_of(parameter, chain)
    if term is None:
        return None
    joint = chain.joints[term.joint]
    if term.stage != LOCATION:
        return FrameOfReference(FrameKind.OWN_AXIS, joint.name)
    before = _branch_to(chain, term.joint)[:-1]
    if not before:
        # Beside a rotary axis that the frame was fixed to, where the tool's first axis lies is relative to that axis.
        if joint.branch != "work" and _guides(chain):
            return FrameOfReference(FrameKind.PRECEDING_AXIS, chain.work[0].name)
        return FrameOfReference(FrameKind.MACHINE)
    return FrameOfReference(FrameKind.PRECEDING_AXIS, chain.joints[before[-1]].name)


def machine_frame(parameters: Sequence[str], chain: Chain, unknown: Sequence[str] = ()) -> MachineFrame:
    """Return the location errors in the machine frame that m ``parameters`` determine, as their linear function.

    A row is made for each location error among the parameters that says where its axis is: not for one along or, of a
    linear axis, about its own direction. A rotary axis of the workpiece's side has a row, too, for what only the axes
    before it determine: on ``w C A ...`` the place of C along A is ``EX0A``. A row on which a parameter without a
    number (``unknown``) has a part is left out. First order: products of two errors, 1e-4 of an error for angles of
    100 µrad, are neglected.
    """
    terms = [term_of(name, chain) for name in parameters]
    lost = [term for name in unknown if (term := term_of(name, chain)) is not None]
    names, units, rows = [], [], []
    for wanted in _wanted([term for term in terms if term is not None], lost, chain):
        if any(_share(term, wanted, chain) != 0.0 for term in lost):
            continue
        shares = [0.0 if term is None else _share(term, wanted, chain) for term in terms]
        if any(shares):
            names.append(wanted.symbol)
            units.append(wanted.unit.name)
            rows.append(shares)
    return MachineFrame(tuple(names), tuple(units), np.array(rows).reshape(len(rows), len(terms)))


def _guides(chain: Chain) -> dict[int, int]:
    """The axis, by its index, whose turn about a direction (3 to 5, a component) the machine does not have.

    Empty where the chain's frame is that of a linear axis, or no two linear axes say where the machine is.
    """
    if not chain.work or not chain.work[0].turns:
        return {}
    tool_first = [*range(len(chain.work), len(chain.joints)), *range(len(chain.work))]
    linear = [index for index in tool_first if not chain.joints[index].turns]
    if not linear:
        return {}
    first, main = linear[0], chain.joints[linear[0]].main
    # One along the first, as U beside X, does not say how the machine is turned about it.
    second = next((index for index in linear if chain.joints[index].main != main), None)
    if second is None:
        return {}
    return {3 + axis: second if axis == main else first for axis in range(3)}


def _wanted(parameters: Sequence[Term], lost: Sequence[Term], chain: Chain) -> list[Term]:
    """The location errors that could have a row: those among the parameters, and all of the work side's rotary axes."""
    locations = [term for term in parameters if term.stage == LOCATION]
    symbols = {term.symbol for term in (*locations, *lost)}
    fixed = [
        Term(f"E{component}0{joint.name}", index, LOCATION, number)
        for index, joint in enumerate(chain.work)
        for number, component in enumerate(COMPONENTS)
        if joint.turns and joint.main != number % 3
    ]
    every = [*locations, *(term for term in fixed if term.symbol not in symbols)]
    return [term for term in every if _places(term, chain.joints[term.joint])]


def _branch_to(chain: Chain, joint: int) -> list[int]:
    """The indices from the bed to a joint, both ends among them."""
    first = 0 if chain.joints[joint].branch == "work" else len(chain.work)
    return list(range(first, joint + 1))


def _origin(chain: Chain, joint: int) -> Array:
    """The place of a joint's frame (3,) mm with all axes at zero."""
    return np.asarray(np.sum([chain.joints[index].offset for index in _branch_to(chain, joint)], axis=0))


def _places(term: Term, joint: Joint) -> bool:
    """Whether a location error says where an axis is: a linear axis has no place, no axis one along itself."""
    if not term.is_rotation and not joint.turns:
        return False
    along = joint.main == term.component % 3
    return not along or (joint.turns and term.is_rotation)


def _share(term: Term, of: Term, chain: Chain) -> float:
    """By how much the location error ``of`` in the machine frame grows with the parameter ``term``, in display
    units."""
    if term.stage != LOCATION:
        return 0.0
    carries = term.joint in _branch_to(chain, of.joint)
    guide = _guides(chain).get(term.component)
    turns_frame = guide is not None and term.joint in _branch_to(chain, guide)
    if term.is_rotation == of.is_rotation:
        return float(carries) - float(turns_frame) if term.component == of.component else 0.0
    if of.is_rotation:
        return 0.0
    turned = np.zeros(3)
    turned[term.component - COMPONENTS.index("A")] = 1.0
    origin = _origin(chain, of.joint)
    lever = float(carries) * (origin - _origin(chain, term.joint)) - float(turns_frame) * origin
    shift = float(np.cross(turned, lever)[of.component])
    # µm by µrad: a lever of 1 mm shifts by 1e-3 µm a µrad.
    return shift * term.unit.factor / MICROMETRE.factor
