"""What is said of a machine in a few sentences: what its model lacks, what looks wrong in the file, what changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np

from monitor.reporting.messages import joined_by_and
from monitor.reporting.nearest_words import (
    ComesNearest,
    LooksStepped,
    more_is_left,
    nearest_sentence,
    step_sentence,
)
from monitor.reporting.numbers import round_result, written
from monitor.units import MICROMETRE


@dataclass(frozen=True)
class MissingEffect:
    """A missing effect as a sentence says it; ``nearest_shape`` where the catalogue does not have its shape, ``others``
    the effects that no data of this plan tell from it."""

    effect: str
    meaning: str
    nearest_shape: str | None
    varies: bool
    others: Sequence[str]


@dataclass(frozen=True)
class MistakeFound:
    """A likely mistake of the file, and the RMS in mm with it (not finite where the readings fit no machine) and
    without; ``enough`` where that explains the readings. Of ``untried`` setups that contradict besides none was tried.
    """

    what: str
    rms_as_recorded: float
    rms_undone: float
    enough: bool = True
    untried: int = 0


#: So many rivals of an effect stand in a sentence; all of them stand with the effect.
MOST_RIVALS = 3
#: From this correlation of neighbours on a run wanders rather than scatters.
WANDERS = 0.25
#: What moved where all targets did.
WHOLE_PIECE = "The piece on the table"


@dataclass(frozen=True)
class Move:
    """A target that moved, or a parameter that stepped, at a run; within it from a ``sequence`` number on, if any."""

    subject: str
    stepped: bool
    size: float
    unit: str
    run: int
    sequence: int | None = None


@dataclass(frozen=True)
class Scattering:
    """A target (of the kind ``target_word``) whose readings scatter ``times`` as much as those of the others."""

    target_word: str
    target: str
    times: float
    deviation_um: float


class RunUnlike(Protocol):
    """A run that leaves ``times`` what the others leave; ``neighbours`` is the correlation of one reading with the
    next, ``as_if`` the effect that makes up most of it, drifting."""

    @property
    def run(self) -> int:
        """Its number."""

    @property
    def times(self) -> float:
        """How many times as much it leaves."""

    @property
    def deviation_um(self) -> float:
        """The standard deviation of a reading in it."""

    @property
    def neighbours(self) -> float:
        """Near zero where it scatters, near one where it wanders."""

    @property
    def as_if(self) -> str | None:
        """What drifted in it, if that is seen."""


@dataclass(frozen=True)
class OffTarget:
    """A target that is off by ``size_um`` in so many ``places`` of its piece, all of them; ``word`` is what a target is
    called, ``along`` by how much it is off along the directions of the piece."""

    word: str
    target: str
    size_um: float
    along: str
    places: int


@dataclass(frozen=True)
class MachineFinding:
    """What an explanation has found: whether the model explains the measurements, what it lacks, how many bad points
    were left out, what scatters, what moved, at which ends of the search (``limits``) more may be there, and whether
    more is left than any effect leaves (``hopeless``). Where the file looks wrong, ``mistakes`` says how. ``unseen``:
    the tests of all residuals together do not show what is missing; ``tolerated``: they do, but by so little that the
    statement may be wrong. ``not_followed`` are errors that the model has in a
    shape which does not follow them. ``recurring``: so many readings that were left out are alike in most runs;
    ``unchecked``: so many bad points lie where no other run read that they may be none; ``contradicted``: the model
    explains the measurements without what was left out, and the tests of all residuals deny it. ``nearest`` comes
    nearest where none is named; ``more_is_left`` than noise leaves with all that is missing in the model. ``stepped``
    is an error that stepped within a run.
    ``off_targets`` are off alike in all places of their piece."""

    explained: bool
    missing: Sequence[MissingEffect]
    bad_points: int
    moves: Sequence[Move]
    limits: Sequence[str]
    most_bad_points: int
    unfitted: Sequence[str]
    hopeless: bool
    mistakes: Sequence[MistakeFound]
    scattering: Sequence[Scattering] = ()
    unlike_runs: Sequence[RunUnlike] = ()
    unseen: bool = False
    tolerated: bool = False
    not_followed: Sequence[str] = ()
    recurring: int = 0
    unchecked: bool = False
    contradicted: bool = False
    nearest: ComesNearest | None = None
    stepped: LooksStepped | None = None
    more_is_left: bool = False
    off_targets: Sequence[OffTarget] = ()

    @property
    def together(self) -> str:
        """What the tests of all residuals say of an effect that they do not show by themselves."""
        return TOLERATED if self.tolerated else UNSEEN


# What is said first where more is left than any effect leaves, and no simple exchange brings it down.
GROSS = (
    "More is left than the effects of a machine leave: look first for exchanged columns or targets, a wrong sign or "
    "unit, or the geometry in campaign.toml; of the simple mistakes that were tried none alone explains it. "
)
# What is said where a single effect is named, and the tests of all residuals together agree with noise.
UNSEEN = (
    "The test of all residuals together, which `monitor compare` judges by, agrees with noise: what is named here is "
    "small beside their scatter, and stands out only where it is looked for by itself."
)
# What is said instead where they do not agree with it, but the statement may be wrong by as much.
TOLERATED = (
    "All residuals together, by which `monitor compare` judges, are larger than stated, not by chance, but by less "
    "than the quarter that a statement may be wrong: what is named here stands out where it is looked for by itself."
)
# What is said of a comparison that these tests alone judge.
TOGETHER = (
    "by all residuals together; `monitor explain {campaign}` also looks for single effects, which may be too small for "
    "this test"
)
# What is said besides where the residual is larger than stated, but the statement may be wrong by as much.
LARGER = (
    "the residual is larger than the stated uncertainty leaves ({p}), by less than the quarter that a statement may be "
    "wrong"
)
# What is said where an error is in the model in an unknown shape.
NOT_FOLLOWED = (
    "What is left of {errors} is not followed by the shape that was added: further shapes of it were not looked for, "
    "and effects of other errors only beside all that it could do; measure it at more positions."
)
# What is said of readings that were left out and may be an error of the machine.
RECURRING = (
    "{count} readings are off alike in most runs at nearly the same places: they are no bad points, the model lacks "
    "something there. They were left out of the search for effects; see whether a small move decides there from which "
    "side an axis came, or whether the part or plate, or a place stated of it, is off there. Where it is the first or "
    "last position of an axis, a step between it and the next would read the same: measure another position between "
    "the two and beyond it."
)
OFF_TARGET = (
    "{word} {target} is off by {size_um:.1f} µm ({along}) in all {places} places of its piece: it stands elsewhere on "
    "the piece than stated, whatever the machine does. Its readings were left out; see whether it is damaged or dirty, "
    "or stated wrongly."
)
UNCHECKED = (
    "They lie where no other run read, and are so many that they may be an error which the model lacks."
)
CONTRADICTED = (
    "The model explains the measurements without what was left out; `monitor compare`, which counts it, says that "
    "something is missing."
)
# What is said where the search ended at a limit, by its kind.
LIMITS = {
    "effects": (
        "The search ended at the most effects that it looks for: more may be missing; add these to the model and "
        "look again."
    ),
    "bad_points": "The search for bad points ended at {most}: there may be more.",
    "rounds": (
        "Effects and bad points had not settled when the search ended: look again with these effects in the model."
    ),
}
ONE_RUN = (
    "one run cannot show what varies from run to run, what stepped between runs, or how well a reading repeats; "
    "measure the same plan again"
)
# What is said where plays fit only if short moves from ball to ball turn nothing over.
SMALL_MOVES = (
    "where the probe went between the balls is not recorded: these readings say that moves of less than 0.1 mm from "
    "one stated place to the next turn no play over, which explain takes so here, and identify, compare and map do not"
)


def size_if_late(effect: str, unit: str, sizes: Sequence[tuple[float, float, float]]) -> str:
    """The sentence about an effect that is told as following its temperature at once and may follow it late; ``sizes``
    are the time constant in minutes, the size and its standard uncertainty, the shortest first."""
    phrases = []
    for minutes, size, u in (sizes[0], sizes[-1]):
        rounded = round_result(size, u)
        phrases.append(
            f"{written(rounded.estimate)} ± {written(rounded.uncertainty)} {unit} with a time constant of "
            f"{minutes:.0f} min"
        )
    late = phrases[0] if len(sizes) == 1 else f"{phrases[0]}, up to {phrases[1]}"
    return (
        f"the size of {effect} is that of what follows at once; these data do not rule out that it follows late: then "
        f"it is {late}"
    )


def fits_too_well(times: float) -> str:
    """The sentence about readings that fit so many times better than they should."""
    return (
        f"the readings fit {times:.0f} times better than their stated standard uncertainty: look whether lengths are "
        "in another unit (inches fit 25 times too well) or the stated value is too large"
    )


def setups_fit_too_well(better: Mapping[str, float]) -> str:
    """The clause about setups whose readings fit so many times ``better`` than they state, by their ids."""
    least, largest = (f"{limit(better.values()):.0f}" for limit in (min, max))
    times = least if least == largest else f"{least} to {largest}"
    return (
        f"the readings of setup{'s' if len(better) > 1 else ''} {joined_by_and([*better])} fit {times} times better "
        "than their stated standard uncertainty: in another unit than their column says (mm for µm is 1000 times, "
        "inches for mm 25 times) they show nothing of the machine; else the stated value is too large"
    )


def machine_sentences(finding: MachineFinding) -> str:
    """The finding in one or two sentences, for people who look rather than read."""
    if finding.mistakes:
        return (
            f"{mistake_sentence(finding.mistakes)} Nothing was changed, and no effect was looked for: "
            f"{what_to_do(finding.mistakes)}"
        )
    moved = [_moved(move) for move in finding.moves]
    # Where nothing is missing, what moved is the finding.
    moved_first = finding.explained and not finding.missing
    sentences = (moved if moved_first else []) + _missing_sentences(finding) + _left_out(finding)
    for each in finding.scattering:
        sentences.append(
            f"{each.target_word} {each.target} scatters {each.times:.1f} times as much as the others "
            f"({each.deviation_um:.1f} µm in a reading): see whether it sits firmly and clean; its readings counted "
            "by so much less."
        )
    sentences += [_unlike(each) for each in finding.unlike_runs]
    if not moved_first:
        sentences += moved
    sentences += [LIMITS[limit].format(most=finding.most_bad_points) for limit in finding.limits]
    if finding.unfitted:
        sentences.append(
            f"Could not be fitted and {'was' if len(finding.unfitted) == 1 else 'were'} skipped: "
            f"{', '.join(finding.unfitted)}."
        )
    if finding.more_is_left:
        sentences.append(more_is_left(len(finding.missing) + (finding.stepped is not None)))
    if finding.not_followed:
        sentences.append(NOT_FOLLOWED.format(errors=joined_by_and(finding.not_followed)))
    return (GROSS if finding.hopeless else "") + " ".join(sentences)


def _moved(move: Move) -> str:
    """What moved or stepped, by how much and when."""
    # The name of a parameter stays as it is written.
    subject = move.subject if move.stepped else f"{move.subject[:1].upper()}{move.subject[1:]}"
    at = f"at run {move.run}"
    if move.sequence is not None:
        at = f"within run {move.run}, from sequence {move.sequence} on"
    return f"{subject} {'stepped' if move.stepped else 'moved'} by {move.size:.1f} {move.unit} {at}."


def _left_out(finding: MachineFinding) -> list[str]:
    """What is said of readings that were left out."""
    sentences = [
        OFF_TARGET.format_map(asdict(each) | {"word": each.word.capitalize()}) for each in finding.off_targets
    ]
    if finding.bad_points:
        sentences.append(
            f"{finding.bad_points} bad point{'s were' if finding.bad_points > 1 else ' was'} left out."
        )
        sentences += [UNCHECKED] if finding.unchecked else []
    if finding.recurring:
        sentences.append(RECURRING.format(count=finding.recurring))
    return sentences + ([CONTRADICTED] if finding.contradicted else [])


def _unlike(unlike: RunUnlike) -> str:
    how = "from one reading to the next: see whether probe, tip and targets sat firmly then"
    if unlike.neighbours > WANDERS:
        how = "wandering slowly: look for what warmed, a door, a draught or a clamp then"
    if unlike.as_if is not None:
        how = f"as if {unlike.as_if} drifted while it was measured"
    return (
        f"Run {unlike.run} leaves {unlike.times:.1f} times as much as the others ({unlike.deviation_um:.1f} µm in a "
        f"reading), {how}. It counted like the others: measure it again, or leave it out of the campaign."
    )


def _more_of_its_shape(first: MissingEffect, further: Sequence[MissingEffect]) -> list[str]:
    """The effects named with one of unknown shape that these data do not tell from another shape of the same error."""
    if first.nearest_shape is None:
        return []
    error = first.effect.partition(":")[0] + ":"
    return [effect.effect for effect in further if any(rival.startswith(error) for rival in effect.others)]


def _some(rivals: Sequence[str]) -> tuple[list[str], int]:
    """The first of many rivals, and how many more there are."""
    named = list(rivals) if len(rivals) == MOST_RIVALS + 1 else list(rivals[:MOST_RIVALS])
    return named, len(rivals) - len(named)


def _with_rivals(missing: MissingEffect) -> str:
    """An effect that is named behind the first, with what these data do not tell from it."""
    if not missing.others:
        return missing.effect
    named, more = _some(missing.others)
    last = f" or one of {more} more" if more else ""
    rivals = f"{', '.join(named)}{last}" if more else " or ".join(named)
    return f"{missing.effect} (or {rivals}, which these data do not rule out)"


def _none_named(finding: MachineFinding) -> str:
    """What is said where no effect is named."""
    if finding.explained:
        return f"Nothing {'else ' if finding.moves else ''}is missing that this plan can see."
    if finding.stepped is not None:
        return step_sentence(finding.stepped, alone=True)
    if finding.nearest is not None:
        return nearest_sentence(finding.nearest)
    if finding.not_followed:
        return "The model does not explain the measurements, but no other error explains more."
    return "The model does not explain the measurements, but no effect of the catalogue explains more."


def _missing_sentences(finding: MachineFinding) -> list[str]:
    if not finding.missing:
        return [_none_named(finding)]
    first = finding.missing[0]
    doubtful = _more_of_its_shape(first, finding.missing[1:])
    further = [_with_rivals(missing) for missing in finding.missing[1:] if missing.effect not in doubtful]
    sentences = [f"The model lacks {first.effect}: {first.meaning}."]
    if first.nearest_shape is not None:
        sentences.append(f"The catalogue does not have its shape; {first.nearest_shape} comes nearest.")
        if further and not doubtful:
            sentences.append("The other effects hold whatever its shape is.")
    if first.varies:
        sentences.append("It varies from run to run and no recorded column follows it.")
    if first.others:
        named, more = _some(first.others)
        rivals = f"{', '.join(named)} and {more} more" if more else ", ".join(named)
        sentences.append(f"These data cannot tell it apart from {rivals}.")
    if finding.unseen:
        sentences.append(finding.together)
    if further:
        sentences.append(f"It also lacks {joined_by_and(further)}.")
    if doubtful:
        error = first.effect.partition(":")[0]
        sentences.append(
            f"These data cannot tell {joined_by_and(doubtful)} from more of the shape of {error}."
        )
    if finding.stepped is not None:
        sentences.append(step_sentence(finding.stepped, alone=False))
    return sentences


def doubt_sentence(doubt: str) -> str:
    """What the places and lengths that a file declares say against its columns, beside a result."""
    return f"Look at the file first: {doubt.removesuffix('.')}."


def mistake_sentence(mistakes: Sequence[MistakeFound]) -> str:
    """What looks wrong in the file, in one sentence."""
    first = mistakes[0]
    ways = " or ".join(mistake.what for mistake in mistakes)
    before = (
        f"residual {_length(first.rms_as_recorded)} as recorded"
        if np.isfinite(first.rms_as_recorded)
        else "as recorded the readings fit no machine of this file"
    )
    remainder = f"{before}, residual {_length(first.rms_undone)} with that undone"
    if first.enough:
        return f"It looks as if {ways}: {remainder}.{_untried(first.untried)}"
    return (
        "No single mistake of those that are tried explains the readings; nearest comes what they would leave if "
        f"{ways}: {remainder}, still far more than is stated.{_untried(first.untried)}"
    )


def _untried(count: int) -> str:
    """What is said of setups that contradict too, but less than those whose mistakes were tried."""
    if count == 0:
        return ""
    if count == 1:
        return " One more setup contradicts, and was not tried: `monitor compare` lists every setup."
    return f" {count} more setups contradict, and were not tried: `monitor compare` lists every setup."


def what_to_do(mistakes: Sequence[MistakeFound]) -> str:
    """What to do about likely mistakes, as the end of a sentence."""
    if mistakes[0].enough:
        return "correct the file first."
    return "look at all that the file says of these setups, and do not correct this alone."


def _length(mm: float) -> str:
    return f"{mm:.2g} mm" if mm >= 0.1 else f"{MICROMETRE.to_display(mm):.2g} µm"
