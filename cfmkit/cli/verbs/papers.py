"""``cfmkit papers``: the numbers that the papers print, computed again."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.cli.options import QUIET_FLAG, Common, argument, flag
from cfmkit.documents.document import (
    BLANK_LINE,
    Document,
    Field,
    Paragraph,
    Span,
    TextLine,
    Tone,
    field,
    line,
    record_table,
)
from cfmkit.errors import ExitCode
from cfmkit.runs.papers import VERDICT_MEANINGS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Block

    Record = Mapping[str, Any]

HELP_POSITION = 64
HELP_EXAMPLE = "cfmkit papers lan-2010"


@dataclass(frozen=True, kw_only=True)
class PapersOptions(Common):
    """Arguments and options."""

    name: str | None = argument(
        "PAPER|FAMILY", "Only this paper, or those of this family: lan-2010, cam; default: all.", default=None
    )
    everything: bool = flag("Also compute the numbers that take a minute.", "--all")
    quiet: bool = QUIET_FLAG()


def run(options: PapersOptions, terminal: Terminal) -> Document:
    """Recompute the numbers printed in the papers and report which agree; exit 5 if a verdict does not hold."""
    from cfmkit.cli.progress import watching
    from cfmkit.runs.papers import check, choose_rows

    asked = choose_rows(options.name)
    records: list[dict[str, Any]] = []
    with watching(terminal, "rows") as progress:
        progress.total(len(asked))
        for done in check(asked, options.everything):
            outcome = {"computed": done.computed, "trouble": done.trouble, "skipped": done.skipped}
            records.append(asdict(done.row) | {"command": done.row.command} | outcome)
            progress.add_finished(1, 0, False)
    counts = {
        verdict: sum(len(record["printed"]) for record in records if record["verdict"] == verdict)
        for verdict in VERDICT_MEANINGS
    }
    wrong = [record for record in records if record["trouble"]]
    reported = f"{sum(counts.values())} printed numbers; " + (
        f"{len(wrong)} verdicts do not hold" if wrong else "every verdict that was computed holds"
    )
    data = {"message": reported, "papers": records, "counts": counts}
    errors = tuple(
        {"message": f"{record['paper']}, {record['place']}, {record['what']}: {record['trouble']}"} for record in wrong
    )
    return Document(
        data,
        _page_blocks(records, counts, reported, bool(terminal.verbose)),
        ExitCode.REQUIREMENT_MISSED if wrong else ExitCode.OK,
        complaints=tuple(f"error    {error['message']}" for error in errors),
        errors=errors,
    )


def _page_blocks(records: Sequence[Record], counts: Mapping[str, int], reported: str, verbose: bool) -> Iterator[Block]:
    from cfmkit.cli.show_topics import references

    titles = {reference["name"]: reference["reference"] for reference in references()}
    yield TextLine((Span("cfmkit papers", Tone.LABEL), Span("  numbers of the papers, and the results here")))
    for paper in dict.fromkeys(record["paper"] for record in records):
        mine = [record for record in records if record["paper"] == paper]
        yield from _list_paper_rows(f"{paper}: {titles.get(paper, '')}", mine, verbose)
    yield BLANK_LINE
    yield Paragraph("verdict", reported, Tone.BAD if "do not hold" in reported else Tone.GOOD)
    named = [
        {"count": str(n), "verdict": verdict, "meaning": VERDICT_MEANINGS[verdict]} for verdict, n in counts.items()
    ]
    yield from record_table("", named, (field("count"), field("verdict"), field("meaning", wraps=True)))


def _list_paper_rows(title: str, records: Sequence[Record], verbose: bool) -> Iterator[Block]:
    """Yield the rows of one paper, with the reasons below them; inputs only where everything is wanted."""
    shown = [record for record in records if verbose or record["trouble"] or record["verdict"] != "given"]
    fields = (
        field("place", wraps=True),
        field("what", wraps=True),
        Field("printed", lambda record: ", ".join(record["printed"]), wraps=True),
        Field("here", _describe_computed, wraps=True),
        Field("verdict", lambda record: "DOES NOT HOLD" if record["trouble"] else record["verdict"]),
    )
    yield from record_table(title, shown, fields)
    silent = sum(len(record["printed"]) for record in records) - sum(len(record["printed"]) for record in shown)
    if silent:
        yield line(f"  and {silent} inputs, which are as printed (-v lists them)", Tone.FAINT)
    reasons = [
        record for record in shown if record["why"] and (verbose or record["verdict"] in ("misprint", "disagrees"))
    ]
    yield from record_table(
        "reasons", reasons, (field("place", ""), field("what", "", wraps=True), field("why", "", wraps=True))
    )
    if verbose:
        commands = [record for record in shown if record["command"]]
        yield from record_table(
            "commands", commands, (field("place", ""), field("what", "", wraps=True), field("command", "", wraps=True))
        )


def _describe_computed(record: Record) -> str:
    if record["skipped"]:
        return "with --all"
    same = record["verdict"] == "given" and not record["trouble"]
    return "the same" if same else ", ".join(record["computed"])
