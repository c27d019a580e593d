"""A mechanism beside its recording or its other models, and a model fitted to a recording, as reports on runs."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cfmkit import api
from cfmkit.documents.run_outcome import Report, Supplement, report_on
from cfmkit.runs.run import run_analysis

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.experiment.calibration import Calibration
    from cfmkit.experiment.comparison import Comparison
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.comparison_of_fidelities import FidelityComparison


def extend_by_recording(
    report: Report,  # on the model
    comparison: Comparison,  # of the model with the recording
    source: MeasuredCurves,  # the recording
    own: Supplement,  # more, about what was found: its files come first, its lines last
    before: Comparison | None = None,  # with the model as it was before a fit
) -> Report:
    """Return the report on a model beside a recording."""
    from cfmkit.experiment import measurement_and_calibration_outputs as add

    beside = Supplement(
        add.comparison_data(comparison, source) | dict(own.data),
        {**own.files, **add.comparison_files(source)},
        (*add.comparison_lines(comparison, source), *own.lines),
        (*add.comparison_warnings(comparison, source), *own.warnings),
        shortfall=add.shortfall(comparison),
        figures=add.comparison_figures(comparison, report.result.spec.name, before),
        tables=own.tables,
    )
    return report.extend(comparison.metrics() | comparison.loss(), beside)


def analyze_beside_recording(source: MeasuredCurves, spec: Spec, run: Run) -> Report:
    """Return the report on a mechanism beside its recording, with the causes that its family finds."""
    from cfmkit.experiment.comparison import compare
    from cfmkit.experiment.measurement_and_calibration_outputs import causes_lines

    report = run_analysis(spec, run)
    if not report.result.curves:
        return report
    comparison = compare(report.result, source)
    causes = comparison.causes(report.result)
    return extend_by_recording(report, comparison, source, Supplement(lines=causes_lines(causes))).extend(
        causes, Supplement()
    )


def analyze_by_each_model(work: Callable[[Spec, Run], Report], spec: Spec, run: Run) -> Report:
    """Return the report of a run beside the curves of the other models of its family."""
    from cfmkit.studies.comparison_of_fidelities import choices_of, compare, data_of, lines_of

    choices = choices_of(spec)
    report = work(spec, run)
    compared = compare(report.result, choices, run)
    return report.extend(
        compared.metrics(),
        Supplement(
            data_of(compared),
            lines=lines_of(compared),
            warnings=compared.warnings,
            curves=compared.curves,
            shortfall=compared.shortfall,
            figures={"fidelity": partial(_draw_models, compared)} if compared.curves else {},
        ),
    )


def _draw_models(compared: FidelityComparison) -> Figure:
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
    heading = Heading(compared.variants[0].result.spec.name, "one mechanism by several models", compared.shortfall)
    return fidelity_figure(heading, [item.curves[0] for item in solved], gaps)


def report_on_calibration(calibration: Calibration, source: MeasuredCurves) -> Report:
    """Return the report on a finished calibration."""
    from cfmkit.experiment import measurement_and_calibration_outputs as add
    from cfmkit.tables import to_csv

    own = Supplement(
        add.calibration_data(calibration),
        {
            "calibrated.yaml": lambda: api.dumps(calibration.spec).encode(),
            "parameters.csv": lambda: to_csv(add.parameters_table(calibration)),
            "residuals.csv": lambda: to_csv(add.residuals_table(calibration)),
        },
        add.calibration_lines(calibration, source.recording),
        calibration.warnings,
    )
    return extend_by_recording(report_on(calibration.result), calibration.after, source, own, calibration.before)
