"""What people say for the record: reasons and events, which stand in tables and reports for ever."""

from __future__ import annotations

import unicodedata

from monitor.exceptions import InputError


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
