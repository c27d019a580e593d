"""``cfmkit examples``: the specs that come with the package, listed, copied, or run to check an installation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.options import JOBS_OPTION, Common, argument, flag, option
from cfmkit.documents.document import Document, Paragraph, Tone, field, next_command, record_table
from cfmkit.errors import UsageError, visible

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal

HELP_POSITION = 52
HELP_EXAMPLE = "cfmkit examples cam"
ALL_EXAMPLES = "all"
QUICK_EXAMPLES = "quick"  # all but those that search for a shape
DURATION_TEXT = (
    "{quick} examples take some seconds each, the last {long} search for shapes for many minutes; "
    "`cfmkit examples --run quick` leaves those out"
)


@dataclass(frozen=True, kw_only=True)
class ExamplesOptions(Common):
    """Arguments and options."""

    name: str | None = argument("NAME", "Example to copy, with its data; default: list all.", default=None)
    out: str | None = option("DIR", "Folder to copy to; default: this one.", "-o", "--out")
    run: str | None = option(
        "NAME|quick|all",
        "Run one example, the quick ones or all of them to check this installation; no files are kept.",
    )
    schema: bool | None = flag(
        "When copying, also write the JSON schema and the line through which editors find it; default: yes.",
        "--schema/--no-schema",
        default=None,
    )
    jobs: int | None = JOBS_OPTION()


def run(options: ExamplesOptions, terminal: Terminal) -> Document:
    """List the examples that come with cfmkit, copy one, or run them to check an installation; nothing is replaced."""
    from cfmkit.runs.shipped_files import copy, examples

    if options.run is not None:
        if options.name is not None or options.out is not None:
            raise UsageError("--run keeps nothing: it takes neither NAME nor --out")
        return _check_examples(options.run, options, terminal)
    if options.name is not None:
        written = [str(path) for path in copy(options.name, options.out or ".", options.schema is not False)]
        verb = _verb(options.name, written[0])
        page = (
            Paragraph("written", ", ".join(map(visible, written)), Tone.GOOD),
            next_command("cfmkit", verb, written[0]),
        )
        return Document({"files": written}, page)
    if options.out is not None or options.schema is not None:
        raise UsageError("--out and --schema are for a copy: name an example")
    records = [{"name": example.name, "family": example.family, "about": example.about} for example in examples()]
    fields = (field("name"), field("family"), field("about", wraps=True))
    return Document({"examples": records}, tuple(record_table("examples", records, fields)))


def _verb(name: str, path: str) -> str:
    """Return what an example is for: a study for the study that it states."""
    from cfmkit.api import load
    from cfmkit.families import family
    from cfmkit.runs.shipped_files import example

    spec = load(path)
    if "/" in name:
        stated = next((study for study in ("sweep", "sensitivity") if getattr(spec, study) is not None), None)
        if stated is not None:
            return stated
    return "design" if family(example(name).family).design and getattr(spec, "design", None) is not None else "analyze"


def _check_examples(name: str, options: ExamplesOptions, terminal: Terminal) -> Document:
    """Return the outcome of examples that were run in a folder that is gone afterwards, the quick ones first."""
    from tempfile import TemporaryDirectory

    from cfmkit.cli.progress import watching
    from cfmkit.runs.batch import batch
    from cfmkit.runs.shipped_files import example, examples

    if name in (ALL_EXAMPLES, QUICK_EXAMPLES):
        mechanisms = [example for example in examples() if "/" not in example.name]
        chosen = sorted(mechanisms, key=lambda example: example.searches)
        searches = sum(example.searches for example in chosen)
        if name == QUICK_EXAMPLES:
            chosen = chosen[: len(chosen) - searches]
        else:
            terminal.complain(
                () if terminal.quiet else (DURATION_TEXT.format(quick=len(chosen) - searches, long=searches),)
            )
    else:
        chosen = [example(name)]
    with TemporaryDirectory(prefix="cfmkit-examples-") as place, watching(terminal, "examples") as progress:
        files = [example.path for example in chosen]
        result = batch(files, place, plots=False, jobs=options.jobs, arguments=terminal.arguments, monitor=progress)
    records = [
        {"name": example.name, "status": entry.status, "exit_code": int(entry.code), "message": entry.message}
        for example, entry in zip(chosen, result.entries, strict=True)
    ]
    wrong = [record for record in records if record["exit_code"] != 0]
    reported = f"{len(records) - len(wrong)} of {len(records)} examples end as they should"
    page = (
        *record_table("examples", records, (field("name"), field("status"), field("message", wraps=True))),
        Paragraph("verdict", reported, Tone.BAD if wrong else Tone.GOOD),
    )
    return Document({"message": reported, "examples": records}, page, result.exit_code)
