"""Compare model and measurement, see where it fails, learn which effect is missing.

``fit`` fits a model, ``compare`` says whether and where it fails, ``explain`` finds the missing effects, told
apart from bad points, balls that moved and steps between runs.
"""

from monitor.discovery.machine.compare import Comparison, compare
from monitor.discovery.machine.explain import Explanation, explain
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.missing import Missing
from monitor.discovery.machine.mistakes import Mistake, find_mistakes, is_gross
from monitor.discovery.machine.version_error import VersionError, version_error

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
