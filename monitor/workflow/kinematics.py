"""Where tool and workpiece are in a machine with errors: the kinematic model alone, without a database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from monitor.effects import ChainEffect, Context, parse_effect, positions_of
from monitor.exceptions import InputError
from monitor.machine import Chain, evaluate, parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.records import Array
from monitor.units import DEGREE

#: Beyond it lies no reading (mm, degrees), error (µm, µrad, µm/m) or length: a kilometre, in µm.
LARGEST = 1e9


@dataclass(frozen=True)
class PosesRequest:
    """The poses of a machine of a ``topology`` (ISO 10791-6 order, such as ``w C B X b Z Y (C1) t``) with errors.

    ``readings`` of n poses by axis, in mm and degrees; an axis without readings stands at zero. ``errors`` by effect
    (``EA0B``, ``EXX:poly1``, ``EBB:harmonic2``) in display units (µm, µrad, µm/m), as many numbers as it has
    coefficients. ``tool_mm`` is the tip in the frame of the last tool axis, ``target_mm`` the point in the frame
    of the last work axis. Raises InputError for readings of unequal length.
    """

    topology: str
    readings: Mapping[str, tuple[float, ...]]
    errors: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    tool_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    target_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        lengths = {axis: len(values) for axis, values in self.readings.items()}
        if not lengths or 0 in lengths.values():
            raise InputError("name at least one axis with one reading or more, for example X=[0, 100]")
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{axis} {count}" for axis, count in lengths.items())
            raise InputError(f"every axis needs the same number of readings; there are {listed}")
        named = {**self.readings, **self.errors, "tool_mm": self.tool_mm, "target_mm": self.target_mm}
        for name, numbers in named.items():
            beyond = [number for number in numbers if not abs(number) <= LARGEST]
            if beyond:
                raise InputError(
                    f"{name}: {beyond[0]:g} is nothing a machine reads or has; {LARGEST:g} is the most"
                )


@dataclass(frozen=True)
class PosesAnswer:
    """Vectors (n, 3) in mm from the target to the tip, in the frame of the last work axis.

    ``vector_mm`` with the errors, ``nominal_mm`` without; ``deviation_um`` is their difference. ``base`` are the
    location errors and gains that the chain needs and can have identified.
    """

    topology: str
    axes: tuple[str, ...]
    base: tuple[str, ...]
    vector_mm: Array
    nominal_mm: Array
    deviation_um: Array


def poses(request: PosesRequest) -> PosesAnswer:
    """Evaluate the exact chain at every pose. Raises InputError, EffectError for what the chain does not have."""
    chain = parse_topology(request.topology)
    names = tuple(joint.name for joint in chain.joints)
    for axis in request.readings:
        if axis not in names:
            raise InputError(
                f"there is no axis {axis} in '{chain.topology}'; its axes are {', '.join(names)}"
            )
    turning = {joint.name for joint in chain.joints if joint.turns}
    positions = positions_of(
        chain,
        {
            axis: np.asarray(values, dtype=float) * (DEGREE.factor if axis in turning else 1.0)
            for axis, values in request.readings.items()
        },
    )
    errors = np.zeros((len(positions), len(chain.joints), 2, 6))
    target = np.tile(np.array(request.target_mm, dtype=float), (len(positions), 1))
    tip = np.array(request.tool_mm, dtype=float)
    nominal = evaluate(chain, positions, np.zeros_like(errors), target, tip).residual
    context = _standing(chain, positions)
    for text, values in request.errors.items():
        _apply(text, values, context, errors, target)
    vector = evaluate(chain, positions, errors, target, tip).residual
    return PosesAnswer(chain.topology, names, base_effects(chain), vector, nominal, (vector - nominal) * 1e3)


def _apply(text: str, values: tuple[float, ...], context: Context, errors: Array, target: Array) -> None:
    effect = parse_effect(text, context.chain)
    if not isinstance(effect, ChainEffect):
        raise InputError(f"'{text}' is no error of an axis; name errors such as EA0B or EXX:poly1")
    basis = effect.basis(context)
    if len(values) != basis.size:
        raise InputError(f"'{text}' has {basis.size} coefficients, not {len(values)}")
    coefficients = np.array([effect.unit.to_internal(value) for value in values])
    basis.apply(coefficients, errors, target)


def _standing(chain: Chain, positions: Array) -> Context:
    """Return the poses one second apart in one run, with nothing recorded."""
    count = len(positions)
    seconds = np.arange(count, dtype=float)
    return Context(
        chain=chain,
        positions=positions,
        run=np.ones(count, dtype=np.int64),
        sequence=np.arange(1, count + 1),
        time=seconds,
        day_time=seconds,
        run_time=seconds / max(count - 1, 1),
        target=np.full(count, ""),
        nominal=np.full((count, 3), np.nan),
        columns={"time_s": seconds},
    )
