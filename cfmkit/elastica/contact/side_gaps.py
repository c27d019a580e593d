"""Gaps between sides of beams and obstacles or pads, in many states: lines of elements, gaps along them, the least."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from cfmkit.arrays import read_only
from cfmkit.elastica.contact.beam_lines import list_elements
from cfmkit.elastica.contact.edges import half_thickness_of, measure_distance
from cfmkit.elastica.contact.line_tangent import find_reach, line_leaves_normal, round_off
from cfmkit.elastica.mechanics import energy
from cfmkit.elastica.mechanics.equations import LineTables, SideData
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.model_arrays import edge_rows
from cfmkit.elastica.mechanics.moving_elements import PLACE_STEP, cuts_at, with_places
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.mechanics.poses import poses
from cfmkit.elastica.model.contact import BeamOnBeam, BeamOnObstacle
from cfmkit.elastica.model.section import Taper

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.discretise import Discretisation
    from cfmkit.elastica.mechanics.problem import NetworkProblem
    from cfmkit.elastica.model.contact import BeamSide
    from cfmkit.elastica.model.section import Section

N_ALONG = 33  # places of an element at which the gap of its side is measured
NEAR_GAP = 1e-3  # share of a mean beam length within which the least gap is found exactly
PARALLEL_GAP = 1e-9  # mean beam lengths by which the gap along a beam changes that is parallel to an obstacle
N_ROUNDS, SLOPE_LEVEL = 20, 1e-9  # of the search for a least gap, and the slope there: its square is the error
GAP_RESOLUTION = 1e-13
BESIDE_CONTACT = 1e-7  # mean beam lengths by which a side may lie in an obstacle beside a contact: rounding


class SideStates(NamedTuple):
    """States at k places of m elements in n states, (n, m, k) each unless said otherwise; dimensionless."""

    place: Any  # (n, m, k, 2)
    turn: Any  # rotation from rest
    angle: Any  # of the tangent
    behind: Any  # arc length from the start of the element
    ahead: Any  # to its end
    parameter: Any
    slope: Any  # (n, m, k, 2) of the middle line, by the unloaded arc length


MeasuredGaps = tuple[Any, Any, SideStates]


class LoadStage(NamedTuple):
    """Places of n states on the way: the drive (n,), and the share of what is constant, (n, 1, 1) or 1."""

    drive: FloatArray
    share: Any = 1.0

    @classmethod
    def from_problem(cls, problem: NetworkProblem, ways: FloatArray) -> LoadStage:
        """Return the stage at places of the way of a problem, (n,)."""
        return cls(np.zeros(len(ways)), ways[:, None, None]) if problem.ramp else cls(ways)

    def rows(self) -> FloatArray:
        """Return drive and share of each state, (n, 2)."""
        rows = np.empty((len(self.drive), 2))
        rows[:, 0], rows[:, 1] = self.drive, np.ravel(self.share)
        return rows

    def take(self, some: Any) -> LoadStage:
        """Return the stage of some of the states."""
        return LoadStage(self.drive[some], self.share if np.isscalar(self.share) else self.share[some])


class ElementLines(NamedTuple):
    """Lines of m elements in n states, from which states at any of their places are evaluated; q Gauss points."""

    z: FloatArray  # (n, size)
    stage: LoadStage
    elements: Any  # (m,)
    start: FloatArray  # (n, m, 2)
    slope: FloatArray  # (n, m, q, 2) of the middle line, by the place along the element
    speed: FloatArray  # (n, m, q) unloaded arc length by the place along the element
    angle: FloatArray  # (n, m, q) unloaded
    rotation: FloatArray  # (n, m, degree + 1)
    cuts: FloatArray  # (n, m, 2)

    def evaluate(self, fractions: FloatArray) -> SideStates:
        """Return the states at fractions of the elements, (k,) of all or (n, m, k)."""
        at = _rows_at(self.rotation.shape[-1] - 1, fractions)
        behind, turn = _apply(at.integrals, self.speed), _apply(at.values, self.rotation)
        low, high = self.cuts[..., :1], self.cuts[..., 1:]
        return SideStates(
            self.start[:, :, None] + at.integrals @ self.slope,
            turn,
            _apply(at.interpolation, self.angle) + turn,
            behind,
            self.speed @ basis(self.rotation.shape[-1] - 1).weights[:, None] - behind,
            low + (high - low) * fractions,
            at.interpolation @ (self.slope / self.speed[..., None]),
        )


def _apply(rows: FloatArray, values: FloatArray) -> Any:
    """Return rows (..., k, q) times values (..., q), (..., k)."""
    return (rows @ values[..., None])[..., 0]


def find_lines(mesh: Discretisation, z: FloatArray, stage: LoadStage, elements: Any) -> ElementLines:
    """Return the lines of elements (m,) in n states (n, size); contacts stand at their places."""
    moved = with_places(mesh, z)
    whole, fields = moved.elements, energy.compute_fields(moved, z, *stage)

    def pick(table: Any, rank: int = 2) -> Any:
        return np.broadcast_to(table, (len(z), *table.shape[-rank:]))[:, elements]

    speed = pick(whole.weight) / basis(mesh.degree).weights
    slope = np.stack([fields.slope_x[:, elements], fields.slope_y[:, elements]], axis=-1) * speed[..., None]
    rotation = z[:, whole.unknowns[elements]][..., energy.rotation_columns(mesh.degree)]
    start = poses(mesh.attachments, z, whole.ends[elements, 0]).place
    cuts = whole.cuts if whole.moved_cuts is None else whole.moved_cuts
    return ElementLines(z, stage, elements, start, slope, speed, pick(whole.angle), rotation, pick(cuts))


class _RowsAtPlaces(NamedTuple):
    """Matrices from an element's unknowns, and values at its Gauss points, to places on it."""

    values: FloatArray
    integrals: FloatArray
    interpolation: FloatArray


@lru_cache(maxsize=64)
def _series_matrix(degree: int) -> FloatArray:
    """Return the matrix from values at the Gauss points to Legendre coefficients."""
    places = basis(degree).places
    return read_only(np.linalg.inv(legendre.legvander(2 * places - 1, len(places) - 1)))


def _rows_at(degree: int, places: FloatArray) -> _RowsAtPlaces:
    """Return the matrices at any places, (..., n): shapes, integrals from values at Gauss points, interpolation."""
    series = _series_matrix(degree)
    x, count = 2 * places - 1, len(series)
    polynomials = legendre.legvander(x, count)
    order = np.arange(1, count)
    primitives = np.empty((*x.shape, count))
    primitives[..., 0] = x + 1
    primitives[..., 1:] = (polynomials[..., 2:] - polynomials[..., :-2]) / (2 * order + 1)
    values = np.empty((*x.shape, degree + 1))
    values[..., 0], values[..., 1] = (1 - x) / 2, (1 + x) / 2
    order = np.arange(2, degree + 1)
    values[..., 2:] = (polynomials[..., 2 : degree + 1] - polynomials[..., : degree - 1]) / np.sqrt(4 * order - 2)
    return _RowsAtPlaces(values, primitives @ series / 2, polynomials[..., :count] @ series)


@lru_cache(maxsize=64)
def find_line_tables(degree: int) -> LineTables:
    """Return the tables of shape functions with which compiled code follows lines."""
    fractions = _even_angles()
    at, rule = _rows_at(degree, fractions), basis(degree)
    parts = fractions, rule.weights, at.values.T, at.integrals.T, at.interpolation.T, _series_matrix(degree)
    return LineTables(read_only(np.concatenate([np.ravel(part) for part in parts])), len(fractions))


def _even_angles() -> FloatArray:
    """Return the places of an element at which gaps are measured."""
    return np.asarray(0.5 * (1 - np.cos(np.pi * np.arange(N_ALONG) / (N_ALONG - 1))))


def interpolate_line(degree: int, fractions: FloatArray, start: Any, slopes: Any) -> tuple[Any, Any]:
    """Return places of elements and their slopes at fractions (p,), from starts (p, 2), slopes (p, q, 2)."""
    rows = _rows_at(degree, fractions[:, None])
    return start + (rows.integrals @ slopes)[:, 0], (rows.interpolation @ slopes)[:, 0]


def join_sides(sides: Sequence[SideData]) -> SideData:
    """Return several sides in one."""
    elements, numbers, edge = (np.concatenate(arrays) for arrays in zip(*sides, strict=True))
    counts = np.array([(0, 0), *((len(side.elements), len(side.edge)) for side in sides[:-1])]).cumsum(axis=0)
    numbers[:, [0, 10]] += counts[:, :1]
    numbers[:, 4] += counts[:, 1]
    return SideData(elements, numbers, edge)


def search_sides(
    mesh: Discretisation, sides: SideData, z: FloatArray, stage: LoadStage, watch: bool = False
) -> FloatArray | None:
    """Return the least gaps of sides in n states by compiled code, (n, sides, 5); None without it."""
    if not len(z):
        return None
    rows: FloatArray | None = equations(mesh).search_sides(z, stage.rows(), sides, find_line_tables(mesh.degree), watch)
    return rows


class LeastGap(NamedTuple):
    """The least gap of the side of a beam."""

    gap: float  # mean beam lengths
    parameter: float


@dataclass(frozen=True, eq=False)
class SideGaps:
    """Gaps of the side of one beam to one obstacle or pad, away from where it touches already."""

    mesh: Discretisation
    item: BeamSide
    touched: tuple[int, ...]  # elements that end where a node or the side touches this obstacle
    laid: tuple[int, ...] = ()  # elements that lie on it

    @cached_property
    def elements(self) -> Any:
        """Elements of the beam, (m,)."""
        return np.array(list_elements(self.mesh, self.item.beam))

    @property
    def section(self) -> Section:
        """Section of the beam."""
        return self.mesh.fits.network.beams[self.item.beam].section

    @cached_property
    def fractions(self) -> FloatArray:
        """Places of an element at which gaps are measured."""
        return _even_angles()

    @cached_property
    def slack(self) -> FloatArray:
        """By how much each element may lie in the obstacle, (m,)."""
        beside = dict.fromkeys(self.touched, BESIDE_CONTACT) | dict.fromkeys(self.laid, 1.0)
        return np.array([beside.get(number, 0.0) for number in self.elements.tolist()])

    def half_thickness(self, parameter: Any, element: int) -> Any:
        """Return half the thickness at parameters of an element, in mean beam lengths."""
        fitted, inside = self.mesh.fits[self.item.beam], float(self.mesh.elements.cuts[element].mean())
        along = fitted.arc(np.clip(parameter, 0.0, 1.0)), float(np.real(fitted.arc(inside)))
        return 0.5 * (np.real(self.section.thickness_at(*along)) + 0.0 * parameter) / self.mesh.scales.length

    def _taper(self, parameter: Any, element: int) -> Any:
        """Return the slope of half the thickness along the unloaded beam."""
        mesh = self.mesh
        if not isinstance(self.section.thickness, Taper):
            return np.zeros(np.shape(parameter))
        fitted, inside = mesh.fits[self.item.beam], float(mesh.elements.cuts[element].mean())
        sides = [self.half_thickness(parameter + step, element) for step in (PLACE_STEP, -PLACE_STEP)]
        return (sides[0] - sides[1]) / (2 * PLACE_STEP) / (fitted.speed(parameter, inside) / mesh.scales.length)

    def measure(self, lines: ElementLines, fractions: FloatArray) -> MeasuredGaps:
        """Return gaps and their slopes along the beam (by arc length) at fractions of elements, (n, m, k) each."""
        gap, slope, seen = self._measure_line(lines, fractions)
        if self.section.shear:
            kinks, reach = self.find_kinks(lines), find_reach(self.mesh, self.item, lines.elements)
            gap, slope = round_off(gap, slope, seen.behind, seen.ahead, kinks, reach)
        return gap, slope, seen

    def _measure_line(self, lines: ElementLines, fractions: FloatArray) -> MeasuredGaps:
        """Return gaps and slopes at fractions of elements, the kinks of beams that shear included."""
        seen = lines.evaluate(fractions)
        value, normal = self.distance(seen.place, lines.z, lines.stage)
        if line_leaves_normal(self.section):
            slope = (normal * seen.slope).sum(axis=-1)
        else:
            slope = normal[..., 0] * np.cos(seen.angle) + normal[..., 1] * np.sin(seen.angle)
        places = [(seen.parameter[:, k], number) for k, number in enumerate(lines.elements)]
        half, taper = (np.stack([law(*at) for at in places], axis=1) for law in (self.half_thickness, self._taper))
        return value - half, slope - taper, seen

    def find_kinks(self, lines: ElementLines) -> FloatArray:
        """Return how steeply the gap falls from contacts at both ends of elements in n states, (n, m, 2)."""
        numbers, sides = lines.elements, self.mesh.side_contacts
        contacts: list[Any] = [contact for contact in sides if contact.item.name == self.item.name]
        pressed = [contact.element for contact in contacts if contact.item.beam == self.item.beam]
        gap, slope, _ = self._measure_line(lines, np.array([0.0, 1.0]))
        at_pad = np.isin(numbers, self.touched)[:, None] & (np.abs(gap) < BESIDE_CONTACT)
        ends = np.stack([np.isin(numbers - 1, pressed), np.isin(numbers, pressed)], axis=1) | at_pad
        return np.where(ends, np.maximum(slope * (-1.0, 1.0), 0.0), 0.0)

    def distance(self, places: Any, z: FloatArray, stage: LoadStage) -> tuple[Any, Any]:
        """Return the distances of places (n, ..., 2) from what may be touched in n states, and their gradients."""
        return measure_distance(self.mesh, self.item, places, z)[:2]

    def is_parallel(self, z: FloatArray, stage: LoadStage) -> bool:
        """Return True if the whole side is parallel to the obstacle in one state (size,): no place touches first."""
        return bool(self._search(z[None], stage)[0, 4] < PARALLEL_GAP)

    def least(self, z: FloatArray, stage: LoadStage, watch: bool = False) -> FloatArray:
        """Return the least gap in each of n states, plus what it may be negative by rounding beside contacts, (n,).

        It is exact where it is below `NEAR_GAP`, and above it otherwise: to `watch` for contact a lower bound.
        """
        return self._search(z, stage, watch)[:, 0]

    def find_least(self, z: FloatArray, stage: LoadStage) -> LeastGap:
        """Return the least gap of one state (size,) exactly: where the side is parallel to the obstacle."""
        _, gap, row, fraction, _ = self._search(z[None], stage)[0].tolist()
        low, high = cuts_at(self.mesh, z)[self.elements[int(row)]]
        return LeastGap(gap, float(low + (high - low) * fraction))

    def _search(self, z: FloatArray, stage: LoadStage, watch: bool = False) -> FloatArray:
        """Return of n states the least gap with its slack, without, where it is, and how gaps spread, (n, 5).

        Its place is a number in `elements` and a fraction. In numpy if the thickness varies, or nothing is compiled.
        """
        result = None if self.packed is None else search_sides(self.mesh, self.packed, z, stage, watch)
        if result is not None:
            return result[:, 0]
        gap, dips = self._find_dips(z, stage)
        raised = (gap + self.slack[:, None]).reshape(len(z), -1)
        least = raised.argmin(axis=1)
        row, place = np.divmod(least, len(self.fractions))
        at_places = gap.reshape(raised.shape)
        columns = raised.min(axis=1), at_places[np.arange(len(z)), least], row, self.fractions[place]
        result = np.column_stack([*columns, np.ptp(at_places, axis=1)])
        for number, dip, value, fraction in zip(dips.state, dips.row, *self._refine(z, stage, dips), strict=True):
            if value + self.slack[dip] <= result[number, 0]:
                result[number, :4] = value + self.slack[dip], value, dip, fraction
        return result

    @cached_property
    def packed(self) -> SideData | None:
        """The side as compiled code takes it; None if the thickness varies, or it shears."""
        mesh, item = self.mesh, self.item
        beams, edge, counts, circle = [item.beam], np.empty((0, 6)), (0, 0, 0), (-1, 0.0)
        if isinstance(item, BeamOnObstacle):
            edge, outline = edge_rows(item.outline), item.outline
            counts = len(outline.length), len(outline.radius), int(outline.closed)
        elif isinstance(item, BeamOnBeam):
            beams.append(item.partner)
            circle = -1, half_thickness_of(mesh, item.partner)
        else:
            circle = mesh.nodes[item.node], item.radius / mesh.scales.length
        sections = [mesh.fits.network.beams[beam].section for beam in beams]
        if any(section.shear or isinstance(section.thickness, Taper) for section in sections):
            return None
        half, count, partner = half_thickness_of(mesh, item.beam), len(self.elements), self.partner_elements
        elements = np.zeros((count + len(partner), 2))
        elements[:count, 0], elements[:count, 1], elements[count:, 0] = self.elements, self.slack, partner
        numbers = np.array([[0, count, half, mesh.scales.length, 0, *counts, *circle, count, len(partner)]], float)
        return SideData(elements, numbers, edge)

    @cached_property
    def partner_elements(self) -> Any:
        """Elements of the other beam that the side may touch, (m,)."""
        partner = self.item.partner if isinstance(self.item, BeamOnBeam) else ""
        return np.array(list_elements(self.mesh, partner), np.int64)

    def _find_dips(self, z: FloatArray, stage: LoadStage) -> tuple[Any, _Dips]:
        """Return gaps at places of elements in n states, and between which of them lies a least one that is near."""
        gap, slope, seen = self.measure(find_lines(self.mesh, z, stage, self.elements), self.fractions)
        step = -np.diff(seen.ahead, axis=-1)
        low, high = slope[..., :-1] * step, slope[..., 1:] * step
        dips = (low < 0) & (high > 0)
        share = np.where(dips, (gap[..., 1:] - high - gap[..., :-1]) / np.where(dips, low - high, 1.0), 0.0)
        bound = gap[..., :-1] + share * low  # where the tangents at both places meet
        slack = self.slack[:, None]
        least = np.minimum((gap + slack).min(axis=(1, 2)), NEAR_GAP)[:, None, None]
        lower = bound + slack < least - GAP_RESOLUTION
        state, row, place = np.nonzero(dips & lower)  # else the least of the gaps that are known is the least
        return gap, _Dips(state, row, place, slope[state, row, place], slope[state, row, place + 1])

    def _refine(self, z: FloatArray, stage: LoadStage, dips: _Dips) -> tuple[FloatArray, FloatArray]:
        """Return the least gaps of dips and their places on their elements, where the slope is zero (Illinois)."""
        a, b = self.fractions[dips.place], self.fractions[dips.place + 1]
        low, high = dips.low.copy(), dips.high.copy()
        value, best = np.full(len(a), np.inf), 0.5 * (a + b)
        for row in np.unique(dips.row).tolist():
            indices = np.flatnonzero(dips.row == row)
            chosen = dips.state[indices]
            lines = find_lines(self.mesh, z[chosen], stage.take(chosen), self.elements[[row]])
            for _ in range(N_ROUNDS):
                middle = b[indices] - high[indices] * (b[indices] - a[indices]) / (high[indices] - low[indices])
                gap, slope, _ = self.measure(lines, middle[:, None, None])
                value[indices], best[indices], slope = gap[:, 0, 0], middle, slope[:, 0, 0]
                if np.abs(slope).max() < SLOPE_LEVEL:
                    break
                below = slope < 0
                high[indices] = np.where(below, 0.5 * high[indices], slope)
                low[indices] = np.where(below, slope, 0.5 * low[indices])
                a[indices], b[indices] = np.where(below, middle, a[indices]), np.where(below, b[indices], middle)
        return value, best


class _Dips(NamedTuple):
    """Between a place of an element and the next the gap has a least value."""

    state: Any
    row: Any  # of the element
    place: Any
    low: FloatArray  # slopes of the gap at both
    high: FloatArray
