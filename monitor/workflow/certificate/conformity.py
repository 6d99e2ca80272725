"""Statements of conformity on demand: the tolerances of the campaign, a decision rule with its name, the risk."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate.record import ConformityStatement, ConformityVerdict
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.numbers import decimal_of, round_to_place, written_probability
from monitor.reporting.texts import Texts

#: Probability of conformity that the third rule asks for; its complement decides for failure.
WANTED = 0.95
#: Each has its words and its risk among the texts: conformity.rule_simple, conformity.risk_simple, ...
RULES = ("simple", "guard", "probability")


def statement_of(
    result: ResultSet, rule: str, texts: Texts, *, campaign: str, dof: float
) -> ConformityStatement:
    """The statement on every parameter of a result that has a tolerance, in the language of ``texts``.

    ``dof`` are the degrees of freedom of the result's covariance. Raises InputError for an unknown rule or no
    tolerance; ``campaign`` is where the tolerances are from.
    """
    # Loaded here: most certificates state no conformity, and every command knows the rules' names.
    from monitor.uncertainty.conformity import conformity

    if rule not in RULES:
        raise InputError(f"there is no decision rule '{rule}'; there are {', '.join(RULES)}")
    limits = np.full(len(result.names), np.nan) if result.tolerances is None else result.tolerances
    chosen = np.flatnonzero(np.isfinite(limits))
    if not len(chosen):
        raise InputError(
            f"campaign {campaign} states no tolerance of {', '.join(result.names)}: a statement of conformity "
            "needs [machine.tolerances] in its campaign.toml"
        )
    tolerance = limits[chosen]
    judged = conformity(
        result.estimate[chosen], result.covariance[np.ix_(chosen, chosen)], -tolerance, tolerance, dof=dof
    )
    verdicts = []
    for place, p in zip(map(int, chosen), map(float, judged.single), strict=True):
        value, limit = abs(float(result.estimate[place])), float(limits[place])
        verdict = _verdict(rule, value, limit, float(result.expanded[place]), p)
        verdicts.append(ConformityVerdict(result.names[place], result.units[place], limit, verdict, p))
    sign = texts.decimal_sign
    wanted, failing = (written_probability(round(one, 12), sign) for one in (WANTED, 1.0 - WANTED))
    words, risk = (
        texts(
            f"conformity.{what}_{rule}", p=written_probability(result.p, sign), wanted=wanted, failing=failing
        )
        for what in ("rule", "risk")
    )
    law = "normal" if np.isinf(dof) else "student"
    freedom = "" if np.isinf(dof) else texts.number(round_to_place(dof, decimal_of(0.1)))
    basis = texts(f"conformity.basis_{law}", campaign=campaign, dof=freedom)
    return ConformityStatement(words, risk, tuple(verdicts), judged.joint, result.state, basis)


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
