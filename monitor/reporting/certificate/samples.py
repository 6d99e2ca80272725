"""Keeps the texts of the sample laboratory files out of a laboratory's own certificates.

The samples are filled in so that a demonstration can be printed. Whoever begins with one of them and forgets a line
would certify with a made-up customer; a certificate of the sample laboratory itself says everywhere what it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from monitor.reporting.certificate.completeness import gaps_of_text

#: The name of the laboratory of each sample file.
NAMES = ("Demo Laboratory (made up, not accredited)", "Vorführlaboratorium (erfunden, nicht akkreditiert)")
#: What only a sample states, key by key; its other texts may well be those of a real laboratory.
TEXTS: Mapping[str, tuple[str, ...]] = {
    "laboratory.name": NAMES,
    "laboratory.address": ("1 Example Road", "Beispielstraße 1", "00000 Nowhere", "00000 Nirgendwo"),
    "laboratory.contact": ("laboratory@example.org", "laboratorium@example.org"),
    "laboratory.country": ("XX",),
    "customer.name": ("Example Customer (made up)", "Beispielkunde Werkzeugmaschinenbau (erfunden)"),
    "customer.address": ("2 Example Street", "Übungsweg 2", "00000 Nowhere", "00000 Nirgendwo"),
    "customer.contact": ("quality@example.org", "qualitaet@example.org"),
    "item.place": ("Demo workshop, hall 1 (made up)", "Vorführwerkstatt, Halle 1 (erfunden)"),
    "method.document": (
        "Demo procedure 1: indirect calibration of five-axis machine tools with balls and a scale bar",
        "Vorführanweisung 1: indirekte Kalibrierung von Fünf-Achs-Werkzeugmaschinen mit Kugeln und einem Maßstab",
    ),
    "traceability.statement": (
        "The unit of length comes from the calibrated scale bar, all other parameters follow from the nominal full "
        "turn of the rotary axes and from the readings of the machine. The demo bar is simulated: traceable to "
        "nothing.",
        "Die Längeneinheit stammt vom kalibrierten Maßstab; alle anderen Parameter folgen aus dem Vollkreis der "
        "Drehachsen und aus den Ablesungen der Maschine. Der vorgeführte Maßstab ist simuliert: auf nichts "
        "rückgeführt.",
    ),
    "statements.title": ("Calibration certificate (demonstration)", "Kalibrierschein (Vorführung)"),
    "authorised_by.name": ("A. Example", "A. Beispiel"),
    "authorised_by.function": ("head of the demo laboratory", "Leiterin des Vorführlaboratoriums"),
}


def sample_faults(answers: Mapping[str, Any]) -> list[str]:
    """Return a fault for each answer (``section.key``) that is still a sample's, where the laboratory is another."""
    name = answers.get("laboratory.name")
    # Without a name the certificate is refused anyway, for want of one.
    if name in (None, *NAMES) or gaps_of_text(name):
        return []
    people = answers.get("authorised_by", ())
    stated = {
        **answers,
        "authorised_by.name": tuple(person.name for person in people),
        "authorised_by.function": tuple(person.function for person in people),
    }
    return [
        f"{key} is still that of the sample file: {text!r}; state your own"
        for key, texts in TEXTS.items()
        for text in _lines(stated.get(key))
        if text in texts
    ]


def _lines(value: Any) -> tuple[str, ...]:
    if isinstance(value, str):
        return (value,)
    return tuple(line for line in value if isinstance(line, str)) if isinstance(value, tuple) else ()
