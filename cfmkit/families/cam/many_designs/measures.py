"""Requested values of many cams at once: metrics over windows, and the family's own values."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.cam.scalar_results import DEFINITIONS
from cfmkit.metrics.ranges_many import RANGES, ManyBranches, rms_to_target, usable_interval, usable_stroke
from cfmkit.metrics.spread import STATIC_BALANCE, metric_of, metrics_of, static_balance

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.base import Measure
    from cfmkit.families.cam.many_designs.forces import Slab
    from cfmkit.specs.units import Ends

    Window = Ends | None

BRANCHES = ("load", "unload")


def measured(cams: Slab, measure: Measure) -> Mapping[str, FloatArray]:
    """Return what a measure is for some designs: branch -> (n,) values, "" for what belongs to no branch."""
    if (scalar := cams.own.get(measure.name) or SCALARS.get(measure.name)) is not None:
        return {"": scalar(cams)}
    if measure.name in STRESSES:
        return {branch: _stress(cams, measure, branch) for branch in BRANCHES}
    if measure.name in ABSENT:
        return {"": np.full(len(cams.designs), np.nan)}
    if measure.name in CYCLES:
        return {"": CYCLES[measure.name](cams, measure.window)}
    if measure.name in METRICS:
        target = cams.designs.target
        return {one: metric_of(measure.name, cams.inside(one, measure.window), target) for one in BRANCHES}
    if measure.name == STATIC_BALANCE:
        return {branch: _static_balance(cams, branch, measure.window) for branch in BRANCHES}
    if measure.name == RMS:
        return {branch: _rms(cams, branch, measure.window) for branch in BRANCHES}
    both = RANGES[measure.name](_everywhere(cams, measure.window))
    if (ends := cams.ends(measure.window)) is not None:
        asked = (ends[0] + ends[1]) / 2 if measure.name.startswith("band") else ends[1]
        both = np.where(np.tile(asked <= cams.travel[:, -1] * (1 + 1e-9), 2), both, np.nan)
    return dict(zip(BRANCHES, np.split(both, 2), strict=True))


def _rms(cams: Slab, branch: str, window: Window) -> FloatArray:
    effort = (cams.up if branch == "load" else cams.down).slider
    low, high = cams.ends(window) or (cams.travel[:, 0], cams.travel[:, -1])
    many = ManyBranches(cams.travel, effort, low, high, lambda at, _rows: cams.exact(branch, at))
    # Where a sample has no force, nothing inside the window is measured.
    known = np.isfinite(cams.inside(branch, window).mean)
    return np.where(known, rms_to_target(many, cams.designs.target), np.nan)


def _static_balance(cams: Slab, branch: str, window: Window) -> FloatArray:
    """Return the largest force over that of the strongest spring: without weights its share of all of them."""
    inside = cams.inside(branch, window)
    largest = np.maximum(np.abs(inside.extremes[0]), np.abs(inside.extremes[1]))
    return np.asarray(static_balance(inside.spread, largest * cams.designs.strongest / cams.designs.stiffness))


def _everywhere(cams: Slab, window: Window) -> ManyBranches:
    """Return both branches, one below the other, at every place: metrics that are places do not depend on samples."""
    if window not in cams.known:
        count, places = len(cams.designs), np.concatenate([cams.places, cams.places])
        first, last = cams.ends(window) or (np.zeros(count), np.full(count, np.inf))
        low, high = np.tile(first, 2), np.minimum(np.tile(last, 2), places[:, -1])
        pose = np.minimum(np.tile((first + last) / 2, 2), places[:, -1]) if window is not None else None

        def exact(travel: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
            return cams.somewhere(np.where(rows < count, 1.0, -1.0)[:, None], travel, rows % count)

        effort = np.concatenate([*cams.everywhere])
        cams.known[window] = ManyBranches(places, effort, low, high, exact, None, pose)
    return cams.known[window]


def _stress(cams: Slab, measure: Measure, branch: str) -> FloatArray:
    largest = cams.stressed(branch, measure.window)
    if measure.name == "stress_max":
        return largest
    return np.where(largest > 0, cams.allowable_stress / np.where(largest > 0, largest, 1.0), np.nan)


METRICS = metrics_of("force")
"""Metrics of one branch inside its window."""

RMS = "rms_to_target"


def _hysteresis(cams: Slab, window: Window) -> FloatArray:
    return cams.inside("load", window).work - cams.inside("unload", window).work


def _usable(cams: Slab) -> tuple[FloatArray, FloatArray]:
    if cams.usable is None:
        ends = cams.travel[:, 0], cams.travel[:, -1]
        branches = [
            ManyBranches(cams.places, force, *ends, partial(cams.somewhere, way), cams.excess(way))
            for force, way in zip(cams.everywhere, (1.0, -1.0), strict=True)
        ]
        cams.usable = usable_interval(branches, cams.designs.target, cams.band, cams.corner_travel)
    return cams.usable


CYCLES: dict[str, Callable[[Slab, Window], FloatArray]] = {
    "hysteresis_area": _hysteresis,
    "usable_stroke": lambda cams, _window: usable_stroke(*_usable(cams)),
    "usable_start": lambda cams, _window: _usable(cams)[0],
    "usable_end": lambda cams, _window: _usable(cams)[1],
}
"""Metrics of both branches together."""


def _smallest_constant(cams: Slab) -> FloatArray:
    one = cams.designs
    p = brace_tangent(one.x0, one.brace)
    inverse = (1.0 + p * p) ** 1.5 / one.radius - (1.0 + p * p) ** 1.5 / one.brace
    return np.where(inverse > 0, 1.0 / inverse, np.nan)


def _largest_contact(cams: Slab) -> FloatArray:
    contacts = [forces.contact for forces in (cams.up, cams.down) if forces.contact is not None]
    return np.asarray(np.max([np.where(np.isfinite(one), one, -np.inf).max(axis=1) for one in contacts], axis=0))


def _half_gap(cams: Slab) -> FloatArray:
    up, down, flank = cams.up.slider, cams.down.slider, cams.flank
    if cams.begin is not None:
        up, down = np.hstack([cams.begin.up, up]), np.hstack([cams.begin.down, down])
        flank = np.hstack([cams.begin.there, np.broadcast_to(flank, cams.travel.shape)])
    total = up + down
    usable = flank & (total > 0)
    found = np.asarray(np.where(usable, (up - down) / np.where(usable, total, 1.0), -np.inf).max(axis=1))
    return np.where(np.isfinite(found), found, np.nan)


def _pressure_angle(cams: Slab) -> FloatArray:
    angle = np.where(cams.flank, _angle(cams.slope, cams.tangent), -np.inf).max(axis=1)
    if cams.begin is not None:
        first = np.where(cams.begin.there, _angle(cams.begin.slope, cams.begin.tangent), -np.inf)
        angle = np.maximum(angle, first[:, 0])
    return np.where(np.isfinite(angle), angle, np.nan)


def _angle(slope: FloatArray, tangent: FloatArray) -> FloatArray:
    return np.arctan2(1.0 + slope * tangent, slope - tangent)


SCALARS: dict[str, Callable[[Slab], FloatArray]] = {
    "force_constant": lambda cams: cams.designs.constant,
    "spring_stiffness": lambda cams: cams.designs.stiffness,
    "theoretical_force": lambda cams: 4.0 * cams.designs.stiffness * cams.designs.constant,
    "undercut_travel": lambda cams: cams.corner_travel,
    "roller_radius_max": lambda cams: cams.designs.curvature_radius,
    "force_constant_min": _smallest_constant,
    "corner_force_max": lambda cams: cams.corner_peak,
    "jam_travel": lambda cams: cams.jam_travel,
    "spring_elongation_max": lambda cams: 2.0 * cams.stretch.max(axis=1),
    "contact_force_max": _largest_contact,
    "pressure_angle_max": _pressure_angle,
    "brace_angle_max": lambda cams: np.arcsin(cams.half_width.max(axis=1) / cams.designs.brace),
    "friction_half_gap_max": _half_gap,
}
"""The family's own values."""

ABSENT = frozenset(DEFINITIONS) - frozenset(SCALARS)
"""Values of motions, contacts, measured and tolerated cams: a cam without these has none."""

WINDOWED = frozenset((*METRICS, *CYCLES, *RANGES, RMS, STATIC_BALANCE))
"""What is measured over a window, or against its ends."""

KNOWN = WINDOWED | frozenset(DEFINITIONS)
"""Everything that can be asked."""

STRESSES = ("stress_max", "safety_factor")

KNOWN_OF_BUILT = KNOWN | frozenset(STRESSES)
"""What can be asked of mechanisms around one cam whose contact is judged."""
