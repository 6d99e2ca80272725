"""The volumetric error that a certificate prints: the map of its run, as numbers to be kept with it."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.records import Array
from monitor.reporting.volumetric_result import Length, Place, VolumetricResult
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.uncertainty import Evaluated
from monitor.workflow.volumetric import Mapped, map_of


def volumetric_result(found: Evaluated, state: str) -> VolumetricResult:
    """The map of an evaluated run in display units. Raises InputError for a machine without three linear axes."""
    mapped = map_of(found)
    error, chain, p = mapped.error, mapped.known.chain, found.framework.p
    linear = [place for place, joint in enumerate(chain.joints) if not joint.turns]
    if len(linear) != 3:
        raise InputError(f"the map is printed for three linear axes; '{chain.topology}' has {len(linear)}")
    flat = [name for name, (first, last) in mapped.ranges.items() if not last > first]
    if flat:
        raise InputError(
            f"the map is printed over a volume, but the campaign stood still along {' and '.join(flat)}: say the "
            "strokes in [machine.axes] of its campaign.toml, or leave the map out"
        )
    k = error.factor(p)
    each = mapped.points**3  # the first pose: rotary axes at zero
    signs = np.array([chain.joints[place].sign for place in linear])
    worst = error.worst
    return VolumetricResult(
        state=state,
        p=p,
        k=k,
        ranges=tuple((name, *ends) for name, ends in sorted(mapped.ranges.items())),
        from_strokes=mapped.from_strokes,
        each=mapped.points,
        poses=len(mapped.poses),
        points=len(error.lengths),
        datum=() if error.datum is None else _place(mapped, error.datum),
        largest=_length(
            float(error.lengths[worst]),
            float(error.u_lengths[worst]),
            k,
            _place(mapped, error.positions[worst]),
        ),
        mean=_length(*error.mean, k),
        rms=_length(*error.rms, k),
        left_out=tuple(mapped.left_out.items()),
        axes=tuple(chain.joints[place].name for place in linear),
        readings_mm=error.positions[:each][:, linear] * signs,
        vectors_um=error.vectors[:each] / MICROMETRE.factor,
        expanded_um=k * error.u_lengths[:each] / MICROMETRE.factor,
    )


def _length(value: float, u: float, k: float, at: Place = ()) -> Length:
    shown = MICROMETRE.to_display
    return Length(shown(value), shown(u), shown(k * u), at)


def _place(mapped: Mapped, position: Array) -> Place:
    """Readings of a commanded point, without the spindle's angle."""
    return tuple(
        (
            joint.name,
            joint.sign * (DEGREE.to_display(float(value)) if joint.turns else float(value)) + 0.0,
            "°" if joint.turns else "mm",
        )
        for joint, value in zip(mapped.known.chain.joints, position, strict=True)
        if joint.kind != "spindle"
    )
