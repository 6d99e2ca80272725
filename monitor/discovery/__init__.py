"""Compare model and measurement, see where it fails, learn which effect is missing.

``fit`` fits a model, ``compare`` says whether and where it fails, ``explain`` finds the missing effects, told
apart from bad points, balls that moved and steps between runs.
"""

from monitor.discovery.compare import Comparison, compare
from monitor.discovery.explain import Explanation, explain
from monitor.discovery.fit import Fit, fit
from monitor.discovery.missing import Missing
from monitor.discovery.mistakes import Mistake, find_mistakes, is_gross
from monitor.discovery.version_error import VersionError, version_error

__all__ = [
    "Comparison",
    "Explanation",
    "Fit",
    "Missing",
    "Mistake",
    "VersionError",
    "compare",
    "explain",
    "find_mistakes",
    "fit",
    "is_gross",
    "version_error",
]
