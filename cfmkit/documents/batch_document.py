"""The document of a batch: a row for each specification, what is missed, and changes since an earlier batch."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from urllib.parse import quote

from cfmkit.documents.document import Document, GridColumn, Note, PageTable, Span, Tone, Written
from cfmkit.errors import ExitCode, visible
from cfmkit.studies.batch_sources_and_outcomes import message, outcome

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.studies.batch_sources_and_outcomes import Entry
    from cfmkit.studies.earlier_batch import BatchComparison

MAX_CHANGES = 8  # changed values on a short page, so that verdicts stay on the screen


def document_of(
    entries: Sequence[Entry],  # every specification
    code: ExitCode,  # of the process
    files: Written | None = None,  # what was written
    compared: BatchComparison | None = None,  # with an earlier batch
) -> Document:
    """Return the document of a batch."""
    reused = sum(entry.reused for entry in entries)
    columns = (GridColumn(), GridColumn(wraps=False), GridColumn(wraps=False), GridColumn())
    return Document(
        exit_code=code,
        title=message(entries),
        summary=f"{reused} reused" if reused else "",
        verdict=_count_changes(compared) if compared else "",
        tables=(PageTable("", columns, tuple(_summary_row(entry) for entry in entries)), *_warnings(entries)),
        notes=(*_missed_notes(entries), *(_change_notes(compared) if compared else ())),
        files=files,
    )


def _count_changes(compared: BatchComparison) -> str:
    count = len(compared.changes_beyond_tolerance)
    return f"{count} value{'s' * (count != 1)} changed" if count else ""


def _warnings(entries: Sequence[Entry]) -> Iterator[PageTable]:
    """Yield the warnings of all specifications, which a short page only counts."""
    rows = tuple((visible(entry.spec), item["name"], item["message"]) for entry in entries for item in entry.warnings)
    if rows:
        yield PageTable("warnings", (GridColumn(wraps=False), GridColumn(wraps=False), GridColumn()), rows, 0)


def _missed_notes(entries: Sequence[Entry]) -> Iterator[Note]:
    for entry in entries:
        for requirement in entry.missed if entry.verb and not entry.errors else ():
            reported = requirement["sentence"].removesuffix(": missed")
            yield Note("missed", f"{visible(entry.spec)}: {reported}", tone=Tone.BAD, whole=True)


def _change_notes(compared: BatchComparison) -> Iterator[Note]:
    """Yield the values that changed since an earlier batch, those beyond the tolerance first."""
    beyond = compared.changes_beyond_tolerance
    text = f"{len(compared.changes)} values differ from {visible(compared.folder)}, {len(beyond)} beyond the tolerance"
    yield Note("compared", text, tone=Tone.BAD if beyond else Tone.GOOD, whole=True)
    for change in beyond[:MAX_CHANGES]:
        yield Note("changed", f"{visible(change.spec)}: {change.sentence}", tone=Tone.BAD, whole=True)
    if len(beyond) > MAX_CHANGES:
        yield Note("changed", f"{len(beyond) - MAX_CHANGES} more values in changes.csv", tone=Tone.FAINT)
    if compared.gone:
        yield Note("missing", f"not in this batch: {', '.join(map(visible, compared.gone))}", tone=Tone.BAD, whole=True)


def _summary_row(entry: Entry) -> tuple[str | Span, ...]:
    word = outcome(entry)
    good = word == "ok"
    tone = Tone.GOOD if good else Tone.FAINT if entry.skipped else Tone.BAD
    link = quote(str(PurePosixPath(entry.folder) / "report.html")) if entry.written else ""
    spec = Span(visible(entry.spec), link=link)
    return spec, entry.verb, Span(word if good or entry.skipped else word.upper(), tone), detail(entry)


def detail(entry: Entry) -> str:
    """Return how many requirements are met, or what went wrong before any could be."""
    if entry.skipped:
        return ""
    if entry.errors:
        return "see above"
    if entry.missed and entry.code is ExitCode.REQUIREMENT_MISSED:
        return f"{len(entry.missed)} of {len(entry.requirements)} requirements"
    if entry.code:
        return entry.message
    reported = f"{len(entry.requirements)} requirement{'s' * (len(entry.requirements) != 1)} met"
    count = len(entry.warnings)
    return reported + (f", {count} warning{'s' * (count != 1)}" if count else "")
