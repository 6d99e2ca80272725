"""The kinematic model of a machine alone: where the tool is, with and without geometric errors."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from monitor.api.arguments import argument, checked
from monitor.records import Array
from monitor.topology_text import plain_topology
from monitor.workflow.kinematics import PosesAnswer, PosesRequest, poses

Point = tuple[float, float, float]


class Machine:
    """A machine by its topology, from the workpiece to the tool: ``Machine("w C B X b Z Y (C1) t")``.

    ``axes`` are its axes, ``base`` the errors that can be identified, both by name. The chain is that of ISO 230-1 and
    ISO 10791-6 (docs/mathematics.md, 1). Raises InputError for a topology that cannot be read.
    """

    @checked
    def __init__(self, topology: str) -> None:
        # One pose at zero: the topology is checked where it is written.
        typed = argument("topology", topology, str)
        answer = poses(PosesRequest(typed, {_first_axis(typed): (0.0,)}))
        self.topology = answer.topology
        self.axes = answer.axes
        self.base = answer.base

    @checked
    def deviation(
        self,
        errors: Mapping[str, float | Sequence[float]],
        *,
        tool: Point = (0.0, 0.0, 0.0),
        target: Point = (0.0, 0.0, 0.0),
        **readings: float | Sequence[float] | Array,
    ) -> Array:
        """Return what the errors do at n poses: (n, 3) in µm, tool against workpiece, seen from the last work axis.

        ``errors`` in µm, µrad and µm/m by effect, such as ``{"EC0B": 20, "EXX:poly1": 15}``; ``readings`` in mm and
        degrees by axis, numbers or arrays of one length, such as ``X=[0, 100], B=30``; ``tool`` and ``target`` in mm
        in the frames of the last axes. Exact: nothing is linearised. Raises InputError, EffectError.
        """
        return self._poses(errors, tool, target, readings).deviation_um

    @checked
    def vector(
        self,
        errors: Mapping[str, float | Sequence[float]] | None = None,
        *,
        tool: Point = (0.0, 0.0, 0.0),
        target: Point = (0.0, 0.0, 0.0),
        **readings: float | Sequence[float] | Array,
    ) -> Array:
        """Return the vector from target to tool tip at n poses: (n, 3) in mm, in the frame of the last work axis.

        Arguments as for ``deviation``; without ``errors`` the nominal machine. Raises InputError, EffectError.
        """
        return self._poses(errors or {}, tool, target, readings).vector_mm

    def _poses(
        self,
        errors: Mapping[str, float | Sequence[float]],
        tool: Point,
        target: Point,
        readings: Mapping[str, float | Sequence[float] | Array],
    ) -> PosesAnswer:
        columns = {axis: argument(axis, values, tuple[float, ...]) for axis, values in readings.items()}
        count = max((len(values) for values in columns.values()), default=1)
        columns = {axis: values * count if len(values) == 1 else values for axis, values in columns.items()}
        return poses(
            PosesRequest(
                self.topology,
                columns or {self.axes[0]: (0.0,)},
                argument("errors", errors, Mapping[str, tuple[float, ...]]),
                argument("tool", tool, Point),
                argument("target", target, Point),
            )
        )

    def __repr__(self) -> str:
        return f"Machine('{self.topology}'): axes {', '.join(self.axes)}; errors {', '.join(self.base)}"


def _first_axis(topology: str) -> str:
    """Return the first axis of a topology as typed, for a pose at zero."""
    names = re.findall(r"[A-Z]\d*", plain_topology(topology)[0])
    return names[0] if names else "X"
