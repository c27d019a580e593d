"""``cfmkit show``: pages on families, units, metrics, materials, stock, papers or one word; drawings of families."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cfmkit.cli import options as shell_completion
from cfmkit.cli import verbs
from cfmkit.cli.options import Common, argument, option
from cfmkit.documents.document import BLANK_LINE, Document, Paragraph, Tone, field, record_table, with_skipped_families
from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

HELP_POSITION = 60
HELP_EXAMPLE = "cfmkit show cam --figure"


@dataclass(frozen=True, kw_only=True)
class ShowOptions(Common):
    """Arguments and options."""

    topic: str | None = argument(
        "WORD",
        "What to explain: a family, units, metrics, materials, stock, references, anything by its name: "
        "brace_length, pla, MPa, or a word by its meaning: creep, BOM; default: list all.",
        shell_completion.topics,
        default=None,
    )
    figure: str | None = option(
        "[FILE]", "Write a drawing of a family with its dimensions named: .png, .svg or .pdf; default: FAMILY.png."
    )


def run(options: ShowOptions, terminal: Terminal) -> Document:
    """Explain a family with every key; list units, metrics, materials, stock or papers; or explain one word."""
    from cfmkit.cli.show_by_meaning import explain_by_meaning
    from cfmkit.cli.show_topics import explain, list_skipped_families, names

    if options.figure is not None:
        return _copy_drawing(options.topic, options.figure)
    try:
        answer = explain(options.topic)
    except UsageError:
        topic = options.topic or ""
        if topic in verbs.names():
            raise UsageError(f"{topic!r} is a command: `cfmkit {topic} --help` explains it") from None
        if topic.lower() in names() or (by_meaning := explain_by_meaning(topic)) is None:
            raise
        answer = by_meaning
    if options.topic and set(answer.data) == {"terms"}:
        answer = explain_by_meaning(options.topic) or answer
    return with_skipped_families(
        list_skipped_families(options.topic), replace(answer, data={"show": options.topic, **answer.data})
    )


def _copy_drawing(name: str | None, destination: str) -> Document:
    """Copy the drawing of a family to a file that is not there yet."""
    from pathlib import Path

    from cfmkit.runs.shipped_files import find_drawn_family, read_dimensions, read_drawing
    from cfmkit.store.safe_disk_changes import reporting, write_new

    record = find_drawn_family(name)
    files = read_drawing(record)
    path = Path(destination or record.name + next(iter(files)))
    if path.suffix.lower() not in files:
        raise UsageError(f"a figure ends with {', '.join(files)}, not {visible(path.suffix)!r}")
    rows = read_dimensions(record)
    with reporting(path):
        write_new(path, files[path.suffix.lower()])
    page = (
        *record_table("", rows, (field("symbol"), field("key", wraps=True), field("meaning", wraps=True))),
        BLANK_LINE,
        Paragraph("written", visible(str(path)), Tone.GOOD),
    )
    return Document({"show": name, "dimensions": rows, "file": str(path)}, page)
