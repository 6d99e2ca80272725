"""The rows of one setup."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.methods.instruments.reading import Reading, Rows


@dataclass(frozen=True)
class Part:
    """The rows of one setup: its ``reading``, its ``rows`` as its kind knows them, their indices ``at`` (m,) among all
    rows, and the ``instrument`` as people call it."""

    id: str
    reading: Reading
    rows: Rows
    at: npt.NDArray[np.int64]
    instrument: str = ""
