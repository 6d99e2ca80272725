"""What machines and curves have in common in the answers of `compare` and `explain`."""

from __future__ import annotations

from monitor.discovery.search.comparison import LackOfFit
from monitor.discovery.search.missing import Missing
from monitor.workflow.explain.compare_answer import LackOfFitTest
from monitor.workflow.explain.explain_answer import SearchedValue
from monitor.workflow.identify.answer import Estimate


def lack_of_fit_test(test: LackOfFit | None) -> LackOfFitTest:
    """The test of lack of fit, empty where it could not be made."""
    if test is None:
        return LackOfFitTest()
    return LackOfFitTest(test.f, test.p_value, test.degrees_of_freedom, test.pure_error_degrees_of_freedom)


def coefficients(effect: Missing) -> dict[str, Estimate]:
    """The coefficients of a missing effect in display units."""
    rows = zip(effect.parameters, effect.units, effect.coefficients, effect.u_coefficients, strict=True)
    return {
        name: Estimate(unit.to_display(float(estimate)), unit.to_display(float(u)), unit.name)
        for name, unit, estimate, u in rows
    }


def searched_value(effect: Missing) -> SearchedValue | None:
    """The value of a missing effect that was searched for in the data; None where it has none."""
    searched = effect.searched
    if searched is None:
        return None
    return SearchedValue(
        searched.name, searched.value, searched.u, searched.unit, searched.frequency, searched.at_least
    )


def rivals(effect: Missing) -> tuple[str, ...]:
    """The effects that the data do not rule out in place of a missing one."""
    return tuple(rival.effect for rival in effect.rivals)


def coinciding(effect: Missing) -> tuple[str, ...]:
    """The rivals that no data of this plan could rule out."""
    return tuple(rival.effect for rival in effect.rivals if rival.coincides)
