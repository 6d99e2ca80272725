"""A health report as HTML and as PDF, from one template.

The HTML is written piece by piece, a machine at a time; the PDF comes in parts of so many machines. Neither
needs more memory for a thousand machines than for twenty.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC

from monitor.reporting.health.page import fleet_context, machine_pages
from monitor.reporting.health.records import Fleet, MachineHealth
from monitor.reporting.pdf.drawn_apart import drawn_apart
from monitor.reporting.pdf.render import html_of, pdf_of, pieces_of

TEMPLATE = "health.html"
#: Machines in one PDF: about 50 pages' worth of layout are held at a time.
MACHINES_A_PART = 25
#: Up to so many machines are laid out again, a second each, where the last page would be more than half empty.
_LAID_OUT_AGAIN = 6


def health_html(fleet: Fleet, machines: Iterable[MachineHealth]) -> Iterator[str]:
    """The whole report as pieces of one HTML page, the machines in the order given."""
    context = {
        **fleet_context(fleet),
        "pages": machine_pages(machines),
        "part": 1,
        "parts": 1,
        "setting": "",
    }
    yield from pieces_of(TEMPLATE, context)


def health_pdf(fleet: Fleet, machines: Sequence[MachineHealth], part: int = 1, parts: int = 1) -> bytes:
    """A part of the report as PDF, the first with the fleet table: the same bytes for the same records.

    Of few machines it is set closer where that saves a last page that would be more than half empty.
    """
    context = {**fleet_context(fleet), "pages": list(machine_pages(machines)), "part": part, "parts": parts}
    closer = {**context, "setting": "close"} if len(machines) <= _LAID_OUT_AGAIN else None
    return pdf_of(
        drawn_apart(html_of(TEMPLATE, {**context, "setting": ""})),
        identifier=f"health {fleet.week} {fleet.made_at.isoformat()} {part}",
        moment=fleet.made_at.replace(tzinfo=UTC),
        closer=None if closer is None else drawn_apart(html_of(TEMPLATE, closer)),
    )
