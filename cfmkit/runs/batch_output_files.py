"""The files of a batch: tables, numbers, page, and a summary in Markdown for continuous integration."""

from __future__ import annotations

import re
import shlex
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cfmkit.errors import ExitCode, visible
from cfmkit.runs.html_report_of_run import ENDS, NAME, part, template
from cfmkit.studies.batch_sources_and_outcomes import message, outcome
from cfmkit.studies.metric_changes_since_earlier_batch import changes_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.store import RunFolder
    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.metric_changes_since_earlier_batch import BatchComparison


def about(arguments: Sequence[str], seed: int, named: Sequence[str], code: ExitCode) -> dict[str, Any]:
    """Return what the manifest says about the batch."""
    return {
        "command": "batch",
        "arguments": list(arguments),
        "seed": seed,
        "spec": {"source": list(named)},
        "status": code.name.lower(),
        "exit_code": int(code),
    }


def write(
    folder: RunFolder,
    entries: Sequence[Entry],
    about: dict[str, Any],
    with_page: bool,
    compared: BatchComparison | None = None,
) -> tuple[str, ...]:
    """Write what a batch found out, and return the names of the files."""
    from cfmkit.studies.batch_sources_and_outcomes import requirements_table, results_table
    from cfmkit.tables import to_csv
    from cfmkit.tables.json_writing import json_bytes

    folder.write("results.csv", to_csv(results_table(entries)))
    folder.write("requirements.csv", to_csv(requirements_table(entries)))
    folder.write("metrics.json", json_bytes(data(entries, ExitCode(about["exit_code"]), compared)))
    if compared is not None:
        folder.write("changes.csv", to_csv(changes_table(compared.changes)))
    if with_page:
        command = shlex.join(["cfmkit", *about["arguments"]])
        folder.write(NAME, page(entries, message(entries), command))
    return (*folder.commit(about).files, "manifest.json")


def data(entries: Sequence[Entry], code: ExitCode, compared: BatchComparison | None = None) -> dict[str, Any]:
    """Return what metrics.json says."""
    required = [{"spec": one.spec, **requirement} for one in entries for requirement in one.requirements]
    return {
        "status": "complete" if code is ExitCode.OK else code.name.lower(),
        "message": message(entries),
        "metrics": {},
        "requirements": required,
        "warnings": [{"spec": one.spec, **item} for one in entries for item in one.warnings],
        "specs": [one.as_json() for one in entries],
        **({"compared": compared.as_json()} if compared is not None else {}),
    }


def page(entries: Sequence[Entry], message: str, command: str) -> bytes:
    """Return the page of a batch.

    Parameters
    ----------
    entries : sequence of Entry
        In the order of the specifications.
    message : str
        The batch in one line.
    command : str
        How it was started.
    """
    rows = [
        (one, _tone(one), _verdict(one), quote(str(PurePosixPath(one.folder) / NAME)) if one.written else "")
        for one in entries
    ]
    text: str = template("batch.html.j2").render(
        rows=rows,
        tone="good" if all(tone == "good" for _, tone, _, _ in rows) else "bad",
        message=message,
        command=command,
        style=part("report.css"),
    )
    return text.encode()


def _verdict(entry: Entry) -> str:
    """Return how a specification ended: that it was solved is no verdict where it misses a requirement."""
    return "requirement missed" if entry.code is ExitCode.REQUIREMENT_MISSED else entry.status.replace("_", " ")


def _tone(entry: Entry) -> str:
    return ENDS.get(int(entry.code), ("bad", ""))[0] if entry.status != "skipped" else "warn"


MOST_CHANGES = 50
"""Changed values that are listed; all stand in changes.csv."""

MARKUP = re.compile(r"([\\`*_\[\]<>|~&@#$]|^[=+-])")
APART = "&#8203;"
"""A blank of no width: a backslash before it does not keep a page from making a mention of @name."""


def summary(entries: Sequence[Entry], compared: BatchComparison | None = None) -> bytes:
    """Return the summary: one row per specification, what is missed, and what has changed.

    Parameters
    ----------
    entries : sequence of Entry
        Every specification of the batch.
    compared : BatchComparison, optional
        With an earlier batch.
    """
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
        yield from _compared(compared)


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


def _compared(compared: BatchComparison) -> Iterator[str]:
    count = len(compared.beyond)
    yield from ("", f"### Compared with {plain(compared.folder)}", "")
    if not compared.changes:
        yield "No metric has changed."
    else:
        reported = f"{count} value{'s' * (count != 1)} changed by more than {100 * compared.tolerance:.4g} %"
        less = len(compared.changes) - count
        yield plain(f"{reported}, {less} by less." if less else f"{reported}.")
        shown = (*compared.beyond, *(one for one in compared.changes if not one.beyond))[:MOST_CHANGES]
        yield from ("", "| specification | change |", "|---|---|")
        for one in shown:
            yield f"| {plain(one.spec)} | {'**' * one.beyond}{plain(one.sentence)}{'**' * one.beyond} |"
        if len(compared.changes) > len(shown):
            yield from ("", f"{len(compared.changes) - len(shown)} more stand in changes.csv.")
    if compared.gone:
        yield from ("", f"No longer there: {plain(', '.join(compared.gone))}")


def plain(text: str) -> str:
    """Return text that Markdown and HTML show as it is, on one line; it mentions nobody and links nowhere.

    Examples
    --------
    >>> plain("a_b | <i>")
    'a\\\\_b \\\\| \\\\<i\\\\>'
    """
    shown = MARKUP.sub(r"\\\1", visible(" ".join(text.split())))
    return shown.replace("@", f"@{APART}").replace("://", f":{APART}//").replace("www.", f"www{APART}.")
