"""``cfmkit check``: whether specs are valid, and every problem with its line; nothing is computed."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cfmkit.cli.failures import answer_to
from cfmkit.cli.options import QUIET_FLAG, SpecOptions, argument
from cfmkit.documents.document import Document, Span, Tone, format_bounds, whole_line
from cfmkit.errors import CfmError, ExitCode, visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import TextLine
    from cfmkit.specs.spec import Spec

HELP_POSITION = 40
HELP_EXAMPLE = "cfmkit check specs/"


@dataclass(frozen=True, kw_only=True)
class CheckOptions(SpecOptions):
    """Arguments and options."""

    specs: list[str] = argument("SPEC", "YAML files, or folders with them; - reads standard input.")
    quiet: bool = QUIET_FLAG()


@dataclass(frozen=True)
class Checked:
    """Outcome of one file: its spec, or the answer that its error is."""

    file: str
    spec: Spec | None
    failure: Document


def run(options: CheckOptions, terminal: Terminal) -> Document:
    """Check specs without computing anything: every problem of every file, with its line and column."""
    files = _files(options.specs)
    checked_files = [_check_file(name, options.changes, len(files) > 1, terminal.excerpts) for name in files]
    bad = sum(item.spec is None for item in checked_files)
    message = f"{bad} of {len(checked_files)} files are not valid" if bad else ""

    return Document(
        {"files": [_record(item) for item in checked_files], "message": message},
        _outcome_lines(checked_files, terminal.verbose > 0),
        _code([item.failure.exit_code for item in checked_files]),
        complaints=tuple(line for item in checked_files for line in item.failure.complaints),
        errors=tuple(entry for item in checked_files for entry in item.failure.errors),
    )


def _files(named: list[str]) -> list[str]:
    """Return the files to check: a folder stands for all YAML files in it and below, as in a batch."""
    from cfmkit.studies.batch_sources_and_outcomes import files_below

    paths: list[str] = []
    for name in named:
        paths += files_below(name) if os.path.isdir(name) else [name]
    return paths


def _check_file(name: str, changes: tuple[str, ...], of_many: bool, excerpts: bool) -> Checked:
    from cfmkit.runs.specfile import bind, read_spec

    try:
        return Checked(name, bind(read_spec(name, changes, of_many)), Document())
    except CfmError as error:
        return Checked(name, None, answer_to(error, excerpts))


def _code(codes: list[ExitCode]) -> ExitCode:
    """Return the exit code of all files: an invalid one counts before a missing one."""
    return next((code for code in (ExitCode.INVALID, ExitCode.USAGE) if code in codes), ExitCode.OK)


def _record(item: Checked) -> dict[str, Any]:
    """Return the entry of one file in the JSON document."""
    about = {"family": item.spec.family, "name": item.spec.name} if item.spec else {"family": None, "name": None}
    return {"file": item.file, "ok": item.spec is not None, **about, "errors": list(item.failure.errors)}


def _outcome_lines(checked_files: list[Checked], everything: bool) -> Iterator[TextLine]:
    """Yield one line per file, names whole whatever the width; and all of its requirements."""
    wide = max(len(visible(item.file)) for item in checked_files)
    for item in checked_files:
        name = f"{visible(item.file).ljust(wide)}  "
        if item.spec is None:
            count = len(item.failure.errors)
            yield whole_line(name, Span("INVALID", Tone.BAD), f"  {count} problem{'s' if count > 1 else ''}")
            continue
        about = f"       {item.spec.family}  {' '.join(item.spec.name.split())}"
        yield whole_line(name, Span("ok", Tone.GOOD), about)
        for requirement in item.spec.requirements if everything else ():
            yield whole_line(
                f"    {requirement.metric} {format_bounds({'min': requirement.min, 'max': requirement.max})}"
            )
