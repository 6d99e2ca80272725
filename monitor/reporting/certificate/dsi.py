"""Quantities in the Digital System of Units: values with units and joint uncertainty, in D-SI 2.1 and 2.2.1.

D-SI 2.2.1 renamed the elements of 2.1 and calls the old ones deprecated. In both, a column of the covariance matrix
holds one element a row, from the first row to the last.
"""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree as ET

import numpy as np

from monitor.exceptions import InputError
from monitor.reporting.certificate.dcc_elements import SI, DccVersion, add
from monitor.reporting.certificate.results import ResultSet

#: Display unit: the same in the notation of D-SI (PTB, SmartCom D-SI metadata model, 2.1).
_UNITS = {
    "µm": r"\micro\metre",
    "µrad": r"\micro\radian",
    "mm": r"\milli\metre",
    "m": r"\metre",
    "rad": r"\radian",
    "°": r"\degree",
    "K": r"\kelvin",
    "°C": r"\degreecelsius",
    "s": r"\second",
    "min": r"\minute",
    "h": r"\hour",
    "hPa": r"\hecto\pascal",
    "%": r"\percent",
    "1": r"\one",
}
_POWERS = {"²": "2", "³": "3", "⁴": "4", "⁵": "5", "⁶": "6", "⁷": "7", "⁸": "8", "⁹": "9"}


def unit_of(name: str) -> str:
    """A display unit such as ``µm/m²`` in the notation of D-SI. Raises InputError for one that has none here."""
    return r"\per".join(_power_of(factor, name) for factor in name.split("/"))


def _power_of(factor: str, name: str) -> str:
    stem, power = re.fullmatch(rf"(.*?)([{''.join(_POWERS)}]|\^[0-9])?", factor).groups()  # type: ignore[union-attr]
    if stem not in _UNITS:
        raise InputError(
            f"unit {name} has no D-SI notation here; there are {', '.join(_UNITS)}, their powers and quotients"
        )
    return _UNITS[stem] + ("" if power is None else rf"\tothe{{{_POWERS.get(power, power[-1])}}}")


def written_unit(notation: str) -> str:
    """A unit in the notation of D-SI as it is printed: ``\\micro\\metre\\per\\metre`` is µm/m."""
    names = {notation: name for name, notation in _UNITS.items()}
    signs = {power: sign for sign, power in _POWERS.items()}
    factors = []
    for factor in re.split(r"\\per(?=\\)", notation):
        stem, _, power = factor.partition(r"\tothe")
        factors.append(names[stem] + (signs[power.strip("{}")] if power else ""))
    return "/".join(factors)


def real(parent: ET.Element, value: float, unit: str) -> ET.Element:
    """One value with its display unit."""
    element = add(parent, "real", space=SI)
    add(element, "value", number(value), SI)
    add(element, "unit", unit_of(unit), SI)
    return element


def standard_uncertainty(parent: ET.Element, u: float) -> None:
    """The standard uncertainty of a real (D-SI 2.2.1)."""
    univariate = add(parent, "measurementUncertaintyUnivariate", space=SI)
    add(add(univariate, "standardMU", space=SI), "valueStandardMU", number(u), SI)


def expanded_uncertainty(
    parent: ET.Element, expanded: float, k: float, p: float, version: DccVersion
) -> None:
    """The expanded uncertainty of a real, its coverage factor and probability."""
    if version is DccVersion.V3_2_1:
        around = add(parent, "expandedUnc", space=SI)
        add(around, "uncertainty", number(expanded), SI)
    else:
        univariate = add(parent, "measurementUncertaintyUnivariate", space=SI)
        around = add(univariate, "expandedMU", space=SI)
        add(around, "valueExpandedMU", number(expanded), SI)
    add(around, "coverageFactor", number(k), SI)
    add(around, "coverageProbability", number(p), SI)


def joint_values(
    parent: ET.Element, result: ResultSet, region: str, factor: float, sampled: bool, version: DccVersion
) -> None:
    """The parameters of a result as one vector with a coverage region and the covariance that it is of.

    ``region`` is ``ellipsoidal`` or ``rectangular``, ``factor`` its coverage factor, which ``sampled`` says came from
    a simulation. D-SI 2.2.1 states the standard uncertainties beside it, in a list of their own.
    """
    units = [unit_of(unit) for unit in result.units]
    values = add(parent, "realListXMLList", space=SI)
    add(values, "labelXMLList", " ".join(result.names), SI)
    add(values, "valueXMLList", " ".join(number(float(value)) for value in result.estimate), SI)
    add(values, "unitXMLList", " ".join(units), SI)
    lists = version is not DccVersion.V3_2_1
    if lists:
        univariate = add(values, "measurementUncertaintyUnivariateXMLList", space=SI)
        standard = add(univariate, "standardMUXMLList", space=SI)
        add(standard, "valueStandardMUXMLList", " ".join(number(float(u)) for u in result.u), SI)
        multivariate = add(values, "measurementUncertaintyMultivariateXMLList", space=SI)
        around = add(multivariate, f"{region}RegionMUXMLList", space=SI)
    else:
        around = add(values, f"{region}RegionXMLList", space=SI)
    suffix = "XMLList" if lists else ""
    matrix = add(around, f"covarianceMatrix{suffix}", space=SI)
    for index, unit in enumerate(units):
        column = add(matrix, f"column{suffix}", space=SI)
        for other, second in enumerate(units):
            element = add(column, f"covariance{suffix}", space=SI)
            add(element, f"value{suffix}", number(float(result.covariance[other, index])), SI)
            add(element, f"unit{suffix}", second + unit, SI)
    add(around, f"coverageFactor{suffix}", number(factor), SI)
    add(around, f"coverageProbability{suffix}", number(result.p), SI)
    add(around, f"distribution{suffix}", "numerical" if sampled else _distribution(result), SI)


def _distribution(result: ResultSet) -> str:
    """The law that the coverage factor is of: the t distribution where the covariance is known from few runs."""
    if math.isfinite(result.dof):
        return "t"
    return "normal" if result.trials is None else "numerical"


def number(value: float) -> str:
    """The shortest decimal that means this double, as the schema writes exponents."""
    text = repr(float(np.float64(value)))
    return text.replace("e", "E").replace("E+", "E")
