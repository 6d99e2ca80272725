"""Model against measurement as a health report states it: what is missing, where it fails, how the error falls."""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.documents import OMITTED, Said
from monitor.records import Verdict
from monitor.reporting.messages import times_stated

#: What may be wrong where readings lie many times as far from a model as is stated of them.
CHECK_STATEMENT = "campaign.toml states too small an uncertainty, or another unit than the readings have"


@dataclass(frozen=True)
class ReversalValue:
    """The reversal value of a play (ISO 230-2), twice its amplitude, with its standard uncertainty."""

    value: float
    u: float
    unit: str


@dataclass(frozen=True)
class MissingEffect:
    """An effect that the model lacks, its cause and what to do; of a play its ``reversal`` value; ``refers_to`` says
    in words what it is stated relative to. ``peak_urad`` is its largest turn, where angles alone show it."""

    effect: str
    meaning: str
    cause: str
    remedy: str
    peak_um: float | None
    rms_before_um: float | None
    rms_after_um: float | None
    not_ruled_out: tuple[str, ...]
    reversal: ReversalValue | None = field(default=None, metadata=OMITTED)
    refers_to: str | None = field(default=None, metadata=OMITTED)
    peak_urad: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ResidualMap:
    """Mean residuals of the runs at every pose of the plan, in µm, and its place, in mm, along the machine's axes."""

    place_mm: tuple[tuple[float, float, float], ...]
    residual_um: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class GroupMean:
    """Mean residual of ``n`` probings in µm with its standard uncertainty, before and after (None: not known)."""

    n: int
    at: float
    before_um: float
    u_before_um: float
    after_um: float | None
    u_after_um: float | None


@dataclass(frozen=True)
class ResidualAgainst:
    """The residual in the direction ``along`` (a term, an axis) against a ``driver``: means of groups, some points."""

    driver: str
    along: str
    groups: tuple[GroupMean, ...]
    at: tuple[float, ...]
    before_um: tuple[float, ...]


@dataclass(frozen=True)
class ErrorStep:
    """The error of one version of the model in µm: on the runs it was fitted to, and on held-out ones (None: unknown).

    ``proposed`` is not in the model yet: what adding the effect would give.
    """

    what: Said
    rms_um: float
    heldout_um: float | None
    proposed: bool


@dataclass(frozen=True)
class ModelHealth:
    """Model against measurement; ``runs`` says in words which runs were compared.

    ``where`` and ``against`` are None where nothing is missing; ``steps`` begin with the method's own model.
    ``unchanged`` are parameters that stepped between runs of the campaign and have no change in the machine's history.
    ``refuted_p`` is the p-value of lack of fit with the noise of neighbours allowed for, where the readings of the
    campaign refute the model; None where they do not, and where runs of the campaign are still to come.
    ``times_stated`` is how many times what is stated the residuals are, where they contradict the statement.
    ``work_points_elsewhere`` is what says that the file states work points elsewhere than they come out.
    """

    campaign: str
    runs: Said
    model: str
    verdict: str
    answer: str
    rms_um: float
    repeatability_um: float | None
    lack_of_fit_f: float | None
    lack_of_fit_p: float | None
    missing: tuple[MissingEffect, ...]
    stated_um: float
    where: ResidualMap | None
    against: ResidualAgainst | None
    steps: tuple[ErrorStep, ...]
    unchanged: tuple[str, ...] = field(default=(), metadata=OMITTED)
    refuted_p: float | None = field(default=None, metadata=OMITTED)
    work_points_elsewhere: Said | None = field(default=None, metadata=OMITTED)
    times_stated: float | None = field(default=None, metadata=OMITTED)

    @property
    def is_doubted(self) -> bool:
        """Whether the values of the model may hold a part of what it lacks."""
        return self.refuted_p is not None or self.verdict == Verdict.SOMETHING_IS_MISSING.value

    @property
    def unexplained(self) -> str:
        """The effect that the model lacks; what `explain` answers where none is named."""
        if self.work_points_elsewhere is not None:
            return self.answer
        if not self.missing:
            times = self.times_stated
            return self.answer if times is None else f"{self.answer.rstrip('.')}; {times_stated(times)}"
        effect = self.missing[0]
        unit = "µm" if effect.peak_urad is None else "µrad"
        size = "" if effect.peak_um is None else f", up to {effect.peak_um:.1f} {unit}"
        return f"the measurements show what the model does not have: {effect.meaning} ({effect.effect}){size}"
