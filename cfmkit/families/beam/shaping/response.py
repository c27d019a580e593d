"""Response of a network to its design variables at chosen poses: force, lines, stresses, slopes; and at many poses.

Poses are rest, some on the way, the window, the two that the paper compares. A search has the force at those of the
window, and the polynomial through them. A force that bends more sharply leaves the band between two poses: hence many.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import distinct, read_only
from cfmkit.elastica import Control, Displacement, PathStatus, gradient, trace
from cfmkit.elastica.results import beam_states
from cfmkit.errors import CfmError
from cfmkit.families.beam.shaping.task_and_variables import Length, has_pad_inside, has_vanished_beam, lengths
from cfmkit.numerics.quadrature import clenshaw_curtis

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.elastica.sensitivity import Gradient
    from cfmkit.families.beam.shaping.task_and_variables import Task, Variables
    from cfmkit.numerics.dual_array import DualArray
    from cfmkit.specs.evaluable_target_curve import TargetCurve


_POSES_PER_REUSE = 8  # poses of the window for one before it
_MIDDLE_SHARE = 0.7  # of the end: a pose under load that stays where it is while the window grows


@dataclass(frozen=True)
class PosePlan:
    """Displacements, and which of them are what."""

    at: FloatArray  # (p,) from rest, increasing [m]
    window: Any  # (j,) indices of those in the window
    shown: Any  # (3,) indices of those at which gaps are looked at: rest, on the way, and the end
    mean: FloatArray  # (p,) weights of the mean over the window
    compared: Any  # (2,) indices of a and b; of the end where the paper's objective is not requested


def poses_of(task: Task, start: float) -> PosePlan:
    """Return the poses for a window that begins at `start` [m]."""
    return _plan_poses(task.points, start, task.window[1], task.compared)


@lru_cache(maxsize=16)
def _plan_poses(points: int, start: float, end: float, compared: tuple[float, float] | None) -> PosePlan:
    inside = start + 0.5 * (end - start) * (1 - np.cos(np.linspace(0, np.pi, points)))
    inside[-1] = end
    before = np.linspace(0.0, start, points // _POSES_PER_REUSE + 2)[1:-1] if start > 0 else np.zeros(0)
    also = np.array(compared or (end, end))
    middle = _MIDDLE_SHARE * end
    at = np.unique(np.concatenate([[0.0], before, inside, also, [middle]]))
    window = np.searchsorted(at, inside)
    mean = np.zeros(len(at))
    mean[window] = clenshaw_curtis(points)
    shown = np.array([0, np.searchsorted(at, middle), window[-1]])
    return PosePlan(read_only(at), window, shown, read_only(mean), np.searchsorted(at, also))


_PLACES_PER_BEAM = 24
"""Along a beam: a parabola through three of so many misses the top of a whole wave by 1e-4, less than the margin."""

# A design that loses stability in the window is no answer; the audit looks at branches.
SEARCH_CONTROL = Control(tolerance=1e-5, branch="stop", most_points=200)


@cache
def _fractions(elements: int) -> FloatArray:
    """Return the places on each element of a beam of so many."""
    return read_only(np.linspace(0.0, 1.0, -(-_PLACES_PER_BEAM // elements) + 1))


@cache
def _all_fractions(counts: frozenset[int]) -> FloatArray:
    """Return the places on elements of beams that are cut into any of some numbers."""
    return distinct(np.concatenate([_fractions(count) for count in counts]))


_COLUMN_PARTS = {
    "x": {"x": 1.0},
    "y": {"y": 1.0},
    "stress": {"bending": 1.0},
    "left": {"axial": 1.0, "bending": 1.0},
    "right": {"axial": 1.0, "bending": -1.0},
}
"""Quantities of limits as sums of those of the engine: the centre line; the bending stress on the left side, signed;
the stress on either side with its axial part, tension positive."""


class NoAnswer(Exception):
    """The engine has no derivatives here."""


@dataclass(frozen=True)
class BeamSamples:
    """Samples of a beam by the engine, at r places."""

    place: FloatArray  # (r,) fraction of the arc length
    index: Any  # (r,) which of the samples of all beams they are


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
        """Arc length and straightness (chord over arc) of every beam, with derivatives."""
        return lengths(self.variables, self.x, self.path.network)

    @cached_property
    def _elements(self) -> tuple[list[int], FloatArray]:
        """All elements, and the fractions of each at which states are computed: those of beams of any number."""
        beams = self.path.mesh.elements.beam
        return list(range(len(beams))), _all_fractions(frozenset(map(beams.count, beams)))

    @cached_property
    def samples(self) -> dict[str, BeamSamples]:
        """Samples of each beam; the ends of elements occur twice among its states, and once here."""
        (_, fractions), beams = self._elements, self.path.mesh.elements.beam
        samples = {}
        for name in self.path.network.beams:
            numbers = [k for k, beam in enumerate(beams) if beam == name]
            among = np.searchsorted(fractions, _fractions(len(numbers)))
            index = (np.array(numbers)[:, None] * len(fractions) + among).ravel()
            place = self._states.place[index]
            once = np.append(True, np.diff(place) > 0)
            samples[name] = BeamSamples(place[once], index[once])
        return samples

    @cached_property
    def _states(self) -> beam_states.BeamStates:
        """States at the poses, at the fractions of all elements, one after the other."""
        path = self.path.take(self.keep)
        return beam_states.states_of_elements(path.network, path.at, *self._elements)

    @cached_property
    def force(self) -> FloatArray:
        """The force that is to be constant, (p,) [N]."""
        force: FloatArray = self.variables.task.force(self.path)[self.keep]
        return force

    @cached_property
    def _columns(self) -> dict[str, FloatArray]:
        """Coordinates [m] and stresses [Pa] at all samples, (p, r)."""
        (_, fractions), beams = self._elements, self.path.network.beams
        width = np.repeat([beams[name].section.width for name in self.path.mesh.elements.beam], len(fractions))
        bending, axial = beam_states.bending_and_axial_stress(width, self._states)
        return {"x": self._states.x, "y": self._states.y, "bending": bending, "axial": axial}

    def column(self, what: str) -> FloatArray:
        """Return what limits look at, a key of `_COLUMN_PARTS`, at all samples, (p, r) [m or Pa]."""
        parts = [factor * self._columns[name] for name, factor in _COLUMN_PARTS[what].items()]
        return np.asarray(sum(parts[1:], parts[0]))

    @cached_property
    def _gradient(self) -> Gradient:
        try:
            outputs = gradient(self.path, self.variables.build, self.x)
            _ = outputs.unknowns  # with them the efforts are known, too
        except (CfmError, np.linalg.LinAlgError):
            raise NoAnswer from None
        return outputs

    @cached_property
    def force_slopes(self) -> FloatArray:
        """Derivatives of the force (p, k) [N].

        Raises NoAnswer where the engine has none.
        """
        return self.variables.task.force_slopes(self._gradient)

    @cached_property
    def _dual(self) -> dict[str, DualArray]:
        """The same as `_columns` with derivatives.

        Raises NoAnswer where the engine has none.
        """
        states = self._gradient.dual_states(*self._elements)
        bending, axial = self._gradient.dual_stresses(*self._elements)
        return {"x": states.x, "y": states.y, "bending": bending, "axial": axial}

    def slopes_at(self, what: str, pose: Any, sample: Any) -> FloatArray:
        """Return derivatives (..., k) by the variables of a `column` at poses and samples."""
        shape = np.broadcast_shapes(np.shape(pose), np.shape(sample))
        if 0 in shape:
            return np.empty((*shape, len(self.x)))
        parts = _COLUMN_PARTS[what].items()
        slopes = [factor * self._dual[name].all_slopes[:, pose, sample] for name, factor in parts]
        return np.asarray(np.moveaxis(sum(slopes[1:], slopes[0]), 0, -1))


def respond(variables: Variables, x: FloatArray, poses: FloatArray) -> Response | None:
    """Return the response of a network at poses that begin with rest [m].

    None if it does not reach them all, has a beam of no length, or a pad in an obstacle at rest.
    """
    task, network = variables.task, variables.build(x)
    if has_vanished_beam(network) or has_pad_inside(network):
        return None
    try:
        path = trace(network, Displacement(task.driven, task.direction, poses), SEARCH_CONTROL)
    except CfmError:
        return None
    if path.status is not PathStatus.COMPLETE:
        return None
    return Response(variables, x.copy(), path)


MANY_POSES = 241  # from rest to the end of the window: of a travel of 13.6 mm one every 0.06 mm
_PLACES_PER_POSE = 8  # places of the interpolated force from pose to pose
_CLOSE_CONTROL = Control(tolerance=1e-7, branch="stop")


@dataclass(frozen=True)
class CloseView:
    """Force of the mechanism [N] and largest stress [Pa] at even poses from rest to the end of the window [m]."""

    at: FloatArray
    force: FloatArray
    stress: FloatArray
    # curve, layers: force [N] that is to be followed, by the displacement [m] of so many layers; the force is divided
    # by it, as it is in the search
    curve: TargetCurve | None = None
    layers: int = 1

    @cached_property
    def _between(self) -> tuple[FloatArray, FloatArray]:
        """Displacements and forces between the poses, too."""
        from scipy.interpolate import CubicSpline

        fine = np.linspace(self.at[0], self.at[-1], _PLACES_PER_POSE * (len(self.at) - 1) + 1)
        force = CubicSpline(self.at, self.force)(fine)
        if self.curve is None:
            return fine, force
        with np.errstate(divide="ignore", invalid="ignore"):  # outside the window the curve may be zero
            return fine, force / self.curve.evaluate(fine * self.layers)

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


def view_closely(task: Task, network: Network) -> CloseView | None:
    """Return a network at many poses; None if it does not reach the end, or loses stability on the way."""
    at = np.linspace(0.0, task.window[1], MANY_POSES)
    try:
        path = trace(network, Displacement(task.driven, task.direction, at), _CLOSE_CONTROL)
    except CfmError:
        return None
    if path.status is not PathStatus.COMPLETE:
        return None
    keep = path.at_requested
    stress = path.peak_stress(axial=task.total_stress).value[keep]
    return CloseView(at, task.force(path)[keep], stress, task.shape, task.layers)
