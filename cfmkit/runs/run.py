"""A run over one specification: read it, compute the analysis or design, and write a folder of files.

`files` yields them, with curve, figures and geometry, by name below the output folder. It touches no disk, and nothing
depends on the time: the same result gives the same bytes.
"""

from __future__ import annotations

import shlex
import sys
import time
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from math import inf, isclose
from typing import TYPE_CHECKING, Any

from cfmkit import api
from cfmkit.documents import run_outcome
from cfmkit.documents.run_document import RunCommand
from cfmkit.errors import GeometryError, SolutionError, SpecError, UsageError
from cfmkit.families import family
from cfmkit.families.run_control import Run, silent
from cfmkit.plots.figure_options import DEFAULT_FORM, FigureForm
from cfmkit.plots.figures import moving_of
from cfmkit.results import OVERWRITTEN_FINDING, PART_NOT_DRAWN, Finding, Status
from cfmkit.runs.exported_files import part_on_paper
from cfmkit.runs.specfile import bind, place_problem, read_spec, rename_source
from cfmkit.store import RunFolder, stable_hash
from cfmkit.tables.csv_and_json import json_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager

    from cfmkit.documents.run_outcome import Report
    from cfmkit.errors import Problem
    from cfmkit.export.contours import Drawing
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.yamlio import YamlDocument
    from cfmkit.store import Manifest
    from cfmkit.studies.journal import Journal
    from cfmkit.tables import Table

    Noting = Callable[[RunFolder, bool], AbstractContextManager[Journal]]


def files(
    report: Report,  # of any status: without a curve only what is known is written
    plots: bool = True,  # whether to draw figures
    page: bool = False,  # whether to write ``report.html``, which has the figures as well
    command: str = "",  # what the page says about how the run was started
    # how figures are written; default: as PNG, as they are drawn. The page has them as SVG
    form: FigureForm = DEFAULT_FORM,
    animate: str | None = None,  # whether to write the mechanism in motion beside its curve, where its family draws it
    started: RunCommand | None = None,  # which commands apply remedies, for the page
) -> Iterator[tuple[str, bytes]]:
    """Yield every file of a run as (name below the folder, content), each when it is needed."""
    result, designed = report.result, report.design.spec if report.design else None
    if designed is not None:
        yield "design.yaml", api.dumps(designed).encode()
    if curves := report.supplement.curves or result.curves:
        from cfmkit.tables import curve_table, to_csv

        yield "curve.csv", to_csv(curve_table(curves))
        for stem, table in result.tables.items():
            yield f"{stem}.csv", to_csv(table())
    yield "metrics.json", json_bytes(report.as_json())
    yield "resolved.yaml", api.dumps(api.resolve(result.spec), complete=True).encode()
    yield from sources(result.spec)
    drawing = part_of(result.spec) if designed is not None and result.status.usable else None
    if drawing is not None:
        yield from geometry(drawing)
    for name, make in report.supplement.files.items():
        yield name, make()
    makers = {**api.figures(result), **report.supplement.figures} if plots or page else {}
    if makers and drawing is not None:
        makers["drawing"] = partial(part_on_paper, drawing, result.spec)
    drawn = {stem: form.draw(make) for stem, make in makers.items()}
    for stem, figure in drawn.items() if plots else ():
        yield from form.write(figure, stem)
    if animate is not None and (moving := moving_of(family(result.spec.family), result)) is not None:
        from cfmkit.plots.mechanism_in_motion import animation

        yield f"figures/motion.{animate}", animation(result, moving, animate)
    if page:
        from cfmkit.documents import report_html

        heading = "Input" if designed is None else "The design"
        every = ("Input with every default and derived value", api.dumps(api.resolve(result.spec), complete=True))
        texts = [(heading, api.dumps(result.spec)), every]
        yield (
            report_html.REPORT_NAME,
            report_html.run_page(report, form.select_page_figures(makers, drawn), command, texts, started),
        )


def sources(spec: Spec) -> Iterator[tuple[str, bytes]]:
    """Yield the data files that a specification names, under the same names: resolved.yaml names them, too."""
    from cfmkit.specs.data_file_paths import list_data_files

    for source in list_data_files(spec.model_dump()):
        yield str(source), source.path.read_bytes()


def part_of(spec: Spec) -> Drawing | None:
    """Return the drawing of what is to be cut or printed; None if there is no part, or none that can be cut."""
    try:
        return _checked_part(spec)
    except (SolutionError, GeometryError):  # the analysis, or `warnings_of_part`, has a warning that says why
        return None


def warnings_of_part(spec: Spec) -> tuple[Finding, ...]:
    """Return findings on the part as drawn, or why it cannot be drawn."""
    try:
        drawing = _checked_part(spec)
    except SolutionError:  # the analysis has a warning
        return ()
    except GeometryError as problem:
        return (Finding(PART_NOT_DRAWN, str(problem)),)
    return () if drawing is None else drawing.warnings


def _checked_part(spec: Spec) -> Drawing | None:
    """Return the part of a family that has one; GeometryError where it cannot be cut as it is."""
    from cfmkit.export.arc_outlines import outlines

    if not family(spec.family).outline:
        return None
    drawing = api.drawing(spec)
    outlines(drawing)
    return drawing


def geometry(drawing: Drawing) -> Iterator[tuple[str, bytes]]:
    """Yield the files of what is to be cut or printed, below ``geometry/``."""
    from cfmkit.export import files as drawn

    for name, data in drawn(drawing).items():
        yield f"geometry/{name}", data


COMMON_FILES = ("metrics.json", "resolved.yaml", "curve.csv")
"""Files that every run may write: what is in their way is found before anything is computed."""


def journal_of(folder: RunFolder, fresh: bool) -> Journal:
    """Return the journal of a folder, to be opened."""
    from cfmkit.studies.journal import Journal

    return Journal(folder.journal, fresh)


def _as_it_is(_folder: RunFolder, run: Run) -> AbstractContextManager[Run]:
    """Return a context that yields a run unchanged."""
    return nullcontext(run)


@dataclass(frozen=True)
class Verb:
    """Differences between computing verbs."""

    name: str
    compute: Callable[[Spec, Run], Report]
    inputs: Mapping[str, Any] = field(default_factory=dict)  # what the manifest says of other files than the spec
    # makes of a run in the folder one that works in several processes, or notes what it has finished
    running: Callable[[RunFolder, Run], AbstractContextManager[Run]] = _as_it_is
    words: tuple[str, ...] = ()  # what the command line says of those files


@dataclass(frozen=True)
class FinishedRun:
    """A finished run: its report, command, manifest, kept files and duration."""

    report: Report
    command: RunCommand  # how it was started
    manifest: Manifest
    kept: dict[str, str]  # files that were edited since the run before, and the names under which they are kept
    seconds: float


@dataclass(frozen=True)
class RunTask:
    """Task of a run."""

    spec: str  # the file; ``-`` is standard input
    out: str  # the output folder
    changes: tuple[str, ...] = ()  # what ``--set`` says
    fidelity: str | None = None  # what ``--fidelity`` says
    seed: int = 0  # random seed
    plots: bool = True  # whether to draw
    of_many: bool = False  # whether it is one of many, and changes may be for others
    page: bool = False  # whether to write ``report.html``
    form: FigureForm = DEFAULT_FORM  # how figures are written
    animate: str | None = None  # whether to write the mechanism in motion, and as what
    time_budget: float | None = None  # after which a search ends [s]

    @property
    def all_changes(self) -> tuple[str, ...]:
        """Changes of the specification: ``--set``, then ``--fidelity``."""
        if self.fidelity is None:
            return self.changes
        if not self.fidelity.strip():
            raise UsageError("--fidelity is empty; `cfmkit show FAMILY` lists the models")
        return (*self.changes, f"analysis.fidelity={self.fidelity}")


def carry_out(
    verb: Verb,  # what to compute
    wanted: RunTask,  # of what, and where to
    arguments: Sequence[str],  # the command line, for the manifest
    progress: Callable[[float, str], None] = silent,  # progress callback
) -> FinishedRun:
    """Return what a run found, after writing its folder."""
    start = time.perf_counter()
    document, spec = read(wanted)
    _make_ready(spec)
    with RunFolder(wanted.out) as folder:
        folder.check(*COMMON_FILES, *(["report.html"] if wanted.page else []))
        with verb.running(folder, Run(wanted.seed, progress, wanted.time_budget)) as run:
            report = _warn_of_replaced_options(_compute_report(verb, spec, run, document), spec, document)
        command = shlex.join(["cfmkit", *arguments])
        started = RunCommand(verb.name, wanted.spec, wanted.all_changes, verb.words, wanted.out)
        for name, data in files(report, wanted.plots, wanted.page, command, wanted.form, wanted.animate, started):
            folder.write(name, data)
        origin = provenance(verb.name, spec, wanted.spec, arguments)
        ending = {"status": report.status.key, "exit_code": int(report.exit_code)}
        manifest = folder.commit(origin | dict(verb.inputs) | {"seed": wanted.seed} | ending)
    return FinishedRun(report, started, manifest, dict(folder.kept), time.perf_counter() - start)


def _make_ready(spec: Spec) -> None:
    """Import the modules that an analysis needs, so that no interrupt ends an import once there is a folder."""
    from cfmkit.families import family

    import_module("cfmkit.runs.notebook_result")
    family(spec.family).model_of(spec)


def read(wanted: RunTask) -> tuple[YamlDocument, Spec]:
    """Return the document that is meant, with what is changed in it, and the checked specification."""
    document = read_spec(wanted.spec, wanted.all_changes, wanted.of_many)
    try:
        return document, bind(document)
    except SpecError as error:
        raise (rename_source(error, "--set analysis.fidelity", "--fidelity") if wanted.fidelity else error) from None


@contextmanager
def placing(document: YamlDocument, options: Collection[str] = ()) -> Iterator[None]:
    """Add the place in the file to errors raised inside the block: a model knows only the path.

    `options` are paths that options of the command have set: what is wrong there has no place in the file.
    """
    try:
        yield
    except SpecError as error:
        raise SpecError([_place_problem(document, problem, options) for problem in error.problems]) from None


def _place_problem(document: YamlDocument, problem: Problem, options: Collection[str]) -> Problem:
    if problem.source or any(f"{problem.path}.".startswith(f"{path}.") for path in options):
        return problem
    return document.problem(problem.path, problem.message)


def _compute_report(verb: Verb, spec: Spec, run: Run, document: YamlDocument) -> Report:
    with placing(document):
        report = verb.compute(spec, run)
    if report.result.status is Status.INVALID:
        raise SpecError([place_problem(document, verb.name, report.result.message)])
    return report


def _warn_of_replaced_options(report: Report, requested: Spec, document: YamlDocument) -> Report:
    """Return a report that warns of values of ``--set`` that a design has replaced."""
    made = report.design.spec if report.design else None
    if made is None:
        return report
    before, after = dict(requested.leaves()), dict(made.leaves())
    stated, written = requested.model_dump(mode="json", exclude_unset=True), made.model_dump(mode="json")
    messages = " ".join(warning.message for warning in report.warnings)
    warnings = [
        Finding(
            OVERWRITTEN_FINDING,
            f"'{path}' ({_text_at(stated, path)}), which --set states, is replaced by "
            f"{_text_at(written, path) or 'none'}: the design determines it",
        )
        for path in before
        if any(f"{path}.".startswith(f"{option}.") for option in document.set_by_options)
        and _text_at(stated, path)
        and not isclose(before[path], after.get(path, inf), rel_tol=1e-9)
        and f"'{path}'" not in messages
    ]
    return report.extend({}, run_outcome.Supplement(warnings=tuple(warnings))) if warnings else report


def _text_at(content: Any, path: str) -> str:
    """Return the value at a dotted path of what a specification is written as, to six digits; "" if it is absent."""
    for part in path.split("."):
        inside = content[int(part)] if isinstance(content, list) else content.get(part)
        if inside is None:
            return ""
        content = inside
    number, space, unit = str(content).partition(" ")
    return f"{float(number):.6g}{space}{unit}"


def provenance(command: str, spec: Spec, source: str, arguments: Sequence[str]) -> dict[str, Any]:
    """Return what every manifest says about its run: the command line and the content of the spec."""
    from cfmkit.families import family, origin

    content: dict[str, Any] = {"source": source, "sha256": stable_hash(spec.model_dump(mode="json"))}
    content |= {"family": package} if (package := origin(spec.family)) else {}  # of another package
    cited = {"bibtex": text} if (text := family(spec.family).bibtex) else {}
    march = sys.modules.get("cfmkit.elastica.mechanics.march")  # of beams that bend only
    engine = {} if march is None else {"beam_engine": march.engine()}
    return {"command": command, "arguments": list(arguments), "spec": content, **engine, **cited}


def run_analysis(spec: Spec, run: Run) -> Report:
    """Return the report on a mechanism as it is."""
    report = run_outcome.report_on(api.analyze(spec, run))
    return report.extend({}, run_outcome.Supplement(lines=_assumed_lines(spec)))


def _assumed_lines(spec: Spec) -> tuple[tuple[str, str], ...]:
    """Return where the data on life and creep come from that a specification leaves to the library."""
    lasting = getattr(spec, "durability", None)
    return () if lasting is None else tuple(("durability", text) for text in lasting.assumed)


def run_design(spec: Spec, run: Run) -> Report:
    """Return the report on the designed mechanism, with the yield of its parts, or on why there is none."""
    from cfmkit.specs.spec import DesignKeys
    from cfmkit.studies.parts.parts import is_made

    block = getattr(spec, "design", None)
    many = isinstance(block, DesignKeys) and is_made(spec, block)
    design = api.design(spec, run.part(0.0, 0.6) if many else run)
    result = api.analyze(design.spec, run) if design.spec is not None else run_outcome.empty_result(spec, design)
    tables = {f"{stem}.csv": partial(_csv_bytes, table) for stem, table in design.tables.items()}
    report = run_outcome.report_on(result, design)
    drawn = warnings_of_part(result.spec) if design.spec is not None and result.status.usable else ()
    names = {finding.name for finding in result.warnings}
    more = tuple(finding for finding in drawn if finding.name not in names)
    lines = (*design.notes, *_assumed_lines(result.spec))
    report = report.extend({}, run_outcome.Supplement(files=tables, lines=lines, warnings=more))
    if design.spec is None or result.status is not Status.COMPLETE:
        return report
    # as it was written: what follows from other values follows from those of each part
    return _judge_many_parts(report, replace(result, spec=design.spec), spec, run.part(0.6, 1.0))


def _judge_many_parts(report: Report, nominal: Result, spec: Spec, run: Run) -> Report:
    """Return a report with what is known of many parts of its design, and its test plan."""
    from cfmkit.studies.delivered_design import friction_note
    from cfmkit.studies.parts.near_parts import expected_forces

    report = _with_yield(report, nominal, spec, run)
    lines = ("test plan", expected_forces(nominal, run)), ("friction", friction_note(nominal, run))
    return report.extend({}, run_outcome.Supplement(lines=tuple((word, text) for word, text in lines if text)))


def _with_yield(report: Report, nominal: Result, spec: Spec, run: Run) -> Report:
    """Return a report with what is known of many parts of its design, where their tolerances are given."""
    from cfmkit.studies.parts.drawn_parts import no_yields, yields_of

    yields = yields_of(nominal, spec, run)
    if yields is None:
        from cfmkit.studies.parts.near_parts import expected_yield

        reported = expected_yield(nominal, run)
        more = run_outcome.Supplement(lines=(("yield", reported),) if reported else ())
        return report.extend(no_yields(spec), more).judge_yields()
    more = run_outcome.Supplement(data={"yield": yields.as_json()}, lines=(("yield", yields.sentence()),))
    return report.extend(yields.quantities(), more).judge_yields()


def _csv_bytes(table: Callable[[], Table]) -> bytes:
    from cfmkit.tables import to_csv

    return to_csv(table())


@contextmanager
def long_run(jobs: int, fresh: bool, folder: RunFolder, plain: Run, noting: Noting = journal_of) -> Iterator[Run]:
    """Yield a run that works in several processes and notes what it has finished in the folder's journal."""
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import serial

    with noting(folder, fresh) as journal:
        yield replace(plain, executor=serial if jobs == 1 else Pool(jobs), notes=journal)
