"""A shape design judged by its own analysis, written as a specification, and reported: audit, tolerances, all starts.

A search never judges itself: force, window and stress that are reported of a design are those of the analysis of its
specification, to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.rounded_and_reported_values import measure_metrics
from cfmkit.elastica.model.beam_fits import BeamFits
from cfmkit.families.beam.contacts import force_extremes
from cfmkit.families.beam.model import analyze
from cfmkit.families.beam.shaping.multistart import Audit, audit_design
from cfmkit.families.beam.shaping.search import COORDINATE_DECIMALS, ShapeCandidate
from cfmkit.families.findings import percent
from cfmkit.families.run_control import Run
from cfmkit.results import Quantity, Searched, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.families.beam.shaping.multistart import Drawn, Explored
    from cfmkit.families.beam.shaping.spec import Tolerances
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


def judge_design(spec: BeamSpec, task: Task, design: ShapeCandidate, audit: Audit | None = None) -> Judged:
    """Return a design as its own analysis finds it: the same curve, stress and metrics as of `cfmkit analyze`.

    `audit`: of the design, where it is known already.
    """
    new = write_design(spec, task, design)
    result = analyze(new, Run())
    window = _confirmed_window(task, result, _window(spec, task, design), _requested_window(spec)[0])
    new = new.replace({"analysis.window": window})
    band = _half_band(task, result, window)
    audit = audit or audit_design(task, design)
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
    network = design.network(task)
    fits, changes = BeamFits(network), dict[str, Any]()
    for name in dict.fromkeys(place.node for place in task.coordinates):
        places = (network.nodes[name].x, network.nodes[name].y)
        changes[f"mechanism.nodes.{name}.at"] = tuple(round(float(place), COORDINATE_DECIMALS) for place in places)
    for name in task.shaped:
        shape: Any = network.beams[name].shape
        changes[f"mechanism.beams.{name}.shape"] = {
            "kind": "polynomial",
            "coefficients": (float(np.real(fits[name].rotation)), *(float(c) for c in shape.coefficients[1:])),
            "length": float(np.real(fits[name].length)),
        }
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


REISSNER_MODEL = "reissner"
SEARCH_DEFINITIONS = {
    "starts": ("requested", "count", "random starts that led to a shape"),
    "starts_within_limits": (
        "requested", "count", "starts whose shape meets all limits, as the audit at more poses found"
    ),
    "starts_sound": (
        "requested", "count",
        "such starts whose shape reaches the end of the window, is stable all the way and does not cross itself",
    ),
    "traces": ("requested", "count", "networks that were followed over the window"),
    "audit_gap": (
        "travel", "length", "least gap between surfaces of different beams at 61 poses from rest on, away from joints"
    ),
    "audit_crossings": ("travel", "count", "poses, of 61 from rest on, at which beams cross"),
    "audit_half_band_reissner": (
        "designed", "ratio",
        "(max - min)/(max + min) of the force with beams that stretch and shear: `half_band` of "
        "`cfmkit analyze design.yaml --fidelity reissner`",
    ),
    "audit_strict_range_reissner": (
        "travel", "ratio",
        "share of the travel in which (max - min) <= 5 % of max with beams that stretch and shear: "
        "`strict_range_fraction` of the same command",
    ),
    "tolerance_half_band_median": (
        "designed", "ratio", "(max - min)/(max + min) of the median network drawn within tolerances"
    ),
    "tolerance_half_band_p90": ("designed", "ratio", "(max - min)/(max + min) that nine of ten such networks keep"),
    "tolerance_strict_range_median": (
        "travel", "ratio", "share of the travel with (max - min) <= 5 % of max, median of them"
    ),
    "tolerance_strict_range_p10": ("travel", "ratio", "the same share that nine of ten of them reach"),
    "tolerance_lost": ("travel", "count", "such networks that cannot be followed to the end of the window"),
}  # fmt: skip
"""Values that only the search knows, with their window: the one requested, the one designed, or the whole travel.

What the analysis of the design knows, too, is not said a second time.
"""


def search_of(task: Task, design: Judged, drawn: Drawn, result: Explored) -> Mapping[str, Searched]:
    """Return what only the search knows, each number with the model and the window that it is of."""
    low, high = design.window
    windows = {"requested": (task.layers * task.window[0], high), "designed": (low, high), "travel": (0.0, high)}
    bands, ranges = drawn.bands, drawn.ranges
    numbers: dict[str, float | None] = {
        **{name: float(count) for name, count in result.count().items()},
        "audit_gap": design.audit.gap,
        "audit_crossings": float(design.audit.crossings),
        "tolerance_half_band_median": float(np.median(bands)) if len(bands) else None,
        "tolerance_half_band_p90": float(np.quantile(bands, 0.9)) if len(bands) else None,
        "tolerance_strict_range_median": float(np.median(ranges)) if len(ranges) else None,
        "tolerance_strict_range_p10": float(np.quantile(ranges, 0.1)) if len(ranges) else None,
        "tolerance_lost": float(drawn.lost),
    }
    if task.fidelity != REISSNER_MODEL and task.contact is None:  # else the metrics say it
        finer = analyze(design.spec.replace({"analysis.fidelity": REISSNER_MODEL}), Run())
        band, share = measure_metrics(finer, design.window, "half_band", "strict_range_fraction")
        numbers |= {"audit_half_band_reissner": band, "audit_strict_range_reissner": share}
    searched = {}
    for name, number in numbers.items():
        window, dimension, definition = SEARCH_DEFINITIONS[name]
        model = REISSNER_MODEL if name.endswith("_reissner") else task.fidelity
        searched[name] = Searched(Quantity(number, dimension, definition), model, windows[window])
    return searched


def notes_of(audit: Audit, drawn: Drawn, spread: Tolerances, held: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs of the page on what was found."""
    median = f"half band {percent(float(np.median(drawn.bands)))}" if len(drawn.bands) else "no force"
    scatter = (
        f"{median} (median of {spread.samples} networks with nodes off by {format_short(spread.nodes, 'length')}, "
        f"coefficients by {spread.coefficients:g} rad)"
    )
    stable = "stable all the way" if audit.stable else "not stable all the way"
    crossings = f"beams cross at {audit.crossings} poses" if audit.crossings else "no crossings"
    more = f" and {len(held) - 8} more" if len(held) > 8 else ""
    active = (("limits", f"active: {'; '.join(held[:8])}{more}"),) if held else ()
    return ("audit", f"{stable}, {crossings}"), ("scatter", scatter), *active


def starts_table(task: Task, result: Explored) -> Table:
    """Return one row per start, in order, each with the audit of its design where that meets all limits."""
    from cfmkit.tables import Table, TableColumn

    designs = result.shapes.values()
    audits = [result.audits.get(index) for index in result.shapes]
    gaps = [np.nan if audit is None or audit.gap is None else 1e3 * audit.gap for audit in audits]
    columns = {
        "window_share": [1 - design.start / task.window[1] for design in designs],
        "objective": [design.objective for design in designs],
        "violation": [max(0.0, design.violation) for design in designs],
    }
    return Table(
        (
            TableColumn("start", tuple(result.shapes)),
            *(TableColumn(name, np.array(values, dtype=float), "1") for name, values in columns.items()),
            TableColumn("sound", tuple(None if audit is None else audit.sound for audit in audits)),
            TableColumn("crossings", tuple(None if audit is None else audit.crossings for audit in audits)),
            TableColumn("gap", np.array(gaps, dtype=float), "mm"),
            TableColumn("evaluations", tuple(design.evaluations for design in designs)),
            TableColumn("ending", tuple(design.ending for design in designs)),
        )
    )
