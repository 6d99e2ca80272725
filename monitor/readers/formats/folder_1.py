"""Campaign folder, format 1: ``campaign.toml``, ``runs.csv`` and ``probings.csv``."""

from __future__ import annotations

from pathlib import Path

from monitor.exceptions import CampaignError
from monitor.readers import probings_file, runs_file
from monitor.readers.artefact_file import read_artefact, read_probe
from monitor.readers.csv_table import CsvTable, parse_csv
from monitor.readers.faults import Faults, near, one_of, quoted
from monitor.readers.files import LARGEST_CSV, LARGEST_TOML, decode, read_bytes
from monitor.readers.machine_file import read_machine
from monitor.readers.method_rules import MethodRules, Plan
from monitor.readers.registry import Reader, method_rules
from monitor.readers.toml_table import Table, parse_toml
from monitor.records import Artefact, Campaign, SourceFile

TOML = "campaign.toml"
FILES = (TOML, runs_file.FILE, probings_file.FILE)
FORMAT = 1
#: A method with a reader of its own (curve_1), to be named where a method is not known.
CURVE = "curve"


def read(folder: Path) -> Campaign:
    """The campaign of a folder; CampaignError with all faults of the folder if there are any."""
    faults = Faults(FILES)
    found = {
        name: read_bytes(folder, name, LARGEST_TOML if name == TOML else LARGEST_CSV, faults)
        for name in FILES
    }
    files = [SourceFile(name, content) for name, content in found.items() if content is not None]
    texts = {file.name: decode(file.name, file.content, faults) for file in files}

    toml = texts.get(TOML)
    top = None if toml is None else parse_toml(TOML, toml, faults)
    name = method = probe = artefact = balls = rules = None
    if top is not None:
        _refuse_other_format(top)
        name = top.text("campaign", required=True, example='"five-days"')
        method = top.text("method", required=True, example='"samba"')
        rules = _rules(top, method)
        part = read_machine(top)
        probe = read_probe(top)
        artefact, balls = read_artefact(top)
        if not _artefact_fits(top, artefact, rules):
            artefact = None
        top.finish()

    runs_table = _table(runs_file.FILE, texts, faults)
    runs = None if runs_table is None else runs_file.read_runs(runs_table, faults)
    table = _table(probings_file.FILE, texts, faults)
    probings = None
    if table is not None:
        probings = probings_file.read_probings(
            table,
            None if top is None else part.axes,
            {} if top is None else part.strokes,
            _targets(rules, balls, artefact),
            None if runs is None or _has_lost_a_run(runs_table, runs) else runs.lines,
            rules,
            faults,
        )
    if rules is not None and artefact is not None and probings is not None and top is not None and part.axes:
        intact = set(probings.probings.run.tolist()) - probings.damaged_runs
        turning = tuple(axis.name for axis in part.axes if axis.kind != "linear")
        plan = Plan(
            probings_file.FILE, probings.probings, probings.lines, tuple(sorted(intact)), turning, artefact
        )
        faults.extend(rules.check(plan))
    if len(faults):
        raise CampaignError(str(folder), faults.sorted())
    assert name is not None
    assert method is not None
    assert part.machine is not None
    assert probe is not None
    assert artefact is not None
    assert runs is not None
    assert probings is not None
    return Campaign(name, method, part.machine, probe, artefact, runs.runs, probings.probings, tuple(files))


def _targets(
    rules: MethodRules | None, balls: list[str] | None, artefact: Artefact | None
) -> list[str] | None:
    """The names that a target may have; None where they are free or not known."""
    if rules is not None and rules.targets_are_balls:
        return balls
    if rules is not None and rules.targets_are_reflectors and artefact is not None and artefact.reflectors:
        return [reflector.id for reflector in artefact.reflectors]
    return None


def _refuse_other_format(top: Table) -> None:
    found = top.raw("format", required=True, example=str(FORMAT))
    if found is not None and (type(found) is not int or found != FORMAT):
        top.fault("format", f"format {quoted(found)} is not known; this software reads format = {FORMAT}")


def _rules(top: Table, method: str | None) -> MethodRules | None:
    if method is None:
        return None
    known = method_rules()
    if method not in known:
        top.fault(
            "method",
            f"method {quoted(method)} is not known; {near(method, [*known, CURVE])}the methods are "
            f"{one_of([*known, CURVE])}",
        )
    return known.get(method)


def _artefact_fits(top: Table, artefact: Artefact | None, rules: MethodRules | None) -> bool:
    """Whether the artefact holds what the method needs, as far as both are known."""
    if artefact is None or rules is None:
        return True
    bar = artefact.scale_bar
    if rules.needs_scale_bar and bar is None:
        told = f"the table [artefact.scale_bar] is missing; the method {rules.name} needs a calibrated bar"
        top.fault("artefact", told)
        return False
    if rules.needs_self_calibration and artefact.self_calibration is None:
        told = f"the table [artefact.self_calibration] is missing; the method {rules.name} needs its nodes"
        top.fault("artefact", told)
        return False
    if rules.needs_l_shape and artefact.l_shape is None:
        told = f"the table [artefact.l_shape] is missing; the method {rules.name} needs its modules and placements"
        top.fault("artefact", told)
        return False
    ends = () if bar is None else bar.balls
    if rules.targets_are_balls and all(ball.id in ends for ball in artefact.balls):
        told = f"there is no [[artefact.balls]] beside the bar's; the method {rules.name} needs one or more"
        top.fault("artefact", told)
        return False
    return True


def _table(name: str, texts: dict[str, str | None], faults: Faults) -> CsvTable | None:
    text = texts.get(name)
    return None if text is None else parse_csv(name, text, faults)


def _has_lost_a_run(table: CsvTable | None, runs: runs_file.RunsPart) -> bool:
    """Whether a run number could not be read: then no other file's run can be called unknown."""
    return table is None or bool(table.damaged) or len(set(table.columns["run"])) != len(runs.lines)


READER = Reader(
    "campaign folder, format 1", lambda folder: any((folder / name).exists() for name in FILES), read
)
