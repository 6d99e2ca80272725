"""What each parameter of a run refers to, and its location errors in the frame of the machine with their covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from monitor.documents import OMITTED
from monitor.machine import Chain, frame_of, machine_frame
from monitor.records import Array, FrameOfReference
from monitor.reporting.frames import frame_words


@dataclass(frozen=True, eq=False)
class MachineFrameAnswer:
    """Location errors in the machine frame: r sums of the parameters, in µm and µrad.

    ``sums`` gives of each its terms, parameter by parameter with its factor; ``covariance`` (r, r) is that of the
    sums, in products of their units. It is singular where there are more of them than parameters that they rest on.
    ``k`` is the coverage factor of one of them by itself (GUM G.3), for the probability of the answer that it stands
    in.
    """

    parameters: tuple[str, ...]
    units: Mapping[str, str]
    estimate: Mapping[str, float]
    u: Mapping[str, float]
    covariance: Array
    sums: Mapping[str, Mapping[str, float]]
    k: float | None = field(default=None, metadata=OMITTED)

    @property
    def moved(self) -> tuple[str, ...]:
        """The parameters whose value in the machine frame is not the one that is stated relative to the axis before."""
        return tuple(name for name in self.parameters if self.sums[name] != {name: 1.0})


def frames_of(parameters: Sequence[str], chain: Chain) -> dict[str, FrameOfReference]:
    """What each parameter of the chain is stated relative to; others (of the artefact, of a shape) are left out."""
    frames = {name: frame_of(name, chain) for name in parameters}
    return {name: frame for name, frame in frames.items() if frame is not None}


def refers_to(parameters: Sequence[str], chain: Chain) -> dict[str, str]:
    """What each parameter, or effect, of the chain is stated relative to, in the words of a table."""
    return {name: frame_words(frame) for name, frame in frames_of(parameters, chain).items()}


def in_machine_frame(
    parameters: Sequence[str], estimate: Array, covariance: Array, chain: Chain, unknown: Sequence[str]
) -> MachineFrameAnswer:
    """The location errors in the machine frame, from ``estimate`` (m,) and ``covariance`` (m, m) in display units.

    A location error on which an ``unknown`` parameter, one without a number, has a part is left out.
    """
    frame = machine_frame(parameters, chain, unknown)
    values = frame.matrix @ estimate
    of_sums = frame.matrix @ covariance @ frame.matrix.T
    u = np.sqrt(np.maximum(np.diag(of_sums), 0.0))
    return MachineFrameAnswer(
        parameters=frame.names,
        units=dict(zip(frame.names, frame.units, strict=True)),
        estimate=dict(zip(frame.names, map(float, values), strict=True)),
        u=dict(zip(frame.names, map(float, u), strict=True)),
        covariance=of_sums,
        sums={
            name: {
                parameter: float(part) for parameter, part in zip(parameters, row, strict=True) if part != 0.0
            }
            for name, row in zip(frame.names, frame.matrix, strict=True)
        },
    )
