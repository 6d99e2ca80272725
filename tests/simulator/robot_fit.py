"""A least squares of a measured robot that knows its structure: the yardstick of what a search may reach.

Unknown are every small error of every joint, frame and reflectors, cosine and sine of every line that the robot has,
and the softness of every joint that gives way under the true weights. Derivatives are differences of 4x4 matrices;
nothing is shared with the product.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from .measured_robot import NAMES, Scene, Session, torques
from .robot import frames
from .robot_campaign import FIXED, JOINTS, REFLECTORS

STEP = 1e-6
ITERATIONS = 6
# Directions without data: products of errors of 1 mrad leave a thousandth of a column.
RCOND = 1e-7


class KnownStructure:
    """The model of the rows of a session that show reflectors on the tool."""

    def __init__(self, session: Session, scene: Scene) -> None:
        tracked = session.tracked
        self.tool = ~np.isin(tracked.target, list(FIXED))
        poses, first = np.unique(session.pose, return_index=True)
        self.pose = np.searchsorted(poses, session.pose[self.tool])
        self.readings = {
            name: np.deg2rad(tracked.readings[first, column]) for column, name in enumerate(NAMES)
        }
        self.target = np.array(
            [list(REFLECTORS).index(tracked.target[row]) for row in np.flatnonzero(self.tool)]
        )
        self.points = tracked.points[self.tool]
        self.shapes = {name: self._shapes(index, name, scene) for index, name in enumerate(NAMES)}
        self.sizes = [self.shapes[name].shape[1] for name in NAMES]
        self.unknowns = np.zeros(36 + 9 + 6 + sum(self.sizes))
        self.unknowns[36:45] = np.array(list(REFLECTORS.values())).reshape(-1)
        self._begin()

    def _shapes(self, index: int, name: str, scene: Scene) -> np.ndarray:
        """What a joint may turn by itself (P, k) for a unit of each coefficient."""
        q = float(JOINTS[index]["sign"]) * self.readings[name]
        waves = [wave(line.order * q) for line in scene.curves.get(name, ()) for wave in (np.cos, np.sin)]
        soft = [1e-6 * torques(self.readings)[name]] if name in scene.softness else []
        return np.column_stack([np.zeros((len(q), 0)), *waves, *soft])

    def _begin(self) -> None:
        carried = self._carried(self.unknowns, [np.zeros(len(self.pose))] * 6)
        turn = Rotation.align_vectors(self.points - self.points.mean(axis=0), carried - carried.mean(axis=0))[
            0
        ]
        self.unknowns[45:48] = turn.as_rotvec()
        self.unknowns[48:51] = self.points.mean(axis=0) - turn.apply(carried.mean(axis=0))

    def _carried(self, unknowns: np.ndarray, more: list[np.ndarray]) -> np.ndarray:
        """The reflectors (n, 3) in the bed's frame; ``more`` turns of the joints at every pose."""
        location = {name: unknowns[6 * index : 6 * index + 6] for index, name in enumerate(NAMES)}
        motion, start = {}, 51
        for index, name in enumerate(NAMES):
            turn = (
                self.shapes[name] @ unknowns[start : start + self.sizes[index]]
                + more[index][: len(self.shapes[name])]
            )
            start += self.sizes[index]
            motion[name] = np.concatenate(
                [np.zeros((len(turn), 3)), turn[:, None] * np.array(JOINTS[index]["axis"])], axis=1
            )
        tool = frames(JOINTS, self.readings, location, motion)[-1][self.pose]
        return (
            np.einsum("nij,nj->ni", tool[:, :3, :3], unknowns[36:45].reshape(3, 3)[self.target])
            + tool[:, :3, 3]
        )

    def seen(self, unknowns: np.ndarray, joint: int | None = None) -> np.ndarray:
        """The points (n, 3) as the tracker sees them; one ``joint`` turned by a step more."""
        none = np.zeros(len(next(iter(self.readings.values()))))
        more = [none + STEP * (index == joint) for index in range(6)]
        return Rotation.from_rotvec(unknowns[45:48]).apply(self._carried(unknowns, more)) + unknowns[48:51]

    def _jacobian(self, now: np.ndarray) -> np.ndarray:
        columns = []
        for index in range(51):
            moved = self.unknowns.copy()
            moved[index] += STEP
            columns.append(((self.seen(moved) - now) / STEP).reshape(-1))
        for index, name in enumerate(NAMES):
            way = (self.seen(self.unknowns, index) - now) / STEP
            columns += [(way * shape[self.pose, None]).reshape(-1) for shape in self.shapes[name].T]
        return np.column_stack(columns)

    def predicted(self, fitted: np.ndarray) -> np.ndarray:
        """Residuals (n, 3) of all rows, from the ``fitted`` poses (marks of rows)."""
        rows = np.repeat(fitted, 3)
        for _ in range(ITERATIONS):
            now = self.seen(self.unknowns)
            jacobian = self._jacobian(now)[rows]
            scale = np.linalg.norm(jacobian, axis=0)
            scale[scale == 0.0] = 1.0
            step = (
                np.linalg.lstsq(jacobian / scale, (self.points - now).reshape(-1)[rows], rcond=RCOND)[0]
                / scale
            )
            self.unknowns = self.unknowns + step
            if np.abs(step * scale).max() < 1e-5:
                break
        return self.points - self.seen(self.unknowns)


def known_structure_error(
    session: Session, scene: Scene, poses: int, off: Sequence[int] = ()
) -> tuple[float, float]:
    """RMS in mm at the poses fitted (the first so many, without those that are ``off``) and at the new ones."""
    model = KnownStructure(session, scene)
    pose = session.pose[model.tool]
    fitted = (pose < poses) & ~np.isin(pose, list(off))
    residual, new = model.predicted(fitted), pose >= poses
    return float(np.sqrt(np.mean(residual[fitted] ** 2))), float(np.sqrt(np.mean(residual[new] ** 2)))
