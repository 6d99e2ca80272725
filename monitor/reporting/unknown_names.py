"""Names of a run's own unknowns as sentences write them: ``work point x``, ``ball 3 radius``, ``laser beam a``.

Methods name what they solve for beside the errors of the machine in English; what follows such a word (a target's
name, an axis) and what comes before it (the id of a setup) is the user's, and stays.
"""

from __future__ import annotations

import re

from monitor.reporting.texts import Texts

#: An unknown of a target: its kind, its name, and which number of it.
_OF_TARGET = re.compile(
    r"(?P<setup>.+ )??(?P<kind>ball|height|module|reflector|target) (?P<name>\S+)"
    r"(?: (?P<part>[abcxyz]|radius|(?:place|tilt) [uv]))?"
)
#: An unknown of an instrument, a stylus, or a piece in its place (``XY shift u``).
_OF_SETUP = re.compile(
    r"(?P<setup>.+ )??(?P<kind>beam|cosine error|frame|length|scale|shift|slope|tilt|tip|turn|work point|zero)"
    r"(?P<part> [abcuvxyz])?"
)


def unknown_words(name: str, texts: Texts) -> str:
    """Return the name of an unknown in the language of ``texts``; one of another form as it is."""
    if (of_target := _OF_TARGET.fullmatch(name)) is None:
        of_setup = _OF_SETUP.fullmatch(name)
        if of_setup is None:
            return name
        return f"{of_setup['setup'] or ''}{_word(of_setup['kind'], texts)}{of_setup['part'] or ''}"
    target = f"{of_target['setup'] or ''}{_word(of_target['kind'], texts)} {of_target['name']}"
    part = of_target["part"]
    if part is None:
        return target
    kind, _, axis = part.partition(" ")
    return " ".join(filter(None, (target, kind if len(kind) == 1 else _word(kind, texts), axis)))


def _word(kind: str, texts: Texts) -> str:
    return texts(f"unknowns.{kind.replace(' ', '_')}")
