"""Characters that change what a terminal, a table or a file name shows, and are seen by nobody."""

from __future__ import annotations

import re

_HIDDEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
"""Control characters, ends of lines, marks of direction, and halves of pairs."""

_LAYOUT = re.compile("[\t\n\r]")
"""Those that a text of several lines may have."""


def has_hidden(text: str, *, lines: bool = False) -> bool:
    """Return whether a text has such characters.

    Args:
        text: a name, or a text of several lines.
        lines: whether tabs and ends of lines are none of them.
    """
    return bool(_HIDDEN.search(_LAYOUT.sub("", text) if lines else text))


def visible(text: str, *, lines: bool = False) -> str:
    """Return a text with such characters escaped, as ``\\x1b``.

    Args:
        text, lines: as in `has_hidden`.
    """

    def escaped(match: re.Match[str]) -> str:
        found = match.group()
        return found if lines and _LAYOUT.match(found) else found.encode("unicode_escape").decode("ascii")

    return _HIDDEN.sub(escaped, text)
