"""The effects that a curve lacks: the same scan as for a machine, over plain columns.

Fit, scan, add the findings to the model, name the outliers, look whether neighbouring rows resemble each other, and
begin again under that until nothing changes. A finding has to stand three things: the false discovery rate of the
scan, a test that allows for correlated noise (what neighbours share is no effect), and the error on rows that took no
part in its fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from monitor.discovery.curve.missing import CurveMissing, missing_effects
from monitor.discovery.curve.outliers import Outlier
from monitor.discovery.curve.quality import noise_of
from monitor.discovery.curve.search import CurveSearch
from monitor.methods.curve.fit import CurveFit, fit
from monitor.methods.curve.problem import CurveProblem
from monitor.statistics.noise import WHITE, Assessed

#: Tides have a dozen lines; more than these are beyond what one scan should report.
MOST_EFFECTS = 12


@dataclass(frozen=True)
class CurveExplanation:
    """The answer: the model as given (``first``), what it lacks, the readings that were left out, the noise that
    remains, and the effects to which the rows are blind."""

    first: CurveFit
    final: CurveFit
    missing: tuple[CurveMissing, ...]
    suspect: tuple[Outlier, ...]
    noise: Assessed
    blind: tuple[str, ...]
    refused: tuple[tuple[str, str], ...]


def explain_curve(problem: CurveProblem, *, rate: float = 0.01, most: int = MOST_EFFECTS) -> CurveExplanation:
    """Explain what a curve's model lacks. ``rate`` is the false discovery rate of each scan.

    Raises DataError where the model cannot be fitted.
    """
    first = fit(problem)
    if first.exact:
        return CurveExplanation(first, first, (), (), noise_of(first), (), ())
    latest, suspect = CurveSearch(problem, rate, WHITE).exhausted((), most)
    noise = noise_of(latest.under)
    if noise.noticed:
        # Some cycles were accepted only jointly with others that were rejected; test each alone.
        latest = latest.alone()
        noise = noise_of(latest.under)
    rounds = [latest]
    if noise.noticed:
        # What independent rows would show was found; search what stands out once the resemblance is filtered out.
        more = replace(latest.under.settled, left_out=problem.left_out)
        search = CurveSearch(more, rate, noise.noise)
        latest, suspect = search.exhausted(suspect, most - len(latest.result.findings))
        noise = noise_of(latest.under)
        rounds.append(latest)
    left_out = latest.under.problem.left_out
    missing = missing_effects(rounds, noise)
    families = {effect.fitted.family for effect in missing}
    scene = rounds[0].scene
    blind = [candidate.family for candidate in scene.candidates if not candidate.visible]
    return CurveExplanation(
        first=first,
        final=latest.under,
        missing=missing,
        suspect=tuple(outlier for outlier in suspect if left_out[outlier.row]),
        noise=noise,
        blind=tuple(dict.fromkeys(family for family in blind if family not in families)),
        refused=scene.refused,
    )
