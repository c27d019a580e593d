"""The document of a run (`design`, `analyze`, `calibrate`): verdict, requirements, metrics, warnings with remedies."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.documents.document import (
    MAX_WARNING_LENGTH,
    Document,
    GridColumn,
    Note,
    PageTable,
    Span,
    Tone,
    ValueRow,
    WarningEntry,
    Written,
    command_line,
    format_bounds,
    name_in_words,
    shortened_to_clause,
)
from cfmkit.errors import ExitCode
from cfmkit.families import family
from cfmkit.metrics import Window, evaluate, known_metrics, shorten_window, split_name, window_of
from cfmkit.metrics.metric_definitions import words
from cfmkit.specs.further_metrics import OF_MANY_PARTS
from cfmkit.specs.units import border_unit, format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cfmkit.documents.run_outcome import Report
    from cfmkit.metrics import Outcome
    from cfmkit.results import Finding, Quantity, Searched
    from cfmkit.specs.spec import Requirement

STDIN_PATH = "-"
SHORT_LABELS = {
    "force_ripple": "ripple",
    "torque_ripple": "ripple",
    "deviation_from_target": "deviation",
    "safety_factor": "safety",
    "stress_max": "stress",
    "hysteresis_area": "hysteresis",
}
"""What values are called where there is little room."""
SHOWN_METRICS = (
    "force_ripple",
    "torque_ripple",
    "allowable_stress",
    "safety_factor",
)
"""Metrics that are shown of every family, as far as they have a value."""
SHOWN_PARTS = {
    "test plan": re.compile(r", and expect (?P<text>.*): each range"),
    "yield": re.compile(
        r"(?P<text>[^:]*%[^:]*\)[^:]*): .*with margins(?P<more>: the same command with )(?P<remedy>.*)"
    ),
}
"""What a short page shows of a paragraph that is longer: its text, and the options that remedy it."""
LITTLE_MARGIN = 1.05  # safety factor below which the margin is called little


@dataclass(frozen=True)
class RunCommand:
    """Command that started a run, so that a remedy can be written as the command that applies it."""

    verb: str
    source: str  # the specification; ``-`` is standard input
    changes: tuple[str, ...] = ()  # what ``--set`` said
    words: tuple[str, ...] = ()  # other words of the command line, which another verb does not take
    folder: str = ""

    def with_remedy(self, cure: str | tuple[str, ...]) -> str:
        """Return the command line that applies a cure to the specification, changed as it was."""
        changes = (cure,) if isinstance(cure, str) else cure
        verb = "design" if changes[0].startswith("design.") else self.verb
        paths = [change.partition("=")[0] for change in changes]
        kept = [change for change in self.changes if change.partition("=")[0].strip() not in paths]
        settings = [word for change in (*kept, *changes) for word in ("--set", change)]
        folder = ["-o", self.folder] if self.source == STDIN_PATH else []
        return command_line("cfmkit", verb, self.source, *(self.words if verb == self.verb else ()), *settings, *folder)


def document_of(
    report: Report,  # of any status
    command: RunCommand | None = None,  # how the run was started; default: remedies are named as options only
    files: Written | None = None,  # what the run wrote
) -> Document:
    """Return the document of a report."""
    spec = report.result.spec
    return Document(
        exit_code=report.exit_code,
        title=" ".join(spec.name.split()),
        summary=_mean_effort_in_words(report),
        verdict=verdict_of(report),
        headline=headline_of(report),
        metrics=metrics_of(report),
        tables=report.supplement.tables,
        notes=tuple(_notes(report, command)),
        warnings=tuple(warning_of(item, command) for item in report.warnings if item not in _reasons(report)),
        files=files,
    )


def verdict_of(report: Report) -> str:
    """Return how a run ended, in a few words."""
    missed, count = len(report.missed), len(report.requirements)
    met = f"{missed} of {count} requirements missed" if missed else _say_all_met(count)
    if not report.status.usable:
        return name_in_words(report.status.key)
    return met if report.status.exit_code is ExitCode.OK else f"partial, {met}"


def _say_all_met(count: int) -> str:
    if count == 0:
        return "no requirements"
    return "requirement met" if count == 1 else f"all {count} requirements met"


def warning_of(item: Finding, command: RunCommand | None = None) -> WarningEntry:
    """Return a finding as a warning of the page, with its remedies as commands."""
    options = tuple(_remedy_as_options(cure, command) for cure in item.cures)
    commands = tuple(command.with_remedy(cure) if command else command_line(*_set_options(cure)) for cure in item.cures)
    short = shortened_to_clause(item.short or item.message, MAX_WARNING_LENGTH - len(item.name) - 2)
    return WarningEntry(item.name, short, item.message, options, commands)


def _remedy_as_options(cure: str | tuple[str, ...], command: RunCommand | None) -> str:
    """Return a remedy as options; with the verb where it is another one than that of the run."""
    first = cure if isinstance(cure, str) else cure[0]
    is_other_verb = first.startswith("design.") and command is not None and command.verb != "design"
    return command_line(*(["design"] if is_other_verb else []), *_set_options(cure))


def _set_options(cure: str | tuple[str, ...]) -> list[str]:
    return [word for change in ((cure,) if isinstance(cure, str) else cure) for word in ("--set", change)]


def _reasons(report: Report) -> list[Finding]:
    """Return the findings whose text is the run's message."""
    return [item for item in report.warnings if item.message == report.result.message]


def _notes(report: Report, command: RunCommand | None) -> Iterator[Note]:
    """Yield how the run ended where that is not as requested, what the design decided, and what the verb adds."""
    status, design = report.status, report.design
    if status.exit_code is not ExitCode.OK:
        yield Note("partial" if status.usable else "failed", report.message, tone=Tone.BAD, whole=True)
        cures = dict.fromkeys(cure for item in _reasons(report) for cure in item.cures)
        for cure in cures:
            text = command.with_remedy(cure) if command else command_line(*_set_options(cure))
            yield Note("remedy", text, is_command=True)
    elif design is not None and design.message != design.status.value:
        yield Note("design", design.message)
    if design is not None and design.nearest_feasible:
        yield from _nearest_feasible(design.nearest_feasible)
    for word, text in report.supplement.lines:
        yield note_of(word, text)
    for text in search_sentences(design.search) if design else ():
        yield Note("search", text, is_detail=True)


def note_of(word: str, text: str) -> Note:
    """Return a paragraph that a verb adds, with what a short page shows of it."""
    shown = SHOWN_PARTS[word].search(text) if word in SHOWN_PARTS else None
    parts = shown.groupdict() if shown else {}
    remedy = parts.get("remedy", "")
    return Note(word, text.removesuffix(parts.get("more", "") + remedy), remedy, short=parts.get("text", ""))


_PLAIN_VALUE = re.compile(r"[-+]?[\d.]+(?:[eE][-+]?\d+)? ?[^\s,]*")


def _nearest_feasible(nearest: Mapping[str, str]) -> Iterator[Note]:
    """Yield the nearest values that work: plain values as options that can be pasted, bounds and others in words."""
    plain = {path: "".join(value.split()) for path, value in nearest.items() if _PLAIN_VALUE.fullmatch(value)}
    if plain:
        yield Note(
            "feasible", " ".join(f"--set {path}={value}" for path, value in plain.items()), whole=True, is_command=True
        )
    for path, value in nearest.items():
        if path not in plain:
            yield Note("feasible", f"{path}: {value}", whole=True)


def search_sentences(searched: Mapping[str, Searched]) -> list[str]:
    """Return what only a design search knows: one sentence for each model and window, which it names first."""
    groups: dict[str, list[str]] = {}
    for name, value in searched.items():
        if value.quantity.value is not None:
            over = "" if value.window is None else f", {span(*value.window, value.motion)}"
            groups.setdefault(value.model + over, []).append(f"{words(name)} {short_value(value.quantity)}")
    return [f"{about}: {', '.join(reported)}" for about, reported in groups.items()]


def span(low: float, high: float, dimension: str) -> str:
    """Return an interval with one unit, rounded for reading.

    Examples
    --------
    >>> span(0.002, 0.24, "length")
    '2 to 240 mm'
    """
    numbers = (f"{float(to_border(value, dimension)):.4g}" for value in (low, high))
    return f"{' to '.join(numbers)} {border_unit(dimension)}"


# --- title ------------------------------------------------------------------------------------------------------------


def shown_window(report: Report) -> Window | None:
    """Return the window of the title: that of the analysis, else the one that all requirements share."""
    if (window := window_of(report.result)) is not None:
        return shorten_window(window, report.result)
    shared = {outcome.over for outcome in report.requirements if outcome.over is not None}
    return shorten_window(Window(*shared.pop()), report.result) if len(shared) == 1 else None


def _mean_effort_in_words(report: Report) -> str:
    """Return the mean effort over the window; "" without a curve."""
    result = report.result
    if not result.status.usable or not result.curves:
        return ""
    curve, window = result.curve, shown_window(report)
    name = f"{curve.kind}_mean"
    measured = report.metrics
    if window is not None and window_of(result) is None:
        measured = evaluate(result, (name, *(f"{name}[{branch}]" for branch in curve.branches)), window)
    low, high = (window.lo, window.hi) if window else (float(curve.motion.min()), float(curve.motion.max()))
    if name not in measured or measured[name].value is None:
        return f"over {span(low, high, curve.motion_dimension)}"
    mean = branches(report, name, measured)
    return f"{mean} over {format_short(high - low, curve.motion_dimension)} ({span(low, high, curve.motion_dimension)})"


# --- values -----------------------------------------------------------------------------------------------------------


def headline_of(report: Report) -> tuple[ValueRow, ...]:
    """Return requirements with their verdicts, then what matters most of the family; nothing without a curve."""
    if not report.result.status.usable:
        return ()
    spec = report.result.spec
    judged = spec.requirements if len(report.requirements) == len(spec.requirements) else spec.part_requirements
    required = [_requirement_row(report, *pair) for pair in zip(judged, report.requirements, strict=True)]
    return (*required, *_fact_rows(report))


def metrics_of(report: Report) -> tuple[ValueRow, ...]:
    """Return every metric that has a value, by branch where branches differ."""
    if not report.result.status.usable:
        return ()
    names = [name for name in report.metrics if "[" not in name and _has_value(report, name)]
    names += [name for name in report.metrics if "[" in name and split_name(name)[0] not in report.metrics]
    window = shorten_window(window_of(report.result), report.result)
    return tuple(
        ValueRow(
            words(name),
            branches(report, name, report.metrics) + _remark(report, name),
            window=_format_window(report, name, window),
            about=report.metrics[name].definition,
        )
        for name in names
    )


def metrics_table(metrics: Mapping[str, Quantity]) -> PageTable:
    """Return one row for each metric, with a column for each branch; those without a value say why."""
    named = [(name, *split_name(name)) for name in metrics]
    branches = tuple(dict.fromkeys(branch for _, base, branch in named if branch is not None and base in metrics))
    rows = []
    for name, base, branch in named:
        if branch in branches and base in metrics:
            continue
        by_branch = [metrics.get(f"{name}[{item}]") for item in branches]
        values = [
            _long_value(metrics[name]),
            *("" if quantity is None else _long_value(quantity) for quantity in by_branch),
        ]
        rows.append((name, *values, metrics[name].definition))
    heads = ("metric", "worst" if branches else "value", *branches, "what it is")
    return PageTable("All metrics", tuple(map(GridColumn, heads)), tuple(rows), 0)


def _long_value(quantity: Quantity) -> str:
    """Return a value with six digits, or "none" with the reason."""
    if quantity.value is None:
        return f"none: {quantity.reason}" if quantity.reason else "none"
    return short_value(quantity, 6)


def requirements_table(outcomes: Iterable[Outcome]) -> PageTable:
    """Return one row for each requirement: its metric, the value, the bounds, and whether they are kept."""
    rows = tuple(
        (
            words(outcome.metric),
            *value_and_bounds(outcome),
            Span("ok", Tone.GOOD) if outcome.ok else Span("MISSED", Tone.BAD),
        )
        for outcome in outcomes
    )
    return PageTable("Requirements", tuple(map(GridColumn, ("", "value", "required", ""))), rows)


def value_and_bounds(outcome: Outcome) -> tuple[str, str]:
    """Return the value of an outcome and its bounds, as its sentence has them."""
    reported = outcome.sentence.removeprefix(words(outcome.metric)).strip().rpartition(": ")[0]
    value, _, bounds = reported.rpartition(", ")
    return value, bounds.removeprefix("allowed ").removeprefix("required ")


def _fact_rows(report: Report) -> Iterator[ValueRow]:
    """Yield what is not required and matters most: stress and size, then what the family leads with."""
    spec = report.result.spec
    shown = {split_name(outcome.metric)[0] for outcome in report.requirements}
    shown |= {f"{report.result.curve.kind}_mean"} if report.result.curves else set()
    if (stress := _stress_row(report, shown)) is not None:
        yield stress
        shown |= {"stress_max", "allowable_stress", "safety_factor"}
    if (size := _size_row(report)) is not None:
        yield size
    if spec.target_curve is not None:
        shown |= {"force_ripple", "torque_ripple"}
    for name in dict.fromkeys(
        (
            "deviation_from_curve",
            "usable_stroke",
            "hysteresis_area",
            *family(spec.family).outputs.headline,
            *SHOWN_METRICS,
        )
    ):
        if name not in shown and _has_value(report, name):
            text = _stroke_in_words(report) if name == "usable_stroke" else branches(report, name, report.metrics)
            about = report.metrics[name].definition
            yield ValueRow(SHORT_LABELS.get(name, words(name)), text + _remark(report, name), about=about)


def _stress_row(report: Report, shown: set[str]) -> ValueRow | None:
    """Return the largest stress beside what is allowed, with the safety factor where no requirement says it."""
    if not _has_value(report, "stress_max") or "stress_max" in shown:
        return None
    text, allowed = short_value(report.metrics["stress_max"], 3), report.result.allowable_stress
    if allowed is not None:
        text = f"{text.partition(' ')[0]} of {format_short(allowed, 'stress', 3)}"
    if "safety_factor" not in shown and _has_value(report, "safety_factor"):
        factor = report.metrics["safety_factor"].value or 0.0
        text += f", safety {factor:.3g}"
        text += " (little margin)" if 1.0 <= factor < LITTLE_MARGIN else ""
    if _has_value(report, "safety_factor"):
        text += _explain_low_safety(report)
    return ValueRow("stress", text, about=report.metrics["stress_max"].definition)


def _size_row(report: Report) -> ValueRow | None:
    """Return the box that the mechanism stays in, and of how many parts it is."""
    space = family(report.result.spec.family).envelope(report.result)
    if space is None:
        return None
    sides = " x ".join(f"{1e3 * side:.3g}" for side in space.sides if side is not None)
    parts = f", {space.parts} parts" if space.parts > 1 else ""
    return ValueRow("size", f"{sides} mm{parts}", about="the box that everything stays in over the travel")


def _has_value(report: Report, name: str) -> bool:
    quantity = report.metrics.get(name)
    return quantity is not None and quantity.value is not None


def _remark(report: Report, name: str) -> str:
    """Return of which stress a safety factor is, by which rule a stress is allowed, and how far a model is known."""
    allowed = report.result.allowable_stress
    if name == "allowable_stress":
        return _stress_rule_in_words(report)
    if name == "safety_factor" and allowed is not None and "allowable_stress" not in report.metrics:
        return f", of {format_short(allowed, 'stress')}{_stress_rule_in_words(report)}{_explain_low_safety(report)}"
    return _explain_low_safety(report, name) if name.endswith("safety_factor") else ""


def _stress_rule_in_words(report: Report) -> str:
    """Return by which rule a stress is allowed, where the mechanism says how much of its strength may be used."""
    try:
        return f" (yield strength / {report.result.spec.get_value('mechanism.safety_factor'):.4g})"
    except KeyError:
        return ""


def _explain_low_safety(report: Report, name: str = "safety_factor") -> str:
    """Return why a safety factor below one is no finding: the model is known to overestimate the stress by as much."""
    factor, share = report.metrics[name].value, report.result.stress_overrated
    if factor is None or any(item.name == "overstressed" for item in report.result.warnings):
        return ""
    return f" (stress overestimated by up to {100 * share:.2g} %)" if 1 / (1 + share) <= factor < 1 else ""


def _stroke_in_words(report: Report) -> str:
    """Return the usable stroke with its ends."""
    stroke, start, end = (report.metrics[name] for name in ("usable_stroke", "usable_start", "usable_end"))
    text = short_value(stroke)
    if start.value is None or end.value is None:
        return text
    return f"{text} ({span(start.value, end.value, stroke.dimension)})"


def branches(report: Report, name: str, metrics: Mapping[str, Quantity]) -> str:
    """Return the value on each branch where they differ, else the one value."""
    by_branch: Mapping[str, Quantity | None] = {}
    if report.result.curves:
        by_branch = {branch: metrics.get(f"{name}[{branch}]") for branch in report.result.curve.branches}
    with_value = {branch: item for branch, item in by_branch.items() if item is not None and item.value is not None}
    texts = {branch: short_value(item, 3) for branch, item in with_value.items()}
    if len(texts) == len(by_branch) and len(set(texts.values())) > 1:
        return ", ".join(f"{text} {branch}" for branch, text in texts.items())
    return short_value(metrics[name])


def short_value(quantity: Quantity, digits: int = 4) -> str:
    """Return a value with its unit, rounded for reading; a word where it stands for one."""
    if quantity.word is not None:
        return quantity.word
    return "no value" if quantity.value is None else format_short(quantity.value, quantity.dimension, digits)


def _format_window(report: Report, name: str, window: Window | None) -> str:
    """Return the window, if there is one and the metric looks only inside."""
    if window is None or not report.result.curves:
        return ""
    curve = report.result.curve
    windowed = {item.name for item in known_metrics(curve.kind) if item.windowed}
    return span(window.lo, window.hi, curve.motion_dimension) if split_name(name)[0] in windowed else ""


def _requirement_row(report: Report, requirement: Requirement, outcome: Outcome) -> ValueRow:
    base, branch = split_name(outcome.metric)
    label = SHORT_LABELS[base] + (f" on {branch}" if branch else "") if base in SHORT_LABELS else words(outcome.metric)
    over = Window(*outcome.over) if outcome.over else None
    apart = "" if over is None or _is_title(report, over) else _format_window(report, outcome.metric, over)
    bound = format_bounds({"min": requirement.min, "max": requirement.max})
    about = outcome.sentence
    if outcome.value is None:
        reason = outcome.sentence.partition("no value (")[2].rpartition("), ")[0]
        return ValueRow(label, f"no value: {reason}", bound, False, about=about)
    if outcome.ok:
        digits = 3 if outcome.metric in OF_MANY_PARTS else 4
        return ValueRow(label, format_short(outcome.value, outcome.dimension, digits), bound, True, apart, about)
    # the sentence rounds so that the value stays on its side of the bound
    missed = outcome.sentence.rpartition(", ")[0].removeprefix(words(outcome.metric)).strip()
    return ValueRow(label, missed.partition(" over ")[0], bound, False, apart, about)


def _is_title(report: Report, window: Window) -> bool:
    """Return True if a window is the one that the title states."""
    shown = shown_window(report)
    if shown is None:
        return False
    slack = 1e-9 * max(abs(shown.lo), abs(shown.hi))
    return abs(shown.lo - window.lo) <= slack and abs(shown.hi - window.hi) <= slack


def complaints_of(report: Report) -> tuple[str, ...]:
    """Return the lines that `--quiet` prints, too."""
    status = report.status
    if not status.usable:
        design = report.design
        reported = design.explanation if design is not None and design.spec is None else report.message
        return (f"error    {name_in_words(status.key)}: {reported}",)
    partial = [] if status.exit_code is ExitCode.OK else [f"partial  {report.message}"]
    return (*partial, *(f"missed   {outcome.sentence.removesuffix(': missed')}" for outcome in report.missed))


def data_of(report: Report) -> dict[str, object]:
    """Return what the JSON document says of a report beside the files."""
    spec, design = report.result.spec, report.design
    data = report.as_json() | {"family": spec.family, "name": spec.name}
    if design is not None:
        data |= {"active_bounds": list(design.active_bounds), "nearest_feasible": dict(design.nearest_feasible)}
    return data
