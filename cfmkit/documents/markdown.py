"""A batch in Markdown, for the summary of a job in continuous integration."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cfmkit.errors import ExitCode, visible
from cfmkit.studies.batch_sources_and_outcomes import message, outcome

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison

MAX_CHANGES = 50  # changed values that are listed; all stand in changes.csv
MARKUP_PATTERN = re.compile(r"([\\`*_\[\]<>|~&@#$]|^[=+-])")
ZERO_WIDTH_SPACE = "&#8203;"
"""A blank of no width: a backslash before it does not keep a page from making a mention of @name."""


def summary(
    entries: Sequence[Entry],  # every specification of the batch
    compared: BatchComparison | None = None,  # with an earlier batch
) -> bytes:
    """Return the summary: one row per specification, what is missed, and what has changed."""
    return ("\n".join(_lines(entries, compared)) + "\n").encode()


def _lines(entries: Sequence[Entry], compared: BatchComparison | None) -> Iterator[str]:
    yield f"## cfmkit: {plain(message(entries))}"
    yield ""
    yield "| specification | verb | verdict | requirements | warnings |"
    yield "|---|---|---|---|---|"
    for one in entries:
        met = len(one.requirements) - len(one.missed)
        required = f"{met} of {len(one.requirements)} met" if one.requirements else ""
        yield f"| {plain(one.spec)} | {plain(one.verb)} | {_mark(one)} | {required} | {plain(one.warned or '')} |"
    troubles = [line for one in entries for line in _troubles(one)]
    if troubles:
        yield from ("", "### What is wrong", "", *troubles)
    if compared is not None:
        yield from _comparison_lines(compared)


def _mark(one: Entry) -> str:
    word = outcome(one)
    return word if word == "ok" or one.skipped else f"**{word}**"


def _troubles(one: Entry) -> Iterator[str]:
    if one.errors:
        yield from (f"- {plain(line)}" for line in one.errors)
    elif one.code is ExitCode.REQUIREMENT_MISSED:
        for requirement in one.missed:
            yield f"- {plain(one.spec)}: {plain(requirement['sentence'])}"
    elif one.code:
        yield f"- {plain(one.spec)}: {plain(one.message)}"


def _comparison_lines(compared: BatchComparison) -> Iterator[str]:
    count = len(compared.changes_beyond_tolerance)
    yield from ("", f"### Compared with {plain(compared.folder)}", "")
    if not compared.changes:
        yield "No metric has changed."
    else:
        reported = f"{count} value{'s' * (count != 1)} changed by more than {100 * compared.tolerance:.4g} %"
        less = len(compared.changes) - count
        yield plain(f"{reported}, {less} by less." if less else f"{reported}.")
        shown = (*compared.changes_beyond_tolerance, *(one for one in compared.changes if not one.beyond))[:MAX_CHANGES]
        yield from ("", "| specification | change |", "|---|---|")
        for one in shown:
            yield f"| {plain(one.spec)} | {'**' * one.beyond}{plain(one.sentence)}{'**' * one.beyond} |"
        if len(compared.changes) > len(shown):
            yield from ("", f"{len(compared.changes) - len(shown)} more values in changes.csv.")
    if compared.gone:
        yield from ("", f"No longer there: {plain(', '.join(compared.gone))}")


def plain(text: str) -> str:
    """Return text that Markdown and HTML show as it is, on one line; it mentions nobody and links nowhere.

    Examples
    --------
    >>> plain("a_b | <i>")
    'a\\\\_b \\\\| \\\\<i\\\\>'
    """
    shown = MARKUP_PATTERN.sub(r"\\\1", visible(" ".join(text.split())))
    return (
        shown.replace("@", f"@{ZERO_WIDTH_SPACE}")
        .replace("://", f":{ZERO_WIDTH_SPACE}//")
        .replace("www.", f"www{ZERO_WIDTH_SPACE}.")
    )
