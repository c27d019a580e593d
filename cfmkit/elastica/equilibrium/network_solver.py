"""One network on one mesh: its arrays, its unstressed state, single solves, marches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.elastica.equilibrium.mesh import PRESTRESS, Mesh, assemble_model, grid, table
from cfmkit.elastica.kernels import compiled
from cfmkit.elastica.kernels.network_array_types import ANGLE, LENGTH, TIGHTENING
from cfmkit.elastica.kernels.status_codes import (
    DRIVE,
    DRIVE_RATE,
    LOG_DETERMINANT,
    REACHED,
    REQUESTED,
    SHORTNESS,
    SOLVED,
    UNSTABLE,
)
from cfmkit.elastica.kernels.workspace import work_space

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.kernels.network_array_types import DiscreteNetwork
    from cfmkit.elastica.model.network_under_drive import Layout

ITERATIONS = 16
"""Of Newton's method, after which a step is cut: from 4 on the curves of eight shipped networks and two strips are the
same to the last bit, with 3 Lee's frame takes other steps. Four times that is room for harder ones."""

_STORED = SHORTNESS + 1  # values with a point
_TIGHT = 1e-12  # prestress of springs, in lengths or radians, that counts
_LARGEST_CHANGE, _SMALLEST_SHARE = 0.35, 1e-3  # of poses in one step; of the prestress
FORCE_WEIGHT = 1e-3  # of a dimensionless force in the arc length


class MarchOptions(NamedTuple):
    """How a march goes: the names of what `cfmkit.elastica.kernels.march.march` takes.

    Attributes
    ----------
    tolerance : float
        Of Newton's method, in units of lengths and rotations [1].
    step, smallest, longest : float
        Lengths of the first, the shortest and the longest step.
    largest_change : float
        Largest change of a pose in a step [rad or mean beam lengths].
    natural : bool
        Whether steps go by the drive, or by the arc length.
    lowest, highest : float
        Range of the drive that is not left.
    inertia : int or None
        Number of unstable directions at the start, whose change ends the march; None to go on.
    sense : float
        1 or -1 where the start is only near an equilibrium: the sense in which the drive goes; else 0.
    landings : float
        How often a step to a value of the drive may be refused.
    """

    tolerance: float
    step: float
    largest_change: float
    natural: bool = True
    smallest: float = 1e-7
    longest: float = np.inf
    lowest: float = -np.inf
    highest: float = np.inf
    inertia: int | None = None
    sense: float = 0.0
    landings: float = np.inf

    def array(self) -> FloatArray:
        """Return them as the compiled code takes them, in its order."""
        steps = (self.step, self.smallest, self.longest, self.largest_change)
        ends = (self.lowest, self.highest, float(self.inertia is not None), float(self.inertia or 0))
        given = (self.tolerance, ITERATIONS, float(self.natural), *steps, FORCE_WEIGHT, *ends)
        return np.array([*given, self.sense, self.landings])


@dataclass(frozen=True, repr=False)
class Points(ShortRepr):
    """Points of a path in dimensionless form: unknowns (n, size), drives (n,) and what a march stores with them."""

    y: FloatArray
    drive: FloatArray
    info: FloatArray

    @classmethod
    def none(cls, size: int) -> Points:
        """Return no points, of so many unknowns."""
        return cls(np.empty((0, size)), np.empty(0), np.empty((0, _STORED)))

    @classmethod
    def of(cls, spot: Spot, requested: int) -> Points:
        """Return one equilibrium; `requested` is the number of the requested point that it is, or -1."""
        info = np.zeros((1, _STORED))
        info[0, UNSTABLE], info[0, REQUESTED] = spot.unstable, requested
        info[0, DRIVE_RATE], info[0, SHORTNESS] = spot.tangent[-1], spot.shortness
        return cls(spot.y[None], np.array([spot.drive]), info)

    @property
    def unstable(self) -> FloatArray:
        """Numbers of unstable directions."""
        return self.info[:, UNSTABLE]

    @property
    def requested(self) -> FloatArray:
        """Numbers of the requested points; -1 for those in between."""
        return self.info[:, REQUESTED]

    @property
    def reached(self) -> FloatArray:
        """The drive, or the arc length since the march began, -1 between two of its steps."""
        return self.info[:, REACHED]

    @property
    def drive_rate(self) -> FloatArray:
        """Change of the drive along the path."""
        return self.info[:, DRIVE_RATE]

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.drive)

    def joined(self, *others: Points) -> Points:
        """Return these points followed by others."""
        return Points(*map(np.concatenate, zip(self.parts, *(other.parts for other in others), strict=True)))

    def copied(self) -> Points:
        """Return the points in arrays of their own."""
        return Points(self.y.copy(), self.drive.copy(), self.info.copy())

    def take(self, keep: Any) -> Points:
        """Return the points that `keep` selects."""
        return Points(*(part[keep] for part in self.parts))

    @property
    def parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The three arrays."""
        return self.y, self.drive, self.info


@dataclass
class Spot:
    """One equilibrium: unknowns, drive, tangent, number of unstable directions, shortness measure, last increment.

    log_size is the logarithm of the size of the determinant of d(residual)/dz.
    """

    y: FloatArray
    drive: float
    tangent: FloatArray
    unstable: int = 0
    shortness: float = 1.0
    increment: float = 0.0
    log_size: float = np.nan


class Solver:
    """Equilibria of a layout on a mesh. Holds work space: not for two threads at once.

    `ramped`: what a share of takes the place of the drive; see `cfmkit.elastica.equilibrium.mesh.assemble_model`.
    """

    def __init__(self, layout: Layout, mesh: Mesh, tolerance: float = 1e-11, ramped: str = "") -> None:
        """Build the arrays."""
        self.layout, self.mesh, self.tolerance, self.ramped = layout, mesh, tolerance, ramped
        self.cut = grid(layout, mesh)
        self.table = table(layout, self.cut)
        self.model: DiscreteNetwork = self._build()
        self.n_free = self._count_free()
        self.n_beams = len(self.model.beam_end)
        self.n_dofs = len(self.model.slot)
        self.n_segments = len(self.cut.segment_step) - 1
        self.n = self.n_free + 3 * self.n_beams
        self.size = self.n + 6 * self.n_segments
        self.scratch = work_space(self.n, self.n_beams, self.n_dofs, self.n_segments)
        self.limits = np.array([tolerance, float(ITERATIONS)])
        self.unit = np.zeros(self.n + 1)
        self.unit[-1] = 1.0

    def finer(self, tolerance: float) -> Solver:
        """Return a solver with twice as many steps in every segment; the two share their work space."""
        fine = object.__new__(type(self))  # `copy` takes its time
        vars(fine).update(vars(self))
        fine.mesh, fine.tolerance = self.mesh.finer(), tolerance
        fine.cut = cut = grid(self.layout, fine.mesh)
        fine.table = table(self.layout, cut)
        fine.model = self.model._replace(table=fine.table, segment_step=cut.segment_step)
        fine.limits = np.array([tolerance, float(ITERATIONS)])
        return fine

    def _build(self) -> DiscreteNetwork:
        return assemble_model(self.layout, self.cut, self.table, self.ramped)

    def _count_free(self) -> int:
        return self.layout.plan.n_free

    def unstressed(self) -> FloatArray:
        """Return the unknowns of the network at rest, before any load or displacement."""
        m, y = self.model, np.zeros(self.size)
        turns = np.exp(1j * m.table[:, :, ANGLE]) * m.table[:, :, LENGTH]
        runs = np.add.reduceat(turns.sum(axis=1), m.segment_step[:-1])
        places = m.beam_end[:, 0]
        first = (m.place_origin[places] + m.place_arm[places]) @ np.array([1.0, 1j])
        before = np.cumsum(runs) - runs
        starts = before + np.repeat(first - before[m.beam_segment[:-1]], np.diff(m.beam_segment))
        y[self.n :].reshape(-1, 6)[:, :2] = np.stack([starts.real, starts.imag], axis=1)
        return y

    def solve(
        self,
        y: FloatArray,
        drive: float,
        border: FloatArray | None = None,
        target: float | None = None,
        model: DiscreteNetwork | None = None,
    ) -> Spot | None:
        """Return the equilibrium near (y, drive) where border . (z, drive) = target; at this drive by default.

        `model`: other values than the network's own.
        """
        m = self.model if model is None else model
        new, state, tangent = y.copy(), np.zeros(6), np.zeros(self.n + 1)
        state[DRIVE], state[LOG_DETERMINANT] = drive, 1.0
        border = self.unit if border is None else border
        goal = drive if target is None else target
        code, _ = compiled.solve(m, self.n_free, new, state, border, goal, self.limits, tangent, self.scratch)
        if code != SOLVED:
            return None
        at, unstable, shortness, increment, _, log_size = state.tolist()
        return Spot(new, at, tangent, int(unstable), shortness, increment, log_size)

    def tangent_at(self, y: FloatArray, drive: float) -> tuple[FloatArray, FloatArray]:
        """Return the tangent by the unknowns z and by the drive; under loads that follow it is not symmetric."""
        compiled.tangent(self.model, self.n_free, y.copy(), drive, self.scratch)
        h = self.scratch[0][: self.n]
        return h[:, : self.n].copy(), h[:, self.n].copy()

    def march(
        self, spot: Spot, targets: FloatArray, options: MarchOptions, room: int, model: DiscreteNetwork | None = None
    ) -> tuple[int, Points]:
        """Follow the path from `spot`; return why the march ended and its points.

        `model`: other values than the network's own.
        """
        y, drive, info = np.empty((room, self.size)), np.empty(room), np.empty((room, _STORED))
        code, stored = compiled.march(
            self.model if model is None else model,
            self.n_free,
            spot.y.copy(),
            spot.drive,
            spot.tangent.copy(),
            np.array(targets),
            options.array(),
            (y, drive, info),
            self.scratch,
        )
        return int(code), Points(y[:stored], drive[:stored], info[:stored])

    def rest(self) -> Spot:
        """Return a place near the equilibrium at rest, while nothing is done.

        Places of segments are left at zero: they follow linearly from all else.
        """
        return Spot(np.zeros(self.size), 0.0, np.zeros(self.n + 1))

    def tightened(self) -> Spot | None:
        """Return a place near the equilibrium while nothing acts but springs that may be prestressed; or None."""
        if not self.layout.network.springs:
            return self.rest()
        model = assemble_model(self.layout, self.cut, self.table, PRESTRESS)
        if np.abs(model.spring_value[:, TIGHTENING]).max() <= _TIGHT:
            return self.rest()
        spot, step = Spot(self.unstressed(), 0.0, np.zeros(self.n + 1)), 1.0
        while spot.drive < 1.0:
            near = self.solve(spot.y, min(1.0, spot.drive + step), model=model)
            if near is None or self.pose_change(near.y, spot.y) > _LARGEST_CHANGE:
                step *= 0.5
                if step < _SMALLEST_SHARE:
                    return None
                continue
            spot = near
        return replace(spot, drive=0.0)

    def degree(self, dof: int, ys: FloatArray, drives: FloatArray) -> FloatArray:
        """Return the values (k,) of a degree of freedom, free or held, of unknowns (k, size) at drives (k,)."""
        m = self.model
        slot = int(m.slot[dof])
        return ys[:, slot] if slot >= 0 else m.base[dof] + drives * m.rate[dof]

    def pose_change(self, one: FloatArray, other: FloatArray) -> float:
        """Return the largest difference of positions (in mean beam lengths) and rotations of two states."""
        return float(np.abs((one - other)[self._in_poses]).max(initial=0.0))

    @cached_property
    def _in_poses(self) -> Any:
        """Which unknowns are positions and rotations."""
        parts = np.arange(self.n, self.size).reshape(-1, 6)
        return np.concatenate([np.arange(self.n_free), parts[:, :3].ravel()])

    def solve_each(self, ys: FloatArray, drives: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the equilibria near ys (k, unknowns) at these drives (k,), and how far they are, (k, 3).

        That is the largest change of the free degrees of freedom, of the forces on the beams' last sections, and of
        all unknowns; infinite where there is no equilibrium.
        """
        new, changes = ys.copy(), np.empty((len(drives), 3))
        compiled.solve_each(self.model, self.n_free, new, drives, self.limits, changes, self.scratch)
        return new, changes
