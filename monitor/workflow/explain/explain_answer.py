"""The answer of `explain`: a comparison, the effects that the model lacks, and readings and changes named as such."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import INLINED, OMITTED, Said, named
from monitor.effects.description import Description
from monitor.reporting.health.comparison import ResidualAgainst, ResidualMap
from monitor.reporting.run_left_out import RunLeftOut
from monitor.reporting.step_words import middle_within
from monitor.workflow.explain.compare_answer import CurveComparison, MachineComparison
from monitor.workflow.explain.ties import Tie
from monitor.workflow.identify.answer import CurveNoise, Estimate, LikelyMistake
from monitor.workflow.instruments.answer import AgainstOthers
from monitor.workflow.plan.test_answer import TestAnswer


@dataclass(frozen=True)
class SearchedValue:
    """A value that was searched for in the data: a time constant, a pitch, a period.

    ``u`` is None where the data do not determine it; ``at_least`` is then what it exceeds at 95 %, if anything.
    """

    what: str
    value: float
    u: float | None
    unit: str
    frequency: float | None = field(default=None, metadata=OMITTED)
    at_least: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class HeldAt:
    """Where a plate that grows is held: the reading of a linear axis there."""

    axis: str
    value: float
    u: float
    unit: str


@dataclass(frozen=True)
class DeviationsApart:
    """How many standard deviations apart two effects are with the present plan, and with the added poses."""

    present: float = field(metadata=named("now"))
    proposed: float = field(metadata=named("then"))


@dataclass(frozen=True)
class CurvePoint:
    """A point of the curve of an unknown shape: the reading of the axis in mm or degrees, the direction of its last
    travel (1 or -1), and the size with its standard uncertainty."""

    at: float
    direction: int
    value: float
    u: float


@dataclass(frozen=True)
class StepBetween:
    """A step of an error: its ``value`` towards higher readings with its standard uncertainty, and the readings of the
    axis between which it lies; no data say where between them. ``width_mm`` is the way over which it goes where it
    says most, None for a step at once: its middle lies within ``middle_mm``."""

    value: float
    u: float
    low_mm: float
    high_mm: float
    width_mm: float | None = field(default=None, metadata=OMITTED)
    middle_mm: tuple[float, float] | None = field(default=None, metadata=OMITTED)

    @property
    def middle(self) -> tuple[float, float]:
        """From where to where in mm its middle may lie, of a step at once the step."""
        return self.middle_mm or middle_within(self.low_mm, self.high_mm, self.width_mm)


@dataclass(frozen=True)
class MachineMissing:
    """An effect that a machine's model lacks: size in ``unit``, evidence, errors before and after it is added, rivals.

    ``heldout_..`` are None with one run of few poses, ``heldout_days_..`` with fewer than three days,
    ``heldout_poses_..`` (poses left out of every run) with fewer than eight poses. ``coinciding`` are rivals that no
    data of this plan could rule out; ``tell_apart_by`` are poses that tell the others apart; ``ties``
    say for every rival what does. Where the catalogue does
    not have the shape of the effect, ``shape_unknown`` says so, ``nearest_shape`` is the entry that comes closest, and
    ``curve`` the shape in ``unit``, without the constant and the slope that every run has of its own.
    ``reversal_value`` of a play (ISO 230-2) is twice its amplitude: what a backlash compensation is set to.
    ``travelled_periods`` of a harmonic is how many of its periods the axis turned, where they are fewer than 1.5 over
    a part of a turn: an offset, a tilt, flexure or another order looks alike there. ``within_its_shape`` are effects
    that stand out beside it but not beside its error in any shape: they cannot be separated from it. ``refers_to``
    says in words what its coefficients are stated relative to, where it is an error of the chain. ``largest`` is the
    coefficient of a table whose absolute value is ``amplitude``, the largest of its nodes, or of several ``steps``,
    each of which lies somewhere between two readings. ``error_peak_um`` stands in the first of several effects of one
    error of the chain: the largest displacement of all of them together. ``held_at`` is where a plate that grows is
    held. Where rows of angles alone show an effect, ``peak_urad`` is its largest turn, and displacements are on a lever
    of one metre.
    """

    rank: int
    effect: str
    description: Description = field(metadata=INLINED)
    amplitude: float
    u: float
    unit: str
    coefficients: Mapping[str, Estimate]
    peak_um: float
    p_value: float
    q_value: float
    rms_before_um: float
    rms_after_um: float
    heldout_before_um: float | None
    heldout_after_um: float | None
    heldout_days_before_um: float | None
    heldout_days_after_um: float | None
    heldout_poses_before_um: float | None
    heldout_poses_after_um: float | None
    indistinguishable_from: tuple[str, ...]
    coinciding: tuple[str, ...]
    tell_apart_by: tuple[dict[str, float], ...]
    standard_deviations_apart: DeviationsApart
    varies_from_run_to_run: bool
    shape_unknown: bool
    nearest_shape: str | None
    curve: tuple[CurvePoint, ...]
    searched: SearchedValue | None = field(default=None, metadata=OMITTED)
    reversal_value: Estimate | None = field(default=None, metadata=OMITTED)
    travelled_periods: float | None = field(default=None, metadata=OMITTED)
    within_its_shape: tuple[str, ...] = ()
    ties: tuple[Tie, ...] = ()
    refers_to: str | None = field(default=None, metadata=OMITTED)
    largest: str | None = field(default=None, metadata=OMITTED)
    error_peak_um: float | None = field(default=None, metadata=OMITTED)
    steps: tuple[StepBetween, ...] | None = field(default=None, metadata=OMITTED)
    held_at: tuple[HeldAt, ...] | None = field(default=None, metadata=OMITTED)
    peak_urad: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class CurveMissing:
    """An effect that a curve's model lacks; it is ``certain`` where noise alone would seldom look so."""

    rank: int
    effect: str
    certain: bool
    noise_alone_p: float
    description: Description = field(metadata=INLINED)
    amplitude: float
    u: float
    unit: str
    coefficients: Mapping[str, Estimate]
    peak_um: float | None
    peak: float
    p_value: float
    q_value: float
    rms_before_um: float | None
    rms_before: float
    rms_after_um: float | None
    rms_after: float
    heldout_before_um: float | None
    heldout_before: float | None
    heldout_after_um: float | None
    heldout_after: float | None
    bic_before: float
    bic_after: float
    indistinguishable_from: tuple[str, ...]
    coinciding: tuple[str, ...]
    tell_apart_by: tuple[dict[str, float], ...]
    varies_from_run_to_run: bool
    searched: SearchedValue | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class BadProbing:
    """A probing that contradicts the same one of the other runs; it was left out. ``turn_urad`` is by how much a whole
    pose is turned, beside what its place is off by; ``refers_to`` says whose frame ``axis`` is one of, where that is
    not the machine's."""

    run: int
    sequence: int
    target: str
    axis: str
    size_um: float
    p_value: float
    turn_urad: float | None = field(default=None, metadata=OMITTED)
    refers_to: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class TargetOffInPlaces:
    """A target that is off alike in all ``places`` and ``runs``, so many of each, by ``x_um``, ``y_um`` and ``z_um``
    from where it is stated, in the frame of its piece; its ``readings`` were left out. ``p_value`` is that of so large
    a vector by chance, among all targets."""

    target: str
    x_um: float
    y_um: float
    z_um: float
    size_um: float
    places: int
    runs: int
    readings: int
    p_value: float


@dataclass(frozen=True)
class BadRow:
    """A row that contradicts the rest of its curve; it was left out. ``line`` is its line of the file."""

    run: int
    sequence: int
    line: int
    target: None
    axis: str
    value: float
    size_um: float | None
    size: float
    p_value: float


@dataclass(frozen=True)
class ScatteringTarget:
    """A target whose readings have ``times`` the standard deviation of those of the others, ``deviation_um``, over
    ``touches`` that several runs repeat; they counted by so much less."""

    target: str
    times: float
    deviation_um: float
    touches: int
    p_value: float


@dataclass(frozen=True)
class UnlikeRun:
    """A run that leaves ``times`` what the others leave, ``deviation_um`` in a reading, with the correlation of
    ``neighbours``: near zero where it scatters, near one where it wanders. ``as_if`` drifted in it."""

    run: int
    times: float
    deviation_um: float
    neighbours: float
    p_value: float
    as_if: str | None = None


@dataclass(frozen=True)
class MovedTarget:
    """A target that stands elsewhere from a probing of a run on; ``of_all`` where the whole piece moved, by this much
    in its middle."""

    target: str
    run: int
    sequence: int
    size: float
    shift_um: tuple[float, ...]
    unit: str
    p_value: float
    of_all: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ChangedTarget:
    """A target that stands elsewhere from a run on."""

    target: str
    run: int
    size: float
    u: float
    unit: str
    p_value: float


@dataclass(frozen=True)
class ChangedParameter:
    """A parameter that stepped at a run; ``refers_to`` says what it is stated relative to."""

    parameter: str
    run: int
    size: float
    u: float
    unit: str
    p_value: float
    refers_to: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class InstrumentAlias:
    """Errors of instruments (``effects``) that the readings cannot tell from the ``parameters`` of the machine, which
    are reported in their stead. ``measurement`` is the test that would tell, None where no single one does, or where
    nobody searched for one (``searched``): `plan` does for any effect that is asked for."""

    effects: tuple[str, ...]
    parameters: tuple[str, ...]
    searched: bool = False
    measurement: TestAnswer | None = None


@dataclass(frozen=True)
class Remaining:
    """What the model with all that was found leaves.

    ``deviation_um`` is the root mean square per degree of freedom, to be compared with ``stated_uncertainty_um``;
    ``carried_rms_um`` is the RMS of the targets that the machine moves and ``resting_rms_um`` that of those beside it,
    both None where all are of one kind. ``beyond_noise``: that is more than noise leaves.
    """

    deviation_um: float
    stated_uncertainty_um: float
    rms_um: float
    carried_rms_um: float | None
    resting_rms_um: float | None
    beyond_noise: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class SteppedError:
    """An error that looks as if it stepped within a run, from a reading on: the likeliest of ``errors`` that these data
    do not tell apart, by how much, and what that would leave of the RMS. ``effect`` is the step as it is added to a
    model; effects that would have been named ``instead_of`` it say far less."""

    effect: str
    errors: tuple[str, ...]
    run: int
    sequence: int
    size: float
    u: float
    unit: str
    rms_before_um: float
    rms_after_um: float
    instead_of: tuple[str, ...] = ()


@dataclass(frozen=True)
class NearestEffect:
    """The effect that comes nearest where none is named: what it would leave, and the rule that refuses it, by a word
    (``refusal``) and as the clause of a sentence (``why``)."""

    effect: str
    rms_before_um: float
    rms_after_um: float
    refusal: str
    why: str


@dataclass(frozen=True, kw_only=True)
class MachineExplanation:
    """The explanation of a machine; ``answer`` is the finding in a few sentences.

    ``scattering`` are targets that are loose or dirty rather than many bad points. ``blind_spots`` are effects that
    leave nothing to see, ``not_recorded`` those that lack a column, and why;
    ``held_out`` are the parts left out in turn for the held-out errors. ``limits_reached`` says where the search ended
    at a limit and more may be there: ``effects``, ``bad_points``, ``rounds``. ``not_fitted`` are effects that stood out
    but could not be fitted, and were skipped. ``not_followed`` are errors that the model has in an unknown shape which
    does not follow them. ``recurring_data`` were left out too, but most runs left them alike at nearly the same place:
    the model lacks something there. ``off_targets`` are off alike in all places of their piece, and were left out
    without a row in either. ``remaining`` is what is left with all that is missing in the model, None where
    nothing is.
    The residual is pictured where something is missing. ``taken_for_machine`` are errors of
    instruments that would be reported as the machine's. ``added_together`` are the first of what is missing and the
    other powers of its error, of which each alone says little. ``against_others`` is there where one setup or
    instrument contradicts all others with all of this in the model too: that comes first; so does
    ``work_points_elsewhere``, where work points come out further from where they are stated than people misstate them.
    ``rate`` is the false
    discovery rate of the scan, None of those that older versions stored: a larger ``q_value`` was asked for at a level
    of its own. ``runs_left_out`` are those that were broken off, say. ``nearest`` is the effect that comes nearest
    where something is missing and none is named, None where none stands out at all. ``stepped`` is an error that
    stepped once within a run, alone or beside what is missing.
    """

    comparison: MachineComparison = field(metadata=INLINED)
    missing: tuple[MachineMissing, ...]
    suspect_data: tuple[BadProbing, ...]
    changes: tuple[MovedTarget | ChangedTarget | ChangedParameter, ...]
    blind_spots: tuple[str, ...]
    not_recorded: Mapping[str, str]
    target_word: str
    held_out: str
    likely_mistakes: tuple[LikelyMistake, ...]
    undecided: tuple[str, ...]
    answer: str
    residual_map: ResidualMap | None
    residual_against: ResidualAgainst | None
    not_fitted: tuple[str, ...] = ()
    not_followed: tuple[str, ...] = ()
    recurring_data: tuple[BadProbing, ...] = ()
    off_targets: tuple[TargetOffInPlaces, ...] = ()
    limits_reached: tuple[str, ...] = ()
    remaining: Remaining | None = None
    taken_for_machine: tuple[InstrumentAlias, ...] = ()
    scattering: tuple[ScatteringTarget, ...] = ()
    unlike_runs: tuple[UnlikeRun, ...] = ()
    added_together: tuple[str, ...] = ()
    against_others: AgainstOthers | None = field(default=None, metadata=OMITTED)
    work_points_elsewhere: Said | None = field(default=None, metadata=OMITTED)
    rate: float | None = field(default=None, metadata=OMITTED)
    runs_left_out: tuple[RunLeftOut, ...] | None = field(default=None, metadata=OMITTED)
    nearest: NearestEffect | None = field(default=None, metadata=OMITTED)
    stepped: SteppedError | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True, kw_only=True)
class CurveExplanation:
    """The explanation of a curve, as that of a machine; ``autocorrelation_after`` the missing effects are added.

    ``changes`` are those between runs: a curve, which is one run, has none.
    """

    comparison: CurveComparison = field(metadata=INLINED)
    missing: tuple[CurveMissing, ...]
    suspect_data: tuple[BadRow, ...]
    changes: tuple[ChangedParameter, ...] = ()
    blind_spots: tuple[str, ...]
    not_recorded: Mapping[str, str]
    autocorrelation_after: CurveNoise
    answer: str


@dataclass(frozen=True)
class ExplainAnswer:
    """The explanation of a campaign.

    ``copied_readings`` says which of its runs equal those of another campaign, and which rows of a run earlier ones: it
    is no part of what is stored.
    """

    explanation: MachineExplanation | CurveExplanation = field(metadata=INLINED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
