"""The YAML parser's complaints in words for somebody who does not know its grammar."""

from __future__ import annotations

from ruamel.yaml.error import MarkedYAMLError

_TAB = "found character '\\t'"

_HINTS = (
    (_TAB, "found a tab; indent with blanks"),
    (
        "mapping values are not allowed",
        "found a second key where the value of the one before still goes on; expected a blank behind every ':' and the "
        "same indentation for keys of one section",
    ),
    ("expected <block end>", "found a line that is not indented like the keys beside it"),
    ("could not find expected ':'", "found text without a ':', expected 'key: value'"),
    ("expected ',' or", "found a bracket that is not closed, or entries without a comma between them"),
    ("for merging", "found a merge key (<<) of something else, expected an alias (*) of a mapping or a list of them"),
    ("duplicate merge key", "found two merge keys (<<), expected one with a list of aliases, <<: [*first, *second]"),
    ("found unexpected end of stream", "found a quote that is not closed"),
)


def yaml_sentence(error: MarkedYAMLError) -> str:
    """Explain a mistake in the text, the likely one first and the parser's own words after it."""
    problem = " ".join(str(error.problem or error.context).split())
    begin = "" if error.context_mark is None else f", which began in line {error.context_mark.line + 1}"
    words = f"{problem}{' ' + error.context.strip() if error.context else ''}{begin if error.context else ''}"
    hint = next((hint for part, hint in _HINTS if part in problem), None)
    return f"this is not valid YAML: {f'{hint} ({words})' if hint else words}"
