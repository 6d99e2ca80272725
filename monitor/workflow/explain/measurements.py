"""The measurements that tell errors of instruments from those of the machine, and from each other."""

from __future__ import annotations

from dataclasses import replace

from monitor.methods import InstrumentPlan, campaign_method
from monitor.methods.model import Model
from monitor.records import Campaign
from monitor.workflow.explain.explain_answer import InstrumentAlias, MachineExplanation, MachineMissing
from monitor.workflow.explain.ties import Tie, TieBreak
from monitor.workflow.plan.instruments import measurement_that_tells

#: So many measurements are looked for in one explanation: each weighs every test of the plan, a second or so.
MOST_MEASUREMENTS = 3


def with_measurements(
    explanation: MachineExplanation, campaign: Campaign, model: Model
) -> MachineExplanation:
    """The explanation with the measurement for each tie and alias of an instrument, the first of them at least."""
    method = campaign_method(campaign).plan
    if not isinstance(method, InstrumentPlan):
        return explanation
    search = _Search(method, campaign, model)
    missing = tuple(search.of_missing(effect) for effect in explanation.missing)
    aliases = tuple(search.of_alias(alias) for alias in explanation.taken_for_machine)
    return replace(explanation, missing=missing, taken_for_machine=aliases)


class _Search:
    """The search for measurements, up to a number of them."""

    def __init__(self, method: InstrumentPlan, campaign: Campaign, model: Model) -> None:
        self.method, self.campaign, self.model = method, campaign, model
        self.searched = 0

    def of_missing(self, effect: MachineMissing) -> MachineMissing:
        """A missing effect with the measurements of its ties."""
        return replace(effect, ties=tuple(self._of_tie(effect.effect, tie) for tie in effect.ties))

    def of_alias(self, alias: InstrumentAlias) -> InstrumentAlias:
        """An alias with its measurement."""
        if self.searched == MOST_MEASUREMENTS:
            return alias
        self.searched += 1
        test = measurement_that_tells(self.method, self.campaign, self.model, alias.effects[:1])
        return replace(alias, searched=True, measurement=test)

    def _of_tie(self, effect: str, tie: Tie) -> Tie:
        if tie.broken_by is not TieBreak.INSTRUMENT or self.searched == MOST_MEASUREMENTS:
            return tie
        self.searched += 1
        pair = (effect, tie.rivals[0])
        return replace(tie, measurement=measurement_that_tells(self.method, self.campaign, self.model, pair))
