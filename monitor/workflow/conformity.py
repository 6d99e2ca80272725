"""Statements of conformity on demand: the tolerances of the campaign, a decision rule with its name, the risk."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate import ConformityStatement, ConformityVerdict
from monitor.uncertainty import FrameworkResult
from monitor.uncertainty.conformity import conformity
from monitor.workflow.uncertainty import Evaluated

#: Probability of conformity that the third rule asks for; its complement decides for failure.
WANTED = 0.95
RULES = {
    "simple": (
        "simple acceptance (ILAC-G8:09/2019, 4.2.1): within where the absolute estimate does not exceed the tolerance; "
        "the uncertainty takes no part in the decision",
        "a single statement may be wrong with a probability of up to 50 %; its probability of conformity is given",
    ),
    "guard": (
        "guard band w = U (ILAC-G8:09/2019, 4.2.3; ISO 14253-1:2017): pass where the absolute estimate does not exceed "
        "tolerance less U, fail where it exceeds tolerance plus U, conditional pass or fail between",
        "all statements 'pass' hold at once with at least the coverage probability {p} of the intervals estimate ± U",
    ),
    "probability": (
        "probability of conformity (JCGM 106:2012, 7): pass at {wanted} or more, fail at {failing} or less, undecided "
        "between",
        "a single statement 'pass' is wrong with a probability of at most {failing}",
    ),
}  # fmt: skip


def statement_of(found: Evaluated, rule: str) -> ConformityStatement:
    """The statement on every parameter with a tolerance. Raises InputError for an unknown rule or no tolerance."""
    if rule not in RULES:
        raise InputError(f"there is no decision rule '{rule}'; there are {', '.join(RULES)}")
    guf = found.framework
    limits = found.campaign.machine.tolerances
    chosen = [place for place, name in enumerate(guf.names) if name in limits]
    if not chosen:
        raise InputError(
            f"campaign {found.campaign.name} states no tolerance of {', '.join(guf.names)}: a statement of conformity "
            "needs [machine.tolerances] in its campaign.toml"
        )
    names = [guf.names[place] for place in chosen]
    units = [found.units[place] for place in chosen]
    scale = np.array([unit.factor for unit in units])
    y = guf.estimate[chosen] / scale
    covariance = guf.covariance[np.ix_(chosen, chosen)] / np.outer(scale, scale)
    tolerance = np.array([limits[name] for name in names])
    expanded = guf.k_q * np.sqrt(np.diag(covariance))
    judged = conformity(y, covariance, -tolerance, tolerance, dof=guf.dof)
    verdicts = tuple(
        ConformityVerdict(
            name,
            unit.name,
            float(limit),
            _verdict(rule, abs(float(value)), float(limit), float(u), float(p)),
            float(p),
        )
        for name, unit, limit, value, u, p in zip(
            names, units, tolerance, y, expanded, judged.single, strict=True
        )
    )
    words, risk = (_filled(text, guf) for text in RULES[rule])
    return ConformityStatement(words, risk, verdicts, judged.joint)


def _filled(text: str, guf: FrameworkResult) -> str:
    return text.format(
        p=f"{guf.p * 100:g} %", wanted=f"{WANTED * 100:g} %", failing=f"{(1 - WANTED) * 100:.3g} %"
    )


def _verdict(rule: str, value: float, limit: float, expanded: float, probability: float) -> str:
    if rule == "simple":
        return "pass" if value <= limit else "fail"
    if rule == "guard":
        if value <= limit - expanded:
            return "pass"
        if value > limit + expanded:
            return "fail"
        return "conditional pass" if value <= limit else "conditional fail"
    if probability >= WANTED:
        return "pass"
    return "fail" if probability <= 1.0 - WANTED else "undecided"
