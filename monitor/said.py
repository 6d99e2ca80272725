"""What people say for the record: reasons and events, which stand in tables and reports for ever."""

from __future__ import annotations

import unicodedata

from monitor.exceptions import InputError

#: A number stands in a line on every page, in a file's name and in other certificates.
LONGEST_NUMBER = 60


def check_letters(text: str, name: str) -> None:
    """Raise InputError for what is no letter on paper: control characters, and those that turn the writing round."""
    for letter in text:
        if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp"):
            raise InputError(
                f"{name} holds the character U+{ord(letter):04X}, which nobody sees: write one line of visible letters"
            )


def reason(text: str, refusal: str) -> str:
    """Return a reason without blanks around it. Raises InputError, with the sentence ``refusal``, for one without a
    letter: "-" reads as none."""
    if not any(letter.isalpha() for letter in text):
        raise InputError(refusal)
    check_letters(text.strip(), "the reason")
    return text.strip()


def check_number_of_certificate(number: str) -> None:
    """Raise InputError for a number that is no line of visible letters."""
    if not number.strip():
        raise InputError("the number of a certificate is not blank; leave --number out for the next free one")
    if number != number.strip() or not number.isprintable() or len(number) > LONGEST_NUMBER:
        raise InputError(
            f"the number of a certificate is one line of at most {LONGEST_NUMBER} visible letters without blanks "
            f"around it, not {number[:LONGEST_NUMBER]!r}{'...' if len(number) > LONGEST_NUMBER else ''}"
        )
