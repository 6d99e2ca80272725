"""The measurements that tell errors of instruments from those of the machine, and from each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from monitor.methods import InstrumentPlan, campaign_method
from monitor.methods.model import Model
from monitor.records import Campaign
from monitor.workflow.explain.explain_answer import InstrumentAlias, MachineExplanation, MachineMissing
from monitor.workflow.explain.ties import Tie, TieBreak
from monitor.workflow.plan.instruments import measurement_that_tells
from monitor.workflow.plan.test_answer import TestAnswer

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
        ties = tuple(each for tie in effect.ties for each in self._of_tie(effect, tie))
        return replace(effect, ties=ties)

    def of_alias(self, alias: InstrumentAlias) -> InstrumentAlias:
        """An alias with its measurement."""
        if self.searched == MOST_MEASUREMENTS:
            return alias
        self.searched += 1
        test = measurement_that_tells(self.method, self.campaign, self.model, alias.effects[:1])
        return replace(alias, searched=True, measurement=test)

    def _of_tie(self, effect: MachineMissing, tie: Tie) -> Iterator[Tie]:
        """A tie with its measurement, of each rival by itself where poses are said to break what none of the plan
        breaks."""
        # What follows a driver (a load) is told by other values of it, which no plan of tests has.
        alike = [rival for rival in tie.rivals if rival in effect.coinciding and "@" not in rival]
        if tie.broken_by is TieBreak.INSTRUMENT and (test := self._measurement(effect.effect, tie.rivals[0])):
            yield replace(tie, measurement=test)
        elif tie.broken_by is TieBreak.MORE_POSES and alike:
            for rival in alike:
                yield self._of_alike(effect.effect, replace(tie, rivals=(rival,)))
            if rest := tuple(rival for rival in tie.rivals if rival not in alike):
                yield replace(tie, rivals=rest)
        else:
            yield tie

    def _of_alike(self, effect: str, tie: Tie) -> Tie:
        """A tie of a rival that does the same at every pose of the plan: by the measurement of another setup or length
        of the tool, or by nothing that is known."""
        if self.searched == MOST_MEASUREMENTS:
            return replace(tie, broken_by=TieBreak.INSTRUMENT, axes=())
        test = self._measurement(effect, tie.rivals[0])
        broken_by = TieBreak.NO_POSES if test is None else TieBreak.INSTRUMENT
        return replace(tie, broken_by=broken_by, axes=(), measurement=test)

    def _measurement(self, effect: str, rival: str) -> TestAnswer | None:
        if self.searched == MOST_MEASUREMENTS:
            return None
        self.searched += 1
        return measurement_that_tells(self.method, self.campaign, self.model, (effect, rival))
