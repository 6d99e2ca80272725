"""What the map does not hold is named: machines of any order of axes, by a forward model that shares no code with it.

Every position and orientation error of ISO 230-1 that a machine has is given to it alone, 100 µrad or 20 µm, and
measured by laser, ball bar and R-test without noise. Wherever the tool then misses its place by more than the map's U
beside what the map says, the error must be among those that have no number or are named as outside.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.machine import parse_topology
from monitor.methods import ChainMethod, campaign_method
from monitor.methods.chain.identification import Identification
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.store import Database, import_campaign
from monitor.uncertainty.geometric_errors import GeometricErrors
from monitor.uncertainty.outside_errors import OutsideError, axis_errors, outside_errors
from monitor.uncertainty.volumetric import VolumetricError, grid, middle, volumetric_error
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.plan.answer import InstrumentPlanAnswer
from monitor.workflow.plan.plan import plan
from monitor.workflow.plan.request import PlanRequest
from tests.simulator.serial_machines import HALF_STROKE, TOOL, SerialMachine, campaign, iso_errors

#: The machines, and the rotary axes around which the R-test goes.
MACHINES = [
    ("w b X Y Z C B t", "CB"),
    ("w b X Y Z B C t", "C"),
    ("w Y b X Z C B t", "CB"),
    ("w C b X Y Z B t", "CB"),
    ("w C b X Y Z B t", "C"),
    ("w C Y b X Z B t", "B"),
    ("w C A Y b X Z t", "CA"),
    ("w C B X b Z Y t", "C"),
    ("w Y b X Z t", ""),
    ("w b X Y Z t", ""),
    ("w X Y Z b t", ""),
]
#: That of `make slow`, without a rotary axis; `make trials` has the others.
IN_SLOW = {("w b X Y Z t", "")}


def _measured(folder: Path, machine: SerialMachine, axes: str, added: tuple[str, ...] = ()) -> Measured:
    read = read_campaign(campaign(folder, machine, 1, 0.0, list(axes)))
    method = campaign_method(read)
    assert isinstance(method, ChainMethod)
    model = Model("instruments", added=added)
    return Measured(machine, method.problem_of(read, model), method.identify(read, model))


class Measured:
    """A machine with what the product says of it."""

    def __init__(self, machine: SerialMachine, problem: ChainProblem, result: Identification) -> None:
        self.machine, self.problem, run = machine, problem, result.runs[0]
        values = dict(zip(result.parameters, run.estimate, strict=True))
        values |= dict(zip(result.added, result.added_estimate, strict=True))
        variances = dict(zip(result.parameters, np.diag(run.covariance), strict=True))
        effects = [
            effect
            for effect in (*problem.base, *problem.added)
            if np.isfinite(values[effect.parameters(problem.context)[0]])
        ]
        names = tuple(name for effect in effects for name in effect.parameters(problem.context))
        self.geometric = GeometricErrors(
            effects=tuple(effects),  # type: ignore[arg-type]
            names=names,
            estimate=np.array([values[name] for name in names]),
            covariance=np.diag([variances.get(name, 0.0) for name in names]),
            context=problem.context,
            run=1,
            tip=TOOL,
        )
        self.refused = {name for refusal in run.refused for name in refusal.parameters}

    @property
    def _asked(self) -> tuple[np.ndarray, np.ndarray]:
        chain = self.problem.context.chain
        ranges = dict.fromkeys("XYZ", (-HALF_STROKE, HALF_STROKE))
        rotary = np.array([joint.turns for joint in chain.joints])
        single = np.eye(len(rotary))[rotary]
        poses = np.concatenate([np.zeros((1, len(rotary))), 0.7 * single, -1.2 * single, 0.6 * rotary[None]])
        return grid(chain, ranges, 2, np.unique(poses, axis=0)), middle(chain, ranges)

    @property
    def outside(self) -> tuple[OutsideError, ...]:
        """What the product names."""
        return outside_errors(self.problem, self.geometric, *self._asked, self.refused)

    @property
    def mapped(self) -> VolumetricError:
        """The map."""
        return volumetric_error(self.geometric, *self._asked)

    def _readings(self, positions: np.ndarray) -> dict[str, float]:
        joints = self.problem.context.chain.joints
        return {
            joint.name: joint.sign * float(np.rad2deg(place) if joint.turns else place)
            for joint, place in zip(joints, positions, strict=True)
        }

    @property
    def beyond(self) -> tuple[float, float]:
        """By how much the tool misses what the map says, mm, and U there, where it is most beyond."""
        mapped = self.mapped
        assert mapped.datum is not None
        datum = self._readings(mapped.datum)
        true = np.array([self.machine.missed(self._readings(place), datum) for place in mapped.positions])
        off = np.linalg.norm(true - mapped.vectors, axis=1)
        expanded = 2.0 * np.sqrt(np.einsum("nii->n", mapped.covariance))
        worst = int(np.argmax(off - expanded))
        return float(off[worst]), float(expanded[worst])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "axes"),
    [
        pytest.param(*machine, marks=() if machine in IN_SLOW else pytest.mark.all_seeds)
        for machine in MACHINES
    ],
)
def test_what_moves_the_tool_beyond_u_is_named(tmp_path: Path, word: str, axes: str) -> None:
    """No error is silent, and what is named moves the tool as much as it is said to."""
    named_errors = {
        each.symbol: each for each in _measured(tmp_path / "none", SerialMachine(word, {}), axes).outside
    }
    for name in iso_errors(word):
        size = 0.02 if name[1] in "XYZ" else 1e-4
        measured = _measured(tmp_path / name, SerialMachine(word, {name: size}), axes)
        off, expanded = measured.beyond
        if off > expanded + 1e-4:
            assert name in {*measured.refused, *named_errors}, (name, off, expanded)
        if name in named_errors:
            assert off == pytest.approx(
                named_errors[name].missed * (1.0 if name[1] in "ABC" else 2.0), rel=0.05, abs=1e-4
            )


@pytest.mark.parametrize("word", sorted({word for word, _ in MACHINES}))
def test_iso_230_1_errors_of_every_axis(word: str) -> None:
    """Those of the product are those of the simulator: three a linear axis, five a rotary one."""
    product = axis_errors(parse_topology(word))
    assert set(product) == set(iso_errors(word))
    assert len(product) == 3 * 3 + 5 * len(SerialMachine(word, {}).rotary)


def test_the_zero_of_a_head_that_no_reading_shows(tmp_path: Path) -> None:
    """100 µrad of it are 17 µm of which neither the map nor its U holds anything, and it is named with so much; the
    zero of the table turns the workpiece as a whole."""
    measured = _measured(tmp_path / "head", SerialMachine("w C b X Y Z B t", {"EB0B": 1e-4}), "C")
    off, expanded = measured.beyond
    assert off > 10.0 * expanded
    outside = {each.symbol: each for each in measured.outside}
    assert set(outside) == {"EB0B", "EC0C", "EY0Y"}
    assert outside["EB0B"].missed == pytest.approx(off, rel=0.01)
    assert not outside["EB0B"].is_shown
    assert not outside["EB0B"].turns_workpiece
    assert outside["EC0C"].turns_workpiece


@pytest.mark.slow
def test_a_zero_that_the_readings_show_gets_a_number_in_the_model(tmp_path: Path) -> None:
    """Around both axes the readings contradict a model without it; with it the map holds the truth."""
    machine = SerialMachine("w C b X Y Z B t", {"EB0B": 1e-4})
    without = {each.symbol: each for each in _measured(tmp_path / "without", machine, "CB").outside}
    assert without["EB0B"].is_shown
    within = _measured(tmp_path / "with", machine, "CB", ("EB0B",))
    index = within.geometric.names.index("EB0B")
    assert within.geometric.estimate[index] == pytest.approx(1e-4, rel=0.01)
    assert "EB0B" not in {each.symbol for each in within.outside}
    assert within.beyond[0] < 1e-4


@pytest.mark.slow
def test_identify_and_plan_name_the_measurement(tmp_path: Path) -> None:
    """The zero of a head has an R-test that would show it; a plan asked for it gives the test's u."""
    with Database(tmp_path / "shop.duckdb") as db:
        machine = SerialMachine("w C b X Y Z B t", {})
        import_campaign(db, read_campaign(campaign(tmp_path / "head", machine, 1, 1.0, ["C"])))
        answer = identify(db, IdentifyRequest("head"))
        named = [refused.parameters for refused in answer.not_seen or ()]
        assert ("EB0B",) in named
        assert (answer.seen_by or {})["EB0B"].reading == "vector"
        planned = plan(db, PlanRequest("head", parameters=("EB0B",)))
        assert isinstance(planned, InstrumentPlanAnswer)
        assert planned.present["EB0B"] is None
        assert planned.tests[0].u["EB0B"] is not None
