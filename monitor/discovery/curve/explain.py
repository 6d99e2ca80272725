"""Which effect a curve lacks: the same scan as for a machine, over plain columns.

Fit, scan, take what was found into the fit, name the outliers, look whether neighbouring rows resemble each
other, and begin again under that until nothing changes. A finding has to stand three things: the false
discovery rate of the scan, a test that allows for correlated noise (what neighbours share is not sold as an
effect), and the error on rows that took no part in its fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from monitor.discovery.curve.missing import CurveMissing, tell
from monitor.discovery.curve.outliers import Outlier
from monitor.discovery.curve.quality import noise_of
from monitor.discovery.curve.search import Views, exhausted
from monitor.discovery.machine.visible import SMALLEST_SHARE
from monitor.methods.curve.fit import CurveFit, fit
from monitor.methods.curve.problem import CurveProblem
from monitor.statistics.noise import WHITE, Assessed

#: Tides have a dozen lines; more than these are beyond what one scan should tell.
MOST_EFFECTS = 12


@dataclass(frozen=True)
class CurveExplanation:
    """The answer: the model as given (``first``), what it lacks, the readings that were left out, the noise that is
    left, and what the rows say nothing of."""

    first: CurveFit
    final: CurveFit
    missing: tuple[CurveMissing, ...]
    suspect: tuple[Outlier, ...]
    noise: Assessed
    blind: tuple[str, ...]
    refused: tuple[tuple[str, str], ...]


def explain_curve(problem: CurveProblem, *, rate: float = 0.01, most: int = MOST_EFFECTS) -> CurveExplanation:
    """What a curve's model lacks. ``rate`` is the false discovery rate of each scan.

    Raises DataError where the model cannot be fitted.
    """
    first = fit(problem)
    if first.exact:
        return CurveExplanation(first, first, (), (), noise_of(first), (), ())
    suspect: tuple[Outlier, ...] = ()
    now, suspect = exhausted(Views(problem, rate, WHITE), suspect, most)
    noise = noise_of(now.under)
    if noise.noticed:
        # Some cycles were taken for the sake of company that did not come: each has to stand alone now.
        now = now.alone()
        noise = noise_of(now.under)
    rounds = [now]
    if noise.noticed:
        # What independent rows would show was found; now what stands out once the resemblance is filtered out.
        more = replace(now.under.settled, left_out=problem.left_out)
        now, suspect = exhausted(Views(more, rate, noise.noise), suspect, most - len(now.result.findings))
        noise = noise_of(now.under)
        rounds.append(now)
    out = now.under.problem.left_out
    missing = tell(rounds, noise)
    named = {one.fitted.family for one in missing}
    return CurveExplanation(
        first=first,
        final=now.under,
        missing=missing,
        suspect=tuple(one for one in suspect if out[one.row]),
        noise=noise,
        blind=tuple(
            dict.fromkeys(
                one.family
                for one in rounds[0].visible.candidates
                if one.share <= SMALLEST_SHARE and one.family not in named
            )
        ),
        refused=rounds[0].visible.refused,
    )
