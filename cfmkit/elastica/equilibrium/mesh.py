"""From a layout to the arrays of the compiled code: beams cut into segments and steps, all without dimension."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.kernels.network_array_types import HALVES, LINE, SLIDE, TABLE_COLUMNS, TURN, DiscreteNetwork
from cfmkit.elastica.kernels.symplectic_splitting_coefficients import DRIFTS, KICKS, NODES, ROWS
from cfmkit.elastica.model.beam import SAME
from cfmkit.elastica.model.section import Taper

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.elastica.model.network_under_drive import Layout
    from cfmkit.elastica.model.section import Section

_GAUSS = np.polynomial.legendre.leggauss(5)
_STEEP = 4.0
"""How many times as thick a beam may be in one place as in another before its segments are shared out by softness.

A strip of about 1 mm with 0.075 mm in one place was cut into 128 segments everywhere, where 32 do; nothing changes for
strips whose optimum is sought between 0.5 mm and 2 mm.
"""

PRESTRESS, LOADS = "prestress", "constant loads"  # what may be applied before the drive begins


@dataclass(frozen=True)
class Mesh:
    """How many segments each beam has and how many steps of the splitting a segment has."""

    segments: int = 2
    steps: int = 2

    def finer(self) -> Mesh:
        """Return the mesh with twice the steps."""
        return Mesh(self.segments, 2 * self.steps)

    def shorter(self, times: int = 2) -> Mesh:
        """Return a mesh with so many times the segments and about as many steps."""
        return Mesh(times * self.segments, -(-self.steps // times))


@dataclass(frozen=True, repr=False)
class Grid(ShortRepr):
    """Where the steps lie: per beam, the parameters at the step boundaries of its segments.

    Attributes
    ----------
    edges : (steps, 2) array
        Parameter of the shape at both ends of every step.
    inside : (steps,) array
        Fraction of the arc length at the middle of every step: says which smooth piece it lies on.
    middle : (steps,) array
        Parameter at the middle of every step.
    beam_of_step, piece : (steps,) int arrays
        The beam that a step is on, and the smooth piece of it; pieces count through all beams.
    segment_step, beam_segment : int arrays
        As in `cfmkit.elastica.kernels.network_array_types.DiscreteNetwork`.
    """

    edges: FloatArray
    inside: FloatArray
    middle: FloatArray
    segment_step: Any
    beam_segment: Any
    beam_of_step: Any
    piece: Any

    def rows(self, count: int, beam: int) -> tuple[FloatArray, FloatArray]:
        """Return what the rows of a beam's steps are to a shape whose parameter is the fraction of the arc length.

        The powers (count, n) of the parameters of the kicks, and (n, 5) how much of the parameter the kicks take, the
        drifts before them, twice the kicks again, and how far the kicks are from the start of their step: what the
        table's columns but the angle are in units of the length and of the length times compliances.
        """
        known = self._rows.get((count, beam))
        if known is None:
            edges = self.edges[self.beam_of_step == beam]
            width = edges[:, 1:] - edges[:, :1]
            places = (edges[:, :1] + width * NODES).ravel()
            shares = np.stack([KICKS, DRIFTS, KICKS, KICKS, NODES], axis=-1)
            powers = np.vander(places, count, increasing=True).T.copy()
            known = self._rows[count, beam] = powers, (width[:, :, None] * shares).reshape(-1, 5)
        return known

    @cached_property
    def _rows(self) -> dict[tuple[int, int], tuple[FloatArray, FloatArray]]:
        return {}


def grid(layout: Layout, mesh: Mesh) -> Grid:
    """Cut every beam at its corners, at its stations, and where its thickness has grown `_STEEP` times; then evenly.

    Where the thickness varies more than that along a beam, segments are shared out by how much load a length bears.
    """
    if not layout.bundle.others:
        return _even(len(layout.network.beams), mesh.segments, mesh.steps)
    breaks = []
    for name, beam in layout.network.beams.items():
        fitted = layout.fits[name]
        stations = [fitted.parameter(float(u)) for u in _graded(beam.section)[1:-1]]
        marks = np.unique(np.concatenate([fitted.course.breaks, stations]))
        marks = marks[np.concatenate([[True], np.diff(marks) > SAME])]
        breaks.append((marks, _shares(beam.section, np.real(fitted.arc(marks)))))
    cut = _cut(breaks, mesh)
    inside = cut.middle.copy()
    for number, name in enumerate(layout.network.beams):
        if not layout.fits[name].course.uniform:
            own = cut.beam_of_step == number
            inside[own] = np.real(layout.fits[name].arc(cut.middle[own]))
    return replace(cut, inside=inside)


def _graded(section: Section) -> FloatArray:
    """Return the stations of a section, and places between those whose thicknesses are more than `_STEEP` apart.

    Fractions of the arc length; from one place to the next the thickness changes by one factor, `_STEEP` at most.
    """
    if not isinstance(section.thickness, Taper):
        return section.stations
    places, values = np.real(section.thickness.stations), np.real(section.thickness.values)
    found = [places]
    for (left, right), (one, other) in zip(itertools.pairwise(places), itertools.pairwise(values), strict=True):
        count = int(np.ceil(abs(np.log(other / one)) / np.log(_STEEP) - 1e-9))
        if count > 1 and right > left:
            between = one * (other / one) ** (np.arange(1, count) / count)
            found.append(left + (right - left) * (between - one) / (other - one))
    return np.unique(np.concatenate(found))


def _shares(section: Section, arcs: FloatArray) -> FloatArray:
    """Return which share of its segments each smooth piece of a beam gets: that of its length, or of its softness.

    A segment is too long for a thrust P where the integral of sqrt(P/EI) ds over it is: with a linear thickness from a
    to b the mean of t^(-3/2) is 2/(sqrt(a b) (sqrt(a) + sqrt(b))).
    """
    lengths = np.diff(arcs)
    if not isinstance(section.thickness, Taper) or np.ptp(np.log(np.real(section.thickness.values))) <= np.log(_STEEP):
        return lengths
    ends = [
        [float(np.real(section.thickness_at(place, 0.5 * (left + right)))) ** 0.5 for place in (left, right)]
        for left, right in itertools.pairwise(arcs.tolist())
    ]
    softness = lengths * np.array([2 / (a * b * (a + b)) for a, b in ends])
    return np.asarray(softness / softness.sum())


@lru_cache(maxsize=64)
def _even(beams: int, segments: int, steps: int) -> Grid:
    """Return the grid of beams without corners or stations whose parameter is the fraction of the arc length."""
    whole = np.array([0.0, 1.0])
    return _cut([(whole, np.ones(1))] * beams, Mesh(segments, steps))


def _cut(breaks: list[tuple[FloatArray, FloatArray]], mesh: Mesh) -> Grid:
    """Cut beams given the parameters of their smooth pieces' ends and the shares of the segments that these get."""
    edges: list[tuple[float, float]] = []
    segment_step, beam_segment, beam_of_step = [0], [0], []
    piece: list[int] = []
    for number, (marks, shares) in enumerate(breaks):
        count = len(segment_step) - 1
        for (left, right), share in zip(itertools.pairwise(marks.tolist()), shares.tolist(), strict=True):
            pieces = max(1, int(np.ceil(mesh.segments * share - 1e-9)))
            steps = np.linspace(left, right, pieces * mesh.steps + 1)
            edges += list(zip(steps[:-1].tolist(), steps[1:].tolist(), strict=True))
            beam_of_step += [number] * (pieces * mesh.steps)
            piece += [piece[-1] + 1 if piece else 0] * (pieces * mesh.steps)
            segment_step += [segment_step[-1] + mesh.steps * (k + 1) for k in range(pieces)]
            count += pieces
        beam_segment.append(count)
    array = np.array(edges)
    return Grid(
        array,
        array.mean(axis=1),
        array.mean(axis=1),
        np.array(segment_step, dtype=np.int64),
        np.array(beam_segment, dtype=np.int64),
        np.array(beam_of_step, dtype=np.int64),
        np.array(piece, dtype=np.int64),
    )


def table(layout: Layout, cut: Grid, known: Any = None) -> Any:
    """Return what the drifts and kicks of all steps take, dimensionless.

    See `cfmkit.elastica.kernels.network_array_types.DiscreteNetwork`. `known` is the table of the layout that this one
    took fits over from: the rows of beams that are neither plain nor changed are taken over too.
    """
    bundle, units = layout.bundle, layout.units
    plain: Any = None
    if bundle.plain:
        plain = bundle.table(*cut.rows(bundle.coefficients.shape[1], bundle.plain[0]), units[1:TABLE_COLUMNS])
        plain = plain.reshape(len(bundle.plain), -1, ROWS, TABLE_COLUMNS)
        if bundle.wide:
            plain = np.pad(plain, [(0, 0)] * 3 + [(0, len(units) - TABLE_COLUMNS)])
            plain[..., HALVES[0]] = plain[..., HALVES[1]] = 0.5 * plain[..., 2]
    if not bundle.others:
        return plain.reshape(-1, ROWS, TABLE_COLUMNS)
    blocks: list[Any] = [None] * len(bundle.beams)
    for place, number in enumerate(bundle.plain):
        blocks[number] = plain[place]
    for number in bundle.others:
        steps = np.flatnonzero(cut.beam_of_step == number)
        blocks[number] = _other(layout, bundle.names[number], cut, steps, known) * units
    return np.concatenate(blocks)


def _other(layout: Layout, name: str, cut: Grid, steps: Any, known: Any) -> Any:
    """Return the table of one beam in SI; what is known of it is not computed again."""
    if known is None or layout.known is None or layout.fits[name] is not layout.known.fits[name]:
        return _si_table(layout, name, cut, steps)
    return known[steps] / layout.units


def _si_table(layout: Layout, name: str, cut: Grid, steps: Any) -> Any:
    """Return the table of one beam in SI."""
    blocks = []
    pieces = cut.piece[steps]
    for piece in np.unique(pieces):
        own = steps[pieces == piece]
        where = cut.middle[own[0]], cut.inside[own[0]]
        blocks.append(si_rows(layout, name, cut.edges[own, :1], cut.edges[own, 1:], where))
    return np.concatenate(blocks)


def si_rows(layout: Layout, name: str, left: FloatArray, right: FloatArray, where: tuple[float, float]) -> Any:
    """Return the rows of steps on one smooth piece of a beam in SI, (n, rows, columns): see `DiscreteNetwork.table`.

    left, right: parameters (n, 1) at the ends of the steps; where: a parameter on the piece and the fraction of the
    arc length there.
    """
    fitted, section, (middle, inside) = layout.fits[name], layout.network.beams[name].section, where
    width = right - left
    t = left + width * NODES
    before = np.concatenate([left, t[:, :-1]], axis=1)
    speed = fitted.speed(t, middle)
    length = width * KICKS * speed
    tapers = isinstance(section.thickness, Taper)
    place = fitted.arc(t) if tapers else t
    _, axial, shear = section.rigidities(place, inside)
    if fitted.course.uniform:
        drift = width * DRIFTS * speed
        start = fitted.arc(before) if tapers else before
        turn = drift * section.mean_compliance(start, place, inside)
    else:  # along the shape's own parameter: the drifts are short: exact to rounding
        half = 0.5 * (t - before)[..., None]
        inner = before[..., None] + half * (1 + _GAUSS[0])
        speeds = fitted.speed(inner, middle) * half * _GAUSS[1]
        drift = speeds.sum(axis=-1)
        bending = section.rigidities(fitted.arc(inner) if tapers else inner, inside)[0]
        turn = (speeds / bending).sum(axis=-1)
    columns = [fitted.angle(t, middle), length, turn, length * axial, length * shear, np.cumsum(drift, axis=1)]
    if layout.bundle.wide:
        columns += _strip_columns(fitted, section, (before, t), where, (drift, turn))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


_PAIR = 0.5 + 0.5 * np.array([-1.0, 1.0]) / np.sqrt(3.0)
_THIRDS = np.linspace(0.0, 1.0, 4)
_RISE = np.array([[0.0, 1.0, 2 * x, 3 * x * x] for x in _PAIR]) @ np.linalg.inv(np.vander(_THIRDS, increasing=True))
"""Slopes at the two nodes of Gauss' rule of the cubic through values at the thirds of a stretch."""


def _strip_columns(
    fitted: Fit, section: Section, ends: tuple[Any, Any], where: tuple[float, float], whole: tuple[Any, Any]
) -> list[Any]:
    """Return the columns of wide strips beside others, in SI: see `cfmkit.elastica.kernels.network_array_types.HALVES`.

    ends: parameters at both ends of the drifts; whole: their lengths, and integrals of ds/EI.
    """
    (before, after), (middle, inside), (drift, turn) = ends, where, whole
    angles = np.stack(np.broadcast_arrays(*(fitted.angle(before + x * (after - before), middle) for x in _THIRDS)))
    places = [before + x * (after - before) for x in _PAIR]
    arcs = [fitted.arc(place) if isinstance(section.thickness, Taper) else place for place in places]
    speeds = [fitted.speed(place, middle) for place in places]
    softs = [speed / section.rigidities(arc, inside)[0] for speed, arc in zip(speeds, arcs, strict=True)]
    still = drift == 0  # of no length: nothing turns in it
    columns = [section.curling(section.thickness_at(arcs[0], inside))[1]]
    for speed, soft, arc, rise in zip(speeds, softs, arcs, _RISE, strict=True):
        length = np.where(still, 1.0, drift) * speed / sum(speeds)
        curl = section.curling(section.thickness_at(arc, inside))[0] / length**2
        rest = 0.5 * np.tensordot(rise, angles, 1)
        columns += [turn * soft / sum(softs), rest, np.where(still, 0.0, curl)]
    return columns


def model(layout: Layout, mesh: Mesh, ramp: str = "") -> DiscreteNetwork:
    """Return the network's arrays; see `assemble_model`."""
    cut = grid(layout, mesh)
    return assemble_model(layout, cut, table(layout, cut), ramp)


def assemble_model(layout: Layout, cut: Grid, values: Any, ramp: str = "") -> DiscreteNetwork:
    """Return the network's arrays for given tables.

    `ramp` names what a share of takes the place of the drive, at one the whole of it: the PRESTRESS of springs while
    nothing else acts, or the LOADS, constant ones and held displacements, while the springs are tight.
    """
    scales, plan, places = layout.scales, layout.plan, layout.places
    base, rate = _held(layout)
    load_value, line, springs = _loads(layout), _line_loads(layout), _springs(layout)
    if ramp:
        base, rate = np.zeros_like(base), base if ramp == LOADS else np.zeros_like(base)
        load_value[:, 1], load_value[:, 0] = load_value[:, 0], 0.0
        line[:, 1], line[:, 0] = line[:, 0], 0.0
    if ramp == PRESTRESS:
        load_value[:], line[:] = 0.0, 0.0
        springs = _relaxed(layout, springs)
    return DiscreteNetwork(
        table=values,
        segment_step=cut.segment_step,
        segment_turn=segment_turns(values, cut.segment_step),
        beam_segment=cut.beam_segment,
        beam_end=plan.beam_end,
        line_load=line,
        place_dof=plan.place_dof,
        place_frame=places.frame,
        place_origin=places.origin / scales.length,
        place_arm=places.arm / scales.length,
        base=base,
        rate=rate,
        slot=plan.slot,
        load_place=plan.load_place,
        load_value=load_value,
        load_follows=plan.load_follows,
        spring_place=plan.spring_place,
        spring_kind=plan.spring_kind,
        spring_value=springs,
    )


def segment_turns(values: Any, segment_step: Any) -> Any:
    """Return the integrals of ds/EI over the segments, (segments,), from their table."""
    turns: Any = np.add.reduceat(values[:, :, 2].sum(axis=1).real, segment_step[:-1])
    return turns


def _held(layout: Layout) -> tuple[Any, Any]:
    """Return the held values and those that the drive moves, dimensionless."""
    base, rate = layout.base, np.zeros(layout.dof_count)
    if layout.held:
        base = base.copy()
        for first in layout.first.values():
            base[first : first + 2] /= layout.scales.length
    if layout.driven is not None:
        dof, sense = layout.driven
        rate[dof] = sense
    return base, rate


def _loads(layout: Layout) -> Any:
    """Return the point loads, dimensionless: constant and per unit of the drive."""
    scales, rows = layout.scales, layout.load_values
    if not rows:
        return np.zeros((0, 2, 3))
    value: list[list[tuple[Any, ...]]] = [[(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)] for _ in rows]
    for k, (when, (fx, fy, moment)) in enumerate(rows):
        unit = scales.drive if when == 1 else 1.0
        value[k][when] = (fx / scales.force * unit, fy / scales.force * unit, moment / scales.moment * unit)
    return np.array(value).reshape(len(rows), 2, 3)


def _line_loads(layout: Layout) -> Any:
    """Return the line loads, dimensionless: constant and per unit of the drive."""
    if not layout.plan.line_beam:
        return np.zeros((len(layout.network.beams), 2, 2))
    line = layout.line_load / layout.scales.force * layout.scales.length
    line[:, 1] *= layout.scales.drive
    return line


def _springs(layout: Layout) -> Any:
    """Return the springs' dimensionless values."""
    scales, rows = layout.scales, layout.spring_values
    if not rows:
        return np.zeros((0, 5))
    line, turn, length = scales.force / scales.length, scales.moment, scales.length
    units = {LINE: (line, length, 1.0, 1.0), TURN: (turn, 1.0, 1.0, 1.0), SLIDE: (line, 1.0, 1.0, length)}
    kinds = layout.plan.spring_kind.tolist()
    value = [
        [*(own / unit for own, unit in zip(row, units[kind], strict=True)), 0.0]
        for row, kind in zip(rows, kinds, strict=True)
    ]
    return np.array(value)


def _relaxed(layout: Layout, tight: Any) -> Any:
    """Return the values of springs that carry nothing at rest and are tight at a drive of one."""
    plan, value = layout.plan, tight.copy()
    kinds = plan.spring_kind
    value[kinds == TURN, 1] = 0.0
    value[kinds == SLIDE, 3] = 0.0
    line = kinds == LINE
    one, other = ((layout.places.origin + layout.places.arm)[plan.spring_place[line, k]] for k in (0, 1))
    value[line, 1] = np.hypot(*(other - one).T) / layout.scales.length
    value[:, 4] = (tight - value).sum(axis=1)
    return value
