"""Report of a design: the results of its analysis, the audit, the effect of tolerances, and all starts.

A search never judges itself: force, window and stress that are reported of a design are those of the analysis of its
specification, to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.rounded_and_reported_values import measure_metrics
from cfmkit.elastica.model.beam import fit
from cfmkit.families.beam.contacts import force_extremes
from cfmkit.families.beam.model import analyze
from cfmkit.families.beam.shaping.multistart import Audit, audit_design
from cfmkit.families.beam.shaping.search import COORDINATE_DECIMALS, ShapeCandidate
from cfmkit.families.beam.shaping.task_and_variables import Variables
from cfmkit.families.findings import percent
from cfmkit.families.run_control import Run
from cfmkit.results import Quantity, Searched, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.families.beam.shaping.multistart import Drawn, Explored, NetworkScatter
    from cfmkit.families.beam.shaping.task_and_variables import Task
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.results import Result
    from cfmkit.tables import Table


@dataclass(frozen=True)
class Judged:
    """A design with what the analysis of its specification and the audit say about it."""

    spec: BeamSpec  # as it is written; its window is the one that the analysis confirms
    candidate: ShapeCandidate  # what came out of the search
    audit: Audit  # whether it exists as drawn
    half_band: float | None  # of the force that is to be constant, over the window, as the analysis finds it
    faults: tuple[str, ...]  # what analysis and audit hold against it
    # largest distance from the target curve over its largest force, where there is one: a metric of the analysis
    miss: float | None = None

    @property
    def window(self) -> tuple[float, float]:
        """The window of the design [m]."""
        window = self.spec.analysis.window
        assert window is not None
        return float(window[0]), float(window[1])


def judge_design(
    # spec, task, design: what was given, what was searched for, and what came out
    spec: BeamSpec,
    task: Task,
    design: ShapeCandidate,
    audit: Audit | None = None,  # of the design, where it is known already
) -> Judged:
    """Return a design as its own analysis finds it: the same curve, stress and metrics as of `cfmkit analyze`."""
    new = write_design(spec, task, design)
    result = analyze(new, Run())
    window = _confirmed_window(task, result, _window(spec, task, design), _requested_window(spec)[0])
    new = new.replace({"analysis.window": window})
    band = _half_band(task, result, window)
    audit = audit or audit_design(Variables(task, design.order), design)
    (miss,) = (None,) if task.shape is None else measure_metrics(result, window, "deviation_from_curve")
    return Judged(new, design, audit, band, tuple(_faults(task, audit, result, window)), miss)


def _half_band(task: Task, result: Result, window: tuple[float, float]) -> float | None:
    """Return (max - min)/(max + min) of the force that is to be constant; None if the analysis does not know it."""
    if task.contact is None:
        return measure_metrics(result, window, "half_band")[0]
    top, bottom = force_extremes(result.state, task.contact, window)
    return None if top is None or bottom is None or bottom <= 0 else (top - bottom) / (top + bottom)


def _confirmed_window(task: Task, result: Result, window: tuple[float, float], asked: float) -> tuple[float, float]:
    """Return the widest window within another one over which the analysis finds the force in band; `asked` at least."""
    start, end = window

    def satisfies_band(micrometres: int) -> bool:
        band = _half_band(task, result, (1e-6 * micrometres, end))
        return band is not None and band <= task.half_band

    if task.objective != "range" or start >= asked:
        return start, end
    bad, good = round(1e6 * start), int(1e6 * asked)
    if satisfies_band(bad):
        return start, end
    while good - bad > 1:
        middle = (bad + good) // 2
        bad, good = (bad, middle) if satisfies_band(middle) else (middle, good)
    return min(good / 1e6, asked), end


def _faults(task: Task, audit: Audit, result: Result, window: tuple[float, float]) -> Iterator[str]:
    """Yield what is wrong with a design."""
    if not audit.complete:
        yield "the path ends early"
    if not audit.stable:
        yield "it is not stable all the way"
    if audit.crossings:
        yield f"beams cross at {audit.crossings} of the poses"
    band = _half_band(task, result, window)
    (stress,) = measure_metrics(result, (0.0, window[1]), "stress_max")
    if band is None and task.contact is not None and result.status is Status.COMPLETE:
        yield f"{task.contact!r} is not touched all over the window"
    elif band is None:
        yield f"the analysis ends before the window does: {result.message}"
    elif task.objective == "range" and band > task.half_band:
        yield f"over the requested window the force is within ± {percent(band)} only"
    allowed = task.allowable_stress
    if allowed is not None and stress is not None and stress > allowed:
        yield f"the stress reaches {format_short(stress, 'stress')}, {format_short(allowed, 'stress')} are allowed"


def write_design(spec: BeamSpec, task: Task, design: ShapeCandidate) -> BeamSpec:
    """Return the specification with nodes and shapes written out, and the window of the design as its window."""
    variables = Variables(task, design.order)
    network = variables.build(design.x)
    moved = dict.fromkeys(coordinate.node for coordinate in task.coordinates)
    nodes = {name: (_place(network.nodes[name].x), _place(network.nodes[name].y)) for name in moved}
    changes: dict[str, Any] = {f"mechanism.nodes.{name}.at": at for name, at in nodes.items()}
    for name in task.shaped:
        beam = network.beams[name]
        start, end = network.nodes[beam.start], network.nodes[beam.end]
        reach = (
            end.x - start.x + beam.end_offset[0] - beam.start_offset[0],
            end.y - start.y + beam.end_offset[1] - beam.start_offset[1],
        )
        fitted = fit(beam, reach)
        shape = {
            "kind": "polynomial",
            "coefficients": (float(np.real(fitted.rotation)), *(float(c) for c in beam.shape.coefficients[1:])),  # type: ignore[union-attr]
            "length": float(np.real(fitted.length)),
        }
        changes[f"mechanism.beams.{name}.shape"] = shape
    changes["analysis.window"] = _window(spec, task, design)
    if spec.design is not None and spec.design.target is not None:
        changes["design.target"] = spec.design.target.written_out()
    return spec.replace(changes)


def _window(spec: BeamSpec, task: Task, design: ShapeCandidate) -> tuple[float, float]:
    """Return the window of a design [m]: the one requested, or the wider one, from a whole micrometre on."""
    asked, end = _requested_window(spec)
    start = float(np.ceil(design.start * task.layers * 1e6 - 1e-6)) / 1e6
    return asked if abs(start - asked) < 1e-6 else start, end


def _requested_window(spec: BeamSpec) -> tuple[float, float]:
    """Return the window that was requested [m]."""
    assert spec.design is not None
    assert spec.design.optimise is not None
    start, end = spec.design.optimise.window
    return float(start), float(end)


def _place(value: float) -> float:
    return round(float(value), COORDINATE_DECIMALS)


REISSNER_MODEL = "reissner"
SEARCH_DEFINITIONS = {
    "starts": ("count", "random starts that led to a shape"),
    "starts_within_limits": ("count", "starts whose shape meets all limits, as the audit at more poses found"),
    "starts_sound": (
        "count",
        "such starts whose shape reaches the end of the window, is stable all the way and does not cross itself",
    ),
    "traces": ("count", "networks that were followed over the window"),
    "audit_gap": ("length", "least gap between surfaces of different beams at 61 poses from rest on, away from joints"),
    "audit_crossings": ("count", "poses, of 61 from rest on, at which beams cross"),
    "audit_half_band_reissner": (
        "ratio",
        "(max - min)/(max + min) of the force with beams that stretch and shear: `half_band` of "
        "`cfmkit analyze design.yaml --fidelity reissner`",
    ),
    "audit_strict_range_reissner": (
        "ratio",
        "share of the travel in which (max - min) <= 5 % of max with beams that stretch and shear: "
        "`strict_range_fraction` of the same command",
    ),
    "tolerance_half_band_median": ("ratio", "(max - min)/(max + min) of the median network drawn within tolerances"),
    "tolerance_half_band_p90": ("ratio", "(max - min)/(max + min) that nine of ten such networks keep"),
    "tolerance_strict_range_median": ("ratio", "share of the travel with (max - min) <= 5 % of max, median of them"),
    "tolerance_strict_range_p10": ("ratio", "the same share that nine of ten of them reach"),
    "tolerance_lost": ("count", "such networks that cannot be followed to the end of the window"),
}
"""What only the search knows. What the analysis of the design knows, too, is not said a second time."""


def search_of(task: Task, design: Judged, drawn: Drawn, result: Explored) -> Mapping[str, Searched]:
    """Return what only the search knows, each number with the model and the window that it is of."""
    window = design.window
    asked, whole = (task.layers * task.window[0], window[1]), (0.0, window[1])
    reported = dict.fromkeys(SEARCH_DEFINITIONS, (task.fidelity, whole))
    reported |= dict.fromkeys(("starts", "starts_within_limits", "starts_sound", "traces"), (task.fidelity, asked))
    reported |= dict.fromkeys(("tolerance_half_band_median", "tolerance_half_band_p90"), (task.fidelity, window))
    reported |= {
        "audit_half_band_reissner": (REISSNER_MODEL, window),
        "audit_strict_range_reissner": (REISSNER_MODEL, whole),
    }
    audit = design.audit
    numbers = (
        _counts(result) | {"audit_gap": audit.gap, "audit_crossings": float(audit.crossings)} | _drawn_values(drawn)
    )
    if task.fidelity != REISSNER_MODEL and task.contact is None:  # else the metrics say it
        numbers |= _reissner(design)
    return {name: Searched(Quantity(numbers[name], *SEARCH_DEFINITIONS[name]), *reported[name]) for name in numbers}


def _reissner(design: Judged) -> dict[str, float | None]:
    """Return what the analysis says of the design with beams that stretch and shear."""
    result = analyze(design.spec.replace({"analysis.fidelity": REISSNER_MODEL}), Run())
    band, share = measure_metrics(result, design.window, "half_band", "strict_range_fraction")
    return {"audit_half_band_reissner": band, "audit_strict_range_reissner": share}


def _counts(result: Explored) -> dict[str, float | None]:
    designs = [design for design in result.designs.values() if design is not None]
    feasible = sum(design.feasible for design in designs)
    traces = sum(design.evaluations for design in designs)
    sound = sum(audit.sound for audit in result.audits.values())
    counts = {"starts": len(designs), "starts_within_limits": feasible, "starts_sound": sound, "traces": traces}
    return {name: float(count) for name, count in counts.items()}


def _drawn_values(drawn: Drawn) -> dict[str, float | None]:
    bands, ranges = drawn.bands, drawn.ranges
    return {
        "tolerance_half_band_median": float(np.median(bands)) if len(bands) else None,
        "tolerance_half_band_p90": float(np.quantile(bands, 0.9)) if len(bands) else None,
        "tolerance_strict_range_median": float(np.median(ranges)) if len(ranges) else None,
        "tolerance_strict_range_p10": float(np.quantile(ranges, 0.1)) if len(ranges) else None,
        "tolerance_lost": float(drawn.lost),
    }


def notes_of(audit: Audit, drawn: Drawn, spread: NetworkScatter, held: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs of the page on what was found."""
    median = f"half band {percent(float(np.median(drawn.bands)))}" if len(drawn.bands) else "no force"
    scatter = (
        f"{median} (median of {spread.samples} networks with nodes off by {format_short(spread.nodes, 'length')}, "
        f"coefficients by {spread.coefficients:g} rad)"
    )
    sound = ", ".join(
        (
            "stable all the way" if audit.stable else "not stable all the way",
            "no crossings" if not audit.crossings else f"beams cross at {audit.crossings} poses",
        )
    )
    return tuple(note for note in (("audit", sound), ("scatter", scatter), _active_limit(held)) if note[1])


def _active_limit(held: tuple[str, ...]) -> tuple[str, str]:
    more = f" and {len(held) - 8} more" if len(held) > 8 else ""
    return "limits", f"active: {'; '.join(held[:8])}{more}" if held else ""


def starts_table(task: Task, result: Explored) -> Table:
    """Return one row per start, in order, each with the audit of its design where that meets all limits."""
    from cfmkit.tables import Table, TableColumn

    audits = [result.audits.get(index) for index, design in result.designs.items() if design is not None]
    gaps = [np.nan if audit is None or audit.gap is None else 1e3 * audit.gap for audit in audits]
    rows = [(index, design) for index, design in result.designs.items() if design is not None]
    columns = {
        "window_share": [1 - design.start / task.window[1] for _, design in rows],
        "objective": [design.objective for _, design in rows],
        "violation": [max(0.0, design.violation) for _, design in rows],
    }
    return Table(
        (
            TableColumn("start", tuple(index for index, _ in rows)),
            *(TableColumn(name, np.array(values, dtype=float), "1") for name, values in columns.items()),
            TableColumn("sound", tuple(None if audit is None else audit.sound for audit in audits)),
            TableColumn("crossings", tuple(None if audit is None else audit.crossings for audit in audits)),
            TableColumn("gap", np.array(gaps, dtype=float), "mm"),
            TableColumn("evaluations", tuple(design.evaluations for _, design in rows)),
            TableColumn("ending", tuple(design.ending for _, design in rows)),
        )
    )
