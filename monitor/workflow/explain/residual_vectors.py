"""The residual of every probing as a vector at its place in the machine, with and without a further effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from monitor.discovery import Fit
from monitor.documents import OMITTED
from monitor.effects import ChainEffect
from monitor.exceptions import DataError
from monitor.machine import Chain
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.curve.fit import CurveFit
from monitor.records import Array, Campaign
from monitor.store import Database
from monitor.workflow.explain.residuals import in_machine_frame
from monitor.workflow.explain.tried import tried
from monitor.workflow.identify.fitting import fitted
from monitor.workflow.models import label

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ResidualsRequest:
    """A model (None: the one that is followed) against a campaign; ``effect`` is tried beside it, nothing is stored."""

    campaign: str
    model: str | None = None
    effect: str | None = None


@dataclass(frozen=True)
class AxisPlace:
    """An axis of the machine with all axes at zero: its unit ``direction``, a point ``at_mm`` on it, and what it
    ``carries`` ("workpiece" or "tool"); its ``kind`` is linear, rotary or spindle."""

    name: str
    carries: str
    kind: str
    direction: Vector
    at_mm: Vector


@dataclass(frozen=True)
class ResidualsAnswer:
    """The n probings of a campaign: run, target and sequence; place in mm and residual in µm, along the machine's axes.

    ``machine`` are its axes from the bed outwards, the workpiece's side first; ``seen_from_outside`` says that places
    are measured points and no positions of three linear axes. ``poses`` are the readings of the rotary axes in degrees
    by axis, ``pose`` (n,) the number of each probing's among them. ``left_out`` probings took no part in the fit.
    ``with_effect_um`` are the residuals once the effect is in the model, ``explained_um`` the residuals less these:
    what the effect explains; ``effect_axis`` is the axis whose error it is, None for what belongs to none.
    """

    campaign: str
    model: str
    axes: tuple[str, ...]
    topology: str
    machine: tuple[AxisPlace, ...]
    seen_from_outside: bool
    poses: tuple[Mapping[str, float], ...]
    pose: tuple[int, ...]
    run: tuple[int, ...]
    sequence: tuple[int, ...]
    target: tuple[str, ...]
    place_mm: tuple[Vector, ...]
    residual_um: tuple[Vector, ...]
    left_out: tuple[bool, ...]
    effect: str | None = field(default=None, metadata=OMITTED)
    effect_axis: str | None = field(default=None, metadata=OMITTED)
    with_effect_um: tuple[Vector, ...] | None = field(default=None, metadata=OMITTED)
    explained_um: tuple[Vector, ...] | None = field(default=None, metadata=OMITTED)


def residual_vectors(db: Database, request: ResidualsRequest) -> ResidualsAnswer:
    """Fit a model to a campaign and list what it leaves. Raises NotFoundError, EffectError, DataError for a curve."""
    fit = fitted(db, request.campaign, request.model)
    if isinstance(fit.fit, CurveFit) or not isinstance(fit.campaign, Campaign):
        raise DataError(
            f"{request.campaign} is a curve: it has no places in a machine; compare shows its residuals"
        )
    problem = fit.fit.problem
    if len(problem.components) > 3:
        raise DataError(
            f"{request.campaign}: a reading of {fit.campaign.method} has {', '.join(problem.components)}, "
            "which is no displacement at a place; compare shows its residuals"
        )
    places, residuals = _measured(fit.fit)
    context = problem.context
    poses, pose = _poses(problem)
    answer = ResidualsAnswer(
        campaign=request.campaign,
        model=label(fit.model),
        axes=tuple(joint.name for joint in context.chain.joints),
        topology=fit.campaign.machine.topology,
        machine=_machine(context.chain),
        seen_from_outside=sum(not joint.turns for joint in context.chain.joints) < 3,
        poses=poses,
        pose=pose,
        run=tuple(np.asarray(context.run).tolist()),
        sequence=tuple(np.asarray(context.sequence).tolist()),
        target=tuple(str(name) for name in context.target),
        place_mm=_vectors(places),
        residual_um=_vectors(residuals),
        left_out=tuple(np.asarray(fit.fit.left_out).tolist()),
    )
    if request.effect is None:
        return answer
    effect, with_effect = tried(db, fit, request.effect)
    remaining = _measured(with_effect)[1]
    return replace(
        answer,
        effect=effect,
        effect_axis=_axis_of(with_effect, effect),
        with_effect_um=_vectors(remaining),
        explained_um=_vectors(residuals - remaining),
    )


def _machine(chain: Chain) -> tuple[AxisPlace, ...]:
    """The axes with all of them at zero: the steps from axis to axis add up, since nothing is turned."""
    places = []
    for carries, branch in (("workpiece", chain.work), ("tool", chain.tool)):
        at = np.zeros(3)
        for joint in branch:
            at = at + np.array(joint.offset)
            places.append(AxisPlace(joint.name, carries, joint.kind, joint.direction, _vector(at)))
    return tuple(places)


def _poses(problem: ChainProblem) -> tuple[tuple[Mapping[str, float], ...], tuple[int, ...]]:
    """The readings of the rotary axes in degrees, each pose once, and which of them every probing was taken at."""
    context = problem.context
    turning = [index for index, joint in enumerate(context.chain.joints) if joint.kind == "rotary"]
    signs = np.array([context.chain.joints[index].sign for index in turning], dtype=float)
    readings = np.round(context.positions[:, turning] * signs * (180.0 / np.pi), 2) + 0.0
    different, pose = np.unique(readings, axis=0, return_inverse=True)
    names = [context.chain.joints[index].name for index in turning]
    poses = tuple(dict(zip(names, map(float, row), strict=True)) for row in different)
    return poses, tuple(np.ravel(pose).tolist())


def _axis_of(fit: Fit, text: str) -> str | None:
    """The axis whose error an effect is."""
    effect = next((added for added in fit.problem.added if added.text == text), None)
    return effect.joint.name if isinstance(effect, ChainEffect) else None


def _measured(fit: Fit) -> tuple[Array, Array]:
    """Places (n, 3) mm and residuals (n, 3) µm; where a reading is one number along a normal, its vector along it."""
    return in_machine_frame(fit, fit.problem.as_vectors(fit.vectors))


def _vectors(rows: Array) -> tuple[Vector, ...]:
    return tuple(map(_vector, np.round(rows, 6)))


def _vector(row: Array) -> Vector:
    x, y, z = map(float, row)
    return x, y, z
