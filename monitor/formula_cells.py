"""Which texts a spreadsheet runs as formulas when it opens them as CSV; in that form they begin with an apostrophe."""

from __future__ import annotations

#: What is not seen at the beginning of a cell, as part of a character class: controls, spaces and format characters of
#: Unicode 15 (general categories Cc, Z and Cf).
_UNSEEN = (
    r"\x00-\x20\x7f-\xa0\xad"
    "\u0600-\u0605\u061c\u06dd\u070f\u0890\u0891\u08e2\u1680\u180e\u2000-\u200f\u2028-\u202f\u205f-\u2064"
    "\u2066-\u206f\u3000\ufeff\ufff9-\ufffb\U000110bd\U000110cd\U00013430-\U0001343f\U0001bca0-\U0001bca3"
    "\U0001d173-\U0001d17a\U000e0001\U000e0020-\U000e007f"
)
#: The beginning of such a text, in the syntax of Python and of RE2, which the database has (OWASP, CSV injection); some
#: programs trim what is not seen before it.
FORMULA = rf"^([\t\r]|[{_UNSEEN}]*[=+\-@])"
