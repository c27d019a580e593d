"""``cfmkit sensitivity``: which value matters, and how good the made parts will be."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cfmkit.cli.options import Common
from cfmkit.cli.studies import Studying
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.cli.answer import Answer
    from cfmkit.cli.terminal import Terminal
    from cfmkit.specs.spec import Spec
    from cfmkit.store.disk import Data
    from cfmkit.studies.sensitivity.findings import Findings

PLACE = 24

Method = Annotated[
    Literal["oat", "local", "morris", "sobol", "tolerance"] | None,
    typer.Option(
        "--method",
        help="One at a time, gradients, Morris screening, Sobol indices, or Monte Carlo over tolerances; "
        "default: the spec's, else oat.",
        show_default=False,
    ),
]
Samples = Annotated[
    int | None,
    typer.Option(
        "--samples",
        metavar="N",
        min=2,
        help="oat: points per parameter; morris: trajectories; sobol: base samples; tolerance: parts.",
        show_default=False,
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="A.B=SPREAD",
        help="A parameter: low:high, normal:DEVIATION or uniform:HALF-WIDTH, e.g. "
        "mechanism.roller_radius='normal:0.05 mm', 'uniform:2 %'. Repeatable; replaces the spec's parameters.",
        show_default=False,
    ),
]
OnFailure = Annotated[
    Literal["fail", "resample", "bound"] | None,
    typer.Option(
        "--on-failure",
        help="Samples without a result: state no index, draw their block anew, or state intervals; default: fail.",
        show_default=False,
    ),
]
Metrics = Annotated[
    str | None,
    typer.Option(
        "--metrics",
        metavar="A,B",
        help="What to look at; default: the metrics of the requirements, over their windows.",
        show_default=False,
    ),
]
StatedSeed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        metavar="N",
        min=0,
        max=2**63 - 1,
        help="Seed of everything random; default: the spec's, else 0.",
        show_default=False,
    ),
]
Design = Annotated[bool, typer.Option("--design", help="Design the mechanism anew at each sample.")]


@dataclass(frozen=True, kw_only=True)
class Options(Studying, Common):
    """Arguments and options."""

    method: Method = None
    samples: Samples = None
    seed: StatedSeed = None  # type: ignore[assignment]
    vary: Vary = None
    on_failure: OnFailure = None
    metrics: Metrics = None
    design: Design = False


def run(options: Options, terminal: Terminal) -> Answer:
    """Find out which value matters most, and how many made parts will meet the requirements.

    The spec's block `sensitivity` says what is uncertain. Finished samples are noted in the folder: after an
    interruption the same command goes on.
    """
    from cfmkit.cli import studies
    from cfmkit.cli.runs import folder_of
    from cfmkit.cli.sensitivity_page import answer
    from cfmkit.studies.sensitivity.methods import carry_out
    from cfmkit.studies.sensitivity.output import exit_code
    from cfmkit.studies.sensitivity.setup import prepare

    start = studies.now()
    out = folder_of(options, "sensitivity")
    setup = prepare(spec_of(options), options.seed, options.max_points)
    with studies.desk(out, terminal, options.fresh) as place:
        place.folder.check("results.csv", "indices.csv", "metrics.json", "resolved.yaml")
        found = replace(carry_out(setup, lambda work: studies.compute(work, options, place)), fresh=options.fresh)
        for piece in found.evaluator.pieces:
            studies.tracebacks(piece.records, terminal)
        for name, data in files(found, not options.no_plots):
            place.folder.write(name, data)
        made = studies.Made("sensitivity", options.spec, setup.study.spec, setup.seed, found.evaluator.count)
        manifest = studies.commit(place, made, terminal, exit_code(found))
        studies.finish(place, [piece.records for piece in found.evaluator.pieces])
    return answer(found, out, (*manifest.files, "manifest.json"), studies.now() - start)


def files(found: Findings, plots: bool) -> Iterator[tuple[str, Data]]:
    """Yield every file of the study; the pictures last."""
    from cfmkit.studies.sensitivity.output import outputs

    yield from outputs(found)
    if plots and not found.interrupted:
        from cfmkit.plots.sensitivity import figures
        from cfmkit.plots.style import png

        for stem, draw in figures(found).items():
            yield f"figures/{stem}.png", png(draw())


def spec_of(options: Options) -> Spec:
    """Return the spec with what the options say about its block `sensitivity`.

    Raises
    ------
    cfmkit.errors.UsageError
        If an option is malformed.
    cfmkit.errors.SpecError
        If the block is not valid with it.
    """
    from cfmkit.cli.runs import spec_of as plain
    from cfmkit.studies.sensitivity.parameters import with_options

    spec = plain(options)
    changes = changes_of(options)
    if not changes or (spec.sensitivity is None and "parameters" not in changes):
        return spec
    return spec.replace({"sensitivity": with_options(spec.sensitivity, changes)})


def changes_of(options: Options) -> dict[str, Any]:
    """Return what the options say, by key of the block."""
    from cfmkit.cli.studies import names

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
        told = "write PATH=low:high, PATH=normal:DEVIATION or PATH=uniform:HALF-WIDTH, with units"
        raise UsageError(f"--vary {option!r}: {told}")
    return path, {first: second} if first in ("normal", "uniform") else (first, second)
