"""The question for statistics of a campaign's runs."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path


@dataclass(frozen=True)
class StatisticsRequest:
    """Statistics of the runs of a ``campaign``, grouped ``by`` a column or a stored selection.

    Only runs ``where`` a condition holds, and those of the stored selection ``select``, take part. Covariance and
    correlation matrices of the parameters and of the probed coordinates go into CSV files in the folder ``matrices``,
    drawings into ``figures``.
    """

    campaign: str
    _: KW_ONLY
    by: str = "day"
    where: str | None = None
    model: str | None = None
    select: str | None = None
    matrices: Path | None = None
    figures: Path | None = None
