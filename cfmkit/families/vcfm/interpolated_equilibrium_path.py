"""A traced beam network as a function: force, stress and form at any travel, from converged points of its path.

Between two bifurcations the force is smooth: there it is a row of Chebyshev polynomials, each on a panel of its own. A
panel whose polynomial has not converged is halved, and the path is traced again at the nodes of the halves. A piece
before a thin leaf buckles, 1/500 of the travel at a rise of 40 thicknesses, so gets as many nodes as any other, and so
does the corner of a leaf with a stated waviness, which has no bifurcation. The stress begins like a square root where a
leaf buckles, and has kinks where its place changes: it is interpolated monotonically, in the angle arccos of the place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.numerics.interpolation import ChebyshevPanels, coefficients, nodes_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path

DOWN_ANGLE = -0.5 * np.pi
GRID_SIZES = (127, 113)  # points requested first, to find the bifurcations; the second where the first leave a doubt
BIFURCATION_DISTANCE = 0.02  # bifurcations closer than this share of the travel are looked at again
PATH_TOLERANCES = (1e-9, 1e-7, 1e-6, 1e-5)
"""Of the path, relative to its largest force, which far beyond the flat pose is a thousand times the peak. Slender
leaves that are pulled straight there do not reach the first: the next is taken."""
COEFFICIENT_RTOL = 3e-8
"""Size of a panel's last coefficients, relative to the largest force so far, at which it has converged; where only a
looser tolerance of the path was reached, or rounding of places leaves more, that: halving does not take it away."""
PANEL_COUNTS, N_CORNER_PANELS = (4, 3, 5), 16
"""Panels of a piece at first, the next number where a path left its branch; and of one that may have corners."""
BIFURCATION_CLEARANCE, PANEL_CLEARANCE = 5e-4, 0.05
"""Nodes keep this share of the travel away from a bifurcation, but no more than that share of their panel: the engine
misses a branch of leaves just above the critical slenderness where a point is requested at 1e-4 of the travel behind
its beginning. From 0.05 of a panel inside, the polynomial at its end makes 450 times the rounding, 1e-9 of the peak."""
MAX_HALVINGS = 12  # at most so many: a corner left then is 1/16000 of its piece
MIN_POINT_ANGLE = 1e-3
"""Least distance of points that the stress is interpolated between, in the angle that is pi for a piece [rad]."""
NEGLIGIBLE_WAVINESS = 1e-7
"""Waviness, in parts of the travel, of leaves whose branch opens and closes again within so little that it is missed:
with it they go round the corner. Just above the slenderness at which arches buckle, 1.0001 times that, their force is
within 2e-6 of the peak of that of the unbuckled form."""
PEAK_TRAVEL_SHARE = 0.25
"""Part of the travel within which the leaves have their peak, which is the scale of all before it."""


@dataclass(frozen=True)
class PathPoints:
    """Converged points of a path in the order of travel: places [m], force [N], stress [Pa], stability, form; (n,)."""

    places: FloatArray
    force: FloatArray
    stress: FloatArray
    stable: Any
    buckled: Any

    def merge(self, points: PathPoints) -> PathPoints:
        """Return these points and others, each place once."""
        pairs = zip(self.columns, points.columns, strict=True)
        places, *columns = (np.concatenate(pair) for pair in pairs)
        _, kept = np.unique(np.abs(places), return_index=True)
        return PathPoints(places[kept], *(column[kept] for column in columns))

    @property
    def columns(self) -> tuple[Any, ...]:
        """All of them."""
        return self.places, self.force, self.stress, self.stable, self.buckled


@dataclass(frozen=True)
class TracedPath:
    """A path as a function of the travel, from zero on."""

    points: PathPoints  # travels all of one sign
    panels: ChebyshevPanels | None  # force [N] over the size of the travel [m]
    edges: tuple[float, ...]  # zero, the bifurcations and the end [m]
    problem: str = ""  # why the path ends early; empty if it does not

    @property
    def sense(self) -> float:
        """1 for travels from zero up, -1 for those from zero down."""
        return -1.0 if self.edges[-1] < 0 else 1.0

    def piece(self, travel: FloatArray) -> Any:
        """Return the number of the piece that each travel is in."""
        inner = self.sense * np.array(self.edges[1:-1])
        return np.searchsorted(inner, self.sense * np.asarray(travel), side="right")

    @cached_property
    def _stresses(self) -> list[Callable[[FloatArray], FloatArray]]:
        """The stress on each piece, as a function of the travel's size."""
        pieces, sizes = self.piece(self.points.places), self.sense * self.points.places
        ends = self.sense * np.array(self.edges)
        laws = []
        for number, (low, high) in enumerate(pairwise(ends)):
            on_piece = pieces == number
            laws.append(_stress_law(sizes[on_piece], self.points.stress[on_piece], float(low), float(high)))
        return laws

    def evaluate(self, travel: FloatArray) -> tuple[FloatArray, FloatArray, Any, Any]:
        """Return force, stress, stability and form at some travels [m]; NaN beyond the end."""
        x, pieces = self.sense * np.asarray(travel, dtype=float), self.piece(travel)
        force, stress = np.full(x.shape, np.nan), np.full(x.shape, np.nan)
        if self.panels is not None:
            force = self.panels.evaluate(x)
            unknown = np.isnan(force)
            force[unknown] = np.interp(x[unknown], self.sense * self.points.places, self.points.force)
            for number, law in enumerate(self._stresses):
                chosen = pieces == number
                stress[chosen] = law(x[chosen])
        beyond = x > self.sense * self.edges[-1] * (1 + 1e-9) + 1e-15
        force[beyond], stress[beyond] = np.nan, np.nan
        return force, stress, self.stable[pieces], self.buckled[pieces]

    @property
    def buckled_range(self) -> tuple[float, float]:
        """Range in which another form than unloaded is taken, from and to [m]; NaN where none is."""
        numbers = np.flatnonzero(self.buckled)
        return (self.edges[numbers[0]], self.edges[numbers[-1] + 1]) if len(numbers) else (np.nan, np.nan)

    @cached_property
    def buckled(self) -> Any:
        """Whether each piece is on a branch that was not there unloaded."""
        return self._majority(self.points.buckled, False)

    @cached_property
    def stable(self) -> Any:
        """Whether each piece is stable."""
        return self._majority(self.points.stable, True)

    def _majority(self, flags: Any, empty: bool) -> Any:
        """Return what most of the points of each piece are."""
        pieces = self.piece(self.points.places)
        flags_of_pieces = [flags[pieces == number] for number in range(len(self.edges) - 1)]
        return np.array([piece_flags.mean() > 0.5 if len(piece_flags) else empty for piece_flags in flags_of_pieces])


def _stress_law(x: FloatArray, stress: FloatArray, low: float, high: float) -> Callable[[FloatArray], FloatArray]:
    """Return the stress of a piece [Pa], monotone between its points in the angle arccos of the place."""
    from scipy.interpolate import PchipInterpolator

    def angle(place: FloatArray) -> FloatArray:
        return np.asarray(np.arccos(np.clip(1.0 - 2.0 * (place - low) / (high - low), -1.0, 1.0)))

    around = angle(x)
    # the path's own points crowd at a bifurcation: two that all but coincide say nothing of the slope
    kept = [0] if len(around) else []
    for number in range(1, len(around)):
        if around[number] - around[kept[-1]] > MIN_POINT_ANGLE:
            kept.append(number)
    if len(kept) < 2:
        return lambda place: np.full(place.shape, stress[0] if len(stress) else np.nan)
    law = PchipInterpolator(around[kept], stress[kept])
    return lambda place: np.asarray(law(angle(place)))


def trace_leaf(network: Network, node: str, end: float, **control: Any) -> TracedPath:
    """Return what a network does while a node moves down by up to `end` [m], or up where that is negative."""
    route = Route(network, node, control)
    for count in GRID_SIZES:
        first, grid = _begin_path(route, end, count)
        gaps = np.abs(np.diff(first.edges[1:-1]))
        # bifurcations close together may come from a point requested next to one: other points tell
        if first.problem or not (gaps < BIFURCATION_DISTANCE * abs(end)).any():
            break
    at_its_end = all(abs(first.edges[-1] - place) <= BIFURCATION_DISTANCE * abs(end) for place in first.edges[1:-1])
    if first.problem and at_its_end and not control.get("imperfection"):
        wavy = trace_leaf(network, node, end, **control | {"imperfection": NEGLIGIBLE_WAVINESS * abs(end)})
        if not wavy.problem:
            return wavy
    if not first.edges[-1]:
        return first
    for number in PANEL_COUNTS:
        panels, points, kept = _resolve_panels(route, first, grid, number)
        if kept:
            break
    return replace(first, points=points, panels=panels)


@dataclass
class Route:
    """Network that is traced, and the tolerance by which that works."""

    network: Network
    node: str
    control: dict[str, Any]
    tolerances: tuple[float, ...] = PATH_TOLERANCES
    rounding: float = 0.0  # error that rounding leaves, relative to the largest force

    def trace_places(self, places: FloatArray) -> tuple[Path, FloatArray]:
        """Return the path through some places, by the strictest tolerance that it reaches, and the places."""
        from cfmkit.elastica import Control, Displacement, PathStatus, trace
        from cfmkit.elastica.results.member_efforts import effort_error

        drive = Displacement(self.node, DOWN_ANGLE, places)
        for number, tolerance in enumerate(self.tolerances):
            path = trace(self.network, drive, Control(**({"tolerance": tolerance} | self.control)))
            if path.status is not PathStatus.INACCURATE:
                self.tolerances = self.tolerances[number:]
                break
        else:  # nor do other places reach the stricter ones
            self.tolerances = self.tolerances[-1:]
        largest = float(np.abs(path.effort).max(initial=0.0))
        if largest > 0:
            self.rounding = max(self.rounding, effort_error(path, 0.0) / largest)
        return path, places

    @property
    def resolved(self) -> float:
        """Size of the last coefficients, relative to the largest force so far, at which a panel has converged."""
        return max(COEFFICIENT_RTOL, self.tolerances[0], self.rounding)


def _begin_path(route: Route, end: float, count: int) -> tuple[TracedPath, FloatArray]:
    """Return a first path through so many places at equal distances up to `end`, without panels, and these [m]."""
    from cfmkit.elastica import PathStatus

    places = end * np.arange(1, count + 1) / count
    path, _ = route.trace_places(places)
    sense, points = np.sign(end), _points(path, places)
    reached = float(points.places[-1]) if len(points.places) else 0.0
    whole = abs(reached - end) <= 1e-9 * abs(end)
    events = sorted((e.drive for e in path.events if e.kind == "bifurcation"), key=abs)
    inner: list[float] = []
    for event in events:  # one that is found from both sides is one
        if 0 < sense * event < sense * reached and abs(event - (inner[-1] if inner else 0.0)) > 1e-10:
            inner.append(event)
    problem = "" if path.status is PathStatus.COMPLETE and whole else path.message
    zero = PathPoints(*(np.array([value]) for value in (0.0, 0.0, 0.0, True, False)))  # the unloaded position
    return TracedPath(zero.merge(points), None, (0.0, *inner, reached), problem), places


def _points(path: Path, places: FloatArray) -> PathPoints:
    """Return the accurate points of a path at which the drive is farther than ever before."""
    drive = np.array(path.drive)
    asked = path.requested >= 0
    drive[asked] = places[path.requested[asked]]  # to the last digit, so that nodes are found again
    size = np.sign(places[-1]) * drive
    farthest = np.maximum.accumulate(np.concatenate([[-1e-30], size[:-1]])) if len(size) else size
    kept = np.flatnonzero(np.asarray(path.accurate) & (size > farthest + 1e-15))
    if not len(kept):
        return PathPoints(*(np.empty(0, kind) for kind in (float, float, float, bool, bool)))
    stress = path.beam_stresses()[0].max(axis=0)
    buckled = np.char.startswith(np.asarray(path.branch).astype(str), "bifurcated")
    return PathPoints(drive[kept], path.effort[kept], stress[kept], path.stable[kept].astype(bool), buckled[kept])


def _resolve_panels(
    route: Route,
    first: TracedPath,  # path that bifurcations are known from
    grid: FloatArray,  # places that were requested of it [m]
    number: int,  # panels of a piece at first
) -> tuple[ChebyshevPanels, PathPoints, bool]:
    """Return the force as converged panels, all points traced for them, and whether these keep their branch."""
    points, sense = first.points, np.sign(first.edges[-1])
    ends, count = sense * np.array(first.edges), N_CORNER_PANELS if route.control.get("imperfection") else number
    pieces, apart = list(pairwise(ends.tolist())), BIFURCATION_CLEARANCE * float(ends[-1])
    # points in every piece and those of the first path: none that follows may step over a bifurcation that this one saw
    guards = [np.linspace(*piece, 5)[1:-1] for piece in pieces]
    steps = sense * grid
    near_edge = np.abs(steps[:, None] - ends[1:-1]).min(axis=1, initial=np.inf) < apart
    guards.append(steps[(steps < ends[-1]) & ~near_edge])
    early = min(float(ends[1]), PEAK_TRAVEL_SHARE * float(ends[-1]))
    wanted = [panel for piece in pieces for panel in pairwise(np.linspace(*piece, count + 1).tolist())]
    done: dict[tuple[float, float], FloatArray] = {}

    def shrink_panel(panel: tuple[float, float]) -> tuple[float, float]:
        """Return the part of a panel that has nodes: clear of bifurcations."""
        low, high = panel
        margin = min(apart, PANEL_CLEARANCE * (high - low))
        return low + margin * (low in ends[1:-1]), high - margin * (high in ends[1:-1])

    kept = True  # no path has left its branch
    for left in range(MAX_HALVINGS, -1, -1):
        places = np.unique(np.concatenate([*guards, *(nodes_of(shrink_panel(panel)) for panel in wanted)]))
        more = _points(*route.trace_places(sense * places))
        kept, points = kept and _is_same_branch(first, more), points.merge(more)
        size = sense * points.places
        largest = np.maximum.accumulate(np.abs(points.force))
        halves: list[tuple[float, float]] = []
        for panel in wanted:
            series = coefficients(shrink_panel(panel), size, points.force)
            scale = largest[np.searchsorted(size, max(panel[1], early), side="right") - 1]
            if left and np.abs(series[-3:]).max() > route.resolved * scale:  # false where a node is missing
                middle = 0.5 * (panel[0] + panel[1])
                halves += [(panel[0], middle), (middle, panel[1])]
            else:
                done[panel] = series
        if not halves:
            break
        wanted = halves
    ordered = sorted(done)
    borders = np.array([low for low, _ in ordered] + [ordered[-1][1]])
    spans = np.array([shrink_panel(panel) for panel in ordered])
    return ChebyshevPanels(borders, spans, np.array([done[panel] for panel in ordered])), points, kept


def _is_same_branch(first: TracedPath, points: PathPoints) -> bool:
    """Return True if points are on the branch that a first path took in each piece, where it has points there."""
    traced = replace(first, points=points)
    both = np.isin(np.arange(len(first.edges) - 1), first.piece(first.points.places))
    return bool(((first.stable == traced.stable) & (first.buckled == traced.buckled))[both].all())
