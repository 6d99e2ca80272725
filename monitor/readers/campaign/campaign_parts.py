"""A campaign put together from the table of ``campaign.toml`` and two tables of text, wherever these came from.

The campaign folder has them as its files; exports of instruments are first turned into them (``mapping``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from monitor.exceptions import did_you_mean
from monitor.readers.campaign import probings_file, runs_file
from monitor.readers.campaign.artefact_file import read_artefact, read_probe
from monitor.readers.campaign.machine_file import MachinePart, read_machine
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.method_rules import MethodRules, Plan
from monitor.readers.registry import method_rules
from monitor.readers.setups.file import probe_of, read_setups
from monitor.readers.sources_file import read_sources
from monitor.readers.tables.csv_table import CsvTable
from monitor.readers.toml_table import Table
from monitor.records import Artefact, Campaign, Probe, SourceFile
from monitor.sources import Source

FORMAT = 1
#: A method with a reader of its own (curve_1), listed where a method is not known.
CURVE = "curve"


@dataclass(frozen=True)
class Head:
    """What ``campaign.toml`` says; None, or no axes, where a key is missing or wrong.

    ``balls`` are known where the artefact is damaged elsewhere.
    """

    name: str | None
    method: str | None
    rules: MethodRules | None
    machine: MachinePart
    probe: Probe | None
    artefact: Artefact | None
    balls: list[str] | None
    sources: tuple[Source, ...] = ()


#: Columns of runs.csv and probings.csv that every method needs.
_OF_ALL_METHODS = (*runs_file.PLAN, *probings_file.FIRST[:-1])
EMPTY = Head(None, None, None, MachinePart(None, None, {}), None, None, None)


@dataclass(frozen=True)
class Parts:
    """The runs and probings of a campaign as far as they could be read."""

    runs: runs_file.RunsPart | None
    probings: probings_file.ProbingsPart | None


def read_parts(head: Head, runs_table: CsvTable | None, table: CsvTable | None, faults: Faults) -> Parts:
    """Read runs and probings, and judge them by the rules of the method; the table of probings is empty then.

    Where the method is not known, nothing is said of columns that one method has and another has not.
    """
    if head.rules is None:
        noted = Faults(())
        parts = _read_parts(head, runs_table, table, noted)
        faults.extend(fault for fault in noted.sorted() if fault.line != 1 or fault.column in _OF_ALL_METHODS)
        return parts
    return _read_parts(head, runs_table, table, faults)


def _read_parts(head: Head, runs_table: CsvTable | None, table: CsvTable | None, faults: Faults) -> Parts:
    ambient = head.rules is not None and head.rules.needs_ambient and not head.rules.needs_setups
    runs = None if runs_table is None else runs_file.read_runs(runs_table, faults, ambient=ambient)
    part = None
    if table is not None:
        listed = None if runs is None or _has_lost_a_run(runs_table, runs) else runs.lines
        expected = probings_file.Expected(
            head.machine.axes, head.machine.strokes, _targets(head), listed, head.rules, _setups(head)
        )
        part = probings_file.read_probings(table, expected, faults)
        # What is judged now is judged by numbers; the text of a million rows is 0.6 GB.
        table.columns.clear()
    if part is not None:
        _check_plan(head, part, faults)
    return Parts(runs, part)


def campaign_of(head: Head, parts: Parts, files: tuple[SourceFile, ...]) -> Campaign:
    """Put the parts of a folder without faults together: then all of them could be read."""
    runs, part = parts.runs, parts.probings
    assert head.name is not None
    assert head.method is not None
    assert head.machine.machine is not None
    assert head.artefact is not None
    assert runs is not None
    assert part is not None
    probe = head.probe or probe_of(head.artefact.setups, part.probings)
    return Campaign(
        head.name, head.method, head.machine.machine, probe, head.artefact, runs.runs, part.probings,
        files, head.sources,
    )  # fmt: skip


def read_head(top: Table) -> Head:
    """Read all of ``campaign.toml``; keys that nobody asked for are refused."""
    _refuse_other_format(top)
    name = top.text("campaign", required=True, example='"five-days"')
    method = top.text("method", required=True, example='"samba"')
    rules = _rules(top, method)
    machine = read_machine(top)
    has_setups = rules is not None and rules.needs_setups
    # Without a method nobody knows whether the folder needs a probe or may have setups.
    probe = read_probe(
        top,
        required=rules is not None and not has_setups,
        has_scale=rules is None or rules.targets_are_reflectors,
    )
    if rules is None:
        top.tables("setups")
    artefact, balls = read_artefact(top)
    fits = _artefact_fits(top, artefact, rules)
    sources = read_sources(top, machine.axes)
    setups = read_setups(top) if has_setups else ()
    artefact = None if artefact is None or setups is None else replace(artefact, setups=setups)
    top.finish()
    return Head(name, method, rules, machine, probe, artefact if fits else None, balls, sources)


def _check_plan(head: Head, part: probings_file.ProbingsPart, faults: Faults) -> None:
    """Apply the rules of the method to the probings, where both and the artefact could be read."""
    if head.rules is None or head.artefact is None or not head.machine.axes:
        return
    intact = set(part.probings.run.tolist()) - part.damaged_runs
    turning = tuple(axis.name for axis in head.machine.axes if axis.kind != "linear")
    plan = Plan(
        probings_file.FILE, part.probings, part.lines, tuple(sorted(intact)), turning, head.artefact,
        is_whole=not part.damaged_runs,
    )  # fmt: skip
    faults.extend(head.rules.check(plan))


def _targets(head: Head) -> list[str] | None:
    """Return the names that a target may have; None where they are free or could not be read."""
    rules, artefact = head.rules, head.artefact
    if rules is not None and rules.targets_are_balls:
        return head.balls
    if rules is not None and rules.targets_are_reflectors and artefact is not None and artefact.reflectors:
        return [reflector.id for reflector in artefact.reflectors]
    return None


def _setups(head: Head) -> list[str] | None:
    """Return the ids of the setups; None where they could not be read or there are none."""
    if head.artefact is None or not head.artefact.setups:
        return None
    return [setup.id for setup in head.artefact.setups]


def _refuse_other_format(top: Table) -> None:
    number = top.raw("format", required=True, example=str(FORMAT))
    if number is not None and (type(number) is not int or number != FORMAT):
        top.fault("format", f"format {quoted(number)} is not known; this software reads format = {FORMAT}")


def _rules(top: Table, method: str | None) -> MethodRules | None:
    """Return the rules of a method; of one that there is not those of the nearest name, by which the rest is judged."""
    if method is None:
        return None
    rules = method_rules()
    if method in rules:
        return rules[method]
    names = [*rules, CURVE]
    hint = did_you_mean(method, names)
    top.fault("method", f"method {quoted(method)} is not known; {hint}the methods are {one_of(names)}")
    return next((rules[name] for name in rules if f"'{name}'" in hint), None)


def _artefact_fits(top: Table, artefact: Artefact | None, rules: MethodRules | None) -> bool:
    """Return whether the artefact has what the method needs; the first thing that it lacks is refused."""
    if artefact is None or rules is None:
        return True
    bar = artefact.scale_bar
    ends = () if bar is None else bar.balls
    lacks = {
        "the table [artefact.scale_bar] is missing; the method {} needs a calibrated bar":
            rules.needs_scale_bar and bar is None,
        "the table [artefact.self_calibration] is missing; the method {} needs its nodes":
            rules.needs_self_calibration and artefact.self_calibration is None,
        "the table [artefact.l_shape] is missing; the method {} needs its modules and placements":
            rules.needs_l_shape and artefact.l_shape is None,
        "there is no [[artefact.balls]] beside the bar's; the method {} needs one or more":
            rules.targets_are_balls and all(ball.id in ends for ball in artefact.balls),
    }  # fmt: skip
    message = next((message for message, lacking in lacks.items() if lacking), None)
    if message is not None:
        top.fault("artefact", message.format(rules.name))
    return message is None


def _has_lost_a_run(table: CsvTable | None, runs: runs_file.RunsPart) -> bool:
    """Return whether a run number could not be read: then no run of another file can be called unknown."""
    return table is None or bool(table.damaged) or len(set(table.columns["run"])) != len(runs.lines)
