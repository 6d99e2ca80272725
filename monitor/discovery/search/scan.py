"""The search for missing effects: step by step, with the false discovery rate controlled over every scan.

Each step weighs every candidate against what the effects selected so far leave over, selects the most convincing
one if it stands the control, and then asks of each effect selected before whether, given the others, another
candidate would do better: a mimic selected early is exchanged. The scan ends when nothing stands.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Generic

import numpy as np

from monitor.discovery.search.acceptance import Acceptance
from monitor.discovery.search.evidence import Evidence, best_of_families_in, pool_of, weigh_beside
from monitor.discovery.search.memory import Memory
from monitor.discovery.search.scene import CandidateT, Scene, family_count
from monitor.discovery.search.steps import step_by_step
from monitor.progress import told
from monitor.statistics import control_false_discoveries
from monitor.stopping import checkpoint

# More than this many effects hidden together in one campaign are beyond what a plan can separate.
MOST_EFFECTS = 6
# Effects that are merged and selected again in turn would go round for ever; a search that has not settled by then is
# reported as it is.
MOST_STEPS = 4 * MOST_EFFECTS
# An exchange must be worth more than the noise of the comparison.
WORTH_EXCHANGING = 1.0


@dataclass(frozen=True)
class Finding(Generic[CandidateT]):
    """One effect that was found: the evidence for it given the others, its q-value, and its rivals.

    ``rivals`` are all candidates with their evidence instead of it, most convincing first, itself included.
    """

    evidence: Evidence[CandidateT]
    q_value: float
    rivals: tuple[Evidence[CandidateT], ...]

    @property
    def candidate(self) -> CandidateT:
        """The effect that was found."""
        return self.evidence.candidate


@dataclass(frozen=True)
class ScanResult(Generic[CandidateT]):
    """The findings of a scan, the most convincing first."""

    findings: tuple[Finding[CandidateT], ...]

    @property
    def candidates(self) -> list[CandidateT]:
        """The effects that were found."""
        return [finding.candidate for finding in self.findings]


def scan(
    scene: Scene[CandidateT],
    acceptance: Acceptance[CandidateT] | None = None,
    *,
    rate: float = 0.01,
    most: int = MOST_EFFECTS,
    begin: Sequence[CandidateT] = (),
) -> ScanResult[CandidateT]:
    """Search the missing effects among the candidates of which the data see anything.

    ``rate`` is the false discovery rate over each scan; ``most`` how many effects at most; ``acceptance`` the rules
    of the search, none where it is None; ``begin`` what an earlier scan of fewer candidates selected.
    """
    steps = _Steps(scene, acceptance or Acceptance(scene), rate)
    selected = step_by_step(steps, begin, most=most, most_steps=MOST_STEPS)
    return ScanResult(steps.findings(selected))


def findings_of(scene: Scene[CandidateT], selected: Sequence[CandidateT]) -> tuple[Finding[CandidateT], ...]:
    """The selected effects with their evidence given the others and their rivals of all candidates, most convincing
    first."""
    return _Steps(scene, Acceptance(scene)).findings(selected)


#: Where a round stands when it weighs its first candidates and when its steps end, and by how much each further step
#: is nearer to that end: medians of nine examples. What is left is the fit of what was accepted, and its rivals.
FIRST_WEIGHED, STEPS_END, SLOWER = 0.25, 0.5, 0.8


def findings_without_rivals(
    scene: Scene[CandidateT], selected: Sequence[CandidateT], families: int
) -> list[Finding[CandidateT]]:
    """The selected effects with their evidence given the others, of a search among so many families."""
    weighed = [
        weigh_beside(scene, [candidate], except_for(selected, index))[0]
        for index, candidate in enumerate(selected)
    ]
    return [Finding(each, min(1.0, each.p_value * families), (each,)) for each in weighed]


class _Steps(Generic[CandidateT]):
    """The steps of a scan of a scene under the rules of its search; what was weighed is not weighed again."""

    def __init__(self, scene: Scene[CandidateT], rules: Acceptance[CandidateT], rate: float = 1.0) -> None:
        self.scene = scene
        self.rules = rules
        self.rate = rate
        self.families = family_count(scene)
        self.pool = pool_of(scene)
        self._weighings = 0
        self._weighed: Memory[list[Evidence[CandidateT]]] = Memory()
        self._alone: Memory[Evidence[CandidateT]] = Memory()

    def weighed(self, selected: Sequence[CandidateT]) -> list[Evidence[CandidateT]]:
        """Evidence for the best of every family in the pool that can be separated from the selected ones, given
        these."""
        checkpoint()
        self._weighings += 1
        told(FIRST_WEIGHED + (STEPS_END - FIRST_WEIGHED) * (1.0 - SLOWER**self._weighings))
        return self._weighed.answer(selected, None, lambda: self._weigh(selected))

    def _weigh(self, selected: Sequence[CandidateT]) -> list[Evidence[CandidateT]]:
        able = self.rules.separable(selected, self.pool.candidates)
        return best_of_families_in(self.scene.remainders.beside(selected), self.pool, able)

    def evidence(self, candidate: CandidateT, others: Sequence[CandidateT]) -> Evidence[CandidateT]:
        """Evidence for one candidate beside others."""
        return self._alone.answer(others, candidate, lambda: weigh_beside(self.scene, [candidate], others)[0])

    def best(self, selected: Sequence[CandidateT], fallen: Collection[str]) -> CandidateT | None:
        """The most convincing candidate that stands the control and is accepted beside the selected ones; families that
        have ``fallen`` are not selected again."""
        return self._best(selected, fallen, self.rules.accepts)

    def _best(
        self,
        selected: Sequence[CandidateT],
        fallen: Collection[str],
        believed: Callable[[Sequence[CandidateT], CandidateT], bool],
    ) -> CandidateT | None:
        """The most convincing candidate that stands the control and is ``believed`` beside the selected ones."""
        families = {candidate.family for candidate in selected}.union(fallen)
        weighed = self.weighed(selected)
        p_values = [evidence.p_value for evidence in weighed]
        q_values = control_false_discoveries(p_values, rate=self.rate).q_value
        for evidence, q_value in zip(weighed, q_values, strict=True):
            candidate = evidence.candidate
            standing = q_value <= self.rate and candidate.family not in families
            if (
                standing
                and believed(selected, candidate)
                and self.rules.stands_among(self.pool, selected, evidence)
            ):
                return candidate
        return None

    def admitted(self, selected: Sequence[CandidateT], best: CandidateT) -> list[CandidateT]:
        """The selected candidates with another one, exchanged for better ones and merged."""
        selected = [*selected, best]
        selected[-1] = self.rules.at_best_value(selected, len(selected) - 1)
        pool = self.pool.with_more([other for other in self.rules.alternatives(best) if other.visible])
        if pool is not self.pool:
            self.pool, self._weighed = pool, Memory()
        return self.merged(self.exchanged(selected))

    def ahead(
        self, selected: Sequence[CandidateT], fallen: Collection[str], most: int
    ) -> list[CandidateT] | None:
        """The selected candidates with several more that stand beside each other; None where there are no such.

        Of three effects of like size each alone may foretell poses that were left out worse than none, by what the two
        others do there. Two shapes of one error among them are a shape that nobody knows, which is asked for later.
        """
        together = list(selected)
        for _ in range(most):
            best = self._best(together, fallen, self.rules.is_credible) if len(together) < most else None
            if best is None:
                break
            together = self.admitted(together, best)
        standing = self.standing(together)
        errors = {self.rules.error_of(candidate) for candidate in standing}
        return standing if len(selected) + 1 < len(standing) == len(errors) else None

    def standing(self, selected: Sequence[CandidateT]) -> list[CandidateT]:
        """The selected candidates without those that do not stand beside the others, the most doubtful first."""
        selected = list(selected)
        while selected:
            evidence = [
                self.evidence(candidate, except_for(selected, index))
                for index, candidate in enumerate(selected)
            ]
            doubtful = [
                index
                for index, weighed in enumerate(evidence)
                if not self._stands(except_for(selected, index), weighed)
            ]
            if not doubtful:
                break
            del selected[max(doubtful, key=lambda index: evidence[index].p_value)]
        return selected

    def _stands(self, others: list[CandidateT], evidence: Evidence[CandidateT]) -> bool:
        """Whether a selected candidate still stands beside the others."""
        return (
            evidence.p_value <= self.rate / self.families
            and self.rules.accepts(others, evidence.candidate)
            and self.rules.stands_among(self.pool, others, evidence)
        )

    def exchanged(self, selected: Sequence[CandidateT]) -> list[CandidateT]:
        """Exchange effects for better ones, given the others, until nothing improves."""
        selected = list(selected)
        for _ in range(MOST_EFFECTS):
            changed = False
            for index in range(len(selected)):
                evidence, others = self.replaceable(selected, index)
                worth = others and others[0].score > evidence.score + WORTH_EXCHANGING
                if worth and self.rules.outdoes(selected, others[0].candidate):
                    selected[index] = others[0].candidate
                    selected[index] = self.rules.at_best_value(selected, index)
                    changed = True
            if not changed:
                break
        return selected

    def merged(self, selected: list[CandidateT]) -> list[CandidateT]:
        """Replace two effects by one where it explains as much at its price: growth of a whole artefact may first be
        mistaken for that of two axes."""
        families = {candidate.family for candidate in selected}
        for first, second in combinations(range(len(selected)), 2):
            others = [candidate for index, candidate in enumerate(selected) if index not in (first, second)]
            weighed = [
                evidence for evidence in self.weighed(others) if evidence.candidate.family not in families
            ]
            pair = self.evidence(selected[first], others).score
            pair += self.evidence(selected[second], [*others, selected[first]]).score
            if weighed and weighed[0].score > pair and self.rules.outdoes(selected, weighed[0].candidate):
                return self.merged([*others, weighed[0].candidate])
        return selected

    def replaceable(
        self, selected: Sequence[CandidateT], index: int
    ) -> tuple[Evidence[CandidateT], list[Evidence[CandidateT]]]:
        """Evidence for the selected effect at an index, given the other selected ones, and for all not selected."""
        others = except_for(selected, index)
        families = {candidate.family for candidate in selected}
        weighed = self.weighed(others)
        evidence = self.evidence(selected[index], others)
        return evidence, [other for other in weighed if other.candidate.family not in families]

    def findings(self, selected: Sequence[CandidateT]) -> tuple[Finding[CandidateT], ...]:
        """The selected effects as findings, most convincing first."""
        findings = [self._finding(selected, index) for index in range(len(selected))]
        return tuple(sorted(findings, key=lambda finding: -finding.evidence.score))

    def _finding(self, selected: Sequence[CandidateT], index: int) -> Finding[CandidateT]:
        """The selected effect at an index as a finding."""
        evidence, others = self.replaceable(selected, index)
        # The smallest of m p-values times m bounds its q-value from above, whatever their dependence.
        rivals = sorted([evidence, *others], key=lambda rival: -rival.score)
        return Finding(evidence, min(1.0, evidence.p_value * self.families), tuple(rivals))


def reduced(
    result: ScanResult[CandidateT], weakest: Callable[[Sequence[Finding[CandidateT]]], int | None]
) -> ScanResult[CandidateT]:
    """Take out the ``weakest`` finding (its index), one after the other, until none is too weak."""
    findings = list(result.findings)
    while findings and (index := weakest(findings)) is not None:
        del findings[index]
    return replace(result, findings=tuple(findings))


def except_for(selected: Sequence[CandidateT], index: int) -> list[CandidateT]:
    """The selected candidates without that at an index."""
    return [*selected[:index], *selected[index + 1 :]]


def by_error_taken_away(scene: Scene[CandidateT], result: ScanResult[CandidateT]) -> ScanResult[CandidateT]:
    """The findings in the order of what they take of the error, each beside those before it."""
    ordered: list[Finding[CandidateT]] = []
    rest = list(result.findings)
    while rest:
        before = [finding.candidate for finding in ordered]
        explained = [weigh_beside(scene, [finding.candidate], before)[0].explained for finding in rest]
        ordered.append(rest.pop(int(np.argmax(explained))))
    return replace(result, findings=tuple(ordered))
