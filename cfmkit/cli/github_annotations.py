"""Annotations for GitHub: what is wrong with the specifications of a batch, beside the line that says it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError, visible

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.metrics.compare import MetricChange
    from cfmkit.studies.batch_sources_and_outcomes import Entry

PLACED = re.compile(r"(?P<file>.*?):(?P<line>\d+):(?P<col>\d+): (?P<reported>.*)", re.DOTALL)
"""How the fault of a file begins."""


def workflow_commands(entries: Sequence[Entry], changes: Sequence[MetricChange] = ()) -> Iterator[str]:
    """Yield one workflow command per fault, missed requirement, warning and changed value, with its place.

    Parameters
    ----------
    entries : sequence of Entry
        Every specification of a batch.
    changes : sequence of MetricChange
        Since an earlier batch; those beyond the tolerance are errors.
    """
    for one in entries:
        if one.skipped:
            continue
        for line in one.errors:
            found = PLACED.fullmatch(line)
            place = {"file": found["file"], "line": found["line"], "col": found["col"]} if found else {"file": one.spec}
            yield command("error", place, found["reported"] if found else line.removeprefix("error    "))
        if one.code and not one.errors and not one.missed:
            yield command("error", {"file": one.spec}, one.message)
        yield from _missed(one)
        for item in one.warnings:
            yield command("warning", {"file": one.spec, "title": item["name"]}, item["message"])
    for change in changes:
        if change.beyond:
            yield command("error", {"file": change.spec, "title": "changed"}, change.sentence)


def _missed(one: Entry) -> Iterator[str]:
    if one.errors:
        return
    for number, requirement in enumerate(one.requirements):
        if not requirement["ok"]:
            place = {"file": one.spec, **_line_of(one.spec, number), "title": "requirement missed"}
            yield command("error", place, requirement["sentence"])


def _line_of(name: str, number: int) -> Mapping[str, str]:
    """Return line and column of a requirement; nothing if the file cannot be read any more."""
    from cfmkit.runs.specfile import read_spec

    try:
        line, column = read_spec(name).place(f"requirements.{number}")
    except CfmError:
        return {}
    return {"line": str(line), "col": str(column)} if line else {}


def command(kind: str, properties: Mapping[str, Any], message: str) -> str:
    """Return a workflow command; no name or message in it can end it or begin another.

    Examples
    --------
    >>> command("error", {"file": "a,b.yaml", "line": "3"}, "100 % wrong")
    '::error file=a%2Cb.yaml,line=3::100 %25 wrong'
    """
    reported = ",".join(f"{key}={_escaped(str(value), ':,')}" for key, value in properties.items())
    return f"::{kind} {reported}::{_escaped(message)}"


def _escaped(text: str, more: str = "") -> str:
    text = visible(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))
    for char in more:
        text = text.replace(char, f"%{ord(char):02X}")
    return text
