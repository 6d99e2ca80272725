"""What needs attention in a fleet: the most urgent rows, and how many of all, by kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.reporting.weekly_notice import WeeklyNotices
from monitor.workflow.fleet.attention import Attention, Onset
from monitor.workflow.history.refuted import ContradictedStatement, RefutedCampaign


@dataclass(frozen=True)
class FleetTableRow:
    """A parameter of a machine: why it needs attention, the tests of its days, its drift, its latest day.

    ``temperature`` is the recorded one that is fitted beside the slope; left out where none is. ``season_not_told``: a
    yearly season can be all of the slope, the history is too short to tell. ``refers_to`` says in words what the
    parameter is stated relative to, where it is an error of the chain. ``since`` is the last event: what is judged
    begins with it. ``onset`` is the moment since which the row holds, by ``onset_is``. ``probability_out`` is that of
    the last run to lie beyond the limit, ``in_tolerance_at_next_check`` that of a run at the ``next_check`` not to;
    left out where there is no limit, the second where the history is too short to foretell anything.
    """

    rank: int
    machine: str
    parameter: str
    attention: Attention
    unit: str
    n: int
    days: int
    mean: float | None
    sd_all: float | None
    sd_pooled: float | None
    between_days: float | None
    bartlett: float | None
    bartlett_p: float | None
    bartlett_q: float | None
    anova_f: float | None
    anova_p: float | None
    anova_q: float | None
    slope_per_year: float | None
    u_slope: float | None
    slope_widening: float | None
    drift_p: float | None
    drift_q: float | None
    latest: float | None
    latest_at: str | None
    since: str | None
    limit: float | None
    years_to_limit: float | None
    temperature: str | None = field(default=None, metadata=OMITTED)
    season_not_told: bool | None = field(default=None, metadata=OMITTED)
    refers_to: str | None = field(default=None, metadata=OMITTED)
    onset: str | None = field(default=None, metadata=OMITTED)
    onset_is: Onset | None = field(default=None, metadata=OMITTED)
    probability_out: float | None = field(default=None, metadata=OMITTED)
    in_tolerance_at_next_check: float | None = field(default=None, metadata=OMITTED)
    next_check: str | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class OlderVersion:
    """The version of a model (``NAME@VERSION``) that the numbers of a machine come from, and the ``newest``.

    Not all of its campaigns were identified by that yet.
    """

    model: str
    newest: str


@dataclass(frozen=True)
class FleetAnswer:
    """The most urgent rows of ``rows``, and how many of all need attention, by kind.

    ``not_identified`` are campaigns without numbers under the model that the numbers of their machine come from: they
    have no part in it. ``older_versions`` by machine say where these are of an older version than the newest of the
    method's own model, as not all of its campaigns were identified by that yet. ``left_out`` names by machine with
    numbers the campaigns that have no part in them. ``tolerances_of_type`` names the machine
    type by machine, where its campaign states no tolerances; ``limits_without_parameter`` says by machine which of that
    type's limits are of none of its parameters.
    ``without_numbers`` are machines of which no run has numbers, which no row stands for; not said of a model that was
    asked for by its name.
    ``models_refuted`` by machine are latest campaigns whose readings refute the model that the values come from;
    ``models_lacking`` by machine those whose stored comparison says that something is missing from it.
    ``statements_contradicted`` by machine are the last runs whose residuals are many times what is stated, days or not.
    ``simulated`` by machine are campaigns that nobody measured.
    ``same_hours`` by machine are groups of campaigns that hold runs of the same hours: its numbers mix them.
    """

    machines: int
    rows: int
    values: int
    false_discovery_rate: float
    attention: Mapping[str, int]
    not_identified: tuple[str, ...]
    table: tuple[FleetTableRow, ...]
    weekly_looks: WeeklyNotices | None = field(default=None, metadata=OMITTED)
    tolerances_of_type: Mapping[str, str] | None = field(default=None, metadata=OMITTED)
    limits_without_parameter: Mapping[str, tuple[str, ...]] | None = field(default=None, metadata=OMITTED)
    models_refuted: Mapping[str, RefutedCampaign] | None = field(default=None, metadata=OMITTED)
    models_lacking: Mapping[str, str] | None = field(default=None, metadata=OMITTED)
    without_numbers: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    older_versions: Mapping[str, tuple[OlderVersion, ...]] | None = field(default=None, metadata=OMITTED)
    left_out: Mapping[str, tuple[str, ...]] | None = field(default=None, metadata=OMITTED)
    simulated: Mapping[str, tuple[str, ...]] | None = field(default=None, metadata=OMITTED)
    same_hours: Mapping[str, tuple[tuple[str, ...], ...]] | None = field(default=None, metadata=OMITTED)
    statements_contradicted: Mapping[str, ContradictedStatement] | None = field(
        default=None, metadata=OMITTED
    )

    @property
    def unexplained(self) -> dict[str, str]:
        """By machine the latest campaign, where the model of its numbers does not explain the readings."""
        contradicted = {
            machine: each.campaign for machine, each in (self.statements_contradicted or {}).items()
        }
        refuted = {machine: each.campaign for machine, each in (self.models_refuted or {}).items()}
        return {**(self.models_lacking or {}), **contradicted, **refuted}
