"""Shifts that no pose at all tells apart: they move the tip alike wherever the axes stand.

Of the poses of a plan nothing is asked here. A shift moves the tip by the same vector whatever target and stylus are;
how the axes before it are turned changes its direction, and where they stand its size, if it has a shape. So poses are
drawn over the whole travel of all axes, and what of a shift another one leaves there is compared with rounding. What a
turn does depends on where is touched, too: where one of both is a turn, targets and a stylus are drawn with the poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import MachineEffect
from monitor.effects import ChainEffect, Context
from monitor.machine import Joint, evaluate
from monitor.records import Array

# Effects have a few coefficients each: so many poses show any difference between two of them.
POSES = 100
# Where the machine file states no stroke: any angle, and half a metre to either side, mm.
ANY_PLACE = 500.0
# What is left of a shift that another one does is rounding, some 1e-15 of it; what differs leaves some hundredths.
SAME = 1e-6


def moves_alike(
    context: Context,
    effect: MachineEffect,
    coefficients: Array,
    rival: MachineEffect,
    strokes: Mapping[str, tuple[float, float]],
) -> bool:
    """Whether a rival can do, wherever the axes stand, what an effect of the given coefficients (k,) does.

    Both are asked at one state of their driver. Two joints that turn about one line make turns alike.
    ``strokes`` gives the travel of axes in mm or rad where the machine file has one.
    """
    if not isinstance(effect, ChainEffect) or not isinstance(rival, ChainEffect):
        return False
    anywhere, tip = _anywhere(context, strokes), np.zeros(3)
    if effect.term.is_rotation or rival.term.is_rotation:
        drawn = np.random.default_rng(1).uniform(-ANY_PLACE, ANY_PLACE, (POSES + 1, 3))
        anywhere, tip = replace(anywhere, nominal=drawn[1:]), drawn[0]
    errors = np.zeros((POSES, len(context.chain.joints), 2, 6))
    pose = evaluate(context.chain, anywhere.positions, errors, anywhere.nominal, tip, jacobian=True)
    assert pose.by_error is not None
    wanted = effect.basis(anywhere).displacement(pose.by_error).reshape(3 * POSES, -1) @ coefficients
    columns = rival.basis(anywhere).displacement(pose.by_error).reshape(3 * POSES, -1)
    remainder = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(np.linalg.norm(remainder)) <= SAME * float(np.linalg.norm(wanted))


def _anywhere(context: Context, strokes: Mapping[str, tuple[float, float]]) -> Context:
    """The context of poses drawn over the whole travel, everything else as in the mean of the campaign."""
    rng = np.random.default_rng(0)
    ranges = np.array([strokes.get(joint.name, _any_range(joint)) for joint in context.chain.joints])
    channels = {
        name: np.full(
            POSES, float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else np.nan
        )
        for name, values in context.columns.items()
    }
    rows = np.zeros(POSES, dtype=np.int64)
    return replace(
        context,
        positions=rng.uniform(ranges[:, 0], ranges[:, 1], (POSES, len(ranges))),
        expected=None,
        run=context.run[rows],
        sequence=np.arange(POSES),
        time=np.full(POSES, float(np.mean(context.time))),
        day_time=np.full(POSES, float(np.mean(context.day_time))),
        run_time=np.full(POSES, 0.5),
        target=context.target[rows],
        nominal=context.nominal[rows],
        columns=channels,
        sight=None,
        instruments=None,
        stretch=None,
        set_up=None,
        approach=None,
        measured=context,
    )


def _any_range(joint: Joint) -> tuple[float, float]:
    """Where a joint may stand whose travel nobody states."""
    return (-np.pi, np.pi) if joint.turns else (-ANY_PLACE, ANY_PLACE)
