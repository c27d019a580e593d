"""``cfmkit sweep``: one mechanism in many variants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cfmkit.cli.options import Common
from cfmkit.cli.studies import Studying
from cfmkit.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.answer import Answer
    from cfmkit.cli.terminal import Terminal
    from cfmkit.store.disk import Data
    from cfmkit.studies.engine import Records
    from cfmkit.studies.summary import Summary
    from cfmkit.studies.sweep import Request

PLACE = 22

Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="A.B=VALUES",
        help="Vary a value: start:stop:n or \\[a, b], with units, e.g. mechanism.roller_radius='8 mm:16 mm:5'. "
        "Repeatable; replaces what the spec's block sweep varies.",
        show_default=False,
    ),
]
Zip = Annotated[bool, typer.Option("--zip", help="Vary values side by side instead of in every combination.")]
Sample = Annotated[
    str | None,
    typer.Option(
        "--sample",
        metavar="lhs:N|sobol:N",
        help="Draw N points from ranges start:stop: a Latin hypercube or a Sobol sequence.",
        show_default=False,
    ),
]
Design = Annotated[bool, typer.Option("--design", help="Design the mechanism anew at each point.")]
Curves = Annotated[bool, typer.Option("--curves", help="Keep the curve of every point in curves.csv.")]
Metrics = Annotated[
    str | None,
    typer.Option("--metrics", metavar="A,B", help="Columns of results.csv; default: all.", show_default=False),
]


@dataclass(frozen=True, kw_only=True)
class Options(Studying, Common):
    """Arguments and options."""

    vary: Vary = None
    zip: Zip = False
    sample: Sample = None
    design: Design = False
    curves: Curves = False
    metrics: Metrics = None


def run(options: Options, terminal: Terminal) -> Answer:
    """Analyse a mechanism in many variants: one row a point, whatever becomes of it.

    Finished points are noted in the folder: after an interruption the same command goes on.
    """
    from cfmkit.cli import studies
    from cfmkit.cli.runs import folder_of, spec_of
    from cfmkit.studies.sweep import prepare, summary_of, writes_curves

    start = studies.now()
    out = folder_of(options, "sweep")
    spec, asked = spec_of(options), request(options)
    work = prepare(spec, asked)
    with studies.desk(out, terminal, options.fresh) as place:
        place.folder.check("results.csv", "metrics.json", "resolved.yaml")
        records = studies.compute(work, options, place)
        studies.tracebacks(records, terminal)
        summary = summary_of(records)
        for name, data in files(records, summary, writes_curves(spec, asked), not options.no_plots):
            place.folder.write(name, data)
        code = exit_code(records, summary)
        made = studies.Made("sweep", options.spec, work.study.spec, options.seed, len(work.plan))
        manifest = studies.commit(place, made, terminal, code)
        studies.finish(place, [records])
        told = summary.as_json(records)
    written = (*manifest.files, "manifest.json")
    ending = studies.Ending(records, code, told, out, written, studies.now() - start, options.fresh)
    return studies.answer(ending, options.spec)


def request(options: Options) -> Request:
    """Return what the options ask for.

    Raises
    ------
    cfmkit.errors.UsageError
        If one is malformed, or two contradict each other.
    """
    from cfmkit.cli.studies import names
    from cfmkit.studies.sweep import Request
    from cfmkit.studies.variation import wish

    if options.zip and options.sample:
        raise UsageError("--zip and --sample exclude each other")
    method, samples = _sample(options.sample) if options.sample else ("zip" if options.zip else None, None)
    return Request(
        vary=tuple(wish(option) for option in options.vary or ()),
        combine=method,  # type: ignore[arg-type]
        samples=samples,
        design=options.design or None,
        curves=options.curves or None,
        metrics=names(options.metrics),
        seed=options.seed,
        most=options.max_points,
        pictures=not options.no_plots,
    )


def _sample(text: str) -> tuple[str, int]:
    method, _, count = text.partition(":")
    if method not in ("lhs", "sobol") or not (count.isascii() and count.isdigit()) or not 0 < len(count) < 19:
        raise UsageError(f"--sample {text!r}: write lhs:N or sobol:N, e.g. sobol:256")
    if int(count) < 1:
        raise UsageError("--sample: there must be at least one point")
    return method, int(count)


def files(records: Records, summary: Summary, curves: bool, plots: bool) -> Iterator[tuple[str, Data]]:
    """Yield every file of the sweep; the pictures last."""
    from cfmkit.studies.sweep import outputs

    yield from outputs(records, summary, curves)
    if plots:
        from cfmkit.cli.study_figures import pictures

        yield from pictures(records, summary)


def exit_code(records: Records, summary: Summary) -> ExitCode:
    """Return what the process is to say; points that were not computed count first."""
    if records.finished < len(records):
        return ExitCode.INTERRUPTED
    return summary.exit_code(records.bugs)
