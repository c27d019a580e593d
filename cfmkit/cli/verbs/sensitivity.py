"""``cfmkit sensitivity``: which value matters, and how good the made parts will be."""

from __future__ import annotations

import shlex
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cfmkit.cli import shell_completion
from cfmkit.cli.options import Studying, Tables, WithReport, flag, option
from cfmkit.cli.page_block_types import (
    BAD,
    BLANK,
    FAINT,
    LABEL,
    CellGrid,
    GridColumn,
    Paragraph,
    Span,
    Written,
    columns,
    line,
    spaced,
    title,
    verdict,
)
from cfmkit.cli.verb_result import Answer
from cfmkit.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from matplotlib.figure import Figure

    from cfmkit.cli.output import Terminal
    from cfmkit.cli.page_block_types import Block
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.parts.share import Share
    from cfmkit.studies.sensitivity.result_types import Findings, IndexLine

PLACE = 24
EXAMPLE = "cfmkit sensitivity cam.yaml --method tolerance --vary mechanism.roller_radius=normal:0.05mm --samples 400"

SHOWN = {
    "oat": ("swing", "normalised_slope"),
    "local": ("normalised_slope", "gradient"),
    "morris": ("mu_star", "sigma"),
    "sobol": ("total_order", "first_order"),
    "tolerance": ("yield_gain_when_halved", "variance_drop_when_halved"),
    "inverse": ("tolerance_alone", "tolerance_together", "tolerance_allocated"),
}
"""Indices on the page; the first says in which order."""

PERCENT = SHOWN["tolerance"]
NOTHING = 1e-12
"""An index below this is the rounding of a difference of numbers near 1 (2e-16 each), not an influence."""

MOST_PARAMETERS = 6
"""Parameters of each metric that are shown without ``-v``: two metrics with them fit on a screen of 24 lines."""


@dataclass(frozen=True, kw_only=True)
class SensitivityOptions(Studying):
    """Arguments and options."""

    report: WithReport = False
    table: Tables = "csv"
    method: Annotated[
        Literal["oat", "local", "morris", "sobol", "tolerance", "inverse"] | None,
        option(
            "--method",
            metavar="NAME",
            text="oat (one at a time), local (gradients), morris (screening), sobol (indices), tolerance (Monte Carlo: "
            "the yield) or inverse (the tolerances that a yield needs); default: the spec's, else oat.",
        ),
    ] = None
    samples: Annotated[
        int | None,
        option(
            "--samples",
            metavar="N",
            low=2,
            text="oat: points per parameter; morris: trajectories; sobol: base samples; tolerance, inverse: parts.",
        ),
    ] = None
    seed: Annotated[
        int | None,
        option("--seed", metavar="N", low=0, text="Seed of all random numbers; default: the spec's, else 0."),
    ] = None  # type: ignore[assignment]
    vary: Annotated[
        list[str] | None,
        option(
            "--vary",
            metavar="A.B=SPREAD",
            text="A parameter: low:high, normal:DEVIATION or uniform:HALF-WIDTH, e.g. "
            "mechanism.width=uniform:2%. Repeatable; replaces the spec's parameters.",
            autocompletion=shell_completion.changes,
        ),
    ] = None
    on_failure: Annotated[
        Literal["fail", "resample", "bound"] | None,
        option(
            "--on-failure",
            metavar="NAME",
            text="For samples without a result: fail (report no index), resample (draw their block again) or bound "
            "(report intervals); default: fail.",
        ),
    ] = None
    metrics: Annotated[
        str | None,
        option(
            "--metrics",
            metavar="A,B",
            text="Metrics to study; default: those of the requirements, over their windows.",
        ),
    ] = None
    design: Annotated[bool, flag("--design", text="Redesign the mechanism at each sample.")] = False


def run(options: SensitivityOptions, terminal: Terminal) -> Answer:
    """Find out which values matter most, and which share of manufactured parts will meet the requirements.

    The spec's block `sensitivity` says what is uncertain. Finished samples are kept in the folder: after an
    interruption, run the same command again to continue.
    """
    from cfmkit.cli import run_study_in_folder
    from cfmkit.cli.run_spec_and_print_page import folder_of
    from cfmkit.runs import html_report_of_study
    from cfmkit.runs.run import placing, read
    from cfmkit.studies.sensitivity.output import exit_code, outputs
    from cfmkit.studies.sensitivity.run_sensitivity_method import carry_out
    from cfmkit.studies.sensitivity.setup import prepare

    start = run_study_in_folder.now()
    out, form, in_parquet = (
        folder_of(options, "sensitivity"),
        options.form,
        run_study_in_folder.wants_parquet(options.table),
    )
    document, spec = read(options)
    with placing(document, [f"sensitivity.{key}" for key in changes_of(options)]):
        setup = prepare(changed_by(options, spec), options.seed, options.max_points)
    with run_study_in_folder.desk(out, terminal, options.fresh) as place:
        place.folder.check("results.csv", "indices.csv", "metrics.json", "resolved.yaml")
        found = replace(
            carry_out(setup, lambda work: run_study_in_folder.compute(work, options, place)), fresh=options.fresh
        )
        for piece in found.evaluator.pieces:
            run_study_in_folder.tracebacks(piece.records, terminal)
        kept: dict[str, bytes] = {}
        for name, data in outputs(found):
            if options.report or (in_parquet and name == "results.csv"):
                kept[name] = data = data if isinstance(data, bytes) else b"".join(map(bytes, data))
            place.folder.write(name, data)
        if in_parquet:
            place.folder.write("results.parquet", run_study_in_folder.as_parquet(kept["results.csv"]))
        makers = _pictures(found) if options.report or not options.no_plots else {}
        drawn = {} if options.no_plots else {stem: form.draw(make) for stem, make in makers.items()}
        for stem, figure in drawn.items():
            for name, content in form.write(figure, stem):
                place.folder.write(name, content)
        if options.report:
            command = shlex.join(["cfmkit", *terminal.arguments])
            shown = form.for_page(makers, drawn)
            study = found.setup.study
            point = run_study_in_folder.command_of_a_point(options, study.design)
            page = html_report_of_study.page(study.spec, found.setup.paths, kept, command, shown, point)
            place.folder.write(html_report_of_study.NAME, page)
        made = run_study_in_folder.Made(
            "sensitivity", options.spec, setup.study.spec, setup.seed, found.evaluator.count
        )
        manifest = run_study_in_folder.commit(place, made, terminal, exit_code(found))
        run_study_in_folder.finish(place, [piece.records for piece in found.evaluator.pieces])
    written = Written(out, (*manifest.files, "manifest.json"), run_study_in_folder.now() - start)
    return _answer(found, written, terminal.verbose > 0)


def _pictures(found: Findings) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws the pictures of a study; nothing of one that was not finished."""
    from cfmkit.plots.sensitivity import figures

    return {} if found.interrupted else figures(found)


def changed_by(options: SensitivityOptions, spec: Spec) -> Spec:
    """Return a spec with what the options say about its block `sensitivity`.

    Raises
    ------
    cfmkit.errors.UsageError
        If an option is malformed.
    cfmkit.errors.SpecError
        If the block is not valid with it.
    """
    from cfmkit.studies.parts.uncertain_values import with_options

    changes = changes_of(options)
    if not changes or (spec.sensitivity is None and "parameters" not in changes):
        return spec
    if spec.sensitivity is not None and any(map(_sets_samples, options.changes)):
        changes = {"samples": spec.sensitivity.samples} | changes
    return spec.replace({"sensitivity": with_options(spec.sensitivity, changes)})


def _sets_samples(change: str) -> bool:
    """Whether a ``--set`` says how many samples are drawn: then this is no number of another method."""
    return change.partition("=")[0].rpartition(":")[2].strip() in ("sensitivity", "sensitivity.samples")


def changes_of(options: SensitivityOptions) -> dict[str, Any]:
    """Return what the options say, by key of the block."""
    from cfmkit.cli.run_study_in_folder import names

    said = {
        "method": options.method,
        "samples": options.samples,
        "on_failure": options.on_failure,
        "parameters": dict(map(spread, options.vary)) if options.vary else None,
        # What the spec says goes together names parameters that may not be there any more.
        "correlated": () if options.vary else None,
        "metrics": names(options.metrics) or None,
        "design": options.design or None,
    }
    return {key: value for key, value in said.items() if value is not None}


def spread(option: str) -> tuple[str, Any]:
    """Return (path, range or tolerance) of ``--vary``.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is neither.
    """
    path, equals, text = (part.strip() for part in option.partition("="))
    first, colon, second = (part.strip() for part in text.partition(":"))
    if not (path and equals and colon and first and second) or ":" in second:
        reported = "write PATH=low:high, PATH=normal:DEVIATION or PATH=uniform:HALF-WIDTH, with units"
        raise UsageError(f"--vary {option!r}: {reported}")
    return path, {first: second} if first in ("normal", "uniform") else (first, second)


def _answer(found: Findings, written: Written, everything: bool) -> Answer:
    from cfmkit.studies.sensitivity.output import as_json, exit_code

    spec, code = found.setup.study.spec, exit_code(found)
    records = [piece.records for piece in found.evaluator.pieces]
    data = as_json(found) | {"family": spec.family, "name": spec.name} | written.data
    data |= {"reused": sum(one.reused for one in records)}
    bugs = sum(one.bugs for one in records)
    complaints = (f"error    {bugs} samples hit a bug in cfmkit; -vv shows the first",) if bugs else ()
    return Answer(data, _page(found, written, everything), code, complaints, tuple(_quiet(found, data, code)))


def _quiet(found: Findings, data: Mapping[str, Any], code: ExitCode) -> Iterator[str]:
    """Yield what a user must hear who has asked to hear nothing else."""
    from cfmkit.studies.sensitivity.output import message

    if code not in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED):
        yield f"{data['status']:<9}{message(found)}"
    for one in data["requirements"]:
        if not one["ok"]:
            yield f"missed   {one['sentence'].removesuffix(': missed')}"


def _page(found: Findings, written: Written, everything: bool) -> Iterator[Block]:
    """Yield the yield, the parameters in the order of what they do, and what failed."""
    from cfmkit.studies.sensitivity.output import message, warnings

    evaluator = found.evaluator
    reused = sum(piece.records.reused for piece in evaluator.pieces)
    right = f"{found.setup.method}, {evaluator.count} samples in {written.seconds:.2f} s"
    yield title(found.setup.study.spec, right + (f", {reused} from the journal" if reused else ""))
    yield BLANK
    if found.all_met is not None:
        yield _yields(found, found.all_met)
        yield BLANK
    for metric, lines in _by_metric(found).items():
        yield line(f"  {spaced(metric)}", LABEL)
        yield _ranking(found, lines, everything)
        yield BLANK
    for outcome in found.setup.nominal.outcomes:
        if not outcome.ok:
            yield Paragraph("missed", f"without any deviation: {outcome.sentence}", BAD)
    if found.interrupted:
        yield Paragraph("stopped", message(found), BAD)
    for item in warnings(found):
        yield Paragraph("warning", f"{item.name}: {item.message}", BAD)
    if evaluator.failed:
        yield Paragraph("first", evaluator.first_failure)
    yield written.block(everything)


def _yields(found: Findings, share: Share) -> CellGrid:
    from cfmkit.studies.sensitivity.output import by_interval, yield_ok

    wanted = found.setup.block.min_yield
    bound = "" if wanted is None else f">= {100 * wanted:.4g} %"
    ok = None if wanted is None else yield_ok(found)
    if by_interval(found):
        bound += " (in the interval)"
    rows: list[tuple[str | Span, ...]] = [(Span("  yield", LABEL), _share(share), bound, verdict(ok))]
    for outcome, one in zip(found.setup.nominal.outcomes, found.each_met, strict=True):
        limits = outcome.sentence.rpartition(": ")[0].partition(", ")[2]
        rows.append((f"  {spaced(outcome.metric)}", _share(one), Span(limits, FAINT), ""))
    return CellGrid(columns(True, True, True, True), rows)


def _share(one: Share) -> str:
    if one.value != one.value:
        return f"not stated: {one.failed} of {one.count} parts have no result"
    low, high = (f"{100 * end:.1f}" for end in one.wilson)
    least, most = (100 * (one.good + more) / one.count for more in (0, one.failed))
    value = f"{least:.1f} to {most:.1f} %" if one.failed else f"{100 * one.value:.1f} %"
    return f"{value}   95 %: {low} ... {high} %"


def _by_metric(found: Findings) -> dict[str, dict[str, dict[str, IndexLine]]]:
    """Return metric -> parameter -> index -> line, the parameters that do most first."""
    tree: dict[str, dict[str, dict[str, IndexLine]]] = defaultdict(lambda: defaultdict(dict))
    for one in found.lines:
        tree[one.metric][one.parameter][one.index] = one
    return {metric: dict(sorted(each.items(), key=_rank)) for metric, each in tree.items()}


def _rank(item: tuple[str, dict[str, IndexLine]]) -> float:
    """Return how far up a parameter stands: largest first, those without a value before all."""
    names = [names[0] for names in SHOWN.values()] + ["variance_drop_when_halved"]
    line = next((item[1][name] for name in names if name in item[1]), None)
    return 0.0 if line is None else -abs(line.value) if line.value is not None else -float("inf")


def _ranking(found: Findings, each: dict[str, dict[str, IndexLine]], everything: bool) -> CellGrid:
    indices = [name for name in SHOWN[found.setup.method] if any(name in lines for lines in each.values())]
    heads = (GridColumn(), *(GridColumn(spaced(name), wraps=False) for name in indices))
    shown = list(each.items())[: None if everything else MOST_PARAMETERS]
    rows = [(f"    {parameter}", *(_index(lines.get(name)) for name in indices)) for parameter, lines in shown]
    return CellGrid(heads, rows)


def _index(line: IndexLine | None) -> str:
    if line is None or line.value is None:
        return "not stated"
    percent = line.index in PERCENT
    unit = " %" if percent else "" if line.unit == "1" else f" {line.unit}"
    value, low, high = (None if end is None else _short(end, percent) for end in (line.value, line.low, line.high))
    if low is None or low == value == high:
        return f"{value}{unit}"
    return f"at least {value}{unit}" if high is None else f"{value}{unit}  ({low} ... {high})"


def _short(value: float, percent: bool) -> str:
    """Return a number of three digits; what is nothing but rounding is zero."""
    return "0" if abs(value) < NOTHING else f"{100 * value if percent else value:.3g}"
