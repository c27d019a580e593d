"""What the engine answers for one vector of design variables: force, centre lines and stresses, with exact slopes.

It is asked at some poses: rest, some on the way, the window, the two that the paper compares. A search sees the force
at those of the window, and the polynomial through them. Where the force bends more sharply than that polynomial can, it
leaves the band between two poses: that is seen at many more poses, where a design is looked at closely.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.designing.objective_and_constraints import LimitRows
from cfmkit.elastica import Control, Displacement, PathStatus, Taper, gradient, trace
from cfmkit.errors import CfmError
from cfmkit.families.beam.shaping.variables import Length, has_vanished_beam, lengths
from cfmkit.numerics.quadrature import clenshaw_curtis

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path, Section
    from cfmkit.families.beam.shaping.task import Task
    from cfmkit.families.beam.shaping.variables import Variables


_EACH = 8  # poses of the window for one before it

_MIDDLE = 0.7  # of the end: a pose under load that stays where it is while the window grows


@dataclass(frozen=True)
class PosePlan:
    """Displacements, and which of them are what.

    Attributes
    ----------
    at : (p,) array
        From rest, increasing [m].
    window : (j,) array
        Indices of those in the window.
    shown : (3,) array
        Indices of those at which gaps are looked at: rest, on the way, and the end.
    mean : (p,) array
        Weights of the mean over the window.
    compared : (2,) array
        Indices of a and b; of the end where the paper's objective is not requested.
    """

    at: FloatArray
    window: Any
    shown: Any
    mean: FloatArray
    compared: Any


def poses_of(task: Task, start: float) -> PosePlan:
    """Return the poses for a window that begins at `start` [m]."""
    end = task.window[1]
    inside = start + 0.5 * (end - start) * (1 - np.cos(np.linspace(0, np.pi, task.points)))
    inside[-1] = end
    before = np.linspace(0.0, start, task.points // _EACH + 2)[1:-1] if start > 0 else np.zeros(0)
    also = np.array(task.compared or (end, end))
    middle = _MIDDLE * end
    at = np.unique(np.concatenate([[0.0], before, inside, also, [middle]]))
    window = np.searchsorted(at, inside)
    mean = np.zeros(len(at))
    mean[window] = clenshaw_curtis(task.points)
    shown = np.array([0, np.searchsorted(at, middle), window[-1]])
    return PosePlan(read_only(at), window, shown, read_only(mean), np.searchsorted(at, also))


# A design that loses stability in the window is no answer; the audit looks at branches.
CONTROL = Control(tolerance=1e-5, branch="stop", most_points=200)


class NoAnswer(Exception):
    """The engine has no derivatives here."""


@dataclass(frozen=True)
class BeamAtPoses:
    """One beam at p poses, at r places along it.

    Attributes
    ----------
    place : (r,) array
        Fraction of the arc length.
    x, y : (p, r) array
        Centre line [m].
    stress : (p, r) array
        Bending stress on the left side [Pa]: signed.
    axial : (p, r) array or None
        Axial stress, where it counts [Pa].
    """

    place: FloatArray
    x: FloatArray
    y: FloatArray
    stress: FloatArray
    axial: FloatArray | None = None

    @property
    def left(self) -> FloatArray:
        """Stress on the left side with the axial part [Pa], tension positive."""
        assert self.axial is not None
        return self.axial + self.stress

    @property
    def right(self) -> FloatArray:
        """Stress on the right side with the axial part [Pa], tension positive."""
        assert self.axial is not None
        return self.axial - self.stress


@dataclass(frozen=True)
class NetworkAtPoses:
    """The network at p poses: the mechanism's force (p,) [N] and its beams by name."""

    force: FloatArray
    lines: dict[str, BeamAtPoses]


@dataclass(frozen=True, eq=False)
class Response:
    """The answer for one vector of variables: the state, and on demand its derivatives by the variables (last axis)."""

    variables: Variables
    x: FloatArray
    path: Path

    @cached_property
    def keep(self) -> Any:
        """Indices of the poses on the path."""
        return self.path.at_requested

    @cached_property
    def lengths(self) -> dict[str, Length]:
        """Lengths of all beams."""
        return lengths(self.variables, self.x)

    @cached_property
    def state(self) -> NetworkAtPoses:
        """Force and beams."""
        states = np.moveaxis(self.path.sampler.states[self.keep], 2, 0)
        axial = {name: self.path.sections(name).axial_stress[self.keep] for name in self._pulled}
        return NetworkAtPoses(self.path.effort[self.keep] * self.variables.task.copies, self._lines(states, axial))

    @property
    def _pulled(self) -> tuple[str, ...]:
        """The beams whose axial stress counts."""
        task = self.variables.task
        return tuple(task.network.beams) if task.total_stress else ()

    @cached_property
    def slopes(self) -> NetworkAtPoses:
        """Derivatives of everything in the state.

        Raises
        ------
        NoAnswer
            Where the engine has none.
        """
        try:
            found = gradient(self.path, self.variables.build, self.x)
            rows, effort = found.rows, found.effort  # in this order: with the rows the efforts are known
            axial = {name: found.sections(name).axial_stress for name in self._pulled}
        except (CfmError, np.linalg.LinAlgError):
            raise NoAnswer from None
        return NetworkAtPoses(effort * self.variables.task.copies, self._lines(np.moveaxis(rows, 2, 0), axial))

    def _lines(self, states: FloatArray, axial: dict[str, FloatArray]) -> dict[str, BeamAtPoses]:
        """Return the beams from dimensionless states (7, p, rows, ...) and axial stresses (p, rows, ...)."""
        from cfmkit.elastica.outcome.sections import MOMENT, X, Y

        sampler, scales = self.path.sampler, self.path.layout.scales
        lines = {}
        for number, name in enumerate(self.variables.task.network.beams):
            rows = sampler.rows(number)
            place = sampler.place(number, rows.t)
            once = np.append(True, np.diff(place) > 0)  # the ends of segments occur twice
            at = rows.index[once]
            stress = _stress_of_moment(self.variables.task.network.beams[name].section, place[once]) * scales.moment
            stress = stress.reshape(-1, *[1] * (states.ndim - 3))
            x, y, moment = (states[which][:, at] for which in (X, Y, MOMENT))
            pull = axial[name][:, once] if name in axial else None
            lines[name] = BeamAtPoses(place[once], x * scales.length, y * scales.length, moment * stress, pull)
        return lines


def respond(variables: Variables, x: FloatArray, poses: FloatArray) -> Response | None:
    """Return the response of a network at poses that begin with rest [m].

    None where it does not reach them all, or has a beam of no length.
    """
    task, network = variables.task, variables.build(x)
    if has_vanished_beam(network):
        return None
    try:
        path = trace(network, Displacement(task.driven, task.direction, poses), CONTROL)
    except CfmError:
        return None
    return Response(variables, x.copy(), path) if path.status is PathStatus.COMPLETE else None


def _stress_of_moment(section: Section, place: FloatArray) -> FloatArray:
    """Return the bending stress at the surface per moment, 6 / (width thickness^2), at places along a beam [1/m3]."""
    given = section.thickness
    thickness = (
        np.interp(place, given.stations, given.values) if isinstance(given, Taper) else np.full(len(place), given)
    )
    return np.asarray(6.0 / (section.width * thickness**2))


@dataclass(frozen=True, eq=False)
class View:
    """What the limits look at: the response at the poses of a window from `start`, with derivatives or without."""

    response: Response
    poses: PosePlan
    start: float
    sloped: bool = False

    @property
    def lengths(self) -> dict[str, Length]:
        """Lengths of all beams."""
        return self.response.lengths

    def rows(
        self, name: str, values: FloatArray, slopes: Callable[[], FloatArray], about: Callable[[], list[str]]
    ) -> LimitRows:
        """Return rows of a limit; the derivatives are computed only if they are wanted."""
        return LimitRows(name, values.ravel(), slopes().reshape(values.size, -1) if self.sloped else None, about)

    def section(self, beam: str) -> Section:
        """Return the section of a beam."""
        return self.response.variables.task.network.beams[beam].section


MANY_POSES = 241
"""From rest to the end of the window: of a travel of 13.6 mm one every 0.06 mm."""

_BETWEEN = 8  # places of the interpolated force from pose to pose
_CLOSE_CONTROL = Control(tolerance=1e-7, branch="stop")


@dataclass(frozen=True)
class CloseView:
    """Force of the mechanism [N] and largest stress [Pa] at even poses from rest to the end of the window [m]."""

    at: FloatArray
    force: FloatArray
    stress: FloatArray

    @cached_property
    def _between(self) -> tuple[FloatArray, FloatArray]:
        """Displacements and forces between the poses, too."""
        from scipy.interpolate import CubicSpline

        fine = np.linspace(self.at[0], self.at[-1], _BETWEEN * (len(self.at) - 1) + 1)
        return fine, CubicSpline(self.at, self.force)(fine)

    @cached_property
    def bands(self) -> FloatArray:
        """Half band of the force from each place to the end [1]; infinite where it is not positive."""
        force = self._between[1][::-1]
        top, bottom = np.maximum.accumulate(force), np.minimum.accumulate(force)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(bottom > 0, (top - bottom) / (top + bottom), np.inf)[::-1]

    def half_band(self, start: float) -> float:
        """Return (max - min)/(max + min) of the force from `start` [m] to the end."""
        return float(np.interp(start, self._between[0], self.bands))

    def widest(self, half_band: float) -> float:
        """Return where the widest window begins that ends with the last pose and keeps a half band [m]."""
        kept = np.flatnonzero(self.bands > half_band)
        return float(self._between[0][min(kept[-1] + 1, len(self.bands) - 1) if len(kept) else 0])


def looked_at(task: Task, network: Network) -> CloseView | None:
    """Return a network at many poses; None where it does not reach the end, or loses stability on the way."""
    at = np.linspace(0.0, task.window[1], MANY_POSES)
    try:
        path = trace(network, Displacement(task.driven, task.direction, at), _CLOSE_CONTROL)
    except CfmError:
        return None
    if path.status is not PathStatus.COMPLETE:
        return None
    keep = path.at_requested
    stress = path.peak_stress(axial=task.total_stress).value[keep]
    return CloseView(at, path.effort[keep] * task.copies, stress)
