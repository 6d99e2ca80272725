"""The request of `predict`."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.exceptions import InputError


@dataclass(frozen=True)
class PredictRequest:
    """Fit a model (the method's own with None) to a campaign and predict the rows of the campaign ``of``; with None the
    campaign's own, in ten parts that each take no part in their fit.

    Raises InputError where a campaign is to be predicted from itself.
    """

    campaign: str
    model: str | None = None
    of: str | None = None

    def __post_init__(self) -> None:
        if self.of == self.campaign:
            raise InputError(
                f"--of {self.of} is the fitted campaign itself; leave --of out, and ten parts of it are predicted from "
                "the others in turn"
            )
