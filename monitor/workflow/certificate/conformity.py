"""Statements of conformity on demand: the tolerances of the campaign, a decision rule with its name, the risk."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate.record import ConformityStatement, ConformityVerdict, Verdict
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.numbers import decimal_of, round_to_place, written_probability
from monitor.reporting.texts import Texts

#: Probability of conformity that the third rule asks for; its complement decides for failure.
WANTED = 0.95


def statement_of(
    result: ResultSet, rule: str, texts: Texts, *, campaign: str, dof: float
) -> ConformityStatement:
    """The statement on every parameter of a result that has a tolerance, in the language of ``texts``.

    ``dof`` are the degrees of freedom of the result's covariance. Raises InputError where ``campaign``, which the
    tolerances are from, states none.
    """
    # Loaded here: most certificates state no conformity.
    from monitor.uncertainty.conformity import conformity

    limits = np.full(len(result.names), np.nan) if result.tolerances is None else result.tolerances
    limited = np.flatnonzero(np.isfinite(limits))
    if not len(limited):
        raise InputError(
            f"campaign {campaign} states no tolerance of {', '.join(result.names)}: a statement of conformity "
            "needs [machine.tolerances] in its campaign.toml"
        )
    tolerance = limits[limited]
    judged = conformity(
        result.estimate[limited], result.covariance[np.ix_(limited, limited)], -tolerance, tolerance, dof=dof
    )
    verdicts = []
    for index, p in zip(map(int, limited), map(float, judged.single), strict=True):
        value, limit = abs(float(result.estimate[index])), float(limits[index])
        verdict = _verdict(rule, value, limit, float(result.expanded[index]), p)
        verdicts.append(ConformityVerdict(result.names[index], result.units[index], limit, verdict, p))
    sign = texts.decimal_sign
    wanted, failing = (
        written_probability(round(probability, 12), sign) for probability in (WANTED, 1.0 - WANTED)
    )
    rule_text, risk = (
        texts(
            f"conformity.{what}_{rule}", p=written_probability(result.p, sign), wanted=wanted, failing=failing
        )
        for what in ("rule", "risk")
    )
    law = "normal" if np.isinf(dof) else "student"
    freedom = "" if np.isinf(dof) else texts.number(round_to_place(dof, decimal_of(0.1)))
    basis = texts(f"conformity.basis_{law}", campaign=campaign, dof=freedom)
    return ConformityStatement(rule_text, risk, tuple(verdicts), judged.joint, result.state, basis)


def _verdict(rule: str, value: float, limit: float, expanded: float, probability: float) -> Verdict:
    """The verdict on an absolute ``value``; ``probability`` is that of conformity."""
    if rule == "simple":
        return Verdict.PASS if value <= limit else Verdict.FAIL
    if rule == "guard":
        if value <= limit - expanded:
            return Verdict.PASS
        if value > limit + expanded:
            return Verdict.FAIL
        return Verdict.CONDITIONAL_PASS if value <= limit else Verdict.CONDITIONAL_FAIL
    if probability >= WANTED:
        return Verdict.PASS
    return Verdict.FAIL if probability <= 1.0 - WANTED else Verdict.UNDECIDED
