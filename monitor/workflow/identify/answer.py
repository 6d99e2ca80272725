"""The answer of `identify`: the parameters of every run with their standard uncertainties, and what has no number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import INLINED, OMITTED, Said
from monitor.effects.shapes import REVERSAL_VALUE, has_reversal_value
from monitor.methods.chain.identification import AsStated, TakenUp
from monitor.records import FrameOfReference
from monitor.reporting.refused import RefusedParameters
from monitor.workflow.plan.test_answer import TestAnswer


@dataclass(frozen=True)
class Estimate:
    """A parameter with its standard uncertainty in a display unit."""

    value: float
    u: float
    unit: str


def reversal_value(effect: str, amplitude: Estimate) -> Estimate | None:
    """The reversal value (ISO 230-2) of a play of that amplitude; None for an effect, as written, of another shape."""
    if not has_reversal_value(effect):
        return None
    return Estimate(REVERSAL_VALUE * amplitude.value, REVERSAL_VALUE * amplitude.u, amplitude.unit)


@dataclass(frozen=True)
class CurveEstimate:
    """A coefficient of a curve; ``u`` allows for the resemblance of neighbouring rows, ``u_independent_rows`` does not.

    Both are None where a searched value has no standard uncertainty.
    """

    value: float
    u: float | None
    unit: str
    u_independent_rows: float | None


@dataclass(frozen=True)
class MachineRun:
    """A run of a machine; ``note`` is a warning to those who use its numbers, empty for none."""

    run: int
    parameters: Mapping[str, Estimate]
    refused: tuple[RefusedParameters, ...]
    rms_um: float
    largest_um: float
    chi_square: float
    degrees_of_freedom: int
    iterations: int
    note: str


@dataclass(frozen=True)
class CurveRun:
    """The one run of a curve; residuals in the unit of the response, and in micrometres where that is a length.

    ``chi_square`` is None without a stated standard uncertainty.
    """

    run: int
    parameters: Mapping[str, CurveEstimate]
    refused: tuple[RefusedParameters, ...]
    rms_um: float | None
    rms: float
    largest_um: float | None
    largest: float
    residual_deviation_um: float | None
    residual_deviation: float
    chi_square: float | None
    degrees_of_freedom: int
    bic: float
    iterations: int


@dataclass(frozen=True)
class CurveNoise:
    """How neighbouring rows of a curve resemble each other under its model.

    ``lag_one`` is the correlation of neighbours, ``slow`` its factor with each further row, ``effective_rows`` the
    number of independent rows that a mean of the ``rows`` is worth.
    """

    noticed: bool
    p_value: float
    lag_one: float
    slow: float
    independent_share: float
    rows: int
    effective_rows: float


@dataclass(frozen=True)
class ResponseOverInputs:
    """What a curve measures: its base model in one line, its response and the unit of that."""

    base: str
    response: str
    unit: str


@dataclass(frozen=True)
class LikelyMistake:
    """What looks wrong in the file, and the RMS with it and with it undone. Where it ``explains`` the readings, that is
    what to correct; else it comes nearest, and more or something else is wrong."""

    what: str
    rms_as_recorded_um: float
    rms_undone_um: float
    explains: bool


@dataclass(frozen=True, kw_only=True)
class IdentifyAnswer:
    """The runs of a campaign under a model; ``added`` are the effects that all runs share, ``taken_up`` the errors that
    no plan gives a number of their own, where the method names them, ``as_stated`` the stated tool points that numbers
    count from; ``lack_of_fit_p`` is that of runs of one plan over their scatter, where there are several.

    A curve has ``curve`` and the ``autocorrelation`` of its rows, a machine neither; a machine has ``frames``, what
    each parameter is stated relative to, and the ``reversal_values`` (ISO 230-2) of plays among the added effects.
    ``likely_mistakes`` say what is wrong in a setup or instrument that contradicts the others, where that explains it,
    ``file_doubts`` what the places and lengths that the file declares say against its columns, in sentences.
    ``not_seen`` are position and orientation errors that no number of the last run holds; ``seen_by`` names for what is
    not seen or not separated the one measurement that gives it a number, where there is one.
    ``work_points_elsewhere`` says which come out further from where they are stated than people misstate them: no
    number counts before that is mended. ``copied_readings`` says which of its runs equal those of another campaign, and
    which rows of a run earlier ones.
    """

    campaign: str
    model: str
    machine: str
    method: str
    curve: ResponseOverInputs | None = field(default=None, metadata=INLINED)
    runs: tuple[MachineRun | CurveRun, ...]
    added: Mapping[str, Estimate | CurveEstimate]
    added_refused: tuple[RefusedParameters, ...]
    autocorrelation: CurveNoise | None = field(default=None, metadata=OMITTED)
    frames: Mapping[str, FrameOfReference] | None = field(default=None, metadata=OMITTED)
    reversal_values: Mapping[str, Estimate] | None = field(default=None, metadata=OMITTED)
    taken_up: tuple[TakenUp, ...] | None = field(default=None, metadata=OMITTED)
    as_stated: tuple[AsStated, ...] | None = field(default=None, metadata=OMITTED)
    lack_of_fit_p: float | None = field(default=None, metadata=OMITTED)
    likely_mistakes: tuple[LikelyMistake, ...] | None = field(default=None, metadata=OMITTED)
    file_doubts: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    not_seen: tuple[RefusedParameters, ...] | None = field(default=None, metadata=OMITTED)
    seen_by: Mapping[str, TestAnswer] | None = field(default=None, metadata=OMITTED)
    work_points_elsewhere: Said | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class RefusedCampaign:
    """A campaign that could not be identified, and why."""

    campaign: str
    why: str


@dataclass(frozen=True)
class IdentificationsAnswer:
    """The identifications of all campaigns, and those that could not be identified."""

    identifications: tuple[IdentifyAnswer, ...]
    refused: tuple[RefusedCampaign, ...]


@dataclass(frozen=True)
class StepwiseParameter:
    """A parameter by both ways, and what of their difference remains without noise."""

    unit: str
    stepwise: float | None
    u_stepwise: float | None
    at_once: float | None
    u_at_once: float | None
    difference_by_method: float | None
    u_difference_by_noise: float | None
    agrees: bool
    why: str


@dataclass(frozen=True)
class StepwiseAnswer:
    """One run step by step, beside the fit of all parameters at once."""

    campaign: str
    run: int
    stepwise: Mapping[str, StepwiseParameter]
