"""``cfmkit analyze``: curve, metrics and requirements of a mechanism as specified."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Annotated

from cfmkit.cli.options import (
    Animate,
    ComputeOptions,
    MeasurementOptions,
    Overlay,
    WithReport,
    data_record,
    flag,
    given_measurement_options,
    option,
    read_measured,
    refuse_without_data,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document
    from cfmkit.documents.run_outcome import Report
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.comparison_of_fidelities import FidelityComparison

HELP_POSITION = 20
HELP_EXAMPLE = "cfmkit analyze cam.yaml --set mechanism.rolling_friction=0.004 --report"


@dataclass(frozen=True, kw_only=True)
class AnalyzeOptions(ComputeOptions, MeasurementOptions):
    """Arguments and options."""

    report: WithReport = False
    animate: Animate = None
    overlay: Overlay = None
    data: Annotated[
        str | None,
        option("--data", metavar="FILE.csv", text="Measured curve to overlay; reports the errors of the model."),
    ] = None
    compare_fidelity: Annotated[
        bool, flag("--compare-fidelity", text="Overlay the curves of all models and report their differences.")
    ] = False


def run(options: AnalyzeOptions, terminal: Terminal) -> Document:
    """Analyse a mechanism as it is: curve, metrics, requirements, figures; with --data also a measured curve."""
    from cfmkit.cli.run_spec_and_print_page import execute
    from cfmkit.runs.run import Verb, run_analysis

    work, inputs = run_analysis, {}
    words: tuple[str, ...] = ()
    if options.data is not None:
        inputs, words = data_record(options.data), ("--data", options.data, *chain(*given_measurement_options(options)))
        work = partial(compute_beside, read_measured(options.data, options))
    else:
        refuse_without_data(options)
    if options.compare_fidelity:
        work = partial(compute_each, work)
    verb = Verb("analyze", "analysed", work, inputs, words=words)
    return execute(verb, options, terminal, options.report)


def compute_beside(source: MeasuredCurves, spec: Spec, run: Run) -> Report:
    """Return the report on a mechanism beside its measured curve."""
    from cfmkit.documents.run_outcome import Supplement
    from cfmkit.experiment.comparison import compare
    from cfmkit.experiment.measurement_and_calibration_outputs import (
        causes_lines,
        comparison_data,
        comparison_figures,
        comparison_files,
        comparison_lines,
        comparison_warnings,
        shortfall,
    )
    from cfmkit.runs.run import run_analysis

    found = run_analysis(spec, run)
    if not found.result.curves:
        return found
    comparison = compare(found.result, source)
    causes = comparison.causes(found.result)
    return found.extend(
        comparison.metrics() | comparison.loss() | dict(causes),
        Supplement(
            comparison_data(comparison, source),
            comparison_files(source),
            comparison_lines(comparison, source) + causes_lines(causes),
            comparison_warnings(comparison, source),
            shortfall=shortfall(comparison),
            figures=comparison_figures(comparison, spec.name),
        ),
    )


def compute_each(work: Callable[[Spec, Run], Report], spec: Spec, run: Run) -> Report:
    """Return the report on a mechanism beside the curves of its other models."""
    from cfmkit.documents.run_outcome import Supplement
    from cfmkit.studies.comparison_of_fidelities import choices_of, compare, data_of, lines_of

    choices = choices_of(spec)
    found = work(spec, run)
    compared = compare(found.result, choices, run)
    drawn = {"fidelity": partial(_picture, compared)} if compared.curves else {}
    return found.extend(
        compared.metrics(),
        Supplement(
            data_of(compared), {}, lines_of(compared), compared.warnings, compared.curves, compared.shortfall, drawn
        ),
    )


def _picture(compared: FidelityComparison) -> Figure:
    """Return the curves overlaid."""
    from cfmkit.plots.axis_labels_and_headings import Heading
    from cfmkit.plots.fidelity import Gap, fidelity_figure

    solved = [item for item in compared.variants if item.result.curves]
    gaps = [
        Gap(
            index,
            "" if number else f"{item.name} \N{MINUS SIGN} {compared.finest}",
            compared.differences(item).places,
            each.values,
        )
        for index, item in enumerate(solved)
        if item.name != compared.finest
        for number, each in enumerate(compared.differences(item).curves.values())
        if len(each.values)
    ]
    spec = compared.variants[0].result.spec
    heading = Heading(spec.name, "one mechanism by several models", compared.shortfall)
    return fidelity_figure(heading, [item.curves[0] for item in solved], gaps)
