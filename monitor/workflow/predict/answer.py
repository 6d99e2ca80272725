"""The answer of `predict`: measured less predicted, row by row and in groups."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.workflow.explain.compare_answer import MachinePart


@dataclass(frozen=True)
class PredictedRow:
    """A row that took no part in the fit: what the model leaves of each of its numbers, in µm."""

    run: int
    sequence: int
    target: str
    residual_um: tuple[float, ...]


@dataclass(frozen=True)
class PredictAnswer:
    """A model fitted to ``campaign`` against rows of the campaign ``of`` that took no part in the fit.

    ``rms_um`` is that of targets that the machine moves, ``resting_rms_um`` that of those beside it (None without
    any), ``fitted_rms_um`` that of the rows of the fit. ``blocks`` parts were left out in turn, 1
    where the rows are another campaign's; ``components`` names the numbers of a row. Of another campaign's run nobody
    knows the size of the effects ``taken_over`` from the run of the fit, which differ from run to run, nor what those
    ``from_own_start``, which count from its first reading, had come to before. ``are_angles``: of every reading 1 µm
    stands for 1 µrad, what it comes to at one metre.
    """

    campaign: str
    model: str
    of: str
    blocks: int
    rms_um: float
    resting_rms_um: float | None
    fitted_rms_um: float
    stated_uncertainty_um: float
    components: tuple[str, ...]
    by_target: Mapping[str, MachinePart]
    rows: tuple[PredictedRow, ...]
    taken_over: tuple[str, ...] = ()
    from_own_start: tuple[str, ...] = ()
    are_angles: bool | None = field(default=None, metadata=OMITTED)
