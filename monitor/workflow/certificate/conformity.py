"""Statements of conformity on demand: the tolerances of the campaign, a decision rule with its name, the risk.

Which rule: ``iso14253`` (or ``probability``, the same decision named after JCGM 106) and ``ilac`` for every parameter
by itself; ``guard`` where all statements together are to hold; ``simple`` where both sides share the risk.

The limit of the volumetric error is decided by the same rule where the certificate has a map: by its largest error with
the u of that point, as in the weekly report. A limit of the machine's file that the certificate cannot decide is named.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from monitor.exceptions import InputError
from monitor.records import VOLUMETRIC, Array
from monitor.reporting import messages
from monitor.reporting.certificate.record import ConformityStatement, ConformityVerdict, Verdict
from monitor.reporting.certificate.results import ResultSet
from monitor.reporting.certificate.volumetric_result import VolumetricResult
from monitor.reporting.numbers import decimal_of, round_to_place, written_probability
from monitor.reporting.texts import Texts
from monitor.units import MICROMETRE

#: Probability of conformity that ISO 14253-1:2017 asks for where nothing else is agreed; its complement decides for
#: failure.
WANTED = 0.95
#: Coverage probability of U in ILAC-G8:09/2019 and EA-4/02 M:2022: k = 2 for a normal distribution.
COVERED = 0.9545
#: Texts that hold as they are where the volumetric error is decided alone; of the others one of it stands beside.
_OF_EITHER = ("rule_simple", "rule_probability")
#: Rules that take the tolerance less w as the limit of acceptance, where they have a w.
_BY_GUARD_BAND = ("guard", "ilac")
#: Halvings of an interval that find a limit of acceptance to 1e-12 of the tolerance.
_HALVINGS = 40


@dataclass(frozen=True)
class _Judged:
    """One parameter, or the volumetric error: absolute ``value``, ``limit``, ``u``, degrees of freedom, guard band w,
    probability."""

    name: str
    unit: str
    value: float
    limit: float
    u: float
    dof: float
    band: float
    probability: float


def statement_of(
    result: ResultSet,
    rule: str,
    texts: Texts,
    *,
    campaign: str,
    freedoms: Mapping[str, float],
    process: Mapping[str, float] | None = None,
    stated: Mapping[str, float] = MappingProxyType({}),
    volumetric: VolumetricResult | None = None,
) -> ConformityStatement:
    """The statement on every parameter of a result that has a tolerance, in the language of ``texts``.

    ``freedoms`` are the degrees of freedom of every parameter's variance and of the volumetric error's, ``process`` the
    standard deviations of true values about zero where global risks are asked for, ``stated`` all limits of the
    machine's file, ``volumetric`` the volumetric error of the certificate. Raises InputError where ``campaign``, which
    the tolerances are from, states none that can be decided, or ``process`` names a parameter that has none.
    """
    spreads = process or {}
    limits = np.full(len(result.names), np.nan) if result.tolerances is None else result.tolerances
    limited = np.flatnonzero(np.isfinite(limits))
    names = [result.names[index] for index in limited]
    limit = stated.get(VOLUMETRIC)
    volumetric_p = volumetric.p if volumetric is not None and not names else None
    if not names and (limit is None or volumetric is None):
        raise InputError(messages.no_tolerance(campaign, result.names, by_map=limit is not None))
    _check_process(spreads, names, campaign)
    judged, joint = _of_parameters(rule, result, limited, limits, freedoms)
    sentences = []
    if limit is not None and volumetric is not None:
        judged.append(_of_volumetric(rule, volumetric, limit, freedoms[VOLUMETRIC]))
        sentences = _volumetric_in_words(rule, volumetric, texts, alone=not names)
    verdicts = [_stated(rule, each, spreads.get(each.name)) for each in judged]
    fewest = min(each.dof for each in judged if each.name != VOLUMETRIC or not names)
    sentences.insert(0, _basis(campaign, fewest, texts, volumetric_alone=not names))
    sentences += _never_passing(rule, judged, texts)
    sentences += _not_decided(stated, [each.name for each in judged], texts)
    return ConformityStatement(
        *_rule_in_words(rule, result, texts, max(map(_largest_risk, judged)), volumetric_p=volumetric_p),
        tuple(verdicts),
        result.state,
        " ".join(sentences),
        _process_in_words(verdicts, spreads, texts),
        joint_probability=joint,
        together=True,
    )


def _check_process(process: Mapping[str, float], names: Sequence[str], campaign: str) -> None:
    unknown = sorted(set(process) - set(names))
    if unknown:
        having = f"only {', '.join(names)} have" if names else "no parameter has"
        raise InputError(f"--process {unknown[0]}: {having} a result and a tolerance in campaign {campaign}")


def _of_parameters(
    rule: str, result: ResultSet, limited: npt.NDArray[np.intp], limits: Array, freedoms: Mapping[str, float]
) -> tuple[list[_Judged], float | None]:
    """The parameters ``limited`` of a result against their ``limits``, and the joint probability of conformity; None of
    none."""
    # Loaded here: most certificates state no conformity.
    from monitor.uncertainty.conformity import conformity

    names = [result.names[index] for index in limited]
    if not names:
        return [], None
    tolerance = limits[limited]
    dofs = np.array([freedoms[name] for name in names])
    within = conformity(
        result.estimate[limited], result.covariance[np.ix_(limited, limited)], -tolerance, tolerance, dof=dofs
    )
    judged = []
    for index, dof, p in zip(map(int, limited), map(float, dofs), map(float, within.single), strict=True):
        value, u = abs(float(result.estimate[index])), float(result.u[index])
        band = _guard_factor(rule, result.k_q, dof) * u
        name, unit = result.names[index], result.units[index]
        judged.append(_Judged(name, unit, value, float(limits[index]), u, dof, band, p))
    return judged, within.joint


def _of_volumetric(rule: str, volumetric: VolumetricResult, limit: float, dof: float) -> _Judged:
    """The largest error of a map against its limit; where the rule takes U it is that of the map."""
    from monitor.uncertainty.conformity import conformity

    value, u = volumetric.largest.value_um, volumetric.largest.u_um
    within = conformity([value], [[u**2]], [-limit], [limit], dof=dof)
    band = _guard_factor(rule, volumetric.k, dof) * u
    return _Judged(VOLUMETRIC, MICROMETRE.name, value, limit, u, dof, band, float(within.single[0]))


def _stated(rule: str, judged: _Judged, spread: float | None) -> ConformityVerdict:
    return ConformityVerdict(
        judged.name,
        judged.unit,
        judged.limit,
        _verdict(rule, judged),
        judged.probability,
        judged.band,
        *_global_risks(rule, judged, spread),
    )


def _volumetric_in_words(rule: str, volumetric: VolumetricResult, texts: Texts, *, alone: bool) -> list[str]:
    """By what the limit of the volumetric error is decided, beside parameters or ``alone``."""
    what = "volumetric_alone" if alone else "volumetric"
    sentences = [texts(f"conformity.{what}", points=volumetric.points)]
    if rule == "guard" and not alone:
        p = written_probability(volumetric.p, texts.decimal_sign)
        sentences.append(texts("conformity.volumetric_guard", p=p))
    if volumetric.left_out:
        sentences.append(texts("conformity.volumetric_left_out"))
    return sentences


def _never_passing(rule: str, judged: Sequence[_Judged], texts: Texts) -> list[str]:
    """Of which parameters no estimate could have passed by the rule, their uncertainty being what it is."""
    names = [each.name for each in judged if not _can_pass(rule, each)]
    if not names:
        return []
    what = "guard" if rule in _BY_GUARD_BAND else "probability"
    shown = [texts("page.volumetric_error") if name == VOLUMETRIC else name for name in names]
    wanted = written_probability(WANTED, texts.decimal_sign)
    return [texts(f"conformity.never_passing_{what}", parameters=", ".join(shown), wanted=wanted)]


def _not_decided(stated: Mapping[str, float], decided: Sequence[str], texts: Texts) -> list[str]:
    """The limits of the machine's file on which the certificate has no result."""
    sentences = []
    lacking = [name for name in stated if name not in decided and name != VOLUMETRIC]
    if lacking:
        sentences.append(texts("conformity.not_decided", parameters=", ".join(lacking)))
    if VOLUMETRIC in stated and VOLUMETRIC not in decided:
        limit = texts.number(decimal_of(stated[VOLUMETRIC]))
        sentences.append(texts("conformity.volumetric_not_decided", limit=limit, unit=MICROMETRE.name))
    return sentences


def _rule_in_words(
    rule: str, result: ResultSet, texts: Texts, wrong: float, *, volumetric_p: float | None
) -> tuple[str, str]:
    """The rule, and the risk of a statement: ``wrong`` is the largest of the limits that are stated, ``volumetric_p``
    the coverage probability of the volumetric error where it is decided alone."""
    sign = texts.decimal_sign
    wanted, failing, outside = (
        written_probability(round(probability, 4), sign) for probability in (WANTED, 1.0 - WANTED, wrong)
    )
    alone = volumetric_p is not None
    covered = written_probability(COVERED, sign)
    p = written_probability(result.p if volumetric_p is None else volumetric_p, sign)
    rule_text, risk = (
        texts(
            f"conformity.{what}_{rule}{'_volumetric' if alone and f'{what}_{rule}' not in _OF_EITHER else ''}",
            p=p, wanted=wanted, failing=failing, covered=covered, outside=outside, count=len(result.names),
        )
        for what in ("rule", "risk")
    )  # fmt: skip
    return rule_text, risk


def _basis(campaign: str, dof: float, texts: Texts, *, volumetric_alone: bool) -> str:
    """From where the limits are, and the distribution of the probabilities; ``dof`` are the fewest of the parameters,
    or those of the volumetric error where it is decided alone."""
    if volumetric_alone:
        what, freedom = (
            ("normal", "")
            if math.isinf(dof)
            else ("student", texts.number(round_to_place(dof, decimal_of(0.1))))
        )
        return texts(f"conformity.basis_volumetric_{what}", campaign=campaign, dof=freedom)
    if math.isinf(dof):
        return texts("conformity.basis_normal", campaign=campaign)
    freedom = texts.number(round_to_place(dof, decimal_of(0.1)))
    return texts("conformity.basis_student", campaign=campaign, dof=freedom)


def _process_in_words(
    verdicts: list[ConformityVerdict], process: Mapping[str, float], texts: Texts
) -> str | None:
    if not process:
        return None
    units = {verdict.name: verdict.unit for verdict in verdicts}
    spreads = ", ".join(
        f"{name} {texts.number(decimal_of(spread))}\N{NO-BREAK SPACE}{units[name]}"
        for name, spread in process.items()
    )
    return texts("conformity.process", spreads=spreads)


def _guard_factor(rule: str, k: float, dof: float) -> float:
    """The guard band w in standard uncertainties; ``k`` is the factor of U where the rule takes that."""
    from monitor.uncertainty.coverage_regions.coverage import single_factor

    if rule == "simple":
        return 0.0
    if rule == "guard":
        return k
    if rule == "ilac":
        return single_factor(COVERED, dof)
    # One limit is near, the other far: the one-sided quantile.
    return single_factor(2.0 * WANTED - 1.0, dof)


def _verdict(rule: str, judged: _Judged) -> Verdict:
    """The verdict on one parameter."""
    value, limit, band = judged.value, judged.limit, judged.band
    if rule == "simple":
        return Verdict.PASS if value <= limit else Verdict.FAIL
    if rule in _BY_GUARD_BAND:
        if value <= limit - band:
            return Verdict.PASS
        if value > limit + band:
            return Verdict.FAIL
        return Verdict.CONDITIONAL_PASS if value <= limit else Verdict.CONDITIONAL_FAIL
    if judged.probability >= WANTED:
        return Verdict.PASS
    return Verdict.FAIL if judged.probability <= 1.0 - WANTED else Verdict.UNDECIDED


def _probability_at(judged: _Judged, value: float) -> float:
    """Probability of conformity if the estimate were ``value``."""
    from monitor.uncertainty.conformity import conformity

    limit = judged.limit
    return float(conformity([value], [[judged.u**2]], [-limit], [limit], dof=judged.dof).single[0])


def _largest_risk(judged: _Judged) -> float:
    """The largest probability with which 'pass' or 'fail' by a guard band can be wrong, whatever the estimate.

    At the edges of acceptance and rejection; both limits count, so that it is more than one tail where the tolerance is
    not wide against u (JCGM 106:2012, 9.3.2).
    """
    passing = (
        1.0 - _probability_at(judged, judged.limit - judged.band) if judged.band <= judged.limit else 0.0
    )
    return max(passing, _probability_at(judged, judged.limit + judged.band))


def _global_risks(rule: str, judged: _Judged, spread: float | None) -> tuple[float | None, float | None]:
    """Consumer's and producer's risk of passing by the rule, None where no spread is stated."""
    if spread is None:
        return None, None
    from monitor.uncertainty.risk import Process

    accepted = _acceptance(rule, judged)
    interval = None if accepted is None else (-accepted, accepted)
    risks = Process(0.0, spread).risks(judged.u, (-judged.limit, judged.limit), interval)
    return risks.consumer, risks.producer


def _can_pass(rule: str, judged: _Judged) -> bool:
    """Whether an estimate of zero would pass; where it does not, none does."""
    if rule in ("simple", *_BY_GUARD_BAND):
        return judged.band <= judged.limit
    return _probability_at(judged, 0.0) >= WANTED


def _acceptance(rule: str, judged: _Judged) -> float | None:
    """The largest absolute estimate that passes; None where none does."""
    if not _can_pass(rule, judged):
        return None
    if rule in ("simple", *_BY_GUARD_BAND):
        return judged.limit - judged.band
    low, high = 0.0, judged.limit
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _probability_at(judged, middle) >= WANTED else (low, middle)
    return low
