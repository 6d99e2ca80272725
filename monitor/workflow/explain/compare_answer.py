"""The answer of `compare`: how large the residual is, how large it should be, and where it is too large.

A machine's residuals are lengths in micrometres. A curve's stand in the unit of its response; keys that end in ``_um``
repeat them in micrometres where the response is a length and are None elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from monitor.documents import INLINED, OMITTED, Said
from monitor.records import Verdict
from monitor.units import MICROMETRE
from monitor.workflow.identify.answer import CurveNoise, LikelyMistake
from monitor.workflow.instruments.answer import AgainstOthers, Disagreement, RunsWithTime


@dataclass(frozen=True)
class LackOfFitTest:
    """F of lack of fit over pure error and its p-value; all None where no probing or row was repeated."""

    f: float | None = None
    p: float | None = None
    degrees_of_freedom: float | None = None
    pure_error_degrees_of_freedom: float | None = None


@dataclass(frozen=True)
class MachinePart:
    """RMS and largest coordinate of the residual over ``n`` probings."""

    rms_um: float
    largest_um: float
    n: int

    @property
    def rms(self) -> float:
        """The RMS in ``unit``."""
        return self.rms_um

    @property
    def largest(self) -> float:
        """The largest coordinate in µm."""
        return self.largest_um


@dataclass(frozen=True)
class CurvePart:
    """RMS and largest residual over ``n`` rows of a curve."""

    rms_um: float | None
    rms: float
    largest_um: float | None
    largest: float
    n: int


class InMicrometres:
    """Gives a machine's residuals, which are in micrometres, the names of a curve's."""

    unit: ClassVar[str] = MICROMETRE.name
    rms_um: float
    repeatability_um: float | None

    @property
    def rms(self) -> float:
        """The RMS in ``unit``."""
        return self.rms_um

    @property
    def repeatability(self) -> float | None:
        """The repeatability in ``unit``, None where it is not known."""
        return self.repeatability_um


@dataclass(frozen=True)
class MachineComparison(InMicrometres):
    """A model against the probings of a machine.

    ``expected_rms_um`` is what the stated standard uncertainty would leave, ``repeatability_um`` the standard deviation
    of a coordinate over the runs (None with one run or plans that differ), ``residual_deviation_um`` the RMS per degree
    of freedom. ``by`` breaks the residual down by target, axis, run, part of the run and indexation; ``refers_to`` says
    in words whose frame x, y and z of the residual are those of, where these are what is read; ``are_angles``: every
    reading is an angle, of which 1 µm stands for 1 µrad, what it comes to at one metre.
    """

    campaign: str
    model: str
    rms_um: float
    largest_um: float
    repeatability_um: float | None
    expected_rms_um: float
    residual_deviation_um: float
    stated_uncertainty_um: float
    lack_of_fit: LackOfFitTest
    excess_over_statement_p: float
    verdict: Verdict
    by: Mapping[str, Mapping[str, MachinePart]]
    refers_to: Mapping[str, str] | None = field(default=None, metadata=OMITTED)
    are_angles: bool | None = field(default=None, metadata=OMITTED)

    @property
    def expected_rms(self) -> float:
        """The RMS that the stated uncertainty would leave, in ``unit``."""
        return self.expected_rms_um

    @property
    def exceeds_statement(self) -> bool:
        """Whether the residual is larger than stated beyond chance, be it by less than a statement may be wrong."""
        # Loaded here: the lists of models, which know of comparisons, need no search.
        from monitor.discovery.search.comparison import LACK_OF_FIT_LEVEL

        return self.excess_over_statement_p < LACK_OF_FIT_LEVEL


@dataclass(frozen=True)
class CurveComparison:
    """A model against the rows of a curve; what a machine's comparison has, and the ``autocorrelation`` of the rows."""

    campaign: str
    model: str
    method: str
    base: str
    response: str
    unit: str
    rows: int
    rms_um: float | None
    rms: float
    largest_um: float | None
    largest: float
    repeatability_um: float | None
    repeatability: float | None
    expected_rms_um: float | None
    expected_rms: float | None
    residual_deviation_um: float | None
    residual_deviation: float
    stated_uncertainty_um: float | None
    stated_uncertainty: float | None
    degrees_of_freedom: int
    bic: float
    lack_of_fit: LackOfFitTest
    excess_over_statement_p: float | None
    autocorrelation: CurveNoise
    verdict: Verdict
    by: Mapping[str, Mapping[str, CurvePart]]


@dataclass(frozen=True)
class CompareAnswer:
    """The comparison; ``target_word`` is what a machine's method calls its targets, None for a curve.

    ``instruments_disagree`` is there where instruments say of one parameter what chance does not explain,
    ``against_others`` where a setup or instrument contradicts all others together,
    ``likely_mistakes`` where a sign, a unit or exchanged columns of it explain that,
    ``run_with_time`` where readings of a setup drift by more than chance explains,
    ``work_points_elsewhere`` where work points come out further from where they are stated than people misstate them,
    ``copied_readings`` where runs equal those of another campaign or rows earlier ones: no part of what is stored.
    """

    comparison: CurveComparison | MachineComparison = field(metadata=INLINED)
    instruments_disagree: Disagreement | None = field(default=None, metadata=OMITTED)
    against_others: AgainstOthers | None = field(default=None, metadata=OMITTED)
    likely_mistakes: tuple[LikelyMistake, ...] | None = field(default=None, metadata=OMITTED)
    run_with_time: tuple[RunsWithTime, ...] | None = field(default=None, metadata=OMITTED)
    target_word: str | None = field(default=None, metadata=OMITTED)
    work_points_elsewhere: Said | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
