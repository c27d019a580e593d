"""What a shape design reports beside the analysis of its specification: the audit and the table of all starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.audit import measured
from cfmkit.families.base import Run
from cfmkit.families.beam.model import analyze
from cfmkit.results import Quantity, Searched
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.beam.shaping.audit import Audit, Drawn, Spread
    from cfmkit.families.beam.shaping.judging import Judged
    from cfmkit.families.beam.shaping.multistart import Explored
    from cfmkit.families.beam.shaping.task import Task
    from cfmkit.tables import Table

REISSNER = "reissner"

DEFINITIONS = {
    "starts": ("count", "random starts that led to a shape"),
    "starts_within_limits": ("count", "starts whose shape meets all limits, as the audit at more poses found"),
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
    "tolerance_half_band_median": (
        "ratio",
        "(max - min)/(max + min) of the median network drawn within tolerances",
    ),
    "tolerance_half_band_p90": (
        "ratio",
        "(max - min)/(max + min) that nine of ten such networks keep",
    ),
    "tolerance_strict_range_median": (
        "ratio",
        "share of the travel with (max - min) <= 5 % of max, median of them",
    ),
    "tolerance_strict_range_p10": (
        "ratio",
        "the same share that nine of ten of them reach",
    ),
    "tolerance_lost": ("count", "such networks that cannot be followed to the end of the window"),
}
"""What only the search knows. What the analysis of the design knows, too, is not said a second time."""


def search_of(task: Task, design: Judged, drawn: Drawn, result: Explored) -> Mapping[str, Searched]:
    """Return what only the search knows, each number with the model and the window that it is of."""
    own = design.window
    asked, whole = (task.layers * task.window[0], own[1]), (0.0, own[1])
    told = dict.fromkeys(DEFINITIONS, (task.fidelity, whole))
    told |= dict.fromkeys(("starts", "starts_within_limits", "traces"), (task.fidelity, asked))
    told |= dict.fromkeys(("tolerance_half_band_median", "tolerance_half_band_p90"), (task.fidelity, own))
    told |= {"audit_half_band_reissner": (REISSNER, own), "audit_strict_range_reissner": (REISSNER, whole)}
    numbers = _counts(result) | _audited(design.audit) | _drawn(drawn)
    if task.fidelity != REISSNER:  # else the metrics say it
        numbers |= _reissner(design)
    return {name: Searched(Quantity(numbers[name], *DEFINITIONS[name]), *told[name]) for name in numbers}


def _reissner(design: Judged) -> dict[str, float | None]:
    """Return what the analysis says of the design with beams that stretch and shear."""
    result = analyze(design.spec.replace({"analysis.fidelity": REISSNER}), Run())
    band, share = measured(result, design.window, "half_band", "strict_range_fraction")
    return {"audit_half_band_reissner": band, "audit_strict_range_reissner": share}


def _counts(result: Explored) -> dict[str, float | None]:
    some = [one for one in result.found.values() if one is not None]
    feasible = sum(one.feasible for one in some)
    traces = sum(one.evaluations for one in some)
    return {"starts": float(len(some)), "starts_within_limits": float(feasible), "traces": float(traces)}


def _audited(audit: Audit) -> dict[str, float | None]:
    return {"audit_gap": audit.gap, "audit_crossings": float(audit.crossings)}


def _drawn(drawn: Drawn) -> dict[str, float | None]:
    bands, ranges = drawn.bands, drawn.ranges
    return {
        "tolerance_half_band_median": float(np.median(bands)) if len(bands) else None,
        "tolerance_half_band_p90": float(np.quantile(bands, 0.9)) if len(bands) else None,
        "tolerance_strict_range_median": float(np.median(ranges)) if len(ranges) else None,
        "tolerance_strict_range_p10": float(np.quantile(ranges, 0.1)) if len(ranges) else None,
        "tolerance_lost": float(drawn.lost),
    }


def notes_of(audit: Audit, spread: Spread, held: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs of the page that hold no number of the block `search`."""
    drawn = (
        f"{spread.samples} networks with nodes off by {format_short(spread.nodes, 'length')} and coefficients by "
        f"{spread.coefficients:g} rad (standard deviations)"
    )
    sound = ", ".join(
        (
            "stable all the way" if audit.stable else "not stable all the way",
            "no crossings" if not audit.crossings else f"beams cross at {audit.crossings} poses",
        )
    )
    return tuple(note for note in (("audit", sound), ("drawn", drawn), _held(held)) if note[1])


def _held(held: tuple[str, ...]) -> tuple[str, str]:
    more = f" and {len(held) - 8} more" if len(held) > 8 else ""
    return "held by", "; ".join(held[:8]) + more


def starts_table(task: Task, result: Explored) -> Table:
    """Return one row per start, in order."""
    from cfmkit.tables import Table, TableColumn

    rows = [(index, one) for index, one in result.found.items() if one is not None]
    columns = {
        "window_share": [1 - one.start / task.window[1] for _, one in rows],
        "objective": [one.objective for _, one in rows],
        "violation": [max(0.0, one.violation) for _, one in rows],
    }
    return Table(
        (
            TableColumn("start", tuple(index for index, _ in rows)),
            *(TableColumn(name, np.array(values, dtype=float), "1") for name, values in columns.items()),
            TableColumn("evaluations", tuple(one.evaluations for _, one in rows)),
            TableColumn("ending", tuple(one.ending for _, one in rows)),
        )
    )
