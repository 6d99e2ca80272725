"""Where the covariance of a run's readings comes from: as data, and as one sentence in each language."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import reduce

from monitor.documents import OMITTED
from monitor.reporting.texts import Texts, texts_of


class CovarianceKind(Enum):
    """What the covariance was estimated from; the value is its key among the texts of section ``covariance``."""

    POOLED_BY_DAY = "pooled_by_day"
    ALL_RUNS = "all_runs"
    STATED_BY_PROBE = "stated_by_probe"
    REPEATABILITY = "repeatability"
    STATED_BY_SETUPS = "stated_by_setups"
    REPEATABILITY_OF_SETUPS = "repeatability_of_setups"


class TakenAsKnown(Enum):
    """What a method takes as known, so that its errors are no part of u; the value is the method's name of it."""

    LINEAR_AXES = "the linear axes"
    STYLUS_TIP = "the stylus tip"


@dataclass(frozen=True)
class CovarianceSource:
    """Where the covariance of the readings comes from.

    ``runs`` and ``dof``, the degrees of freedom, belong to a covariance that was estimated from repeated runs, ``u_um``
    to one that was stated or is the repeatability, in µm, ``times`` to a repeatability as a multiple of what each
    setup of an instrument states. ``selection`` names the stored selection (or campaign) whose runs were taken.
    ``for_the_run`` is true where repeated runs would have sufficed and an uncertainty of the run itself was asked for.
    ``neighbours`` is the correlation of a reading with the one before it, where the residuals show one, and
    ``further`` its factor with each further reading; with ``of_poses`` the correlation is that of the readings of one
    pose, and the factor that of each further pose. ``linear_axes`` says that stated errors of the linear axes were
    added, ``taken_as_known`` whose errors are no part of u.
    """

    kind: CovarianceKind
    runs: int | None = field(default=None, metadata=OMITTED)
    dof: int | None = field(default=None, metadata=OMITTED)
    u_um: float | None = field(default=None, metadata=OMITTED)
    selection: str | None = None
    linear_axes: bool = False
    taken_as_known: tuple[TakenAsKnown, ...] = ()
    times: float | None = field(default=None, metadata=OMITTED)
    for_the_run: bool | None = field(default=None, metadata=OMITTED)
    neighbours: float | None = field(default=None, metadata=OMITTED)
    further: float | None = field(default=None, metadata=OMITTED)
    of_poses: bool | None = field(default=None, metadata=OMITTED)


def covariance_sentence(source: CovarianceSource, texts: Texts | None = None) -> str:
    """The source in a sentence without its full stop, in the language of ``texts`` (English without)."""
    say = texts or texts_of()
    # Two digits: that is how well the repeatability of few runs is known at most.
    digits = ".2g" if source.kind is CovarianceKind.REPEATABILITY else "g"
    u = "" if source.u_um is None else f"{source.u_um:{digits}}".replace(".", say.decimal_sign)
    times = "" if source.times is None else f"{source.times:.2g}".replace(".", say.decimal_sign)
    key = f"covariance.{source.kind.value}" + "_for_the_run" * bool(source.for_the_run)
    sentence = say(key, runs=source.runs, dof=source.dof, u=u, times=times)
    if source.neighbours is not None and source.further is not None:
        alike, further = (
            f"{number:.2g}".replace(".", say.decimal_sign) for number in (source.neighbours, source.further)
        )
        key = "covariance.neighbours" + "_of_poses" * bool(source.of_poses)
        sentence = say(key, sentence=sentence, correlation=alike, further=further)
    if source.selection is not None:
        sentence = say("covariance.selection", name=source.selection, sentence=sentence)
    if source.linear_axes:
        sentence = say("covariance.with_linear_axes", sentence=sentence)
    if source.taken_as_known:
        names = [say(f"covariance.{error.name.lower()}") for error in source.taken_as_known]
        both = reduce(lambda first, second: say("covariance.both", first=first, second=second), names)
        sentence = say("covariance.taken_as_known", sentence=sentence, names=both)
    return sentence
