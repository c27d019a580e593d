"""Exact derivatives of a path's outputs by design variables: implicit differentiation, complex steps of the geometry.

At an equilibrium R(z, x) = 0, so dz/dx = -(dR/dz)^-1 dR/dx, in compiled code (`kernels.design_derivatives`); how
the network changes with x comes from complex steps of the function that builds it (`array_derivatives`).
Variables may change positions, shapes, sections, materials, offsets, links' arms, springs, loads, support displacements
and directions; not the number of anything. The drive keeps its values; a support that turns takes its drive with it.

One function an output, SI, variables last; `gradient` returns all of them, each computed when it is first needed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.outcome.largest_stress_along_beam import STENCIL
from cfmkit.elastica.outcome.sections import ENERGY, MOMENT, TURN, H, V, X, Y
from cfmkit.elastica.sensitivity.array_derivatives import slope
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.kernels.network_array_types import DesignSlopes
    from cfmkit.elastica.model.network import LineLoad, Network
    from cfmkit.elastica.outcome.path import Path
    from cfmkit.elastica.sensitivity.array_derivatives import ComplexSteps, PlainSlopes


_COMPILED = [2, 3, 0, 1, 5, 6, 4]  # where x, y, turn, moment, h, v, energy are in the rows of the compiled code


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of the unknowns and the forces at p chosen points of a path by k design variables.

    Attributes
    ----------
    path : Path
        What was differentiated.
    points : (p,) int array
        Indices of the points.
    complex_steps, design : ComplexSteps, DesignSlopes
        How the network and its arrays change.
    """

    path: Path
    points: Any
    complex_steps: ComplexSteps
    design: DesignSlopes

    @property
    def unknowns(self) -> FloatArray:
        """Derivatives of everything that was solved for, (p, unknowns, k), dimensionless."""
        return self._all[0]

    @cached_property
    def push(self) -> FloatArray:
        """Derivatives of the force on what the drive moves, (p, k), dimensionless, where no force turns with its node.

        They are ready with the unknowns; without them they take less time.
        """
        return self._all[1] if "_all" in vars(self) else self._slopes(0)[1]

    @cached_property
    def _all(self) -> tuple[FloatArray, FloatArray]:
        return self._slopes(self.path.solver.size)

    def _slopes(self, size: int) -> tuple[FloatArray, FloatArray]:
        """Return derivatives of the unknowns, (p, size, k), none if the size is zero, and of the force, (p, k)."""
        from cfmkit.elastica.kernels import compiled

        s, count = self.path.solver, len(self.complex_steps)
        unknowns = np.empty((len(self.points) if size else 0, size, count))
        push = np.empty((len(self.points), count))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        if not compiled.slopes(s.model, self.design, s.n_free, ys, drives, (unknowns, push), s.scratch):
            raise InputError("the tangent is singular at a point of the path: no derivative there")
        return unknowns, push

    @cached_property
    def held(self) -> FloatArray:
        """Derivatives of the forces on all degrees of freedom and of the springs' energy, (p, dofs + 1, k)."""
        from cfmkit.elastica.kernels import compiled

        s = self.path.solver
        out = np.empty((len(self.points), s.n_dofs + 1, len(self.complex_steps)))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        compiled.held_slopes(s.model, self.design, s.n_free, ys, drives, self.unknowns, out)
        return out

    @cached_property
    def rows(self) -> FloatArray:
        """Derivatives of the sampled states, (p, rows, 7, k): x, y, turn, moment, h, v, energy; dimensionless."""
        segments = len(self.path.sampler.cut.segment_step) - 1
        return self.rows_of(np.ones((len(self.points), segments), dtype=np.bool_))[:, :, _COMPILED]

    def rows_of(self, wanted: Any) -> FloatArray:
        """Return the derivatives of the sampled states in some segments only, in the order of the compiled code.

        wanted (p, segments): a search asks for few. (p, rows, 7, k), component c of `rows` at ``_COMPILED[c]``; zero
        in other segments.
        """
        from cfmkit.elastica.kernels import compiled

        sampler, solver = self.path.sampler, self.path.solver
        design = self.complex_steps.arrays(sampler.model, sampler.cut, every=True)
        out = np.zeros((len(self.points), sampler.states.shape[1], 7 * len(self.complex_steps)))
        ys, drives = self.path.points.y[self.points], self.path.points.drive[self.points]
        compiled.row_slopes(sampler.model, design, solver.n_free, ys, drives, self.unknowns, wanted, out)
        return out.reshape(*out.shape[:2], 7, -1)


def _values(g: Slopes, dof: int) -> tuple[FloatArray, FloatArray]:
    """Return a degree of freedom (p,) and its derivatives (p, k), dimensionless."""
    slot, known = int(g.path.solver.model.slot[dof]), g.path.value(dof)[g.points]
    if slot >= 0:
        return known, g.unknowns[:, slot]
    return known, g.design.base[:, dof] + g.path.points.drive[g.points][:, None] * g.design.rate[:, dof]


def _turned(frame: float, by: FloatArray, a: Any, b: Any) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of a vector given along and across a frame that turns by `by` (k,); a, b: with theirs."""
    (a, da), (b, db), c, s = a, b, np.cos(frame), np.sin(frame)
    dx = c * da - s * db - (s * a + c * b)[:, None] * by
    dy = s * da + c * db + (c * a - s * b)[:, None] * by
    return dx, dy


def _frame(g: Slopes, node: str) -> tuple[float, FloatArray]:
    """Return the direction of a node's frame and its derivatives (k,)."""
    direction = float(np.real(g.path.layout.direction[node]))
    if g.complex_steps.plain is not None:
        return direction, np.zeros(len(g.complex_steps))
    return direction, np.array([slope(layout.direction[node]) for layout in g.complex_steps.stepped], dtype=float)


def motion(g: Slopes, node: str) -> FloatArray:
    """Return the derivatives of a node's displacement and rotation, (p, 3, k) [m, m, rad]."""
    layout = g.path.layout
    master, length = layout.network.master_of(node), layout.scales.length
    along, across = (_values(g, layout.first[master] + k) for k in range(2))
    turn, dturn = _values(g, layout.plan.swing[node])
    dx, dy = _turned(*_frame(g, master), along, across)
    ax, ay = np.real(np.subtract(layout.position(node), layout.position(master)))
    pairs = [(network.nodes[node], network.nodes[master]) for network, _ in g.complex_steps.built]
    px, py = slope(np.array([(one.x - other.x, one.y - other.y) for one, other in pairs])).T
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    dx = dx * length + (c - 1) * px - s * py - (s * ax + c * ay) * dturn
    dy = dy * length + s * px + (c - 1) * py + (c * ax - s * ay) * dturn
    return np.stack([dx, dy, _values(g, layout.plan.turn[node])[1]], axis=1)


def reaction(g: Slopes, node: str) -> FloatArray:
    """Return the derivatives of the force and moment that support and drive exert on a node, (p, 3, k)."""
    layout = g.path.layout
    first, scales = layout.supported(node), layout.scales
    force = -g.path.residual[g.points, first : first + 3]
    slopes = -g.held[:, first : first + 3]
    dx, dy = _turned(*_frame(g, node), (force[:, 0], slopes[:, 0]), (force[:, 1], slopes[:, 1]))
    return np.stack([dx * scales.force, dy * scales.force, slopes[:, 2] * scales.moment], axis=1)


def energy(g: Slopes) -> FloatArray:
    """Return the derivatives of the strain energy of beams and springs, (p, k) [J]."""
    cut = g.path.sampler.cut
    ends = cut.segment_step[1:] + np.arange(len(cut.segment_step) - 1)
    total: FloatArray = g.rows[:, ends, ENERGY].sum(axis=1) + g.held[:, -1]
    return total * g.path.layout.scales.moment


def shape(g: Slopes, beam: str) -> FloatArray:
    """Return the derivatives of the centre line, (p, n, 2, k) [m]."""
    index = g.path.sampler.rows(list(g.path.layout.network.beams).index(beam)).index
    return g.rows[:, index][:, :, [X, Y]] * g.path.layout.scales.length


@dataclass(frozen=True)
class SectionSlopes:
    """Derivatives of `cfmkit.elastica.outcome.sections.Sections` along a beam: (p, n, k)."""

    moment: FloatArray
    normal: FloatArray
    shear: FloatArray
    bending_stress: FloatArray
    axial_stress: FloatArray


def sections(g: Slopes, beam: str) -> SectionSlopes:
    """Return the derivatives of section forces and stresses at the sampled places of a beam."""
    layout, sampler = g.path.layout, g.path.sampler
    number = list(layout.network.beams).index(beam)
    at, scales = sampler.rows(number), layout.scales
    now, change = sampler.states[g.points][:, at.index], g.rows[:, at.index]
    known = g.path.sections(beam)
    angle, width, thick, by = _geometry(g, beam, at)
    psi = angle[:, None] + now[..., [TURN]]
    turn = by[0] + change[:, :, TURN]
    c, s = np.cos(psi), np.sin(psi)
    normal, shear = known.normal[g.points][..., None], known.shear[g.points][..., None]
    moment, force = change[:, :, MOMENT] * scales.moment, scales.force
    dn = (c * change[:, :, H] + s * change[:, :, V]) * force + shear * turn
    dq = (c * change[:, :, V] - s * change[:, :, H]) * force - normal * turn
    area = (width * thick)[:, None]
    grows = by[1] / width + by[2] / thick[:, None]
    bending = 6 * moment / (area * thick[:, None])
    bending -= known.bending_stress[g.points][..., None] * (grows + by[2] / thick[:, None])
    return SectionSlopes(moment, dn, dq, bending, dn / area - known.axial_stress[g.points][..., None] * grows)


def axial_stress_at(g: Slopes, found: FloatArray, points: Any, index: Any) -> FloatArray:
    """Return the derivatives of the axial stress at some rows, each at a point, (n, k) [Pa].

    found: `Slopes.rows_of` segments that these rows are in; points, index (n,): which of the p points, which rows.
    """
    layout, sampler = g.path.layout, g.path.sampler
    angles, areas, turns, growths = [], [], [], []
    for number, beam in enumerate(layout.network.beams):
        angle, width, thick, by = _geometry(g, beam, sampler.rows(number))
        angles.append(angle)
        areas.append(width * thick)
        turns.append(by[0])
        growths.append(by[1] / width + by[2] / thick[:, None])
    by_h, by_v, by_turn = (found[points, index, _COMPILED[which]] for which in (H, V, TURN))
    state, force = sampler.states[g.points[points], index], layout.scales.force
    psi = np.concatenate(angles)[index] + state[:, TURN]
    c, s = np.cos(psi)[:, None], np.sin(psi)[:, None]
    h, v = state[:, [H]] * force, state[:, [V]] * force
    dn = (c * by_h + s * by_v) * force + (v * c - h * s) * (np.concatenate(turns)[index] + by_turn)
    area = np.concatenate(areas)[index][:, None]
    return np.asarray((dn - (h * c + v * s) * np.concatenate(growths)[index]) / area)


def _geometry(g: Slopes, beam: str, at: Any) -> tuple[FloatArray, float, FloatArray, tuple[Any, Any, Any]]:
    """Return angle (n,), width and thickness (n,) at the rows of a beam, and their derivatives (n, k), (k,), (n, k)."""
    cut, count = g.path.sampler.cut, len(g.complex_steps)
    if g.complex_steps.plain is not None:
        return _plain_geometry(g, g.complex_steps.plain, beam, at)
    angles, thicks, widths = [], [], []
    for layout in (g.path.layout, *g.complex_steps.stepped):
        fitted, section = layout.fits[beam], layout.network.beams[beam].section
        angle, thick = np.empty(len(at.t), complex), np.empty(len(at.t), complex)
        pieces, place = cut.piece[at.step], fitted.arc(at.t)
        for piece in np.unique(pieces):
            here = pieces == piece
            first = int(at.step[here][0])
            angle[here] = fitted.angle(at.t[here], cut.middle[first])
            thick[here] = section.thickness_at(place[here], cut.inside[first])
        angles.append(angle)
        thicks.append(thick)
        widths.append(section.width)
    by = (
        slope(np.array(angles[1:])).reshape(count, -1).T,
        slope(np.array(widths[1:])),
        slope(np.array(thicks[1:])).reshape(count, -1).T,
    )
    return angles[0].real, float(np.real(widths[0])), thicks[0].real, by


def _plain_geometry(g: Slopes, design: PlainSlopes, beam: str, at: Any) -> tuple[Any, float, Any, tuple[Any, Any, Any]]:
    """Return the same for a network of plain beams."""
    fitted, section = g.path.layout.fits[beam], g.path.layout.network.beams[beam].section
    number, ones = list(g.path.layout.network.beams).index(beam), np.ones(len(at.t))
    by = (design.angle(number, at.t), design.sections[:, number, 1], ones[:, None] * design.sections[:, number, 2])
    return fitted.angle(at.t, 0.5), float(section.width), section.thickness_at(at.t, 0.5), by


def stress_extremes(g: Slopes, beam: str, axial: bool) -> FloatArray:
    """Return the derivatives of the highest and lowest stress on both sides of a beam, (p, 2, 2, k) [Pa]."""
    found = g.path.stress_extremes(beam, axial)
    slopes = sections(g, beam)
    t = g.path.sampler.rows(list(g.path.layout.network.beams).index(beam)).t
    near = found.row[g.points][..., None] + np.arange(STENCIL)
    weights = _weights(t[near], found.parameter[g.points])
    points = np.arange(len(g.points))[:, None, None, None]
    bending: FloatArray = np.einsum("psew,psewk->psek", weights, slopes.bending_stress[points, near])
    bending *= np.array([1.0, -1.0])[:, None, None]
    if not axial:
        return bending
    return np.asarray(bending + np.einsum("psew,psewk->psek", weights, slopes.axial_stress[points, near]))


def _weights(nodes: FloatArray, place: FloatArray) -> FloatArray:
    """Return the weights of polynomial interpolation (..., n) from nodes (..., n) at places (...)."""
    same = np.eye(nodes.shape[-1], dtype=bool)
    gaps = np.where(same, 1.0, nodes[..., :, None] - nodes[..., None, :])
    over = np.where(same, 1.0, place[..., None, None] - nodes[..., None, :])
    weights: FloatArray = (over / gaps).prod(axis=-1)
    return weights


def load_displacement(g: Slopes, drive: Loading) -> FloatArray:
    """Return the derivatives of the work-conjugate displacement of a load drive, (p, k) [J]."""
    from cfmkit.elastica.model.network import PointLoad

    total = np.zeros((len(g.points), len(g.complex_steps)))
    for number, load in enumerate(drive.loads):
        others = [drive.loads[number] for _, drive in g.complex_steps.built]
        total += _point_work(g, load, others) if isinstance(load, PointLoad) else _line_work(g, load, others)
    return total


def _point_work(g: Slopes, load: Any, others: list[Any]) -> FloatArray:
    """Return the derivatives of a point load times the displacement of its node."""
    moved, slopes = g.path.motion(load.node)[g.points], motion(g, load.node)
    force = np.array([load.fx, load.fy, load.moment], dtype=float)
    change = slope(np.array([[o.fx, o.fy, o.moment] for o in others])).T
    if not load.follows:
        return np.asarray(np.einsum("r,prk->pk", force, slopes) + moved @ change)
    c, s, turn = np.cos(moved[:, 2:]), np.sin(moved[:, 2:]), slopes[:, 2]
    fx, fy = c * force[0] - s * force[1], s * force[0] + c * force[1]
    dfx, dfy = c * change[0] - s * change[1] - fy * turn, s * change[0] + c * change[1] + fx * turn
    work = fx * slopes[:, 0] + fy * slopes[:, 1] + dfx * moved[:, :1] + dfy * moved[:, 1:2]
    return np.asarray(work + force[2] * turn + moved[:, 2:] * change[2])


def _line_work(g: Slopes, load: LineLoad, others: list[Any]) -> FloatArray:
    """Return the derivatives of a line load's work-conjugate displacement."""
    path, sampler = g.path, g.path.sampler
    beam = list(path.layout.network.beams).index(load.beam)
    index, weights = sampler.rows(beam).index, sampler.weights(path.layout, beam)
    moved = path.line_motion(load.beam)[g.points]
    still = np.stack([_rest_slope(g, k, index) for k in range(len(g.complex_steps))], axis=-1)
    change = (g.rows[:, index][:, :, [X, Y]] - still) * path.layout.scales.length
    force, by = np.array([load.wx, load.wy], dtype=float), slope(np.array([[o.wx, o.wy] for o in others])).T
    grows = np.array([slope(sampler.weights(layout, beam)) for layout in g.complex_steps.stepped]).T
    density = np.einsum("r,pnrk->pnk", force, change) + moved @ by
    return np.asarray(np.einsum("n,pnk->pk", weights, density) + (moved @ force) @ grows)


def _rest_slope(g: Slopes, k: int, index: Any) -> FloatArray:
    """Return the derivatives of the unloaded centre line by variable k at rows, (n, 2), dimensionless."""
    from cfmkit.elastica.equilibrium.mesh import assemble_model, table

    sampler = g.path.sampler
    layout = g.complex_steps.stepped[k]
    model = assemble_model(layout, sampler.cut, table(layout, sampler.cut, sampler.model.table))
    return np.asarray(slope(sampler.rest(model)[index]))


@dataclass(frozen=True, eq=False)
class Gradient(Slopes):
    """Derivatives at p chosen points of a path by k design variables; each output is computed when first needed."""

    @cached_property
    def effort(self) -> FloatArray:
        """Derivatives of `Path.effort`, (p, k)."""
        layout = self.path.layout
        if isinstance(layout.drive, Loading):
            return read_only(load_displacement(self, layout.drive))
        dof, sense = layout.driven  # type: ignore[misc]
        unit = layout.scales.moment if dof == layout.first[layout.drive.node] + 2 else layout.scales.force
        if self.path.solver.model.load_follows.any():
            return read_only(-sense * unit * self.held[:, dof])
        return read_only(-unit * self.push)

    @property
    def motion(self) -> Mapping[str, FloatArray]:
        """Node -> (p, 3, k) derivatives of `Path.motion`, of linked nodes too."""
        return _Lookup(self, motion)

    @property
    def reaction(self) -> Mapping[str, FloatArray]:
        """Node -> (p, 3, k) derivatives of `Path.reaction`."""
        return _Lookup(self, reaction)

    def end_force(self, beam: str, end: int) -> FloatArray:
        """Return the derivatives of `Path.end_force`, (p, 3, k)."""
        s, scales = self.path.solver, self.path.layout.scales
        index = list(self.path.layout.network.beams).index(beam)
        at = s.n_free + 3 * index if end == 1 else s.n + 6 * int(s.cut.beam_segment[index]) + 3
        units = np.array([scales.force, scales.force, scales.moment])
        return read_only(self.unknowns[:, at : at + 3] * units[:, None])

    @cached_property
    def energy(self) -> FloatArray:
        """Derivatives of `Path.energy`, (p, k)."""
        return read_only(energy(self))

    def shape(self, beam: str) -> FloatArray:
        """Return the derivatives of `Path.shape`, (p, n, 2, k): of material points of the beam."""
        return read_only(shape(self, beam))

    def sections(self, beam: str) -> SectionSlopes:
        """Return the derivatives of `Path.sections`; arrays (p, n, k)."""
        return sections(self, beam)

    def axial_stress_at(self, found: FloatArray, points: Any, index: Any) -> FloatArray:
        """Return the derivatives of axial stress at single rows, (n, k); see the function of this name."""
        return axial_stress_at(self, found, points, index)

    def stress_extremes(self, beam: str, axial: bool = True) -> FloatArray:
        """Return the derivatives of the values of `Path.stress_extremes`, (p, 2, 2, k).

        An extreme inside a beam stays one while its place moves, so that its place needs no derivative (envelope
        theorem).
        """
        return read_only(stress_extremes(self, beam, axial))


class _Lookup(Mapping[str, Any]):
    """Derivatives by node, computed when needed."""

    def __init__(self, gradient: Gradient, output: Callable[[Gradient, str], FloatArray]) -> None:
        self.gradient, self.output = gradient, output

    def __getitem__(self, node: str) -> FloatArray:
        return read_only(self.output(self.gradient, node))

    def __iter__(self) -> Iterator[str]:
        return iter(self.gradient.path.layout.network.nodes)

    def __len__(self) -> int:
        return len(self.gradient.path.layout.network.nodes)


def gradient(path: Path, build: Callable[[Any], Network], variables: Any, points: Any = None) -> Gradient:
    """Return the derivatives of a path's outputs by design variables.

    Parameters
    ----------
    path : Path
        A path of ``build(variables)``.
    build : callable
        From the design variables (real or complex) to the network, or to the network and its drive where variables
        change loads or direction of the drive.
    variables : (k,) array
        Where to differentiate: the variables that the path was traced for.
    points : sequence of int, optional
        Points of the path; all those requested by default.

    Raises
    ------
    cfmkit.errors.InputError
        If a variable changes the make-up of the network, moves a corner of a beam and a step of its thickness past
        each other, or moves one side of a step only. Outputs raise it where the tangent is singular at a point.
    """
    from cfmkit.elastica.sensitivity.array_derivatives import ComplexSteps

    solver = path.solver
    complex_steps = ComplexSteps(path.layout, build, variables)
    design = complex_steps.arrays(solver.model, solver.cut)
    chosen = np.asarray(path.at_requested if points is None else points, dtype=np.int64)
    return Gradient(path, read_only(chosen, np.int64), complex_steps, design)
