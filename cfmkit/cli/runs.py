"""What `design` and `analyze` have in common: a spec in, a folder of files and a report out."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit import report
from cfmkit.cli.answer import Answer
from cfmkit.errors import SpecError, UsageError
from cfmkit.families.base import Run
from cfmkit.specfile import STDIN, bind, placed, read_spec, renamed
from cfmkit.store import RunFolder, stable_hash

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from contextlib import AbstractContextManager

    from cfmkit.cli.options import Computing, OneSpec
    from cfmkit.cli.terminal import Terminal
    from cfmkit.report import Report
    from cfmkit.spec import Spec
    from cfmkit.store import Manifest
    from cfmkit.yamlio import Document

FIRST = ("metrics.json", "resolved.yaml", "curve.csv")
"""Files that every run may write: what is in their way is found before anything is computed."""


def _as_it_is(_folder: RunFolder, run: Run) -> AbstractContextManager[Run]:
    """Leave a run as it is."""
    return nullcontext(run)


@dataclass(frozen=True)
class Verb:
    """What distinguishes one computing verb from another.

    `compute` returns the report on a spec; `done` is the word for it, in the header; `inputs` is
    what the manifest says about other files than the spec; `running` makes of a run in the folder one
    that works in several processes, or notes what it has finished.
    """

    name: str
    done: str
    compute: Callable[[Spec, Run], Report]
    inputs: Mapping[str, Any] = field(default_factory=dict)
    running: Callable[[RunFolder, Run], AbstractContextManager[Run]] = _as_it_is


@dataclass(frozen=True)
class Outcome:
    """Everything about a finished run that is shown: the report, where it was written, how long it took."""

    verb: Verb
    report: Report
    source: str
    changes: tuple[str, ...]
    folder: str
    manifest: Manifest
    kept: dict[str, str]
    seconds: float

    @property
    def written(self) -> tuple[str, ...]:
        """The files, in the order in which they were written."""
        return tuple(self.manifest.files)


def execute(verb: Verb, options: Computing, terminal: Terminal) -> Answer:
    """Run a verb over the spec that the options name and write the folder."""
    start = time.perf_counter()
    out = folder_of(options, verb.name)
    document = _document(options)
    spec = _spec(document, options)
    with RunFolder(out) as folder, terminal.progress() as progress:
        folder.check(*FIRST)
        with verb.running(folder, Run(options.seed, progress)) as run:
            found = _computed(verb, spec, run, document)
        for name, data in report.files(found, plots=not options.no_plots):
            folder.write(name, data)
        origin = provenance(verb.name, spec, options.spec, terminal)
        manifest = folder.commit(origin | dict(verb.inputs) | {"seed": options.seed} | _ending(found))
        kept = dict(folder.kept)
    seconds = time.perf_counter() - start
    return answer(Outcome(verb, found, options.spec, tuple(options.changes), out, manifest, kept, seconds))


def answer(outcome: Outcome) -> Answer:
    """Return the answer of a finished run."""
    found = outcome.report
    data = found.as_json() | {
        "family": found.result.spec.family,
        "name": found.result.spec.name,
        "out": outcome.folder,
        "files": [*outcome.written, "manifest.json"],
    }
    design = found.design
    if design is not None:
        data |= {"active_bounds": list(design.active_bounds), "nearest_feasible": dict(design.nearest_feasible)}
    if outcome.kept:
        data |= {"kept": outcome.kept}

    def view(terminal: Terminal) -> None:
        from cfmkit.cli.layout import show_run

        show_run(outcome, terminal)

    return Answer(data, view, found.exit_code, quiet_complaints=tuple(_complaints(found)))


def _complaints(found: Report) -> list[str]:
    """Return what a user must hear who has asked to hear nothing else."""
    status = found.status
    if not status.usable:
        return [f"error    {status.key.replace('_', ' ')}: {found.message}"]
    partial = [] if status.exit_code == 0 else [f"partial  {found.message}"]
    return [*partial, *(f"missed   {outcome.sentence.removesuffix(': missed')}" for outcome in found.missed)]


def folder_of(options: OneSpec, verb: str) -> str:
    """Return the output folder: the one asked for, or one named after the spec and the verb.

    Raises
    ------
    cfmkit.errors.UsageError
        If the spec comes from standard input and no folder is given.
    """
    if options.out is not None:
        if not options.out.strip():
            raise UsageError("--out is empty; give a folder")
        return options.out
    if options.spec == STDIN:
        raise UsageError("a spec from standard input has no name; say with --out where to write")
    return str(Path("cfm-out") / f"{Path(options.spec).stem}-{verb}")


def spec_of(options: Computing) -> Spec:
    """Return the checked spec that the options name, with what they change."""
    return _spec(_document(options), options)


def _document(options: Computing) -> Document:
    if options.fidelity is None:
        return read_spec(options.spec, options.changes)
    if not options.fidelity.strip():
        raise UsageError("--fidelity is empty; `cfmkit show` and the family's name lists what there is")
    return read_spec(options.spec, (*options.changes, f"analysis.fidelity={options.fidelity}"))


def _spec(document: Document, options: Computing) -> Spec:
    try:
        return bind(document)
    except SpecError as error:
        raise (renamed(error, "--set analysis.fidelity", "--fidelity") if options.fidelity else error) from None


def _computed(verb: Verb, spec: Spec, run: Run, document: Document) -> Report:
    from cfmkit.results import Status

    found = verb.compute(spec, run)
    if found.result.status is Status.INVALID:
        raise SpecError([placed(document, verb.name, found.result.message)])
    return found


def provenance(command: str, spec: Spec, source: str, terminal: Terminal) -> dict[str, Any]:
    """Return what every manifest says about its run: the command line and the content of the spec."""
    content = {"source": source, "sha256": stable_hash(spec.model_dump(mode="json"))}
    return {"command": command, "arguments": list(terminal.arguments), "spec": content}


def _ending(found: Report) -> dict[str, Any]:
    return {"status": found.status.key, "exit_code": int(found.exit_code)}
