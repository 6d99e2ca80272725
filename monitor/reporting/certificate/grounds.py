"""Grounds on which a certificate is refused, unless the laboratory accepts them by name and with a reason.

Each ground is data, found by the workflow; its sentence is made here, in the language of the certificate and in English
for who issues it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import StrEnum

from monitor.documents import OMITTED
from monitor.reporting.texts import Texts

#: Between the names of a ground that is of several parameters together.
SEVERAL = ", "
#: The unit of what is counted in standard uncertainties.
IN_U = "u"
#: The unit of runs that equal those of the same machine, where that is what differs.
AT_ANOTHER_TIME = "started_at"
#: The units of rows that stand too late beside the readings, or too early.
LATE, EARLY = "late", "early"


class GroundKind(StrEnum):
    """What speaks against a certificate; the value is how it is accepted and stored."""

    LACK_OF_FIT = "lack-of-fit"
    GROSS_READINGS = "gross-readings"
    IMPLAUSIBLE = "implausible"
    SCALE_BAR = "scale-bar"
    TEMPERATURE = "temperature"
    UNITS = "units"
    WORK_POINT = "work-point"
    INSTRUMENTS = "instruments"
    SCALE = "scale"
    SIMULATED = "simulated"
    COPIED_RUNS = "copied-runs"
    COPIED_ROWS = "copied-rows"
    NOMINAL_READINGS = "nominal-readings"
    LATE_ROWS = "late-rows"


@dataclass(frozen=True)
class Ground:
    """One ground: of a ``run`` and a ``subject`` (parameter, reading, bar, setup), a ``size`` beyond its ``limit``.

    Both are in ``unit``; a temperature that is missing has none of the three, one that no place has all of
    them. Lack of fit has a parameter as its subject where it is about its budget; units have columns as theirs, and
    none where the residuals are a ``size`` of what the statements leave, or the setup of which they are. Of what was
    simulated the subject is the machine, of a scale the instrument with the parameters that rest on it. Of instruments
    the subject is a parameter with the two that disagree, and ``size`` is their E_n; or it is who contradicts all
    others, by ``size`` in standard uncertainties. Where it may be any of several they are ``several``, each by its
    name; where nobody alone explains it there is no subject. Of copied runs and rows ``size`` counts them; the subject
    is the other campaign, with its machine where that is another, or the number of the first row and of that which it
    repeats. Of nominal readings ``size`` counts them; the subject has the numbers of the first and the last, and the
    setup. Of late rows ``size`` is by how many rows the columns of the subject stand too late, or too early, from the
    row of the subject on.
    """

    kind: GroundKind
    run: int
    subject: str
    size: float | None = None
    limit: float | None = None
    unit: str = ""
    several: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class AcceptedGround:
    """Grounds of one kind that the laboratory accepts, and its reason in its own words."""

    kind: GroundKind
    grounds: tuple[Ground, ...]
    reason: str


def ground_sentence(ground: Ground, texts: Texts) -> str:
    """A ground in words, without a full stop."""
    return texts(
        f"grounds.{_key(ground)}",
        run=ground.run,
        subject=texts("grounds.or").join(ground.several or (ground.subject,)),
        size=_written(ground.size, texts),
        limit=_written(ground.limit, texts),
        unit=ground.unit,
    )


def _key(ground: Ground) -> str:
    """The name of a ground's sentence among the texts."""
    match ground.kind:
        case GroundKind.TEMPERATURE if ground.size is not None:
            return "impossible_temperature"
        case GroundKind.IMPLAUSIBLE if SEVERAL in ground.subject:
            return "common_gain"
        case GroundKind.UNITS if not ground.subject:
            return "fits_too_well"
        case GroundKind.UNITS if not ground.unit:
            return "setup_fits_too_well"
        case GroundKind.INSTRUMENTS if ground.unit == IN_U:
            return _who(ground)
        case GroundKind.LACK_OF_FIT if ground.subject:
            return "lack_in_budget"
        case GroundKind.COPIED_RUNS if ground.unit == AT_ANOTHER_TIME:
            return "copied_runs_elsewhen"
        case GroundKind.LATE_ROWS if ground.unit == EARLY:
            return "early_rows"
    return ground.kind.value.replace("-", "_")


def _who(ground: Ground) -> str:
    """The sentence for setups that contradict each other: of one, of any of several, of nobody alone."""
    if ground.several:
        return "one_of_several"
    return "against_others" if ground.subject else "nobody_alone"


def _written(value: float | None, texts: Texts) -> str:
    """A number to four digits, all of them before the decimal sign; empty for none."""
    if value is None:
        return ""
    return texts.number(
        Decimal(round(value)) if abs(value) >= 1e4 else Decimal(f"{Decimal(f'{value:.4g}'):f}")
    )


def accepted_statements(accepted: Sequence[AcceptedGround], texts: Texts) -> list[str]:
    """What is printed of each accepted kind: its grounds, and the laboratory's reason."""
    return [
        texts(
            "grounds.accepted",
            grounds="; ".join(ground_sentence(ground, texts) for ground in entry.grounds),
            reason=entry.reason,
        )
        for entry in accepted
    ]
