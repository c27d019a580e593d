"""States along the beams at solved points, and where the stress is largest.

Between the rows of a fine sampling the state is integrated, not interpolated, so that an extreme inside a beam is
found to rounding and not to the spacing of samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.beams.discretise import Mesh, assemble_model, grid, table
from cfmkit.beams.kernels.rk8 import COUPLING, NODES, STAGES, WEIGHTS

if TYPE_CHECKING:
    from cfmkit.beams.solver import Points, Solver
    from cfmkit.curves import FloatArray

_ROWS = 8  # samples of a segment
_ZOOMS, _PER_ZOOM = 3, 9

X, Y, TURN, MOMENT, H, V, ENERGY = range(7)


@dataclass(frozen=True)
class Rows:
    """Where the rows of a sampling lie on one beam: row index, parameter, and the step that begins there."""

    index: Any
    t: FloatArray
    step: Any


class Sampler:
    """States along all beams at the points of a path, dimensionless."""

    def __init__(self, solver: Solver, points: Points) -> None:
        """Integrate along all beams at all points."""
        from cfmkit.beams.kernels import entry

        self.solver, self.layout = solver, solver.layout
        mesh = Mesh(solver.mesh.segments, max(_ROWS, solver.mesh.steps))
        self.per_segment = mesh.steps + 1
        self.cut = grid(self.layout, mesh)
        self.model = assemble_model(self.layout, self.cut, table(self.layout, self.cut))
        segments = len(self.cut.segment_step) - 1
        count = len(self.cut.edges) + segments
        self.states = np.empty((len(points), count, 7))
        self.drive = points.drive
        for k in range(len(points)):
            entry.states(self.model, solver.n_free, points.y[k], points.drive[k], self.states[k])

    def rows(self, beam: int) -> Rows:
        """Return the rows of a beam in order; segment boundaries occur twice."""
        cut = self.cut
        index, t, step = [], [], []
        for segment in range(cut.beam_segment[beam], cut.beam_segment[beam + 1]):
            first, last = cut.segment_step[segment], cut.segment_step[segment + 1]
            index += [int(k) + segment for k in range(first, last + 1)]
            t += [*cut.edges[first:last, 0].tolist(), float(cut.edges[last - 1, 1])]
            step += [*range(first, last), last - 1]
        return Rows(np.array(index), np.array(t), np.array(step))

    def energy(self) -> FloatArray:
        """Return the strain energy of all beams at every point."""
        cut = self.cut
        ends = cut.segment_step[1:] + np.arange(len(cut.segment_step) - 1)
        total: FloatArray = self.states[:, ends, ENERGY].sum(axis=1)
        return total

    def at(self, beam: int, rows: Rows, start: Any, t: FloatArray, points: Any) -> FloatArray:
        """Return states (k, 7) at parameters t (k,) of a beam, each integrated from the row number `start` (k,)."""
        out: FloatArray = self.states[points, rows.index[start]].copy()
        for row in np.unique(start):
            chosen = np.flatnonzero(start == row)
            out[chosen] = self._advance(beam, out[chosen], rows, int(row), t[chosen], self.drive[points[chosen]])
        return out

    def _advance(self, beam: int, state: FloatArray, rows: Rows, row: int, t: FloatArray, drive: FloatArray) -> Any:
        """Return states one Runge-Kutta step further."""
        step = int(rows.step[row])
        width = t - rows.t[row]
        values = self.stage_table(beam, step, rows.t[row] + np.outer(width, NODES))
        load = self.model.line_load[beam, 0] + np.outer(drive, self.model.line_load[beam, 1])
        slopes = np.zeros((STAGES, *state.shape))
        for i in range(STAGES):
            now = state + width[:, None] * np.tensordot(COUPLING[i, :i], slopes[:i], axes=1)
            slopes[i] = _slope(values[:, i], now, load)
        return state + width[:, None] * np.tensordot(WEIGHTS, slopes, axes=1)

    def stage_table(self, beam: int, step: int, t: FloatArray) -> Any:
        """Return the table of `cfmkit.beams.kernels.model.Model` at any parameters on a step."""
        layout, cut = self.layout, self.cut
        name = list(layout.network.beams)[beam]
        fitted, section, scales = layout.fits[name], layout.network.beams[name].section, layout.scales
        angle = fitted.angle(t, cut.middle[step])
        speed = fitted.speed(t, cut.middle[step]) / scales.length
        bending, axial, shear = section.rigidities(self.place(beam, t), cut.inside[step])
        return np.stack(
            [
                angle,
                speed,
                speed / bending * scales.rigidity,
                speed * axial * scales.force,
                speed * shear * scales.force,
            ],
            axis=-1,
        )

    def place(self, beam: int, t: FloatArray) -> FloatArray:
        """Return the fractions of the arc length at parameters."""
        fitted = self.layout.fits[list(self.layout.network.beams)[beam]]
        if fitted.course.uniform:
            return t
        flat = np.array([float(np.real(fitted.arc(float(x)))) for x in np.ravel(t)])
        return flat.reshape(np.shape(t))


def _slope(values: FloatArray, state: FloatArray, load: FloatArray) -> FloatArray:
    """Return the slopes of the states (k, 7) for table values (k, 5)."""
    psi = values[:, 0] + state[:, TURN]
    c, s, h, v = np.cos(psi), np.sin(psi), state[:, H], state[:, V]
    normal, shear = h * c + v * s, v * c - h * s
    stretch, slip = values[:, 1] + values[:, 3] * normal, values[:, 4] * shear
    x, y = stretch * c - slip * s, stretch * s + slip * c
    moment = state[:, MOMENT]
    energy = 0.5 * (values[:, 2] * moment**2 + values[:, 3] * normal**2 + values[:, 4] * shear**2)
    w = values[:, 1]
    return np.stack([x, y, values[:, 2] * moment, y * h - x * v, -w * load[:, 0], -w * load[:, 1], energy], axis=-1)


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
        """Return the largest magnitude over the section [Pa], without the axial part if so asked."""
        bending = np.abs(self.bending_stress)
        return bending + np.abs(self.axial_stress) if axial else bending


def sections(sampler: Sampler, beam: int, states: FloatArray, t: FloatArray, step: Any) -> Sections:
    """Return section forces and stresses (SI) for states (..., 7) at parameters t on given steps."""
    layout, cut = sampler.layout, sampler.cut
    name = list(layout.network.beams)[beam]
    section, scales = layout.network.beams[name].section, layout.scales
    angle, thickness = np.empty(t.shape), np.empty(t.shape)
    place = sampler.place(beam, t)
    for one in np.unique(step):
        here = step == one
        angle[here] = layout.fits[name].angle(t[here], cut.middle[one])
        thickness[here] = section.thickness_at(place[here], cut.inside[one])
    psi = angle + states[..., TURN]
    h, v = states[..., H] * scales.force, states[..., V] * scales.force
    normal, shear = h * np.cos(psi) + v * np.sin(psi), v * np.cos(psi) - h * np.sin(psi)
    moment = states[..., MOMENT] * scales.moment
    area = section.width * thickness
    return Sections(place, moment, normal, shear, 6 * moment / (area * thickness), normal / area)


def extremes(sampler: Sampler, beam: int, axial: bool) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of a beam [Pa] at every point, and its place as a fraction of the arc length."""
    rows = sampler.rows(beam)
    states = sampler.states[:, rows.index]
    count = len(states)
    t = np.broadcast_to(rows.t, states.shape[:2])
    coarse = sections(sampler, beam, states, t, np.broadcast_to(rows.step, t.shape)).stress(axial)
    best = coarse.argmax(axis=1)
    low, high = rows.t[np.maximum(best - 1, 0)], rows.t[np.minimum(best + 1, len(rows.t) - 1)]
    value, where = coarse[np.arange(count), best], rows.t[best]
    points = np.repeat(np.arange(count), _PER_ZOOM)
    for _ in range(_ZOOMS):
        tries = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, _PER_ZOOM)
        stress = _stress_at(sampler, beam, rows, tries.ravel(), points, axial).reshape(tries.shape)
        top = stress.argmax(axis=1)
        pick = np.arange(count)
        better = stress[pick, top] >= value
        value, where = np.where(better, stress[pick, top], value), np.where(better, tries[pick, top], where)
        spacing = (high - low) / (_PER_ZOOM - 1)
        low, high = np.maximum(low, where - spacing), np.minimum(high, where + spacing)
    vertex = _vertex(low, where, high, sampler, beam, rows, axial)
    final = _stress_at(sampler, beam, rows, vertex, np.arange(count), axial)
    better = final >= value
    place = sampler.place(beam, np.where(better, vertex, where))
    return np.where(better, final, value), place


def _stress_at(sampler: Sampler, beam: int, rows: Rows, t: FloatArray, points: Any, axial: bool) -> FloatArray:
    """Return the stress at parameters t (k,) for the points (k,)."""
    start = np.clip(np.searchsorted(rows.t, t, side="right") - 1, 0, len(rows.t) - 2)
    states = sampler.at(beam, rows, start, t, points)
    return sections(sampler, beam, states, t, rows.step[start]).stress(axial)


def _vertex(
    low: FloatArray, middle: FloatArray, high: FloatArray, sampler: Sampler, beam: int, rows: Rows, axial: bool
) -> FloatArray:
    """Return the vertex of the parabola through three places, the middle where there is none."""
    points = np.arange(len(middle))
    a, b, c = (_stress_at(sampler, beam, rows, t, points, axial) for t in (low, middle, high))
    left, right = middle - low, middle - high
    below = left * (b - c) - right * (b - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = middle - 0.5 * (left**2 * (b - c) - right**2 * (b - a)) / below
    usable = np.isfinite(vertex) & (vertex > low) & (vertex < high) & (left > 0) & (right < 0)
    return np.where(usable, vertex, middle)
