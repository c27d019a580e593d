"""A second opinion on equilibria: corotational two-node elements, which share nothing with the functional.

The engine integrates Reissner's theory along the beams; here a beam is a chain of straight elements that are linear
in a frame which moves with them (Timoshenko, section constant in the element). Equilibrium is a stationary point of
the total energy, its gradient written out, its Hessian by complex steps. The error falls with the square of the
element length: two meshes and Richardson's extrapolation remove it. The path checked gives a first guess, no more.
Wide strips have the energy of `cfmkit.elastica.mechanics.wide_strip` [A], at the mean curvature of an element.

References
----------
[A] D. G. Ashwell, J. Roy. Aeron. Soc. 54 (1950) 708: the anticlastic curvature of rectangular beams and plates.
[C] M. A. Crisfield, Non-linear Finite Element Analysis of Solids and Structures, vol. 1 (1991), ch. 7.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica import Loading
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path

_STEP = 1e-30
"""Of a complex step: nothing is subtracted, so that its square may vanish beside one."""

_ITERATIONS = 40
"""Of Newton's method: up to 5 on a V-beam and Lan's network, 8 on a cantilever bent by six tenths of its length. Early
steps are cut to 0.3 rad, so that forty reach 12 rad: nearly two revolutions."""

_CONVERGED = 1e-9
"""Largest last step, in lengths and radians: a step of 1e-5 is followed by one of 1e-9 there, so the next one, which is
not taken, would be at rounding."""

_GAUSS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Recheck:
    """Efforts and stresses of corotational elements at points of a path."""

    # (p,) force or moment of the drive [N or N m], extrapolated; NaN where no equilibrium was found
    effort: FloatArray
    stress: FloatArray  # (p,) largest stress at the ends of the elements [Pa], extrapolated
    stable: Any  # (p,) whether the energy is at a minimum there while the drive is held
    elements: int  # of the finer mesh


def recheck(path: Path, points: Any = None, elements: int = 48) -> Recheck:
    """Return force, stress and stability at points of a path by corotational elements.

    Parameters
    ----------
    path : Path
        Of a network of beams, rigid joints and rigid links under a displacement or rotation.
    points : sequence of int, optional
        Points of the path; all those requested by default.
    elements : int
        About so many in the coarser of two meshes; the finer has twice as many.

    Raises
    ------
    cfmkit.errors.InputError
        If the network has pins, springs or loads, or is driven by a load.
    """
    net = path.network
    joints = {joint for beam in net.beams.values() for joint in (beam.start_joint, beam.end_joint)}
    pinned = "pin" in joints or not all(link.turns for link in net.links)
    if isinstance(path.load_case, Loading) or pinned or net.springs or net.loads or path.load_case.loads:
        raise InputError("the check by elements is for beams, links and supports under a displacement or rotation only")
    chosen = path.at_requested if points is None else np.asarray(points)
    meshes = [_Elements(path, elements, split) for split in (1, 2)]
    effort, stress, stable = [], [], []
    for index in chosen.tolist():
        coarse, fine = (mesh.solve(path, index) for mesh in meshes)
        effort.append((4.0 * fine.effort - coarse.effort) / 3.0)
        stress.append((4.0 * fine.stress - coarse.stress) / 3.0)
        stable.append(fine.stable)
    return Recheck(read_only(effort), read_only(stress), read_only(stable, np.bool_), len(meshes[1].dofs))


@dataclass(frozen=True)
class _State:
    """One equilibrium: force on the drive, largest stress, stability."""

    effort: float
    stress: float
    stable: bool


class _Elements:
    """The elements of a network: their degrees of freedom, arms, reference chords and rigidities."""

    def __init__(self, path: Path, count: int, split: int) -> None:
        """Cut the beams at corners, stations and evenly between, and every element into `split`."""
        self.path, self.network, self.fits, self.split = path, path.network, path.fits, split
        total = sum(float(np.real(fit.length)) for fit in self.fits.values())
        self.first = {name: 3 * k for k, name in enumerate(path.mesh.bodies)}
        self.size = 3 * len(self.first)
        dofs: list[tuple[int, int]] = []
        arms: list[tuple[Any, Any]] = []
        places: list[tuple[int, float, float]] = []
        self.inner: list[tuple[int, float]] = []  # beam and parameter of every node inside a beam
        for number, name in enumerate(self.fits):
            marks = self._marks(name, total / count)
            ends = [self._end(name, side) for side in (0, 1)]
            nodes = [ends[0]]
            for t in marks[1:-1]:
                nodes.append((self.size, np.zeros(2)))
                self.inner.append((number, t))
                self.size += 3
            nodes.append(ends[1])
            for (i, arm_i), (j, arm_j) in itertools.pairwise(nodes):
                dofs.append((i, j))
                arms.append((arm_i, arm_j))
            places += [(number, a, b) for a, b in itertools.pairwise(marks)]
        self.dofs, self.arms = np.array(dofs), np.array(arms)
        self._sections(places)

    def _marks(self, name: str, longest: float) -> list[float]:
        """Return the parameters of a beam's nodes."""
        fit, section = self.fits[name], self.network.beams[name].section
        stations = [fit.parameter(float(u)) for u in section.stations[1:-1]]
        breaks = np.unique(np.round(np.concatenate([fit.course.breaks, stations]), 13))
        marks = [0.0]
        for left, right in itertools.pairwise(breaks.tolist()):
            share = float(np.real(fit.arc(right) - fit.arc(left)))
            pieces = self.split * max(2, int(np.ceil(share * float(np.real(fit.length)) / longest)))
            marks += np.linspace(left, right, pieces + 1)[1:].tolist()
        return marks

    def _end(self, name: str, side: int) -> tuple[int, FloatArray]:
        """Return the first degree of freedom of the node that moves a beam's end, and the arm between them."""
        beam = self.network.beams[name]
        master = self.network.master_of((beam.start, beam.end)[side])
        own, node = self.network.nodes[(beam.start, beam.end)[side]], self.network.nodes[master]
        return self.first[master], np.add((own.x - node.x, own.y - node.y), (beam.start_offset, beam.end_offset)[side])

    def _sections(self, places: list[tuple[int, float, float]]) -> None:
        """Set reference chords, rigidities at mid-length and thicknesses at the ends of the elements."""
        names = list(self.network.beams)
        rows = []
        for number, a, b in places:
            fit, section = self.fits[names[number]], self.network.beams[names[number]].section
            t, weight = 0.5 * (a + b) + 0.5 * (b - a) * _GAUSS[0], 0.5 * (b - a) * _GAUSS[1]
            middle = 0.5 * (a + b)
            run, angle = np.real(fit.speed(t, middle)) * weight, np.real(fit.angle(t, middle))
            inside = float(np.real(fit.arc(middle)))
            arcs = np.array([float(np.real(fit.arc(one))) for one in (a, middle, b)])
            bending, axial, shear = (float(np.real(v[1])) for v in section.rigidities(arcs, inside))
            h = np.real(section.thickness_at(arcs, inside))
            chord = (float(run @ np.cos(angle)), float(run @ np.sin(angle)))
            rest = float(np.real(fit.angle(b, middle) - fit.angle(a, middle)))
            curl, share = (float(np.real(one)) for one in section.curling(section.thickness_at(arcs, inside)[1]))
            rows.append((*chord, bending, axial, shear, h[0], h[2], np.real(section.width), rest, curl, share))
        table = np.array(rows)
        self.chord, self.bending, self.thickness, self.width = table[:, :2], table[:, 2], table[:, 5:7], table[:, 7]
        self.length = np.hypot(*self.chord.T)
        # where stretching is left out an element is made ten thousand times stiffer than it is slender
        firm = 1e4 * 12 * self.bending / self.length**2
        self.axial = np.where(table[:, 3] > 0, 1.0 / np.maximum(table[:, 3], 1e-300), firm)
        self.slip = 12 * self.bending * table[:, 4] / self.length**2
        self.rest, self.curl, self.share = table[:, 8], table[:, 9] / self.length**2, table[:, 10]

    def local(self, u: Any) -> tuple[Any, Any, Any, tuple[Any, Any], Any]:
        """Return normal force, end moments, direction and length of the elements for local freedoms u (e, 6)."""
        turned = []
        for end in (0, 1):
            c, s = np.cos(u[:, 3 * end + 2]), np.sin(u[:, 3 * end + 2])
            ax, ay = self.arms[:, end].T
            turned.append((c * ax - s * ay - ax, s * ax + c * ay - ay))
        dx = self.chord[:, 0] + u[:, 3] + turned[1][0] - u[:, 0] - turned[0][0]
        dy = self.chord[:, 1] + u[:, 4] + turned[1][1] - u[:, 1] - turned[0][1]
        now = np.sqrt(dx * dx + dy * dy)
        c, s = dx / now, dy / now
        c0, s0 = (self.chord / self.length[:, None]).T
        # half the chord's turn by its tangent: good for a whole turn either way
        turn = 2 * np.arctan((s * c0 - c * s0) / (1 + c * c0 + s * s0))
        a, b = u[:, 2] - turn, u[:, 5] - turn
        k = self.bending / self.length / (1 + self.slip)
        first = k * ((4 + self.slip) * a + (2 - self.slip) * b)
        last = k * ((2 - self.slip) * a + (4 + self.slip) * b)
        if self.share.any():
            more = self.bending / self.length * _by_hindered_curling(b - a, self.rest, self.curl, self.share)
            first, last = first - more, last + more
        return self.axial * (now - self.length) / self.length, first, last, (c, s), now

    def forces(self, u: Any) -> Any:
        """Return the gradient of the elements' energies by their local freedoms (e, 6)."""
        normal, first, last, (c, s), now = self.local(u)
        shear = (first + last) / now
        fx, fy = normal * c + shear * s, normal * s - shear * c
        levers = []
        for end in (0, 1):
            cc, ss = np.cos(u[:, 3 * end + 2]), np.sin(u[:, 3 * end + 2])
            ax, ay = self.arms[:, end].T
            levers.append((cc * ax - ss * ay) * fy - (ss * ax + cc * ay) * fx)
        return np.stack([-fx, -fy, first - levers[0], fx, fy, last + levers[1]], axis=1)

    def gradient(self, u: FloatArray) -> FloatArray:
        """Return the gradient of the energy by all freedoms."""
        index, out = self._index(), np.zeros(self.size)
        np.add.at(out, index, self.forces(u[index]))
        return out

    def _index(self) -> Any:
        return np.concatenate([self.dofs[:, :1] + np.arange(3), self.dofs[:, 1:] + np.arange(3)], axis=1)

    def hessian(self, u: FloatArray) -> Any:
        """Return the Hessian of the energy by all freedoms, sparse."""
        from scipy.sparse import coo_array

        index = self._index()
        own = u[index]
        columns = []
        for k in range(6):
            stepped = own.astype(complex)
            stepped[:, k] += 1j * _STEP
            columns.append(self.forces(stepped).imag / _STEP)
        values = np.stack(columns, axis=2)
        rows = np.repeat(index[:, :, None], 6, axis=2)
        return coo_array((values.ravel(), (rows.ravel(), rows.transpose(0, 2, 1).ravel())), (self.size, self.size))

    def solve(self, path: Path, index: int) -> _State:
        """Return the equilibrium near a point of the path."""
        from scipy.sparse.linalg import splu

        turn, free, driven = self._frames()
        held, u = turn[:, free], self._guess(path, index)
        for _ in range(_ITERATIONS):
            # pivots stay on the diagonal: their signs are those of the energy's curvatures
            factors = splu(
                (held.T @ self.hessian(u) @ held).tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            step = factors.solve(held.T @ self.gradient(u))
            u = u - held @ (step * min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-300)))
            if float(np.abs(step).max()) < _CONVERGED:
                break
        else:
            return _State(np.nan, np.nan, False)
        dof, sense = driven
        effort = sense * float((turn.T @ self.gradient(u))[dof])
        return _State(effort, self._stress(u), bool((factors.U.diagonal() > 0).all()))

    def _frames(self) -> tuple[Any, Any, tuple[int, float]]:
        """Return the turn of the nodes' frames (sparse), the freedoms that are free, the driven one with its sense."""
        from scipy.sparse import lil_array

        turn, free = lil_array((self.size, self.size)), np.ones(self.size, dtype=bool)
        driven = 0, 0.0
        turn.setdiag(1.0)
        arrays = self.path.mesh
        for name, unknowns in arrays.bodies.items():
            first, (c, s) = self.first[name], arrays.attachments.frame[arrays.nodes[name]]
            turn[first : first + 2, first : first + 2] = np.array([[c, -s], [s, c]])
            free[first : first + 3] = np.isin(unknowns, arrays.free)
            for local, rate in enumerate(arrays.rate[list(unknowns)].tolist()):
                if rate:
                    driven = first + local, rate
        return turn.tocsc(), np.flatnonzero(free), driven

    def _guess(self, path: Path, index: int) -> FloatArray:
        """Return the path's own motions: exact at the nodes of the network, interpolated inside the beams."""
        u = np.zeros(self.size)
        for name, first in self.first.items():
            u[first : first + 3] = path.motion(name)[index]
        names, first = list(self.network.beams), 3 * len(self.first)
        moved = {}
        for number in {beam for beam, _ in self.inner}:
            name = names[number]
            moved[number] = path.places(name), (*path.line_motion(name)[index].T, path.states(name).turn[index])
        for k, (beam, t) in enumerate(self.inner):
            places, columns = moved[beam]
            arc = float(np.real(self.fits[names[beam]].arc(t)))
            u[first + 3 * k : first + 3 * k + 3] = [np.interp(arc, places, column) for column in columns]
        return u

    def _stress(self, u: FloatArray) -> float:
        """Return the largest stress at the ends of the elements."""
        normal, first, last, _, _ = self.local(u[self._index()])
        moments = np.abs(np.stack([first, last], axis=1))
        area = self.width[:, None] * self.thickness
        found = 6 * moments / (area * self.thickness) + np.abs(normal)[:, None] / area
        return float(found.max())


def _by_hindered_curling(turn: Any, rest: FloatArray, curl: FloatArray, share: FloatArray) -> Any:
    """Return the moments that elements need beyond those of narrow ones, over EI/L, (e,).

    The derivative of turn^2/2 share (1 - g) by the turn (e,), g at z = curl (turn + rest)^2; `share`: nu^2/(1 - nu^2).
    """
    z = curl * (turn + rest) ** 2
    g, slope = _curling(z)
    return share * turn * ((1 - g) - turn * slope * curl * (turn + rest))


def _curling(z: Any) -> tuple[Any, Any]:
    """Return g = 2/th (cosh th - cos th)/(sinh th + sin th) and its derivative by z = th^4, (e,) each."""
    near = np.abs(z) < 0.05  # the first terms of both series are exact to rounding there, the closed form is not
    top, below = 1 + z / 360 + z * z / 1814400, 1 + z / 120 + z * z / 362880
    close = top / below
    rising = (1 / 360 + z / 907200 - close * (1 / 120 + z / 181440)) / below
    th = np.sqrt(np.sqrt(np.where(near, 1.0, z)))
    even, odd = np.cosh(th) - np.cos(th), np.sinh(th) + np.sin(th)
    far = 2 / th * even / odd
    falling = (2 / th * (1 - even * (np.cosh(th) + np.cos(th)) / odd**2) - far / th) / (4 * th**3)
    return np.where(near, close, far), np.where(near, rising, falling)
