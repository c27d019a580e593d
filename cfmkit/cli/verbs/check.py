"""``cfmkit check``: are specs valid, without computing anything."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cfmkit.cli import completion
from cfmkit.cli.answer import Answer
from cfmkit.cli.failures import answer_to
from cfmkit.cli.options import Changing, Common, Quiet
from cfmkit.errors import CfmError, ExitCode, visible

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.text import Text

    from cfmkit.cli.terminal import Terminal
    from cfmkit.specs.spec import Spec

PLACE = 40

SpecFiles = Annotated[
    list[str],
    typer.Argument(
        metavar="SPEC...",
        help="YAML files, or folders with them; - reads standard input.",
        show_default=False,
        autocompletion=completion.specs,
    ),
]


@dataclass(frozen=True, kw_only=True)
class Options(Changing, Common):
    """Arguments and options."""

    specs: SpecFiles
    quiet: Quiet = False


@dataclass(frozen=True)
class Finding:
    """What became of one file: its spec, or the answer that its error is."""

    file: str
    spec: Spec | None
    failure: Answer


def run(options: Options, terminal: Terminal) -> Answer:
    """Check specs without computing anything: every fault of every file, with its line and column."""
    files = _files(options.specs)
    found = [_checked(name, options.changes, len(files) > 1) for name in files]

    def view(terminal: Terminal) -> None:
        for line in _lines(found, terminal.verbose > 0):
            line.no_wrap, line.overflow = True, "ignore"  # names stand whole, whatever the width
            terminal.show(line)

    return Answer(
        {"files": [_record(item) for item in found], "message": _message(found)},
        view,
        _code([item.failure.exit_code for item in found]),
        complaints=tuple(line for item in found for line in item.failure.complaints),
        errors=tuple(entry for item in found for entry in item.failure.errors),
    )


def _files(named: list[str]) -> list[str]:
    """Return the files to check: a folder stands for all YAML files in it and below, as in a batch."""
    from cfmkit.studies.batch import files_below

    found: list[str] = []
    for name in named:
        found += files_below(name) if os.path.isdir(name) else [name]
    return found


def _checked(name: str, changes: tuple[str, ...], of_many: bool) -> Finding:
    from cfmkit.runs.specfile import bind, read_spec

    try:
        return Finding(name, bind(read_spec(name, changes, of_many)), Answer())
    except CfmError as error:
        return Finding(name, None, answer_to(error))


def _code(codes: list[ExitCode]) -> ExitCode:
    """Return the exit code of all files: an invalid one counts before a missing one."""
    return next((code for code in (ExitCode.INVALID, ExitCode.USAGE) if code in codes), ExitCode.OK)


def _message(found: list[Finding]) -> str:
    bad = sum(item.spec is None for item in found)
    return f"{bad} of {len(found)} files are not valid" if bad else ""


def _record(item: Finding) -> dict[str, Any]:
    """Return the entry of one file in the JSON document."""
    about = {"family": item.spec.family, "name": item.spec.name} if item.spec else {"family": None, "name": None}
    return {"file": item.file, "ok": item.spec is not None, **about, "errors": list(item.failure.errors)}


def _lines(found: list[Finding], requirements: bool) -> Iterator[Text]:
    """Yield one line a file, and its requirements if asked for."""
    from rich.text import Text

    from cfmkit.cli.terminal import BAD, GOOD

    wide = max(len(visible(item.file)) for item in found)
    for item in found:
        if item.spec is None:
            count = len(item.failure.errors)
            told = f"  {count} problem{'s' if count > 1 else ''}"
            yield Text.assemble(visible(item.file).ljust(wide), "  ", ("INVALID", BAD), told)
            continue
        about = f"       {item.spec.family}  {' '.join(item.spec.name.split())}"
        yield Text.assemble(visible(item.file).ljust(wide), "  ", ("ok", GOOD), about)
        for requirement in item.spec.requirements if requirements else ():
            yield Text(f"    {_required(requirement)}")


def _required(requirement: Any) -> str:
    bounds = [f">= {requirement.min}"] if requirement.min is not None else []
    bounds += [f"<= {requirement.max}"] if requirement.max is not None else []
    return f"{requirement.metric} {' and '.join(bounds)}"
