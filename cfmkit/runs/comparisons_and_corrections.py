"""Reports on a mechanism beside its recording, beside its other models, fitted to a recording, or corrected by it.

``cfmkit correct`` changes a design so that the next part has the force that a measured part missed: its files are the
corrected design, and a table of values before, after, and predicted for the next part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit import api
from cfmkit.documents.document import GridColumn, PageTable
from cfmkit.documents.run_outcome import Report, Supplement, empty_result, report_on
from cfmkit.errors import SpecError
from cfmkit.experiment import measurement_and_calibration_outputs as add
from cfmkit.experiment.correction import correct
from cfmkit.experiment.redrawn_values import NotMakeable, dimension_of
from cfmkit.metrics import evaluate
from cfmkit.metrics.metric_definitions import words
from cfmkit.results import Design, Status
from cfmkit.runs.run import run_analysis
from cfmkit.specs.units import border_unit, format_short, to_border
from cfmkit.tables import Table, TableColumn, to_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.figure import Figure

    from cfmkit.experiment.calibration import Calibration
    from cfmkit.experiment.comparison import Comparison
    from cfmkit.experiment.correction import DesignCorrection
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.families.run_control import Run
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.comparison_of_fidelities import FidelityComparison


def extend_by_recording(
    report: Report,  # on the model
    comparison: Comparison,  # of the model with the recording
    source: MeasuredCurves,  # the recording
    supplement: Supplement,  # more, about what was found: its files come first, its lines last
    before: Comparison | None = None,  # with the model as it was before a fit
) -> Report:
    """Return the report on a model beside a recording."""
    from cfmkit.experiment import measurement_and_calibration_outputs as add

    beside = Supplement(
        add.comparison_data(comparison, source) | dict(supplement.data),
        {**supplement.files, **add.comparison_files(source)},
        (*add.comparison_lines(comparison, source), *supplement.lines),
        (*add.comparison_warnings(comparison, source), *supplement.warnings),
        shortfall=add.shortfall(comparison),
        figures=add.comparison_figures(comparison, report.result.spec.name, before),
        tables=supplement.tables,
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
    from cfmkit.plots.curves import Gap, fidelity_figure

    solved = [item for item in compared.variants if item.result.curves]
    gaps = [
        Gap(
            index,
            "" if number else f"{item.name} \N{MINUS SIGN} {compared.finest}",
            compared.differences(item).places,
            difference.values,
        )
        for index, item in enumerate(solved)
        if item.name != compared.finest
        for number, difference in enumerate(compared.differences(item).curves.values())
        if len(difference.values)
    ]
    heading = Heading(compared.variants[0].result.spec.name, "one mechanism by several models", compared.shortfall)
    return fidelity_figure(heading, [item.curves[0] for item in solved], gaps)


def report_on_calibration(calibration: Calibration, source: MeasuredCurves) -> Report:
    """Return the report on a finished calibration."""
    from cfmkit.experiment import measurement_and_calibration_outputs as add
    from cfmkit.tables import to_csv

    supplement = Supplement(
        add.calibration_data(calibration),
        {
            "calibrated.yaml": lambda: api.dumps(calibration.spec).encode(),
            "parameters.csv": lambda: to_csv(add.parameters_table(calibration)),
            "residuals.csv": lambda: to_csv(add.residuals_table(calibration)),
        },
        add.calibration_lines(calibration, source.recording),
        calibration.warnings,
    )
    return extend_by_recording(report_on(calibration.result), calibration.after, source, supplement, calibration.before)


WITHIN_SCATTER = "within the scatter: nothing to correct"
SHOWN_METRICS = ("ripple", "max", "stress_max", "safety_factor", "hysteresis_area")
"""What is compared beside the mean; the first two are of the force or torque."""
N_ROWS_ON_PAGE = 8


@dataclass(frozen=True)
class CorrectedValue:
    """One value of the part before, and of the corrected one, in SI; ends of 95 % intervals where they are known."""

    name: str
    dimension: str
    before: float
    after: float
    before_ends: tuple[float, float] | None = None
    after_ends: tuple[float, float] | None = None

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Name, before, after and the interval of the prediction, as a page shows them."""
        before = self._format_value(self.before)
        if self.before_ends is not None:
            before += f" ({self._format_span(self.before_ends)})"
        predicted = "" if self.after_ends is None else self._format_span(self.after_ends)
        return self.name, before, self._format_value(self.after), predicted

    def _format_value(self, value: float) -> str:
        return format_short(value, self.dimension, 5)

    def _format_span(self, ends: tuple[float, float]) -> str:
        return f"{float(to_border(ends[0], self.dimension)):.4g} to {self._format_value(ends[1])}"

    @property
    def numbers(self) -> dict[str, Any]:
        """Values and interval ends in border units, by name; None where there is no interval."""
        numbers: dict[str, float | None] = {"before": self.before, "after": self.after}
        for name, ends in (("before", self.before_ends), ("after", self.after_ends)):
            numbers |= {f"{name}_low_95": ends and ends[0], f"{name}_high_95": ends and ends[1]}
        shown = {
            key: None if value is None else float(f"{float(to_border(value, self.dimension)):.12g}")
            for key, value in numbers.items()
        }
        return {"value": self.name, "unit": border_unit(self.dimension), **shown}


def report_on_corrected(source: MeasuredCurves, fit: str | None, tared: bool, spec: Spec, run: Run) -> Report:
    """Return the report on the corrected design: metrics of the part that will be made of it."""
    drawn = api.resolve(spec)
    try:
        correction = correct(drawn, source, None if fit is None else fit.split(","), tared, run)
    except NotMakeable as problem:
        failed = Design(None, Status.INFEASIBLE, str(problem), nearest_feasible=problem.nearest)
        return report_on(empty_result(drawn, failed), failed)
    return report_of(correction, source, tared or fit is not None)


def report_of(correction: DesignCorrection, source: MeasuredCurves, zero_known: bool) -> Report:
    """Return the report on a correction."""
    calibration = correction.explanation.calibration
    rows = rows_of(correction)
    made = replace(correction.predicted, spec=correction.corrected)
    files = {
        **dict(_specs_of_parts(correction)),
        "correction.csv": lambda: to_csv(_values_table(rows)),
        "residuals.csv": lambda: to_csv(add.residuals_table(calibration)),
    }
    if calibration.parameters:
        files["parameters.csv"] = lambda: to_csv(add.parameters_table(calibration))
    heads = ("", "before (95 %)", "after", "predicted (95 %)")
    shown = rows if correction.changes else rows[:1]  # else every value is as before
    table = PageTable("", tuple(map(GridColumn, heads)), tuple(row.cells for row in shown), N_ROWS_ON_PAGE)
    supplement = Supplement(
        add.calibration_data(calibration) | {"correction": _correction_data(correction, rows)},
        files,
        warnings=(*calibration.warnings, *correction.warnings),
        tables=(table,),
    )
    before = calibration.before if calibration.parameters else None
    report = report_on(made, Design(correction.corrected, Status.COMPLETE))
    report = extend_by_recording(report, calibration.after, source, supplement, before)
    # how the file was read and the residuals are no news here
    return replace(
        report, supplement=replace(report.supplement, lines=tuple(_correction_notes(correction, zero_known)))
    )


def rows_of(correction: DesignCorrection) -> tuple[CorrectedValue, ...]:
    """Return the redrawn values, then forces and stress of the part that was made and of the next one."""
    drawn = [
        CorrectedValue(path.removeprefix("mechanism."), dimension_of(correction.drawn, path), before, now)
        for path, (before, now) in correction.changes.items()
    ]
    kind = correction.nominal.curve.kind
    forces = correction.before, correction.after
    ends = [(force.low, force.high) for force in forces]
    mean = CorrectedValue(f"mean {kind}", kind, forces[0].value, forces[1].value, *ends)
    return (*drawn, mean, *_metric_rows(correction, kind))


def _metric_rows(correction: DesignCorrection, kind: str) -> Iterator[CorrectedValue]:
    names = [f"{kind}_{name}" if name in ("ripple", "max") else name for name in SHOWN_METRICS]
    before, after = evaluate(correction.built), evaluate(correction.predicted)
    for name in names:
        old, new = before.get(name), after.get(name)
        if old is not None and new is not None and old.value is not None and new.value is not None:
            yield CorrectedValue(words(name), new.dimension, old.value, new.value)


def _correction_notes(correction: DesignCorrection, zero_known: bool) -> Iterator[tuple[str, str]]:
    """Yield what differs in the part, and what is done about it."""
    calibration, kind = correction.explanation.calibration, correction.nominal.curve.kind
    for explanation in correction.explanations:
        word = "found" if explanation is correction.explanation else "or"
        yield word, "; ".join(explanation.sentences) or "the recording shows no error of the part"
    zero = calibration.zeros.effort
    if zero:
        yield "zero", f"without load the sensor shows {format_short(zero, kind, 3)}, which is taken off"
    elif not zero_known:
        yield "zero", "the recording does not tell it from the force: taken as recorded, within 2 % (state --tare)"
    loss = calibration.after.loss()
    if (factor := loss.get("data_loss_factor")) is not None and factor.value is not None:
        area = format_short(loss["data_loss"].value or 0.0, "energy", 3)
        yield "loss", f"a measured cycle loses {area}, loss factor {factor.value:.3g}"
    wanted, reached = (format_short(value, kind, 4) for value in (correction.target, correction.before.value))
    if not correction.changes:
        yield "corrected", f"{WITHIN_SCATTER} (mean {kind} {reached})"
        return
    yield "corrected", f"for {wanted} instead of {reached}; the next part is assumed to be made with the same errors"
    if correction.will_be_made != correction.corrected:
        yield "made", "this page is of the part as it will be made: predicted.yaml; design.yaml is what is drawn"


def _specs_of_parts(correction: DesignCorrection) -> Iterator[tuple[str, Any]]:
    """Yield the parts with their errors as specifications, where a specification can say so."""
    parts = {"calibrated.yaml": correction.made} | (
        {"predicted.yaml": correction.will_be_made} if correction.changes else {}
    )
    for name, part in parts.items():
        text = api.dumps(part)
        try:
            api.loads(text, name)
        except SpecError:  # a spring that is not as its wire says
            continue
        if part not in (correction.drawn, correction.corrected):
            yield name, partial(str.encode, text)


def _values_table(rows: tuple[CorrectedValue, ...]) -> Table:
    records = [row.numbers for row in rows]
    columns = []
    for name in records[0]:
        values = tuple("" if record[name] is None else record[name] for record in records)
        columns.append(TableColumn(name, values))
    return Table(tuple(columns))


def _correction_data(correction: DesignCorrection, rows: tuple[CorrectedValue, ...]) -> dict[str, Any]:
    """Return what metrics.json says of a correction."""
    return {
        "within_scatter": not correction.changes,
        "values": [row.numbers for row in rows],
        "explanations": [
            {"errors": [error.label for error in item.errors], "criterion": item.criterion}
            for item in correction.explanations
        ],
    }
