"""The answers of `plan`: of balls at indexations, of angles of a table, and of tests of instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from monitor.documents import INLINED, OMITTED, named
from monitor.workflow.explain.explain_answer import DeviationsApart
from monitor.workflow.plan.test_answer import TestAnswer

#: Positions of rotary axes in degrees by the name of the column: ``a_deg``.
Pose = Mapping[str, float]


@dataclass(frozen=True)
class TimeAnswer:
    """Seconds for probing one target and for going to another indexation besides, and what they are taken from."""

    seconds_a_probing: float
    seconds_an_indexation: float
    source: str = field(metadata=named("from"))


@dataclass(frozen=True)
class PlannedParameter:
    """What a plan promises of a parameter, None where it gives no number.

    ``figure_of_merit`` is what an hour of the plan says of the parameter, against the present plan; ``separation`` is
    how well it is separated from the others (0 to 1).
    """

    u: float | None
    expanded: float | None
    unit: str
    figure_of_merit: float | None
    separation: float


@dataclass(frozen=True)
class BallPlan:
    """Balls at indexations, what they cost and promise; ``k_q`` is the coverage factor of all parameters jointly."""

    balls: tuple[str, ...]
    ball_places_mm: Mapping[str, tuple[float, ...]]
    poses: tuple[Pose, ...]
    probings: int
    seconds: float
    k_q: float
    parameters: Mapping[str, PlannedParameter]
    refused: tuple[str, ...]
    blind_spots: tuple[str, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class BallSubset:
    """The best subset of its size of the campaign's own balls, and the standard uncertainties that it gives."""

    balls: tuple[str, ...]
    seconds: float
    u: Mapping[str, float | None]


class SeparationVerdict(Enum):
    """Whether two effects can be separated."""

    IMPOSSIBLE = "no pose that this machine reaches tells them apart"
    WITH_POSES = "probe at these poses too"
    ALREADY = "this plan tells them apart already"


@dataclass(frozen=True)
class SeparationAnswer:
    """Poses that separate two effects of size ``peak_um`` at the tip."""

    effects: tuple[str, str]
    peak_um: float
    poses: tuple[Pose, ...]
    standard_deviations_apart: DeviationsApart
    verdict: SeparationVerdict


@dataclass(frozen=True)
class BallPlanAnswer:
    """What the plan of a campaign's first run promises, and a proposed one; ``blind_spots`` leave nothing to see."""

    campaign: str
    machine: str
    model: str
    p: float
    stated_uncertainty_um: float
    time_model: TimeAnswer
    present: BallPlan
    by_balls: tuple[BallSubset, ...]
    blind_spots: tuple[str, ...]
    wanted: Mapping[str, float] | None = field(default=None, metadata=OMITTED)
    proposed: BallPlan | None = field(default=None, metadata=OMITTED)
    separate: SeparationAnswer | None = field(default=None, metadata=OMITTED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def new_balls(self) -> dict[str, tuple[float, ...]]:
        """Return where the proposed balls stand that the campaign does not have, in mm."""
        places = {} if self.proposed is None else self.proposed.ball_places_mm
        return {name: position for name, position in places.items() if name not in self.present.balls}


@dataclass(frozen=True)
class ShapeUncertainty:
    """Expanded uncertainties of the points of a shape; None where no point has a number."""

    largest_expanded_shape_um: float | None
    median_expanded_shape_um: float | None
    points_without_number: int
    points_beyond_nodes: int


@dataclass(frozen=True)
class AngleParameter:
    """The expected standard uncertainty of a parameter, None where it has no number."""

    u: float | None
    unit: str


@dataclass(frozen=True)
class AnglesOfTable:
    """A plan of angles of a table; ``unseen_dimensions`` are left open by it."""

    angles_deg: tuple[float, ...]
    probings: int
    unseen_dimensions: int
    shape: ShapeUncertainty = field(metadata=INLINED)
    parameters: Mapping[str, AngleParameter]
    refused: tuple[str, ...]


@dataclass(frozen=True)
class OneMoreAngle:
    """The present plan with one more angle, which stands under the column's name: ``c_deg``."""

    angle: Pose = field(metadata=INLINED)
    shape: ShapeUncertainty = field(metadata=INLINED)
    unseen_dimensions: int


@dataclass(frozen=True)
class AnglePlanAnswer:
    """What the angles of a campaign's first run promise, the worth of one more, and the best next ones."""

    campaign: str
    machine: str
    method: str
    model: str
    p: float
    k: float
    table: str
    stated_uncertainty_um: float
    conditions: Mapping[str, str]
    present: AnglesOfTable
    angles: tuple[OneMoreAngle, ...]
    next_angles_deg: tuple[float, ...]
    proposed: AnglesOfTable


@dataclass(frozen=True)
class UnseenParameter:
    """A parameter that the readings give no number, and the test that would give it the smallest ``u``."""

    parameter: str
    unit: str
    u: float
    test: TestAnswer


@dataclass(frozen=True)
class InstrumentPlanAnswer:
    """Which instrument next, and where: for the ``asked`` parameters of a run the best test of each setup, best first.

    ``present`` are standard uncertainties as measured, by parameter; ``proposed`` tests in turn, each with what all up
    to it leave; ``unseen`` what has no number yet, with the test that would see it. ``standing`` are linear axes that
    stood still and have no stroke in the machine file, so that no test moves them. ``pairs`` are two tests for each
    asked parameter that no single test gives a number, the second with what both leave; none where no pair does.
    ``not_turned`` are rotary axes that no test turns, because bar and sphere would leave the strokes.
    """

    campaign: str
    machine: str
    method: str
    model: str
    run: int
    asked: tuple[str, ...]
    units: Mapping[str, str]
    present: Mapping[str, float | None]
    tests: tuple[TestAnswer, ...]
    proposed: tuple[TestAnswer, ...]
    unseen: tuple[UnseenParameter, ...]
    standing: tuple[str, ...]
    pairs: Mapping[str, tuple[TestAnswer, ...]] = field(default_factory=dict)
    not_turned: tuple[str, ...] = ()


PlanAnswer = BallPlanAnswer | AnglePlanAnswer | InstrumentPlanAnswer
