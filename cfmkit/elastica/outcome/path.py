"""The outcome of a trace: converged equilibria in the order of the path, and what can be requested about them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.model.network import LineLoad
from cfmkit.elastica.outcome.largest_stress_along_beam import StressExtremes, extremes, signed_extremes
from cfmkit.elastica.outcome.sections import Sampler, Sections, along_beam

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.network_solver import Points, Solver
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.elastica.model.network_under_drive import Layout

_TIE = 1e-9  # share by which stresses of two beams differ that are one but for rounding


class PathStatus(Enum):
    """How a path ended."""

    COMPLETE = "all requested points were reached"
    LIMIT_POINT = "the drive cannot go further: a limit point"
    JUMPS = "stability is lost and no stable equilibrium is near"
    LOST = "the path was lost: no step converged"
    OUTSIDE = "the path left the range of the drive"
    FULL = "the path has more points than allowed"
    NO_START = "no equilibrium under the constant loads"
    INACCURATE = "the tolerance could not be reached"


@dataclass(frozen=True)
class Event:
    """Something on the path: a limit point, a bifurcation, or a change of stability that was not resolved.

    `drive` is where (SI); `before` and `after` count the unstable directions on both sides of the path that it lies on,
    in the sense of travel: at the end of a branch, of the path that it joins. What is passed before the drive begins is
    reported first: its kind ends in "under prestress" or "under constant loads", `drive` is the share [1].
    """

    kind: str
    drive: float
    before: int
    after: int


@dataclass(frozen=True)
class StressPeak:
    """The largest stress at every point [Pa], the beam that has it and the place on it (fraction of its length)."""

    value: FloatArray
    beam: Any
    place: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class Path(ShortRepr):
    """Equilibria of a network under a drive.

    Attributes
    ----------
    solver : Solver
        That found them.
    points : Points
        The equilibria, dimensionless, with what a march stores with them.
    status, message : PathStatus, str
        Whether all requested points were reached, and if not, why and where.
    branch : (n,) array of str
        Which branch each point is on.
    events : tuple of Event
        Limit points and bifurcations, in path order.
    error : float
        Estimated error of forces and positions, relative to the largest of the path: the change with half the step.
    accurate : (n,) array of bool
        False at the points of a path that misses its tolerance whose own error is above it, or not known.
    imperfection : str
        What was added to the shapes (`Control.imperfection`): its size and mode; empty for the network as given.
    """

    solver: Solver
    points: Points
    branch: Any
    status: PathStatus
    message: str
    events: tuple[Event, ...]
    error: float
    accurate: Any
    imperfection: str = ""

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    @property
    def layout(self) -> Layout:
        """The index map."""
        return self.solver.layout

    @cached_property
    def drive(self) -> FloatArray:
        """Value of the drive at every point [m, rad or 1]."""
        return read_only(self.points.drive * self.layout.scales.drive)

    @cached_property
    def unstable(self) -> Any:
        """Number of unstable directions while the drive is held.

        Under loads that follow, what they act on is condensed to a small unsymmetric matrix, whose negative real
        eigenvalues count: there the network diverges.
        """
        return read_only(self.points.unstable, np.int64)

    @property
    def stable(self) -> Any:
        """True where it is stable while the drive is held; under loads that follow: where it does not diverge."""
        return read_only(self.unstable == 0, np.bool_)

    @cached_property
    def requested(self) -> Any:
        """Index of the requested point, -1 for points in between."""
        return read_only(self.points.requested, np.int64)

    @cached_property
    def at_requested(self) -> Any:
        """Indices of the points that were requested, in path order."""
        return read_only(np.flatnonzero(self.requested >= 0), np.int64)

    @cached_property
    def fits(self) -> dict[str, Fit]:
        """How each beam was fitted between its nodes."""
        return self.layout.fits

    @cached_property
    def _observed(self) -> tuple[FloatArray, FloatArray]:
        from cfmkit.elastica.kernels import compiled

        s, out = self.solver, np.empty((len(self), self.layout.dof_count + 1))
        if len(self):
            compiled.forces(s.model, s.n_free, np.ascontiguousarray(self.points.y), self.points.drive, out, s.scratch)
        return out[:, :-1], out[:, -1]

    @property
    def residual(self) -> FloatArray:
        """Forces of loads, springs and beams on every degree of freedom at every point, dimensionless."""
        return self._observed[0]

    def value(self, dof: int) -> FloatArray:
        """Return the values of a degree of freedom, free or held, at every point, dimensionless."""
        return self.solver.degree(dof, self.points.y, self.points.drive)

    def motion(self, node: str) -> FloatArray:
        """Return displacement and rotation of a node, (n, 3) [m, m, rad]."""
        return read_only(self.layout.motion(node, self.value))

    def reaction(self, node: str) -> FloatArray:
        """Return force and moment that hold a node, (n, 3) [N, N, N m]: of its support and of a drive by a motion.

        Loads are not among them, those of a drive neither.

        Raises
        ------
        cfmkit.errors.InputError
            If a link moves the node.
        """
        residual, scales = self.residual, self.layout.scales
        first, frame = self.layout.supported(node), self.layout.direction[node]
        c, s = np.cos(frame), np.sin(frame)
        a, b, moment = (-residual[:, first + k] for k in range(3))
        force = scales.force
        return read_only(np.stack([(c * a - s * b) * force, (s * a + c * b) * force, moment * scales.moment], axis=-1))

    @cached_property
    def effort(self) -> FloatArray:
        """Work-conjugate of the drive: the force along it [N], the moment [N m], or for loads the displacement [J]."""
        scales, drive = self.layout.scales, self.layout.drive
        if isinstance(drive, Loading):
            return read_only(self._load_displacement(drive))
        dof, sense = self.layout.driven  # type: ignore[misc]
        unit = scales.moment if dof == self.layout.first[drive.node] + 2 else scales.force
        return read_only(-self.residual[:, dof] * sense * unit)

    def _load_displacement(self, drive: Loading) -> FloatArray:
        total = np.zeros(len(self))
        for load in drive.loads:
            if isinstance(load, LineLoad):
                total += self._line_work(load)
                continue
            moved = self.motion(load.node)
            if not load.follows:
                total += moved @ np.array([load.fx, load.fy, load.moment])
                continue
            c, s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
            fx, fy = c * load.fx - s * load.fy, s * load.fx + c * load.fy
            total += fx * moved[:, 0] + fy * moved[:, 1] + load.moment * moved[:, 2]
        return total

    def _line_work(self, load: LineLoad) -> FloatArray:
        """Return the line load's work-conjugate displacement [J]."""
        index = list(self.layout.network.beams).index(load.beam)
        moved = self.line_motion(load.beam) @ np.array([load.wx, load.wy])
        return np.asarray(moved @ self.sampler.weights(self.layout, index))

    def line_motion(self, beam: str) -> FloatArray:
        """Return the displacements of the sampled places of a beam, (n, k, 2) [m]."""
        rows = self.sampler.rows(list(self.layout.network.beams).index(beam)).index
        moved = self.sampler.states[:, rows, :2] - self.sampler.rest(self.sampler.model)[rows]
        return read_only(moved * self.layout.scales.length)

    def end_force(self, beam: str, end: int) -> FloatArray:
        """Return (h, v, m) on the first (0) or last (1) section of a beam, (n, 3) [N, N, N m].

        It is what the part after the section exerts on the part before it, in global axes.
        """
        s, scales = self.solver, self.layout.scales
        index = list(self.layout.network.beams).index(beam)
        at = s.n_free + 3 * index if end == 1 else s.n + 6 * int(s.cut.beam_segment[index]) + 3
        return read_only(self.points.y[:, at : at + 3] * np.array([scales.force, scales.force, scales.moment]))

    @cached_property
    def sampler(self) -> Sampler:
        """States along all beams (computed when first needed)."""
        return Sampler(self.solver, self.points)

    def sampled(self, rows: int) -> Path:
        """Return the path with states at so many even places of each segment: no integrals along beams are taken."""
        found = replace(self)
        vars(found)["sampler"] = Sampler(self.solver, self.points, rows)
        return found

    @cached_property
    def energy(self) -> FloatArray:
        """Strain energy of beams and springs at every point [J]."""
        return read_only((self.sampler.energy() + self._observed[1]) * self.layout.scales.moment)

    def shape(self, beam: str, point: int) -> FloatArray:
        """Return the deformed centre line of a beam at one point, (k, 2) [m]."""
        rows = self.sampler.rows(list(self.layout.network.beams).index(beam))
        return read_only(self.sampler.states[point, rows.index, :2] * self.layout.scales.length)

    def places(self, beam: str) -> FloatArray:
        """Return where the sampled places of a beam lie, (k,) [fraction of the arc length]."""
        index = list(self.layout.network.beams).index(beam)
        return self.sampler.place(index, self.sampler.rows(index).t)

    def sections(self, beam: str) -> Sections:
        """Return section forces and stresses along a beam at all points; arrays (n, k)."""
        return along_beam(self.sampler, list(self.layout.network.beams).index(beam))

    def beam_stress(self, beam: str, axial: bool = True) -> tuple[FloatArray, FloatArray]:
        """Return the largest stress of a beam at every point [Pa] and its place (fraction of the length)."""
        known = self._beam_stresses.get((beam, axial))
        if known is None:
            value, place = extremes(self.sampler, list(self.layout.network.beams).index(beam), axial)
            known = self._beam_stresses[beam, axial] = read_only(value), read_only(place)
        return known

    @cached_property
    def _beam_stresses(self) -> dict[tuple[str, bool], tuple[FloatArray, FloatArray]]:
        """Result of `beam_stress`, of which curves, metrics between their points and findings are made."""
        return {}

    def stress_extremes(self, beam: str, axial: bool = True) -> StressExtremes:
        """Return the highest and lowest stress on both sides of a beam at every point, signed, with their places."""
        return signed_extremes(self.sampler, list(self.layout.network.beams).index(beam), axial)

    def peak_stress(self, axial: bool = True) -> StressPeak:
        """Return the largest stress of the network at every point, with its place; see `most_stressed`."""
        names = list(self.layout.network.beams)
        found = [self.beam_stress(name, axial) for name in names]
        values = np.array([value for value, _ in found])
        places = np.array([place for _, place in found])
        best = most_stressed(values, places)
        pick = np.arange(len(self))
        return StressPeak(
            read_only(values[best, pick]), read_only(np.array(names)[best], np.str_), read_only(places[best, pick])
        )


def most_stressed(values: FloatArray, places: FloatArray) -> Any:
    """Return which beam (n,) has the largest of stresses (beams, n) at places (fractions of the length).

    Beams that meet have one stress there, but for rounding: it is that of the beam that begins.
    """
    return np.where(values >= (1 - _TIE) * values.max(axis=0), -places, -np.inf).argmax(axis=0)
