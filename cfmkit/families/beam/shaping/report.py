"""What a shape design reports beside the analysis of its specification: the audit and the table of all starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.beam.words import percent
from cfmkit.results import Quantity
from cfmkit.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.beam.shaping.audit import Audit, Spread
    from cfmkit.families.beam.shaping.multistart import Explored
    from cfmkit.families.beam.shaping.task import Task
    from cfmkit.tables import Table

DEFINITIONS = {
    "audit_half_band": ("ratio", "(max - min)/(max + min) of the force over the window of the design"),
    "audit_half_band_reissner": ("ratio", "the same with beams that stretch and shear"),
    "audit_strict_range": ("ratio", "share of the travel up to d in which (max - min) <= 5 % of max"),
    "audit_strict_range_reissner": ("ratio", "the same with beams that stretch and shear"),
    "audit_stress": ("stress", "largest bending stress from rest to d"),
    "audit_gap": ("length", "least gap between surfaces of different beams from rest to d, away from joints"),
    "audit_crossings": ("count", "poses, of 61 from rest to d, at which beams cross"),
    "tolerance_half_band_median": ("ratio", "median half band of networks within the tolerances"),
    "tolerance_half_band_p90": ("ratio", "half band that nine of ten networks within the tolerances keep"),
    "tolerance_strict_range_median": ("ratio", "median share of the travel with (max - min) <= 5 % of max"),
    "tolerance_strict_range_p10": ("ratio", "share of the travel that nine of ten networks reach"),
    "tolerance_lost": ("count", "networks within the tolerances that cannot be followed to d"),
}


def values_of(audit: Audit) -> Mapping[str, Quantity]:
    """Return the audit by name."""
    bands, ranges = audit.bands, audit.ranges
    numbers: dict[str, float | None] = {
        "audit_half_band": audit.half_band,
        "audit_half_band_reissner": audit.stiff,
        "audit_strict_range": audit.strict,
        "audit_strict_range_reissner": audit.strict_stiff,
        "audit_stress": audit.stress,
        "audit_gap": audit.gap,
        "audit_crossings": float(audit.crossings),
        "tolerance_half_band_median": float(np.median(bands)) if len(bands) else None,
        "tolerance_half_band_p90": float(np.quantile(bands, 0.9)) if len(bands) else None,
        "tolerance_strict_range_median": float(np.median(ranges)) if len(ranges) else None,
        "tolerance_strict_range_p10": float(np.quantile(ranges, 0.1)) if len(ranges) else None,
        "tolerance_lost": float(audit.lost),
    }
    return {name: Quantity(value, *DEFINITIONS[name]) for name, value in numbers.items()}


def notes_of(audit: Audit, spread: Spread, held: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs of the page."""
    return tuple(note for note in (_audit(audit), _tolerances(audit, spread), _held(held)) if note[1])


def _audit(audit: Audit) -> tuple[str, str]:
    parts = [
        "stable all the way" if audit.stable else "not stable all the way",
        "no crossings" if not audit.crossings else f"beams cross at {audit.crossings} poses",
    ]
    if audit.half_band is not None:
        strict = percent(audit.strict or 0.0)
        parts.append(f"force ± {percent(audit.half_band)} over the window, within 5 % over {strict} of the way")
    if audit.stiff is not None:
        parts.append(f"with stretching and shear ± {percent(audit.stiff)} and {percent(audit.strict_stiff or 0.0)}")
    if audit.stress is not None:
        parts.append(f"bending stress up to {format_short(audit.stress, 'stress')}")
    if audit.gap is not None:
        parts.append(f"gaps of at least {format_short(audit.gap, 'length')}")
    return "audit", ", ".join(parts)


def _tolerances(audit: Audit, spread: Spread) -> tuple[str, str]:
    if not len(audit.bands):
        return "spread", ""
    lost = f"; {audit.lost} cannot be followed to the end" if audit.lost else ""
    band, band_p90 = (percent(float(np.quantile(audit.bands, share))) for share in (0.5, 0.9))
    kept, kept_p90 = (percent(float(np.quantile(audit.ranges, share))) for share in (0.5, 0.1))
    return "spread", (
        f"nodes off by {format_short(spread.nodes, 'length')} and coefficients by {spread.coefficients:g} rad "
        f"(standard deviations, {spread.samples} networks): force ± {band} in the median, "
        f"± {band_p90} in nine of ten; within 5 % over {kept} of the way in the median, {kept_p90} in nine of ten{lost}"
    )


def _held(held: tuple[str, ...]) -> tuple[str, str]:
    more = f" and {len(held) - 8} more" if len(held) > 8 else ""
    return "held by", "; ".join(held[:8]) + more


def starts_table(task: Task, result: Explored) -> Table:
    """Return one row a start, in order."""
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
