"""The problem of a tracked campaign under a model: the side of the chain that is seen, and its points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.effects import Context, context_of
from monitor.effects.artefact.tracker import measured_points
from monitor.exceptions import DataError
from monitor.machine import Chain
from monitor.methods.model import Model, chain_of
from monitor.methods.tracker.problem import TrackingProblem, as_triples, first_guess
from monitor.records import Array, Campaign
from monitor.sources import SCALE, CommonQuantity

NAME = "tracker"
DEFAULT_MODEL = Model(NAME)
# Three coordinates agree to the last digit by chance once in thousands of rows.
MOST_COPIES = 0.05


def tool_side(chain: Chain) -> Chain:
    """The part of a chain that a tracker beside the machine sees moving."""
    if not chain.tool:
        raise DataError(
            f"'{chain.topology}' has no axis on the tool's side; a tracker beside the machine sees none of it move"
        )
    return Chain(chain.topology, (), chain.tool, chain.down)


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> TrackingProblem:
    """The least-squares problem of a campaign under a model.

    Every coordinate of a point has the stated standard uncertainty, and all of a run the scale where it is stated.
    """
    chain = tool_side(chain_of(campaign.machine))
    context = context_of(campaign, chain)
    fixed = tuple(reflector.id for reflector in campaign.artefact.reflectors if reflector.fixed)
    points = measured_points(context)
    for run in np.unique(context.run):
        if not np.any((context.run == run) & ~np.isin(context.target, list(fixed))):
            raise DataError(f"run {run} of campaign {campaign.name} measured no reflector on the tool")
    _refuse_copies(campaign, context, points)
    carried, places = first_guess(context, points, fixed)
    u = campaign.probe.scale_uncertainty
    ratios = {name: axis.gear_ratio for name, axis in campaign.machine.axes.items()}
    return TrackingProblem(
        context=replace(context, nominal=carried, resting=frozenset(fixed)),
        base=model.base_of(chain, outside=True),
        added=model.added_to(chain, outside=True),
        sigma=np.full((len(context), 3), campaign.probe.standard_uncertainty),
        reflectors=as_triples(places),
        fixed=fixed,
        gear_ratios=tuple((name, ratio) for name, ratio in ratios.items() if ratio is not None),
        observer=campaign.probe.id,
        scale=None
        if u is None
        else CommonQuantity(campaign.probe.id, campaign.probe.certificate or "", SCALE, u),
        is_scale_known=SCALE in campaign.probe.known,
    )


def _refuse_copies(campaign: Campaign, context: Context, points: Array) -> None:
    """Rows that stand there twice to the last digit are no second measurement: noise would look like effects."""
    targets = np.unique(context.target, return_inverse=True)[1]
    rows = np.column_stack([context.run, targets, context.positions, points])
    copies = len(rows) - len(np.unique(rows, axis=0))
    if copies > MOST_COPIES * len(rows):
        raise DataError(
            f"{copies} of {len(rows)} rows of campaign {campaign.name} repeat another row of the same run to the last "
            "digit, measured point and all: leave the copies out, they are no measurements of their own"
        )
