"""Force between a surface and the tip of an end-effector that a beam mechanism supports [Lan, sec. IV].

The curve of the solved mechanism and the profile of the surface (`analysis.surface`) go in; forces, stress and extremes
along the surface come out, with warnings where the tip lifts off, jams or cannot reach the surface.

The carrier moves along x; the tip is guided along the drive and follows the heights, so that the mechanism is displaced
by the preload plus the height. With a slope angle a and friction m the axial force F of the mechanism is held by the
normal force N: F = N (cos a - m sin a) on the way along x, and the carrier is pushed back by N (sin a + m cos a). On
the way back the slope has the other sign. Between the points of a profile the surface runs on (`SurfaceCourse`);
extremes are those of everything between its ends.

Assumes: slow motion, a sharp tip that stays on the surface, guides without friction.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), sec. IV and Fig. 14.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazyMapping, LazySequence, ShortRepr
from cfmkit.curves import Column, Curve
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.end_stops import LARGEST_FORCE
from cfmkit.numerics.holes_in_samples import MAX_HOLE_SHARE, holes_between
from cfmkit.numerics.interpolation import bisect, values_at
from cfmkit.results import Quantity, Status, quantities
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.families.beam.constant_force_range_and_extremes import SolvedMechanism
    from cfmkit.families.beam.spec import FileProfile, FormulaProfile, Surface
    from cfmkit.results import Finding, Result


N_PLACES = 4001  # places along a surface among which an extreme is searched, before the best one is refined
_N_SURFACE_ROWS = 201  # of the curve along a surface that is given by few points
_CORNER_OFFSET = 1e-9  # share of the length: places so far to both sides of a corner are searched, too


@dataclass(frozen=True, repr=False)
class SurfaceCourse(ShortRepr):
    """A surface between its ends."""

    # height, slope: height [m] and its derivative [1] at places [m]; at a corner the slope is that of one side
    height: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]
    rows: FloatArray  # (n,) the places that the curve along it is written at [m]
    corners: FloatArray  # (k,) where the slope jumps [m]
    holes: tuple[tuple[float, float], ...] = ()  # between which places it was not measured [m]

    def places(self, end: float) -> FloatArray:
        """Return many places up to one [m], the rows and both sides of every corner among them."""
        start = float(self.rows[0])
        beside = _CORNER_OFFSET * (float(self.rows[-1]) - start)
        both = np.concatenate([self.corners - beside, self.corners + beside])
        every = np.unique(np.concatenate([np.linspace(start, end, N_PLACES), self.rows, both]))
        return every[(every >= start) & (every <= end)]


def course_of(surface: Surface) -> SurfaceCourse:
    """Return heights and slopes of the surface of an analysis.

    Raises DataError if the file cannot be used.
    """
    profile = surface.profile
    return _read_file_course(profile) if profile.kind == "file" else _read_formula_course(profile)


def _read_formula_course(profile: FormulaProfile) -> SurfaceCourse:
    from cfmkit.specs.formula_of_x import formula, slope

    height, rise = formula(profile.height), slope(profile.height)
    rows = np.linspace(0.0, profile.length, profile.points)
    return SurfaceCourse(lambda x: height(x * 1e3) * 1e-3, lambda x: rise(x * 1e3), rows, np.zeros(0))


def _read_file_course(profile: FileProfile) -> SurfaceCourse:
    from pathlib import Path

    from scipy.interpolate import CubicSpline

    from cfmkit.tables.measured_outline import read_profile

    x, y = read_profile(getattr(profile.file, "path", Path(profile.file)))
    rows = np.unique(np.concatenate([x, np.linspace(x[0], x[-1], _N_SURFACE_ROWS)]))
    if profile.between == "smooth":
        spline = CubicSpline(x, y)
        least = MAX_HOLE_SHARE * (x[-1] - x[0])
        holes = tuple((low, high) for low, high in holes_between(x, x[0], x[-1]) if high - low > least)
        return SurfaceCourse(spline, spline.derivative(), rows, np.zeros(0), holes)
    steps = np.diff(y) / np.diff(x)

    def slope(places: FloatArray) -> FloatArray:
        return np.asarray(steps[np.clip(np.searchsorted(x, places, side="right") - 1, 0, len(steps) - 1)])

    return SurfaceCourse(lambda places: np.interp(places, x, y), slope, rows, x[1:-1])


def largest(function: Callable[[FloatArray], FloatArray], places: FloatArray) -> float:
    """Return the largest value of a function near the best of some places, refined between its neighbours.

    Examples
    --------
    >>> round(largest(lambda x: 1 - (x - 0.3) ** 2, np.linspace(0.0, 1.0, 5)), 12)
    1.0
    """
    largest = -np.inf
    for _ in range(_N_ZOOMS):
        values = function(places)
        best = int(np.argmax(values))
        largest = max(largest, float(values[best]))
        low, high = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
        places = np.linspace(low, high, _PLACES_PER_ZOOM)
    return largest


_N_ZOOMS, _PLACES_PER_ZOOM = 5, 65  # each makes the places 32 times as dense
TIP_DEFINITIONS = {
    "tip_force_min": ("force", "smallest axial force of the tip along the surface"),
    "tip_force_max": ("force", "largest axial force of the tip along the surface"),
    "tip_force_band": ("ratio", "(max - min)/max of the axial force along the surface"),
    "surface_relief": ("length", "largest minus smallest height of the surface, as far as it is followed"),
    "contact_force_max": ("force", LARGEST_FORCE),
    "lateral_force_max": ("force", "largest force against the motion along the surface, in both directions of "
    "the motion"),
    "surface_reach": ("length", "distance along the surface that the mechanism can follow"),
    "surface_stress_max": ("stress", "largest stress in the mechanism along the surface"),
    "surface_safety_factor": (
        "factor", "allowable stress over the largest stress along the surface; 1 or more is within the limit"
    ),
}  # fmt: skip
_TRAVEL_SLACK = 1e-12  # of the travel: a surface may reach exactly to its ends
_NO_FORCE = 1e-9  # of the largest force: less is none


@dataclass(frozen=True)
class SurfaceResult:
    """Forces, motions and scalar results along a surface, as far as the mechanism can follow it."""

    # place, height, displacement, (n,): along the surface, of it, and of the mechanism [m]
    place: FloatArray
    height: FloatArray
    displacement: FloatArray
    force: FloatArray  # (n,) axial force of the tip [N]
    # contact, lateral, (2, n): normal force on the surface and force against the motion [N], on the way along x and on
    # the way back; not finite where the tip jams
    contact: FloatArray
    lateral: FloatArray
    stress: FloatArray  # (n,) largest stress in the mechanism [Pa]
    stable: Any  # (n,) whether the mechanism is stable there
    values: Mapping[str, float | None]  # the scalar results; extremes are those between the points, too
    findings: tuple[Finding, ...] = ()  # all that is wrong with it
    missing: str = ""  # why it ends before the surface does, or has a hole
    hole: str = ""  # where the surface was not measured: nothing is known there, nor what holds over the whole surface


@dataclass(frozen=True)
class TipOnSurface:
    """Tip on a surface: the curve of the mechanism behind it, up to where that turns back, and the surface."""

    surface: Surface  # what the tip follows
    course: SurfaceCourse  # its height and slope
    # x, effort, stress, stable, (n,): increasing displacements [m], forces [N], largest stresses [Pa], and 1 if stable
    x: FloatArray
    effort: FloatArray
    stress: FloatArray
    stable: FloatArray
    between: BetweenPoints | None = None  # the model between these displacements

    def stress_at(self, displacement: FloatArray) -> FloatArray:
        """Return the largest stress in the mechanism at displacements [Pa]."""
        if self.between is None:
            return np.interp(displacement, self.x, self.stress)
        return self.between.stress("", np.clip(displacement, self.x[0], self.x[-1]))

    def displacement(self, place: FloatArray) -> FloatArray:
        """Return the displacement of the mechanism at places along the surface [m]."""
        return self.surface.preload + self.course.height(place)

    def force(self, place: FloatArray) -> FloatArray:
        """Return the axial force at places along the surface [N]."""
        return self.force_at(self.displacement(place))

    def force_at(self, displacement: FloatArray) -> FloatArray:
        """Return the axial force at displacements [N]; at those that are not solved for, that at the nearest one."""
        return values_at(self.x, self.effort, np.clip(displacement, self.x[0], self.x[-1]))

    def contact(self, place: FloatArray, direction: int) -> FloatArray:
        """Return the normal force on the way along x (1) or back (-1) [N]; infinite where the tip jams."""
        slope = direction * self.course.slope(place)
        with np.errstate(divide="ignore"):
            return self.force(place) * np.hypot(1.0, slope) / np.maximum(1.0 - self.surface.friction * slope, 0.0)

    def lateral(self, place: FloatArray, direction: int) -> FloatArray:
        """Return the force against the motion along x (1) or back (-1) [N]."""
        slope = direction * self.course.slope(place)
        return self.contact(place, direction) * (slope + self.surface.friction) / np.hypot(1.0, slope)

    def follows(self, place: FloatArray) -> Any:
        """Return at which places the mechanism follows the surface and presses on it."""
        u = self.displacement(place)
        slack = _TRAVEL_SLACK * (self.x[-1] - self.x[0])
        inside = (u >= self.x[0] - slack) & (u <= self.x[-1] + slack)
        return inside & (self.force(place) >= 0)

    def ending(self, place: float) -> Finding:
        """Return why the tip does not follow the surface beyond a place [m]."""
        u = float(self.displacement(np.array([place]))[0])
        where, asked = format_short(place, "length"), format_short(u, "length")
        lifts = f"the tip leaves the surface at {where} along it"
        if u < self.x[0] and self.effort[0] <= 0:
            return finding("tip_lifts_off", f"{lifts}: there the mechanism is at rest and the surface falls further")
        if self.x[0] <= u <= self.x[-1] and np.isfinite(self.force(np.array([place]))).all():
            reason = f"the force of the mechanism falls to zero at a displacement of {asked}"
            return finding("tip_lifts_off", f"{lifts}: {reason}")
        low, high = (format_short(float(end), "length") for end in (self.x[0], self.x[-1]))
        message = f"the surface requires a displacement of {asked} at {where}"
        return finding("surface_out_of_reach", f"{message}, the mechanism is solved for {low} to {high}")


def follow_surface(solution: SolvedMechanism) -> SurfaceResult | None:
    """Return forces and results along the surface of the analysis; None if there is no surface."""
    surface = solution.spec.analysis.surface
    if surface is None:
        return None
    tip = _tip_on_surface(solution, surface)
    endings: list[Finding] = []
    rows = tip.course.rows
    places, end = tip.course.places(float(rows[-1])), float(rows[-1])
    lost = np.flatnonzero(~tip.follows(places))
    if len(lost):
        first = int(lost[0])
        beyond = float(places[first])
        if first:
            last_good = float(places[first - 1])
            beyond = bisect(lambda place: not tip.follows(np.array([place]))[0], last_good, beyond)
            end = float(np.nextafter(beyond, last_good))
        endings.append(tip.ending(beyond))
        rows = np.append(rows[rows < end], end) if first else rows[:0]
    u = tip.displacement(rows)
    contact, lateral = (np.array([force(rows, 1), force(rows, -1)]) for force in (tip.contact, tip.lateral))
    stress, stable = tip.stress_at(u), np.interp(u, tip.x, tip.stable) == 1
    allowable = solution.assembly.allowable_stress
    values, height, force = _values(tip, rows, allowable), u - surface.preload, tip.force(rows)
    result = SurfaceResult(rows, height, u, force, contact, lateral, stress, stable, values)
    if holes := [hole for hole in tip.course.holes if len(rows) and hole[0] < rows[-1]]:
        result, hole = _drop_holes(result, holes)
        endings.append(hole)
    missing = "; ".join(warning.message for warning in endings)
    return replace(result, findings=(*endings, *_findings(tip, result, allowable)), missing=missing)


def _drop_holes(result: SurfaceResult, holes: Sequence[tuple[float, float]]) -> tuple[SurfaceResult, Finding]:
    """Return a result without numbers in holes of the surface, and without scalar results; and what says so."""
    unknown = np.any([(result.place > low) & (result.place < high) for low, high in holes], axis=0)
    rows: dict[str, Any] = {
        name: np.where(unknown, np.nan, getattr(result, name))
        for name in ("height", "displacement", "force", "contact", "lateral", "stress")
    }
    spans = " and ".join(f"{format_short(low, 'length')} to {format_short(high, 'length')}" for low, high in holes)
    hole = f"the surface has no points from {spans} along it"
    unknown_values = "the force there is not known, nor the extremes"
    remedy = "'analysis.surface.profile.between: straight' takes straight lines there for the surface"
    message, cure = f"{hole}: {unknown_values}; {remedy}", "analysis.surface.profile.between=straight"
    result = replace(result, **rows, values=dict.fromkeys(TIP_DEFINITIONS), hole=hole)
    return result, finding("surface_hole", message, cure)


def _tip_on_surface(solution: SolvedMechanism, surface: Surface) -> TipOnSurface:
    """Return the mechanism up to where its path turns back: the tip cannot follow it beyond."""
    x, effort, stress = solution.motion, solution.effort, solution.stress
    steps = np.sign(np.diff(x))
    turns = np.flatnonzero(steps != steps[0])
    count = int(turns[0]) + 1 if len(turns) else len(x)
    sense = slice(None) if steps[0] > 0 else slice(None, None, -1)
    stable = np.asarray(solution.stable, float)
    x, effort, stress, stable = (values[:count][sense] for values in (x, effort, stress, stable))
    if (law := solution.model_between_points) is not None:  # with the extremes between the points
        places, effort = law.knots
        x, stress, stable = places, law.stress("", places), np.interp(places, x, stable)
    effort = np.where(np.abs(effort) > _NO_FORCE * np.nanmax(np.abs(effort)), effort, 0.0 * effort)  # at rest: rounding
    return TipOnSurface(surface, course_of(surface), x, effort, stress, stable, law)


def _values(tip: TipOnSurface, rows: FloatArray, allowable: float | None) -> dict[str, float | None]:
    """Return the scalar results by name; extremes are those of the surface and of the force between all points."""
    numbers: dict[str, float | None] = dict.fromkeys(TIP_DEFINITIONS)
    if not len(rows):
        return numbers
    places = tip.course.places(float(rows[-1]))
    top, bottom = largest(tip.displacement, places), -largest(lambda at: -tip.displacement(at), places)
    between = np.unique(np.concatenate([np.linspace(bottom, top, N_PLACES), np.clip(tip.x, bottom, top)]))
    high, low = largest(tip.force_at, between), -largest(lambda at: -tip.force_at(at), between)
    stress = float(tip.stress_at(between).max())
    contact, lateral = (
        max(largest(partial(force, direction=direction), places) for direction in (1, -1))
        for force in (tip.contact, tip.lateral)
    )
    return numbers | {
        "tip_force_min": low,
        "tip_force_max": high,
        "tip_force_band": (high - low) / high if high > 0 else None,
        "surface_relief": top - bottom,
        "contact_force_max": contact if np.isfinite(contact) else None,
        "lateral_force_max": lateral if np.isfinite(lateral) else None,
        "surface_reach": float(rows[-1] - rows[0]),
        "surface_stress_max": stress,
        "surface_safety_factor": allowable / stress if allowable is not None and stress > 0 else None,
    }


def _findings(tip: TipOnSurface, result: SurfaceResult, allowable: float | None) -> Iterator[Finding]:
    """Yield a warning for a stress beyond the allowable one, and for each direction in which the tip jams."""
    stress = result.values["surface_stress_max"]
    if allowable is not None and stress is not None and stress > allowable:
        largest_stress, limit = (format_short(value, "stress") for value in (stress, allowable))
        message = f"along the surface the largest stress is {largest_stress}; the allowable stress is {limit}"
        yield finding("surface_stress_exceeded", message)
    if not len(result.place):
        return
    places = tip.course.places(float(result.place[-1]))
    for direction, direction_name in ((1, "along x"), (-1, "back")):
        jammed = ~np.isfinite(tip.contact(places, direction))
        if jammed.any():
            place = format_short(float(places[int(jammed.argmax())]), "length")
            yield finding("tip_jams", f"on the way {direction_name} the slope at {place} is too steep for the friction")


def add_surface(result: Result, solution: SolvedMechanism) -> Result:
    """Return the result of an analysis with what is along its surface, if there is one."""
    along = follow_surface(solution)
    if along is None:
        return result
    curves = (*result.curves, *([_curve_of(along)] if len(along.place) > 1 else []))
    warnings = LazySequence(lambda: (*result.warnings, *along.findings))
    values = LazyMapping(result.values, result.values.__getitem__, _values_along(along))
    followed = replace(result, curves=curves, values=values, warnings=warnings)
    if along.missing and result.status is Status.COMPLETE:
        followed = replace(followed, status=Status.PARTIAL, message=along.missing)
    return followed


def _curve_of(result: SurfaceResult) -> Curve:
    """Return forces and motions as a curve over the distance along the surface."""
    extra = {
        "surface_height": Column(result.height, "length"),
        "mechanism_displacement": Column(result.displacement, "length"),
        "contact_force": Column(result.contact[0], "force"),
        "lateral_force": Column(result.lateral[0], "force"),
        "contact_force_back": Column(result.contact[1], "force"),
        "lateral_force_back": Column(result.lateral[1], "force"),
        "max_stress": Column(result.stress, "stress"),
    }
    branch = np.repeat(["surface"], len(result.place))
    return Curve(result.place, result.force, branch, result.stable, extra, label={"over": ("surface", "text")})


def _values_along(result: SurfaceResult) -> Mapping[str, Quantity]:
    """Return the scalar results along a surface by name."""
    if result.hole:
        return {name: Quantity(None, *meant, result.hole) for name, meant in TIP_DEFINITIONS.items()}
    return quantities(TIP_DEFINITIONS, result.values)
