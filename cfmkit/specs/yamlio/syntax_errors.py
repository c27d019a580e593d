"""What the YAML scanner and parser complain about, in plain words."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cfmkit.specs.yamlio.source_text import Fault

if TYPE_CHECKING:
    from yaml.error import Mark, YAMLError

_PLAIN_WORDS = (
    ("mapping values are not allowed", "a second ': ' on one line, or a line indented under a value; "
     "quote text that holds ': ', or put the key on a separate line"),
    ("sequence entries are not allowed", "a '- ' item cannot start here; put it on a separate line"),
    ("'([@`])' that cannot start any token", "text cannot start with this character; quote it"),
    ("'%' that cannot start any token", "text cannot start with '%'; quote it, or write the number before it: 5 %"),
    ("unexpected end of stream", "a quotation is never closed"),
    ("unexpected document separator", "a quotation is never closed"),
    ("unknown escape character|escape sequence of", "an unknown escape after '\\'; in '...' nothing is escaped"),
    ("expected ',' or ']', but got '<stream end>'", "a '[' is never closed"),
    ("expected ',' or '}', but got '<stream end>'", "a '{' is never closed"),
    ("expected ',' or ']'", "in a [...] list a ',' or ']' is missing before this"),
    ("expected ',' or '}'", "in a {...} block a ',' or '}' is missing before this"),
    ("expected the node content, but found '(.+)'", r"a value is missing before \1"),
    ("expected <block end>, but found '<scalar>'", "text after a closing quote; quote the whole text"),
    ("expected <block end>, but found '<block mapping start>'|expected <block end>, but found '<block sequence start>'",
     "this line is indented differently from the lines it belongs to"),
    ("expected <block end>, but found '\\?'", "a key among list items; indent it under an item"),
    ("expected <block end>, but found '-'", "a list item among keys: indent it under the key it belongs to"),
    ("expected <block end>, but found '(.+)'", r"\1 does not belong here; check the indentation"),
    ("could not find expected ':'", "a key without ': ' after it"),
    ("expected chomping or indentation indicators|expected a comment or a line break", "text after '|' or '>'; put it "
     "on the next line, or quote text that starts so"),
    ("directive|incompatible YAML", "a '%' line before the specification is not read; remove it"),
    ("tag", "tags (!...) are not read; write the plain value"),
    ("expected alphabetic or numeric character", "'&' and '*' (anchors) are not read; quote text that starts so"),
    ("expected '<document start>'", "text after the end of the specification, or before its start"),
)  # fmt: skip


def fault_of(error: YAMLError) -> Fault:
    """Return the fault that a YAML error tells, where it is and in plain words."""
    problem = f"{getattr(error, 'context', None) or ''}: {getattr(error, 'problem', None) or error}"
    message = next(filter(None, (_translated(problem, *entry) for entry in _PLAIN_WORDS)), None)
    mark: Mark | None = getattr(error, "problem_mark", None)
    if message and "never closed" in message:
        mark = getattr(error, "context_mark", None) or mark
    opened: Mark | None = getattr(error, "context_mark", None)
    if message and "is missing before" in message and opened and mark and opened.line != mark.line:
        message += f" (it starts in line {opened.line + 1})"
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    return Fault(line, column, (), message or "this is not YAML: " + " ".join(problem.strip(": ").split()))


def _translated(problem: str, pattern: str, words: str) -> str | None:
    match = re.search(pattern, problem)
    return match.expand(words.replace("\\'", "\\\\'")) if match else None
