"""What `monitor identify` prints: the parameters of the runs, the coefficients of a curve, the steps of the L-shape."""

from __future__ import annotations

from collections.abc import Mapping

from monitor.cli import output
from monitor.cli.contradiction_output import likely_mistakes
from monitor.cli.measurement_output import test_name, where
from monitor.cli.residual_output import four_digits, with_uncertainty
from monitor.records import FrameOfReference
from monitor.reporting import messages
from monitor.reporting.curve_finding import correlation
from monitor.reporting.frames import frame_words
from monitor.reporting.machine_finding import doubt_sentence
from monitor.reporting.run_coefficient import run_of
from monitor.workflow.history.refuted import REFUTED_P
from monitor.workflow.identify.answer import CurveRun, Estimate, IdentifyAnswer, MachineRun, StepwiseAnswer

# A screen holds so many runs beside the names of the parameters.
SHOWN_RUNS = 6


def show(answer: IdentifyAnswer) -> None:
    """The parameters of the runs, or the coefficients of a curve."""
    for run in answer.runs:
        if isinstance(run, CurveRun):
            _coefficients(answer, run)
    runs = [run for run in answer.runs if isinstance(run, MachineRun)]
    if runs:
        _machine(answer, runs)


def _machine(answer: IdentifyAnswer, runs: list[MachineRun]) -> None:
    """The parameters of the last runs, newest last, and what was refused."""
    output.copied(answer.copied_readings)
    if answer.work_points_elsewhere is not None:
        output.say(str(answer.work_points_elsewhere))
    shown = runs[-SHOWN_RUNS:]
    before = f" (the last {len(shown)} of {len(runs)} runs; --json has all)" if len(runs) > len(shown) else ""
    output.table(
        f"{answer.campaign}, model {answer.model}{before}",
        ["parameter", "unit", "relative to", *(f"run {run.run}" for run in shown), "u"],
        [*_rows(shown, answer.frames or {}), ["RMS", "µm", "", *(f"{run.rms_um:.2f}" for run in shown), ""]],
        text_columns=3,
    )
    for note in (run.note for run in runs if run.note):
        output.say(note)
    likely_mistakes(answer.likely_mistakes)
    for doubt in answer.file_doubts or ():
        output.say(doubt_sentence(doubt))
    for why in dict.fromkeys(refusal.why for run in runs for refusal in run.refused):
        output.say(f"no number: {why}")
    _not_seen(answer)
    _taken_up(answer)
    _as_stated(answer)
    _refuted(answer)
    _added(answer)


def _added(answer: IdentifyAnswer) -> None:
    """The added effects, and those that have no number."""
    for name, estimate in answer.added.items():
        run = run_of(name)
        output.say(
            f"{name}: {output.rounded(estimate.value, estimate.u)} ± {output.two_digits(estimate.u)} "
            f"{estimate.unit} {'in all runs' if run is None else f'of run {run}'}"
        )
        if answer.reversal_values is not None and name in answer.reversal_values:
            output.say(f"   {reversal_words(answer.reversal_values[name])}")
    alike: dict[str, list[str]] = {}
    for refusal in answer.added_refused:
        alike.setdefault(refusal.why, []).extend(refusal.parameters)
    for why, names in alike.items():
        output.say(f"no number: {', '.join(names)}: {why}")


def _not_seen(answer: IdentifyAnswer) -> None:
    """The errors that are in no number, and which measurement would give one."""
    for refused in answer.not_seen or ():
        output.say(f"in no number: {', '.join(refused.parameters)}: {refused.why}")
    for name, test in (answer.seen_by or {}).items():
        output.say(f"{name} would show by {test_name(test)}: {where(test)}")


def _taken_up(answer: IdentifyAnswer) -> None:
    """The errors that have no number of their own."""
    unseen_by_all = {name for refused in answer.not_seen or () for name in refused.parameters}
    alike: dict[tuple[str, ...], list[str]] = {}
    for taken in answer.taken_up or ():
        if taken.by and taken.parameter not in unseen_by_all:
            alike.setdefault(tuple(taken.by), []).append(taken.parameter)
    for by, names in alike.items():
        lacks = "has no number of its own" if len(names) == 1 else "have no numbers of their own"
        output.say(f"{', '.join(names)} {lacks}: {_doing_the_same(by)}")
    _unseen(answer)


def _unseen(answer: IdentifyAnswer) -> None:
    """The errors of which the readings say nothing, with why where an instrument of the model is absent."""
    unseen = [taken for taken in answer.taken_up or () if not taken.by]
    for taken in unseen:
        if taken.why is not None:
            output.say(f"no number: {taken.why}")
    names = [taken.parameter for taken in unseen if taken.why is None]
    if names:
        output.say(f"such readings see nothing of {', '.join(names)}")


def _as_stated(answer: IdentifyAnswer) -> None:
    """The stated tool points and scales that numbers count from."""
    for stated in answer.as_stated or ():
        if "scale" in stated.moved:
            counted = f"{', '.join(stated.moved['scale'])} {'counts' if _is_one(stated.moved) else 'count'}"
            output.say(
                f"the scale of {stated.name} is taken as exact: {counted} from it, and u does not say how well it "
                "is known (state scale_standard_uncertainty_um_per_m)"
            )
            continue
        moved = ", ".join(f"{' and '.join(names)} with its {axis}" for axis, names in stated.moved.items())
        output.say(
            f"tool_point_mm of {stated.name} is taken as stated: {moved} {'moves' if _is_one(stated.moved) else 'move'}"
            ", and u does not say how well it is known (state tool_point_standard_uncertainty_mm)"
        )


def _refuted(answer: IdentifyAnswer) -> None:
    """That the readings refute the model, though the residuals may be within three times what is stated."""
    if answer.lack_of_fit_p is None or answer.lack_of_fit_p >= REFUTED_P:
        return
    output.say(messages.model_refuted([answer.campaign], 1, answer.model, answer.lack_of_fit_p))
    if any("scale" not in stated.moved for stated in answer.as_stated or ()):
        output.say(
            "a tool point that is not known to a few micrometres can be all of it where a head turns: "
            "tool_point_standard_uncertainty_mm makes it an unknown, which takes up the head's zero as well"
        )


def _is_one(moved: Mapping[str, tuple[str, ...]]) -> bool:
    return sum(map(len, moved.values())) == 1


def _doing_the_same(names: tuple[str, ...]) -> str:
    """Half a sentence on what takes an error up."""
    if len(names) == 1:
        # The one name that is a plural: of the unknowns of setups.
        return f"{names[0]} {'do' if names[0].startswith('the unknowns ') else 'does'} the same"
    return f"{', '.join(names[:-1])} and {names[-1]} together do the same"


def reversal_words(value: Estimate) -> str:
    """The reversal value of a play."""
    return (
        f"reversal value (ISO 230-2), twice the amplitude: {output.rounded(value.value, value.u)} ± "
        f"{output.two_digits(value.u)} {value.unit}"
    )


def _rows(runs: list[MachineRun], frames: Mapping[str, FrameOfReference]) -> list[list[str]]:
    """A row for every parameter: its unit and frame, its value in every run, and the standard uncertainty of the
    last."""
    rows = []
    for name in dict.fromkeys(name for run in runs for name in run.parameters):
        estimates = [run.parameters.get(name) for run in runs]
        last = [estimate for estimate in estimates if estimate is not None][-1]
        values = ["-" if each is None else output.rounded(each.value, each.u) for each in estimates]
        rows.append([name, last.unit, frame_words(frames.get(name)), *values, output.two_digits(last.u)])
    return rows


def _coefficients(answer: IdentifyAnswer, run: CurveRun) -> None:
    curve, noise = answer.curve, answer.autocorrelation
    assert curve is not None
    assert noise is not None
    rows = [
        [name, with_uncertainty(estimate.value, estimate.u), estimate.unit]
        for name, estimate in run.parameters.items()
    ]
    rows.append(["residual standard deviation", four_digits(run.residual_deviation), curve.unit])
    output.table(
        f"{answer.campaign}, model {answer.model} ({curve.base}), {run.degrees_of_freedom} degrees of freedom",
        ["coefficient", "value ± u", "unit"],
        rows,
    )
    for refusal in run.refused:
        output.say(f"no number: {refusal.why}")
    if noise.noticed:
        output.say(
            f"neighbouring rows resemble each other ({correlation(noise.lag_one, noise.slow)}); u allows for it: "
            f"{noise.effective_rows:.0f} of {noise.rows} rows for a mean"
        )


def stepwise(answer: StepwiseAnswer) -> None:
    """Every parameter by both ways."""
    rows = []
    for name, step in answer.stepwise.items():
        both = step.at_once is not None
        rows.append(
            [
                name,
                step.unit,
                output.rounded(step.stepwise, step.u_stepwise),
                output.two_digits(step.u_stepwise),
                output.rounded(step.at_once, step.u_at_once) if both else "-",
                output.two_digits(step.u_at_once) if both else "-",
                output.rounded(step.difference_by_method, step.u_stepwise) if both else "-",
                "" if step.agrees else "differs",
                step.why,
            ]
        )
    output.table(
        f"{answer.campaign}, run {answer.run}: step by step and all at once",
        ["parameter", "unit", "stepwise", "u", "at once", "u", "by method", "", "what tells them apart"],
        rows,
        text_columns=2,
    )
    output.say(
        "by method: what of the difference remains without noise; 'differs': the rest exceeds 2 u of it"
    )
