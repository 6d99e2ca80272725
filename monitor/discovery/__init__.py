"""Compare model and measurement, see where it fails, learn which effect is missing.

``fit`` fits a model, ``compare`` says whether and where it fails, ``explain`` identifies the missing effects,
separated from bad points, balls that moved and steps between runs.
"""

from monitor.discovery.machine.compare import ChainComparison, compare
from monitor.discovery.machine.evidence.robust import RobustFit, robust_fit
from monitor.discovery.machine.explain import Explanation, explain
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.missing import ChainMissing
from monitor.discovery.machine.mistakes.cures import Mistake
from monitor.discovery.machine.mistakes.late_rows import (
    LateRows,
    find_late_rows,
    find_late_rows_without_fit,
    late_rows,
    late_rows_without_fit,
)
from monitor.discovery.machine.mistakes.mistakes import (
    find_mistakes,
    find_other_names,
    find_reading_mistakes,
    is_far,
    is_gross,
)
from monitor.discovery.machine.mistakes.run_mistakes import find_run_mistakes
from monitor.discovery.machine.mistakes.setup_mistakes import find_setup_mistakes, only_misread
from monitor.discovery.machine.mistakes.still_axes import find_still_axes
from monitor.discovery.machine.mistakes.turned_passes import find_turned_passes
from monitor.discovery.machine.shapes.step_places import Between, nearest_readings
from monitor.discovery.machine.shapes.steps_of_model import steps_of_model
from monitor.discovery.machine.version_error import VersionError, version_error
from monitor.records import Verdict

__all__ = [
    "Between",
    "ChainComparison",
    "ChainMissing",
    "Explanation",
    "Fit",
    "LateRows",
    "Mistake",
    "RobustFit",
    "Verdict",
    "VersionError",
    "compare",
    "explain",
    "find_late_rows",
    "find_late_rows_without_fit",
    "find_mistakes",
    "find_other_names",
    "find_reading_mistakes",
    "find_run_mistakes",
    "find_setup_mistakes",
    "find_still_axes",
    "find_turned_passes",
    "fit",
    "is_far",
    "is_gross",
    "late_rows",
    "late_rows_without_fit",
    "nearest_readings",
    "only_misread",
    "robust_fit",
    "steps_of_model",
    "version_error",
]
