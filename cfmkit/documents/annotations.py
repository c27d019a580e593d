"""Annotations of GitHub for a batch in continuous integration: each problem at the line of its specification."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from cfmkit.errors import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.metrics.compare import MetricChange
    from cfmkit.studies.batch_sources_and_outcomes import Entry

LOCATION_PATTERN = re.compile(r"(?P<file>.*?):(?P<line>\d+):(?P<col>\d+): (?P<reported>.*)", re.DOTALL)
"""How the fault of a file begins."""
MAX_CHANGES = 8  # changed values in one annotation: GitHub cuts long ones


def workflow_commands(
    entries: Sequence[Entry],  # every specification of a batch
    # line and column of a requirement of a file, by its number; (0, 0) if it is not known
    place_of: Callable[[str, int], tuple[int, int]],
    changes: Sequence[MetricChange] = (),  # since an earlier batch; those beyond the tolerance are errors
) -> Iterator[str]:
    """Yield one workflow command for each specification with something to say, at the place of its gravest problem."""
    for one in entries:
        beyond = [change for change in changes if change.spec == one.spec and change.beyond]
        if not one.skipped and (found := _annotation(one, place_of, beyond)):
            yield found


def _annotation(one: Entry, place_of: Callable[[str, int], tuple[int, int]], beyond: Sequence[MetricChange]) -> str:
    """Return the one command for a specification: faults before missed requirements, changes and warnings; or ""."""
    place: dict[str, Any] = {"file": one.spec}
    if one.errors:
        texts = [found["reported"] if (found := LOCATION_PATTERN.fullmatch(text)) else text for text in one.errors]
        if first := LOCATION_PATTERN.fullmatch(one.errors[0]):
            place = {"file": first["file"], "line": first["line"], "col": first["col"]}
        return command("error", place, "\n".join(text.removeprefix("error    ") for text in texts))
    texts = [requirement["sentence"] for requirement in one.missed]
    if texts:
        number = next(at for at, requirement in enumerate(one.requirements) if not requirement["ok"])
        line, column = place_of(one.spec, number)
        place |= ({"line": line, "col": column} if line else {}) | {"title": "requirement missed"}
    elif one.code:
        texts = [one.message]
    elif beyond:
        place["title"] = "changed"
    texts += [change.sentence for change in beyond[:MAX_CHANGES]]
    texts += [f"{len(beyond) - MAX_CHANGES} more values in changes.csv"] * (len(beyond) > MAX_CHANGES)
    if texts:
        return command("error", place, "\n".join(texts))
    if not one.warnings:
        return ""
    names = ", ".join(dict.fromkeys(item["name"] for item in one.warnings))
    return command("warning", place | {"title": names}, "\n".join(item["message"] for item in one.warnings))


def command(kind: str, properties: Mapping[str, Any], message: str) -> str:
    """Return a workflow command; no name or message in it can end it or begin another.

    Examples
    --------
    >>> command("error", {"file": "a,b.yaml", "line": "3"}, "100 % wrong")
    '::error file=a%2Cb.yaml,line=3::100 %25 wrong'
    """
    reported = ",".join(f"{key}={_escape(str(value), ':,')}" for key, value in properties.items())
    return f"::{kind} {reported}::{_escape(message)}"


def _escape(text: str, more: str = "") -> str:
    text = visible(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))
    for char in more:
        text = text.replace(char, f"%{ord(char):02X}")
    return text
