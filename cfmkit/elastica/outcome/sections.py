"""States, section forces and stresses along the beams at solved points.

Between the rows of a fine sampling the state is integrated, not interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.equilibrium.mesh import Mesh, assemble_model, grid, si_rows, table
from cfmkit.elastica.kernels.network_array_types import ANGLE, LENGTH
from cfmkit.elastica.kernels.symplectic_splitting_coefficients import ROWS

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.network_solver import Points, Solver
    from cfmkit.elastica.model.network_under_drive import Layout

_ROWS = 8  # samples of a segment
_TIGHT = 2e-12  # tolerance of Newton's method from which on there are twice as many: stress slopes are interpolated
_CLOSED = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) / 28350  # Newton-Cotes on nine rows

_STEP = 1e-30
"""Of a complex step: nothing is subtracted, so that its square may vanish beside one."""

X, Y, TURN, MOMENT, H, V, ENERGY = range(7)


@dataclass(frozen=True)
class SampledRows:
    """Where the rows of a sampling lie on one beam: row index, parameter, and the step that begins there."""

    index: Any
    t: FloatArray
    step: Any


class Sampler:
    """States along all beams at the points of a path, dimensionless."""

    def __init__(self, solver: Solver, points: Points, rows: int | None = None) -> None:
        """Integrate along all beams at all points.

        rows: samples of a segment, if not those that integrals along a beam (`weights`) need.
        """
        from cfmkit.elastica.kernels import compiled

        self.solver, self.layout = solver, solver.layout
        panel = len(_CLOSED) - 1  # integrals take whole panels; steps of coils come in any number
        usual = _ROWS if solver.tolerance > _TIGHT else 2 * _ROWS
        steps = panel * -(-max(usual, solver.mesh.steps) // panel) if rows is None else max(rows, solver.mesh.steps)
        mesh = Mesh(solver.mesh.segments, steps)
        self.per_segment = mesh.steps + 1
        self.cut = grid(self.layout, mesh)
        self.model = assemble_model(self.layout, self.cut, table(self.layout, self.cut))
        segments = len(self.cut.segment_step) - 1
        count = len(self.cut.edges) + segments
        self.states = np.empty((len(points), count, 7))
        self.drive = points.drive
        self._rows: dict[int, SampledRows] = {}
        compiled.states(self.model, solver.n_free, np.ascontiguousarray(points.y), points.drive, self.states)

    def rows(self, beam: int) -> SampledRows:
        """Return the rows of a beam in order; segment boundaries occur twice."""
        if beam not in self._rows:
            self._rows[beam] = self._rows_of(beam)
        return self._rows[beam]

    def _rows_of(self, beam: int) -> SampledRows:
        cut = self.cut
        index, t, step = [], [], []
        for segment in range(cut.beam_segment[beam], cut.beam_segment[beam + 1]):
            first, last = cut.segment_step[segment], cut.segment_step[segment + 1]
            index += [int(k) + segment for k in range(first, last + 1)]
            t += [*cut.edges[first:last, 0].tolist(), float(cut.edges[last - 1, 1])]
            step += [*range(first, last), last - 1]
        return SampledRows(np.array(index), np.array(t), np.array(step))

    def energy(self) -> FloatArray:
        """Return the strain energy of all beams at every point."""
        cut = self.cut
        ends = cut.segment_step[1:] + np.arange(len(cut.segment_step) - 1)
        total: FloatArray = self.states[:, ends, ENERGY].sum(axis=1)
        return total

    def rest(self, m: Any) -> Any:
        """Return the rows' places before any load, (rows, 2), dimensionless; for stepped models too."""
        turn, length = m.table[:, :, ANGLE], m.table[:, :, LENGTH]
        runs = np.stack([(f(turn) * length).sum(axis=1) for f in (np.cos, np.sin)], axis=1)
        whole = np.result_type(runs, m.place_origin)
        out = np.empty((len(runs) + len(m.segment_step) - 1, 2), dtype=whole)
        for beam, place in enumerate(m.beam_end[:, 0]):
            at = m.place_origin[place] + m.place_arm[place]
            for segment in range(m.beam_segment[beam], m.beam_segment[beam + 1]):
                first, last = m.segment_step[segment], m.segment_step[segment + 1]
                part = out[first + segment : last + segment + 1]
                part[0], part[1:] = at, at + np.cumsum(runs[first:last], axis=0)
                at = part[-1]
        return out

    def weights(self, layout: Layout, beam: int) -> Any:
        """Return the weights [m] that integrate along a beam of a layout what is given at its rows."""
        rows, fitted = self.rows(beam), layout.fits[list(layout.network.beams)[beam]]
        speed = np.array(
            [fitted.speed(t, self.cut.middle[step]) for t, step in zip(rows.t.tolist(), rows.step, strict=True)]
        )
        panel = len(_CLOSED) - 1
        own = np.zeros(len(rows.t))
        for first in range(0, len(rows.t), self.per_segment):
            for start in range(first, first + self.per_segment - 1, panel):
                own[start : start + panel + 1] += _CLOSED * (rows.t[start + panel] - rows.t[start])
        return own * speed

    def at(self, beam: int, rows: SampledRows, start: Any, t: FloatArray, points: Any) -> FloatArray:
        """Return states (k, 7) at parameters t (k,) of a beam, each integrated from the row number `start` (k,)."""
        from cfmkit.elastica.kernels import compiled

        count, m = len(t), self.model
        values = self.step_table(beam, rows.step[start], rows.t[start], t)
        load = self.load(beam, points)
        single = m._replace(
            table=values,
            segment_step=np.arange(count + 1),
            segment_turn=np.zeros(count),
            beam_segment=np.arange(count + 1),
            beam_end=np.zeros((count, 2), np.int64),
            line_load=np.stack([load, np.zeros_like(load)], axis=1),
        )
        old = self.states[points, rows.index[start]]
        y = np.concatenate([np.zeros(3 * count), old[:, [X, Y, TURN, H, V, MOMENT]].ravel()])
        out = np.empty((1, 2 * count, 7))
        compiled.states(single, 0, y[None], np.zeros(1), out)
        return out[0, 1::2]

    def load(self, beam: int, points: Any) -> Any:
        """Return the line load on a beam at points (k,), (k, 2), dimensionless."""
        own = self.model.line_load[beam]
        return own[0] + np.outer(self.drive[points], own[1])

    def step_table(self, beam: int, step: Any, left: FloatArray, right: FloatArray) -> Any:
        """Return the table of a `DiscreteNetwork` from one parameter (k,) to another, on steps (k,)."""
        cut, name = self.cut, list(self.layout.network.beams)[beam]
        out, pieces = np.empty((len(step), ROWS, len(self.layout.units))), cut.piece[step]
        for piece in sorted(set(pieces.tolist())):
            own = pieces == piece
            first = int(step[own][0])
            where = cut.middle[first], cut.inside[first]
            out[own] = si_rows(self.layout, name, left[own, None], right[own, None], where)
        return out * self.layout.units

    def place(self, beam: int, t: FloatArray) -> FloatArray:
        """Return the fractions of the arc length at parameters."""
        arcs: FloatArray = np.real(self.layout.fits[list(self.layout.network.beams)[beam]].arc(t))
        return arcs


@dataclass(frozen=True)
class Sections:
    """Section forces and stresses at places of one beam; arrays of one shape.

    Attributes
    ----------
    place : array
        Fraction of the arc length.
    moment : array
        [N m].
    normal, shear : array
        [N]; tension positive.
    bending_stress, axial_stress : array
        Largest bending stress of the section, M t / 2I, and N / A [Pa].
    """

    place: FloatArray
    moment: FloatArray
    normal: FloatArray
    shear: FloatArray
    bending_stress: FloatArray
    axial_stress: FloatArray

    def stress(self, axial: bool = True) -> FloatArray:
        """Return the largest magnitude over the section [Pa], without the axial part if so requested."""
        bending = np.abs(self.bending_stress)
        return bending + np.abs(self.axial_stress) if axial else bending


def sections(sampler: Sampler, beam: int, states: FloatArray, t: FloatArray, step: Any) -> Sections:
    """Return section forces and stresses (SI) for states (..., n, 7) at parameters t (n,) on given steps (n,)."""
    layout, cut = sampler.layout, sampler.cut
    name = list(layout.network.beams)[beam]
    section, scales = layout.network.beams[name].section, layout.scales
    angle, thickness = np.empty(t.shape), np.empty(t.shape)
    place, pieces = sampler.place(beam, t), cut.piece[step]
    for piece in sorted(set(pieces.tolist())):
        here = pieces == piece
        first = int(step[here][0])
        angle[here] = layout.fits[name].angle(t[here], cut.middle[first])
        thickness[here] = section.thickness_at(place[here], cut.inside[first])
    psi = angle + states[..., TURN]
    c, s = np.cos(psi), np.sin(psi)
    h, v = states[..., H] * scales.force, states[..., V] * scales.force
    normal, shear = h * c + v * s, v * c - h * s
    moment = states[..., MOMENT] * scales.moment
    area = section.width * thickness
    place = np.broadcast_to(place, moment.shape)
    return Sections(place, moment, normal, shear, 6 * moment / (area * thickness), normal / area)


def stress_slopes(
    sampler: Sampler, beam: int, states: FloatArray, where: tuple[FloatArray, Any, Any], found: Sections
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of bending and axial stress by the parameter of the shape, at places (n,): two (n,).

    where: parameters, steps and points; found: `sections` there.
    """
    (t, step, points), layout, cut = where, sampler.layout, sampler.cut
    name = list(layout.network.beams)[beam]
    section, scales, fitted = layout.network.beams[name].section, layout.scales, layout.fits[name]
    angle, thick, speed = (np.empty(t.shape, complex) for _ in range(3))
    bending, axial, shear = (np.empty(t.shape) for _ in range(3))
    pieces, length = cut.piece[step], np.real(fitted.length)
    for piece in sorted(set(pieces.tolist())):
        here = pieces == piece
        first = int(step[here][0])
        inside, ahead = cut.inside[first], 1j * _STEP
        angle[here] = fitted.angle(t[here] + ahead, cut.middle[first])
        speed[here] = fitted.speed(t[here], cut.middle[first])
        place = found.place[here]
        thick[here] = section.thickness_at(place + ahead * speed[here] / length, inside)
        bending[here], axial[here], shear[here] = section.rigidities(place, inside)
    psi, g = angle.real + states[:, TURN], speed.real
    c, s = np.cos(psi), np.sin(psi)
    along, across = g * (1 + found.normal * axial), g * found.shear * shear
    load = sampler.load(beam, points) * scales.force / scales.length
    moment = across * found.normal - along * found.shear
    turn = angle.imag / _STEP + g * found.moment / bending  # a wide strip turns less; N/A hardly varies with it
    normal = found.shear * turn - g * (load[:, 0] * c + load[:, 1] * s)
    t0, grow = thick.real, thick.imag / _STEP / thick.real
    area = section.width * t0
    return 6 * moment / (area * t0) - 2 * found.bending_stress * grow, normal / area - found.axial_stress * grow


def along_beam(sampler: Sampler, beam: int, points: Any = None) -> Sections:
    """Return section forces and stresses at the rows of a beam at points, (n, rows); default: at all of them."""
    rows = sampler.rows(beam)
    states = sampler.states if points is None else sampler.states[points]
    return sections(sampler, beam, states[:, rows.index], rows.t, rows.step)
