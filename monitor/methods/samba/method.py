"""SAMBA: scale and master balls artefact; balls touched at many indexations, a calibrated bar for the length.

The geometric errors, the balls' places and the stylus tip are identified together (34 unknowns with 4 balls and a
bar on a five-axis machine), so nothing but the bar has to be calibrated. Source: A. Los, Uncertainty
estimation in indirect calibration of five-axis machine tools, Polytechnique Montréal 2017, chapters 3 and 4;
conventions as in docs/conventions.md.
"""

from __future__ import annotations

import numpy as np

from monitor.effects import ChainEffect, context_of
from monitor.exceptions import DataError
from monitor.machine import refuse_untouchable
from monitor.methods.bar_temperature import bar_temperature
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import still_joints
from monitor.methods.chain.touch import Distance, TouchProblem
from monitor.methods.method import ChainMethod, Nouns, TouchPlan
from monitor.methods.model import Model, chain_of
from monitor.methods.rehearsal import Rehearsal
from monitor.methods.samba.virtual import chosen_campaign, virtual_campaign
from monitor.records import Array, Campaign
from monitor.refusal import Advice, AdviceKind
from monitor.sources import CommonQuantity

NAME = "samba"
DEFAULT_MODEL = Model(NAME)


def bar_length(campaign: Campaign) -> Array:
    """Length (R,) mm of the bar in every run, in the order of the runs' numbers.

    With an expansion coefficient and a reference temperature it follows how warm the bar was: its own recorded
    temperature, else that of the air. A run without either has the calibrated length.
    """
    bar = campaign.artefact.scale_bar
    if bar is None:
        raise DataError(f"campaign {campaign.name} has no scale bar; samba needs [artefact.scale_bar]")
    runs = sorted(campaign.runs, key=lambda run: run.run)
    length = np.full(len(runs), bar.length)
    if bar.expansion_coefficient is not None and bar.reference_temperature is not None:
        temperatures = [bar_temperature(campaign, run) for run in runs]
        warmer = [
            0.0 if warmth is None else warmth.degrees - bar.reference_temperature for warmth in temperatures
        ]
        length *= 1.0 + bar.expansion_coefficient * np.array(warmer)
    return length


def problem_of(campaign: Campaign, model: Model = DEFAULT_MODEL) -> TouchProblem:
    """The least-squares problem of a campaign under a model.

    Every coordinate of a probing has the probe's stated standard uncertainty, the bar its own.
    """
    chain = chain_of(campaign.machine)
    refuse_untouchable(chain)
    bar = campaign.artefact.scale_bar
    if bar is None:
        raise DataError(f"campaign {campaign.name} has no scale bar; samba needs [artefact.scale_bar]")
    missing = [name for name in bar.balls if name not in campaign.probings.target]
    if missing and len(campaign.probings):
        raise DataError(
            f"campaign {campaign.name} never probed {' and '.join(missing)} of the scale bar; without the bar "
            "nothing gives the unit of length"
        )
    probed = np.isin(sorted(run.run for run in campaign.runs), campaign.probings.run)
    problem = TouchProblem(
        context=context_of(campaign, chain),
        base=model.base_of(chain),
        added=model.added_to(chain),
        sigma=np.full((len(campaign.probings), 3), campaign.probe.standard_uncertainty),
        distances=(
            Distance(
                bar.balls,
                bar_length(campaign)[probed],
                bar.standard_uncertainty,
                CommonQuantity(
                    campaign.artefact.id, bar.certificate or "", "length of the bar", bar.standard_uncertainty
                ),
            ),
        ),
        tip=campaign.probe.tip or (0.0, 0.0, 0.0),
    )
    return problem.foreseen() if problem.added else problem


def advice(problem: ChainProblem, parameters: tuple[str, ...], run: int) -> Advice:
    """What the plan did not move and would have to move."""
    missing = _bar_ends_missing(problem, run)
    if missing and _gains(problem).intersection(parameters):
        return Advice(AdviceKind.NOT_PROBED, tuple(missing), run=run)
    still = still_joints(problem, run, "rotary", "spindle")
    if not still:
        return _of_bar(problem, parameters) or Advice(AdviceKind.MORE_INDEXATIONS)
    spindle = next((joint.name for joint in still if joint.kind == "spindle"), None)
    if spindle is not None and any(name.endswith(f"0{spindle}") for name in parameters):
        return Advice(AdviceKind.SPINDLE_STILL, (spindle,))
    return Advice(AdviceKind.AXIS_STILL, tuple(joint.name for joint in still))


def _of_bar(problem: ChainProblem, parameters: tuple[str, ...]) -> Advice | None:
    """Which way a bar would have to lie for gains that one rotary axis cannot tell, whatever its angles: it compares
    the scales across it with each other, and a length with none. None where that is not what is missing."""
    turning = [joint for joint in problem.context.chain.joints if joint.turns]
    gains = {
        effect.joint.main: effect.term.symbol
        for effect in problem.base
        if isinstance(effect, ChainEffect) and effect.is_gain
    }
    if len(turning) != 1 or len(gains) != 3 or not set(parameters) <= _gains(problem):
        return None
    (axis,) = turning
    across = sorted(symbol for main, symbol in gains.items() if main != axis.main)
    return Advice(AdviceKind.BAR_DIRECTION, (axis.name, gains[axis.main], *across))


def _bar_ends_missing(problem: ChainProblem, run: int) -> list[str]:
    distances = problem.distances if isinstance(problem, TouchProblem) else ()
    ends = sorted({name for distance in distances for name in distance.between})
    targets = problem.context.target[problem.context.run == run]
    return [name for name in ends if name not in targets]


def _gains(problem: ChainProblem) -> set[str]:
    return {
        name
        for effect in problem.base
        if isinstance(effect, ChainEffect) and effect.is_gain
        for name in effect.parameters(problem.context)
    }


METHOD = ChainMethod(
    name=NAME,
    title="scale and master balls",
    description="balls and a scale bar, touched at indexed angles",
    nouns=Nouns(target="ball", row="touch"),
    problem_of=problem_of,
    advice=advice,
    plan=TouchPlan(),
    rehearsal=Rehearsal("machine tool", virtual_campaign, noise_um=1.0, chosen_campaign=chosen_campaign),
)
