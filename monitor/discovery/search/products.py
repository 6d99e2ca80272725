"""Products of columns with each other and with a residual: what some of them explain of it needs no row again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.search.projection import RELATIVE_RANK
from monitor.records import Array

# Of a sum of squares less than this part is the rounding of products.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Products:
    """Products ``gram`` (k, k) of columns with each other and ``onto`` (k,) with a residual, of which ``total`` is the
    sum of squares and ``whole`` that before anything was taken out."""

    gram: Array
    onto: Array
    total: float
    whole: float

    @property
    def lengths(self) -> Array:
        """The lengths (k,) of the columns."""
        return np.asarray(np.sqrt(np.maximum(np.diagonal(self.gram), 0.0)))

    def without(self, part: int) -> Products:
        """Those with the span of one of the columns taken out."""
        taken, onto = self.gram[part] / self.gram[part, part], float(self.onto[part])
        total = max(self.total - onto**2 / float(self.gram[part, part]), ROUNDING * self.whole)
        return Products(
            self.gram - np.outer(self.gram[part], taken), self.onto - taken * onto, total, self.whole
        )

    def left_by(self, parts: Sequence[int]) -> float:
        """The sum of squares that some of the columns leave of the residual."""
        if not parts:
            return self.total
        some = np.array(parts)
        scale = self.lengths[some]
        scale = np.where(scale == 0.0, 1.0, scale)
        values, vectors = np.linalg.eigh(self.gram[np.ix_(some, some)] / np.outer(scale, scale))
        keep = values > RELATIVE_RANK * max(float(values[-1]), 1.0)
        along = vectors[:, keep].T @ (self.onto[some] / scale)
        return max(self.total - float(np.sum(along**2 / values[keep])), ROUNDING * self.whole)
