"""The method ``l-shape``: the 21 geometric errors of three axes from an L-shaped standard piece."""

from __future__ import annotations

import numpy as np

from monitor.effects import context_of, parse_effect
from monitor.exceptions import DataError
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.l_shape.base import ORDERS, l_shape_base
from monitor.methods.l_shape.problem import LShapeProblem
from monitor.methods.l_shape.stepwise import stepwise
from monitor.methods.method import ChainMethod, Nouns, Stepwise
from monitor.methods.model import Model, chain_of
from monitor.records import Campaign
from monitor.refusal import Advice, AdviceKind
from monitor.units import MICROMETRE

NAME = "l-shape"
DEFAULT_MODEL = Model(NAME)
#: The four columns of a row: where the spots of plane and paraboloid lie on the detector.
COLUMNS = ("plane_u_um", "plane_v_um", "paraboloid_u_um", "paraboloid_v_um")
PLACEMENT = "placement"


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> LShapeProblem:
    """The least-squares problem of a campaign; spots have the stated standard uncertainty of the sensor.

    Raises DataError where the machine has other axes than three linear ones, or the piece is not described.
    """
    chain = chain_of(campaign.machine)
    piece = campaign.artefact.l_shape
    if piece is None:
        raise DataError(
            f"campaign {campaign.name} has no [artefact.l_shape]; l-shape needs its modules and placements"
        )
    base = l_shape_base(chain)
    probings = campaign.probings
    return LShapeProblem(
        context=context_of(campaign, chain),
        base=model.base_of(chain) if model.base else tuple(parse_effect(text, chain) for text in base),
        added=model.added_to(chain),
        sigma=np.full((len(probings), 4), campaign.probe.standard_uncertainty),
        spots=np.column_stack([probings.channels[name] for name in COLUMNS]) * MICROMETRE.factor,
        placement=probings.channels[PLACEMENT].astype(np.int64) - 1,
        piece=piece,
        tip=campaign.probe.tip or (0.0, 0.0, 0.0),
    )


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan left out."""
    assert isinstance(problem, LShapeProblem)
    rows = problem.context.run == run
    used = {problem.piece.placements[index].plane for index in np.unique(problem.placement[rows])}
    missing = tuple(plane for plane in ("XY", "XZ", "YZ") if plane not in used)
    if missing:
        return Advice(AdviceKind.PIECE_PLANES, missing)
    # As many as a cubic needs.
    return Advice(AdviceKind.MORE_MODULES, count=len(ORDERS) + 1)


METHOD = ChainMethod(
    name=NAME,
    title="L-shaped standard piece",
    description="modules of an L, scanned by an angle sensor: the 21 errors of three axes",
    nouns=Nouns(target="module", row="reading"),
    problem_of=problem_of,
    advice=advice,
    base_effects=l_shape_base,
    # Spots move by micrometres whatever is exchanged; noise and module errors leave no more than this.
    gross_times=2.5,
    stepwise=Stepwise(stepwise),
)
