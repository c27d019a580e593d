"""What `design`, `analyze` and `calibrate` share: options in, an answer out, the page of a run, its numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit import api
from cfmkit.cli.page_block_types import (
    BAD,
    BLANK,
    MARGIN,
    CellGrid,
    Paragraph,
    Span,
    Written,
    columns,
    command_line,
    spaced,
    title,
    verdict,
    whole_line,
)
from cfmkit.cli.verb_result import Answer
from cfmkit.errors import ExitCode, UsageError
from cfmkit.families import family
from cfmkit.metrics import Window, known_metrics, left_of, split_name, window_of
from cfmkit.metrics.metric_definitions import words
from cfmkit.runs.run import Request, carry_out
from cfmkit.runs.specfile import STDIN
from cfmkit.specs.units import border_unit, format_short, to_border
from cfmkit.specs.what_yield_metrics_mean import OF_MANY_PARTS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.cli.options import Computing, OneSpec
    from cfmkit.cli.output import Terminal
    from cfmkit.cli.page_block_types import Block
    from cfmkit.metrics import Outcome
    from cfmkit.results import Finding, Quantity, Searched
    from cfmkit.runs.run import FinishedRun, Verb
    from cfmkit.runs.run_outcome import Report
    from cfmkit.specs.spec import Requirement, Spec


NO_MOTION = (
    "--animate: no film was written, because this run has no poses to draw: it has no curve, its family draws none, "
    "or the cam is analysed dynamically or as measured"
)
"""What is said where a film was requested and there is none."""


def execute(verb: Verb, options: Computing, terminal: Terminal, page: bool = False) -> Answer:
    """Run a verb over the spec that the options name and write the folder."""
    out = folder_of(options, verb.name)
    wanted = Request(options.spec, out, options.changes, options.fidelity, options.seed, not options.no_plots)
    wanted = replace(wanted, page=page, form=options.form, animate=getattr(options, "animate", None))
    if wanted.animate == "mp4":
        from cfmkit.plots.animation import require_ffmpeg

        require_ffmpeg()
    with terminal.progress() as progress:
        outcome = carry_out(verb, wanted, terminal.arguments, progress)
    found = answer(outcome, everything=terminal.verbose > 0)
    if wanted.animate and f"figures/motion.{wanted.animate}" not in outcome.written:
        return replace(found, complaints=(*found.complaints, NO_MOTION))
    return found


def folder_of(options: OneSpec, verb: str) -> str:
    """Return the output folder: the one requested, or one named after the spec and the verb.

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
        raise UsageError("a spec from standard input has no name; give the output folder with --out")
    return str(Path("cfm-out") / f"{Path(options.spec).stem}-{verb}")


def answer(outcome: FinishedRun, everything: bool) -> Answer:
    """Return the answer of a finished run; its page shows what matters most, or everything."""
    found = outcome.report
    spec = found.result.spec
    written = Written(outcome.folder, (*outcome.written, "manifest.json"))
    data = found.as_json() | {"family": spec.family, "name": spec.name} | written.data
    design = found.design
    if design is not None:
        data |= {"active_bounds": list(design.active_bounds), "nearest_feasible": dict(design.nearest_feasible)}
    if outcome.kept:
        data |= {"kept": outcome.kept}
    page = _page(outcome, written, everything)
    return Answer(data, page, found.exit_code, quiet_complaints=tuple(_complaints(found)))


def _complaints(found: Report) -> list[str]:
    """Return what a user must hear who has asked to hear nothing else."""
    status = found.status
    if not status.usable:
        design = found.design
        reported = design.explanation if design is not None and design.spec is None else found.message
        return [f"error    {spaced(status.key)}: {reported}"]
    partial = [] if status.exit_code == 0 else [f"partial  {found.message}"]
    return [*partial, *(f"missed   {outcome.sentence.removesuffix(': missed')}" for outcome in found.missed)]


def _page(outcome: FinishedRun, written: Written, everything: bool) -> Iterator[Block]:
    """Yield a header, the numbers that matter, how the run ended, warnings, files."""
    found = outcome.report
    done = outcome.verb.done if found.result.status.usable else "tried"
    yield title(found.result.spec, f"{done} in {outcome.seconds:.2f} s", droppable=True)
    yield BLANK
    if listed := rows(found, everything):
        cells = [(f"  {row.label}", row.value, row.bound, verdict(row.ok)) for row in listed]
        yield CellGrid(columns(True, True, False, False), cells)
        yield BLANK
    for word, text in found.supplement.lines:
        yield Paragraph(word, text)
    for text in searched(found.design.search) if found.design else ():
        yield Paragraph("search", text)
    yield from _ending(outcome)
    yield from _warnings(outcome)
    yield written.block(everything)
    for name, spare in outcome.kept.items():
        yield Paragraph("kept", f"{name} was edited since the last run; the edited version is kept as {spare}", BAD)


def _ending(outcome: FinishedRun) -> Iterator[Block]:
    """Yield how the run ended, where that is not as asked, with what would cure it, and what the design decided."""
    found = outcome.report
    status, design = found.status, found.design
    if status.exit_code is not ExitCode.OK:
        cures = tuple(dict.fromkeys(cure for item in _reasons(found) for cure in item.cures))
        yield Paragraph("partial" if status.usable else "failed", found.message + (":" if cures else ""), BAD)
        yield from _commands(outcome, cures)
    elif design is not None and design.message != design.status.value:
        yield Paragraph("design", design.message)
    if design is not None and design.nearest_feasible:
        yield Paragraph("feasible", ", ".join(f"{path} = {value}" for path, value in design.nearest_feasible.items()))
    if found.missed:
        yield Paragraph("missed", f"{len(found.missed)} of {len(found.requirements)} requirements", BAD)


def _warnings(outcome: FinishedRun) -> Iterator[Block]:
    """Yield the warnings that say more than the run's message, each with the commands that would cure it."""
    reasons = _reasons(outcome.report)
    for item in outcome.report.warnings:
        if item not in reasons:
            yield Paragraph("warning", f"{item.name}: {item.message}" + (":" if item.cures else ""), BAD)
            yield from _commands(outcome, item.cures)


def _reasons(found: Report) -> list[Finding]:
    """Return the warnings that say what the run's message says."""
    return [item for item in found.warnings if item.message == found.result.message]


def _commands(outcome: FinishedRun, cures: Iterable[str | tuple[str, ...]]) -> Iterator[Block]:
    """Yield a line for each command that applies a cure."""
    for cure in cures:
        yield whole_line(Span(" " * MARGIN + _cure(outcome, cure)))


def _cure(outcome: FinishedRun, cure: str | tuple[str, ...]) -> str:
    """Return the command line that applies a cure to the spec of a run, changed as it was."""
    changes = (cure,) if isinstance(cure, str) else cure
    verb = "design" if changes[0].startswith("design.") else outcome.verb.name
    paths = [change.partition("=")[0] for change in changes]
    kept = [change for change in outcome.changes if change.partition("=")[0].strip() not in paths]
    settings = [word for change in (*kept, *changes) for word in ("--set", change)]
    folder = ["-o", outcome.folder] if outcome.source == STDIN else []
    words = outcome.verb.words if verb == outcome.verb.name else ()
    return command_line("cfmkit", verb, outcome.source, *words, *settings, *folder)


HEADLINE = (
    "force_mean",
    "torque_mean",
    "deviation_from_curve",
    "usable_stroke",
    "force_ripple",
    "torque_ripple",
    "hysteresis_area",
    "stress_max",
    "allowable_stress",
    "safety_factor",
)
"""Metrics that are shown of every family, as far as they have a value."""


@dataclass(frozen=True)
class NumberRow:
    """One line: what it is, its value, and the bound that it had to keep."""

    label: str
    value: str
    bound: str = ""
    ok: bool | None = None


def rows(report: Report, everything: bool = False) -> list[NumberRow]:
    """Return the lines of a report: numbers first, then what was required.

    Parameters
    ----------
    report : Report
        Of any status; without a curve there are none.
    everything : bool
        Every metric that has a value, not only those that matter most.
    """
    if not report.result.status.usable:
        return []
    asked = {outcome.metric for outcome in report.requirements}
    wanted = report.metrics if everything else (*family(report.result.spec.family).headline, *HEADLINE)
    plain = [name for name in dict.fromkeys(wanted) if name not in asked and "[" not in name]
    found = [_number(report, name) for name in plain if _has_value(report, name)]
    spec = report.result.spec
    judged = spec.requirements if len(report.requirements) == len(spec.requirements) else spec.part_requirements
    required = zip(judged, report.requirements, strict=True)
    return [*found, *(_requirement(report, *pair) for pair in required)]


def searched(found: Mapping[str, Searched]) -> list[str]:
    """Return what only a design search knows: one paragraph for each model and window, which it names first."""
    groups: dict[str, list[str]] = {}
    for name, one in found.items():
        if one.quantity.value is not None:
            over = "" if one.window is None else f", {span(*one.window, one.motion)}"
            groups.setdefault(one.model + over, []).append(f"{words(name)} {_short(one.quantity)}")
    return [f"{about}: {', '.join(reported)}" for about, reported in groups.items()]


def span(low: float, high: float, dimension: str) -> str:
    """Return an interval with one unit, rounded for reading.

    Examples
    --------
    >>> span(0.002, 0.24, "length")
    '2 ... 240 mm'
    """
    numbers = (f"{float(to_border(value, dimension)):.4g}" for value in (low, high))
    return f"{' ... '.join(numbers)} {border_unit(dimension)}"


def _has_value(report: Report, name: str) -> bool:
    quantity = report.metrics.get(name)
    return quantity is not None and quantity.value is not None


def _number(report: Report, name: str) -> NumberRow:
    if name == "usable_stroke":
        return NumberRow(words(name), _stroke(report))
    if name == "allowable_stress":
        return NumberRow(words(name), _short(report.metrics[name]) + _rule(report.result.spec))
    window = left_of(window_of(report.result), report.result)
    rule = _allowed(report) if name == "safety_factor" else ""
    rule += _overrated(report, name) if name.endswith("safety_factor") else ""
    rule += _flat_part(report) if name == "window_force" else ""
    return NumberRow(words(name), _branches(report, name, report.metrics) + _over(report, name, window) + rule)


def _flat_part(report: Report) -> str:
    """Return where the flat part of a curve is: not the window that is judged."""
    start, end = (report.metrics[name] for name in ("window_start", "window_end"))
    return "" if start.value is None or end.value is None else f" over {span(start.value, end.value, start.dimension)}"


def _allowed(report: Report) -> str:
    """Return the stress that a safety factor is of, where no row of its own says it."""
    allowed = report.result.allowable_stress
    if allowed is None or "allowable_stress" in report.metrics:
        return ""
    return f", of {format_short(allowed, 'stress')}{_rule(report.result.spec)}"


def _overrated(report: Report, name: str) -> str:
    """Return why a safety factor below one is no finding: the model is known to overestimate the stress by as much."""
    factor, share = report.metrics[name].value, report.result.stress_overrated
    reported = {one.name for one in report.result.warnings}
    if factor is None or "overstressed" in reported or not 1 / (1 + share) <= factor < 1:
        return ""
    return f" (this model overestimates the stress by up to {100 * share:.2g} %)"


def _stroke(report: Report) -> str:
    """Return the usable stroke with its ends and the travel that was run."""
    stroke, start, end = (report.metrics[name] for name in ("usable_stroke", "usable_start", "usable_end"))
    length, motion = _short(stroke), report.result.curve.motion
    if start.value is None or end.value is None:
        return length
    run = span(float(motion.min()), float(motion.max()), stroke.dimension)
    return f"{length}: {span(start.value, end.value, stroke.dimension)} of {run}"


def _rule(spec: Spec) -> str:
    """Return by which rule a stress is allowed, where the mechanism says how much of its strength may be used."""
    try:
        return f": yield strength / {spec.at('mechanism.safety_factor'):.4g}"
    except KeyError:
        return ""


def _branches(report: Report, name: str, metrics: Mapping[str, Quantity]) -> str:
    """Return the value on each branch where they differ, else the one value."""
    each = {branch: metrics.get(f"{name}[{branch}]") for branch in report.result.curve.branches}
    texts = {branch: _short(item, 3) for branch, item in each.items() if item is not None and item.value is not None}
    if len(texts) == len(each) and len(set(texts.values())) > 1:
        return ", ".join(f"{text} {branch}" for branch, text in texts.items())
    return _short(metrics[name])


def _short(quantity: Quantity, digits: int = 4) -> str:
    if quantity.word is not None:
        return quantity.word
    return "no value" if quantity.value is None else format_short(quantity.value, quantity.dimension, digits)


def _over(report: Report, name: str, window: Window | None) -> str:
    """Return the window, if there is one and the metric looks only inside."""
    curve = report.result.curve
    windowed = {item.name for item in known_metrics(curve.kind) if item.windowed}
    if window is None or split_name(name)[0] not in windowed:
        return ""
    return f" over {span(window.lo, window.hi, curve.motion_dimension)}"


def _requirement(report: Report, requirement: Requirement, outcome: Outcome) -> NumberRow:
    label = words(outcome.metric)
    if outcome.value is None:
        reason = outcome.sentence.partition("no value (")[2].rpartition("), ")[0]
        return NumberRow(label, f"no value: {reason}", _bound(requirement), False)
    if outcome.ok:
        return NumberRow(label, _kept(report, outcome), _bound(requirement), True)
    # The sentence rounds so that the value stays on its side of the bound.
    missed = outcome.sentence.rpartition(", ")[0].removeprefix(label).strip()
    return NumberRow(label, missed, _bound(requirement), False)


def _kept(report: Report, outcome: Outcome) -> str:
    """Return the value of a metric that keeps its bound, branch by branch, over the window it was measured in."""
    if outcome.metric in OF_MANY_PARTS:
        return _short(report.metrics[outcome.metric], 3)
    window = Window(*outcome.over) if outcome.over else None
    # only what the row shows: all metrics over its window would take longer than the model of a cam
    branches = [f"{outcome.metric}[{branch}]" for branch in report.result.curve.branches]
    own = report.result.values
    by_branch = {item.name for item in known_metrics(report.result.curve.kind)} - set(own)
    shown = [name for name in branches if name in own or outcome.metric in by_branch]
    measured = api.evaluate(report.result, (outcome.metric, *shown), window)
    return _branches(report, outcome.metric, measured) + _over(report, outcome.metric, window)


def _bound(requirement: Requirement) -> str:
    if requirement.min is None:
        return f"<= {requirement.max}"
    return f">= {requirement.min}" if requirement.max is None else f"{requirement.min} ... {requirement.max}"
