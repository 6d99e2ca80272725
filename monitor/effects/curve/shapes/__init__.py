"""The shapes of a curve's effects, one a file."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from monitor.effects.curve.effect import CurveEffect
from monitor.effects.curve.shape import CurveShape


@cache
def _shapes() -> dict[str, CurveShape]:
    """Return the shapes by the names that the files list in ``SHAPES``."""
    shapes: dict[str, CurveShape] = {}
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        shapes |= importlib.import_module(f"{__name__}.{module.name}").SHAPES
    return shapes


def shape_of(effect: CurveEffect) -> CurveShape:
    """Return the shape of an effect."""
    return _shapes()[effect.shape]
