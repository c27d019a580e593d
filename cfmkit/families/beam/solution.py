"""Solution of a beam mechanism: effort, stress, gaps, stability, frequencies along its path; columns of nodes, beams.

Columns are those that `analysis.outputs` asks for, of beams and of solids alike, and forces. Every other file of this
family may import these types.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import Named, Several, ShortRepr, distinct, read_only
from cfmkit.curves import Column
from cfmkit.elastica.model.contact import BeamOnBeam, NodeOnBeam
from cfmkit.elastica.results.between_loads import interpolate_loads
from cfmkit.elastica.results.between_points import interpolate_path
from cfmkit.elastica.results.curling_stiffening import HinderedCurling, hindered_curling
from cfmkit.elastica.results.folding_path_between_points import interpolate_folding_path
from cfmkit.elastica.results.member_efforts import effort_error, largest_member_efforts
from cfmkit.elastica.results.path import most_stressed
from cfmkit.families.beam.constant_force_range_and_extremes import AlongMotion
from cfmkit.families.beam.network_from_spec import Assembly, node_place, thickest_of
from cfmkit.families.beam.strips_and_gaps import BeamGap, smallest_gap
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.elastica.results.folding_path_between_points import AlongTheWay
    from cfmkit.elastica.vibration import Frequencies
    from cfmkit.families.beam.spec import BeamSpec, Outputs

    Read = Callable[[str], FloatArray]  # from a name to three values at each of n points, (n, 3)
    LazyColumns = dict[str, Callable[[], Column]]


_DISPLACEMENT_RTOL = 1e-15
"""Share of the largest displacement: a few units in the last place, as of the cosine of 90 deg."""
_N_POSES = 7
AT_CORNER = 1e-9  # share of the travel within which a place is that of a corner
_N_FLUTTER_MODES = 4  # modes among which two may meet: it is the lowest ones that do


@dataclass(frozen=True, eq=False, repr=False)
class Solution(ShortRepr):
    """A solved mechanism, as checks, scalar values and pictures need it."""

    assembly: Assembly  # the network and what is done to it
    path: Path  # its equilibria
    # (n,) which points of the path make the curve: those requested, or all where the path is followed through folds
    keep: Any
    ends: Any = ()  # (m,) points of the path at which windows end between two points of the curve
    back: Solution | None = None  # the way back from the end, which friction makes another one

    @property
    def spec(self) -> BeamSpec:
        """The specification."""
        return self.assembly.spec

    @cached_property
    def motion(self) -> FloatArray:
        """Displacement or rotation of the driven node along the drive [m or rad]."""
        drive = self.spec.mechanism.drive
        if drive.by_motion:
            return read_only(self.path.drive[self.keep])
        moved = self.path.motion(self.assembly.driven)[self.keep]
        if drive.turns:
            return read_only(moved[:, 2])
        angle = self.assembly.direction
        along = moved[:, 0] * np.cos(angle) + moved[:, 1] * np.sin(angle)
        return read_only(np.where(np.abs(along) > _DISPLACEMENT_RTOL * np.abs(along).max(initial=0.0), along, 0.0))

    def describe_motion(self, motion: float) -> str:
        """Return a motion [m or rad] as a user reads it."""
        return format_short(motion, self.spec.motion)

    @cached_property
    def model_between_points(self) -> BetweenPoints | None:
        """The equilibria between the points of the path; None of paths whose motion turns back."""
        drive, axial = self.spec.mechanism.drive, self.spec.stress == "total"
        unit, allowed = self.assembly.effort_unit, self.assembly.allowable_stress
        if not drive.by_motion:
            along = None if drive.turns else self.assembly.direction
            return interpolate_loads(self.path, self.assembly.driven, along, unit, axial, allowed)
        return interpolate_path(self.path, unit, axial, allowed)

    @cached_property
    def curling(self) -> HinderedCurling:
        """By what share beams that are solved as narrow ones are too soft."""
        return hindered_curling(self.path)

    @cached_property
    def along(self) -> AlongMotion:
        """The curve along its motion."""
        return AlongMotion(self)

    @cached_property
    def winding(self) -> AlongTheWay | None:
        """The equilibria at every place of the way of a path whose motion turns back."""
        if self.model_between_points is not None:
            return None
        return interpolate_folding_path(self.path, self.replace_path)

    @cached_property
    def with_ends(self) -> Solution:
        """The same with the ends of windows among the points of the curve."""
        keep = distinct(np.array([*self.keep, *self.ends], np.int64))
        return self if len(keep) == len(self.keep) else replace(self, keep=read_only(keep, np.int64), ends=())

    @cached_property
    def effort(self) -> FloatArray:
        """Force [N] or torque [N m] of all copies; none where the tolerance is not reached."""
        effort = self.path.effort if self.spec.mechanism.drive.by_motion else self.path.drive
        return read_only(np.where(self.accurate, self.assembly.effort_unit * effort[self.keep], np.nan))

    @cached_property
    def effort_error(self) -> float | None:
        """Numerical error of the effort [N or N m]; None under a load, which is the effort itself."""
        if not self.spec.mechanism.drive.by_motion:
            return None
        return self.assembly.effort_unit * effort_error(self.path, self.spec.analysis.tolerance)

    def part_efforts(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest effort of one beam or spring of one copy at places of the motion of any shape [N or N m].

        Where the path turns back, between its points, and of several states at one place the largest.
        """
        if self.model_between_points is not None:
            return self._part_efforts_at(np.ravel(places)).reshape(np.shape(places))
        motion, efforts = self.with_ends.motion, self.with_ends.largest_member_efforts
        low, high = np.minimum(motion[1:], motion[:-1]), np.maximum(motion[1:], motion[:-1])
        at = np.clip(places, low.min(), high.max())[:, None]
        share = np.clip((at - motion[:-1]) / np.where(high > low, np.diff(motion), 1.0), 0.0, 1.0)
        between = (1.0 - share) * efforts[:-1] + share * efforts[1:]
        return np.asarray(np.where((at >= low) & (at <= high), between, 0.0).max(axis=1))

    def _part_efforts_at(self, places: FloatArray) -> FloatArray:
        assert self.model_between_points is not None
        efforts, corner_width = self._solved_part_efforts(places), AT_CORNER * float(np.ptp(self.motion))
        for corner, *sides in self.model_between_points.beside_corners[:, [1, 0, 2]].tolist():
            at_corner = np.abs(places - corner) <= corner_width
            if at_corner.any():  # there are two directions: along one it may be unbounded, along the other it goes on
                steps = np.array([side - corner for side in sides if side != corner])
                first, second = (self._solved_part_efforts(corner + count * steps) for count in (1, 2))
                efforts[at_corner] = (2 * first - second)[np.where(np.isfinite(first), first, np.inf).argmin()]
        return efforts

    def _solved_part_efforts(self, places: FloatArray) -> FloatArray:
        assert self.model_between_points is not None
        if not len(places):  # sides of beams that touch have no arrays of no states
            return np.empty(0)
        path = self.model_between_points.solve_at(places)
        return np.where(path.accurate, self.replace_path(path).largest_member_efforts, np.nan)

    def replace_path(self, path: Path) -> Solution:
        """Return the solution with another path, all of whose points make the curve."""
        return replace(self, path=path, keep=np.arange(len(path)), ends=())

    @cached_property
    def largest_member_efforts(self) -> FloatArray:
        """Largest effort of one beam or spring of one copy at every point of the curve [N or N m]."""
        return read_only(largest_member_efforts(self.path, self.keep, lambda path: self.replace_path(path).motion))

    @cached_property
    def accurate(self) -> Any:
        """Whether each point reaches the tolerance."""
        return read_only(np.broadcast_to(self.path.accurate, (len(self.path),))[self.keep], np.bool_)

    @cached_property
    def stresses(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Of each beam, the largest stress [Pa] and its place, at every point of the curve."""
        axial, keep = self.spec.stress == "total", self.keep
        rows = zip(self.path.network.beams, *self.path.beam_stresses(axial), strict=True)
        return Named({name: Several((value[keep], place[keep])) for name, value, place in rows})

    @cached_property
    def stress(self) -> FloatArray:
        """The largest stress at every point of the curve [Pa]."""
        largest = np.max([value for value, _ in self.stresses.values()], axis=0)
        return read_only(np.where(self.accurate, largest, np.nan))

    @cached_property
    def stress_at(self) -> Several[Any]:
        """The beam with the largest stress at every point of the curve, and the place on it."""
        values, places = (np.array(rows) for rows in zip(*self.stresses.values(), strict=True))
        best, pick = most_stressed(values, places), np.arange(len(self.keep))
        return Several((read_only(np.array(list(self.stresses))[best], np.str_), read_only(places[best, pick])))

    @cached_property
    def stable(self) -> Any:
        """Whether each point is a stable equilibrium that reaches the tolerance."""
        return read_only(self.stable_equilibrium & self.accurate, np.bool_)

    @cached_property
    def stable_equilibrium(self) -> Any:
        """Whether the equilibrium at each point is stable, accurate or not.

        Under loads that turn with their node all motions decide where masses are known, else the path's count.
        """
        frequencies = self.frequencies if self.follows else None
        stable = self.path.stable[self.keep] if frequencies is None else ~(frequencies.flutters | frequencies.diverges)
        return read_only(stable, np.bool_)

    @cached_property
    def follows(self) -> bool:
        """Whether a load turns with its node: stability may then be lost by flutter."""
        return self.path.follows

    @cached_property
    def frequencies(self) -> Frequencies | None:
        """Natural frequencies about every point of the curve; None if none are requested and nothing can flutter."""
        masses = self.assembly.masses()
        count = self.spec.analysis.modes or (_N_FLUTTER_MODES if self.follows else 0)
        if masses is None or not count or not len(self.keep):
            return None
        from cfmkit.elastica.vibration import frequencies

        return frequencies(self.path, masses, count, self.keep, self.assembly.hold())

    @cached_property
    def cross_stiffness(self) -> FloatArray:
        """Stiffness of the driven node across the drive at every point of the curve, of all copies [N/m].

        nan where nothing gives way, where the tolerance is not reached, and of drives that turn.
        """
        if self.spec.mechanism.drive.turns or not len(self.keep):
            return read_only(np.full(len(self.keep), np.nan))
        from cfmkit.elastica.results.cross_stiffness import cross_stiffness

        stiffness = cross_stiffness(self.path, self.assembly.driven, self.assembly.direction, self.keep)
        is_known = self.accurate & np.isfinite(stiffness)
        return read_only(np.where(is_known, self.assembly.parallel * stiffness, np.nan))

    @cached_property
    def gaps(self) -> tuple[BeamGap | None, BeamGap | None]:
        """The smallest gap between two beams before any load, and of some places of the curve [m]; None without one."""
        if len(self.keep) < 2:
            return None, None
        gaps_of_poses = [self._least_gap(int(self.keep[pose])) for pose in choose_points(len(self.keep), _N_POSES)]
        return gaps_of_poses[0], min((gap for gap in gaps_of_poses if gap is not None), default=None)

    def _least_gap(self, point: int) -> BeamGap | None:
        network = self.path.network
        lines = {name: self.path.shape(name, point) for name in network.beams}
        halves = {name: 0.5 * thickest_of(beam.section) for name, beam in network.beams.items()}
        if (mirror := self.assembly.mirror) is not None:
            lines |= {f"{name}'": mirror.reflect(line) for name, line in lines.items()}
        return smallest_gap(lines, halves, pairs_in_contact(network))

    def beam_force(self, beam: str) -> FloatArray:
        """Return force and moment that a beam exerts on its last node, (n, 3) [N, N, N m], of one copy."""
        return read_only(-self.path.end_force(beam, 1)[self.keep])


def choose_points(count: int, most: int) -> NDArray[Any]:
    """Return at most so many of the points of a curve, evenly, its ends included; none if it has none."""
    return distinct(np.linspace(0, count - 1, most).astype(int)) if count else np.zeros(0, int)


def node_at(path: Path, node: str, point: int | None = None) -> FloatArray:
    """Return where a node is at a point of a path, or before any load (2,) [m]."""
    at = node_place(path.network, node)
    return at if point is None else at + path.motion(node)[point, :2]


def pairs_in_contact(network: Network) -> set[frozenset[str]]:
    """Return the pairs of beams whose contact is solved for, with their sides or the pad of a node at an end."""
    pads = [contact for contact in network.contacts if isinstance(contact, NodeOnBeam)]
    ends = {(name, node) for name, beam in network.beams.items() for node in (beam.start, beam.end)}
    at_pads = {frozenset((name, pad.beam)) for pad in pads for name, node in ends if node == pad.node}
    return at_pads | {frozenset((item.beam, item.partner)) for item in network.contacts if isinstance(item, BeamOnBeam)}


MOTION_DIMENSIONS = {"x": "length", "y": "length", "rotation": "angle"}
REACTION_DIMENSIONS = {"fx": "force", "fy": "force", "m": "torque"}
END_FORCES = {"force_x": "force", "force_y": "force", "moment": "torque"}
"""What three columns of a node or a beam are called after its name, and their dimensions."""


def columns_of(name: str, read: Read, endings: Mapping[str, str]) -> LazyColumns:
    """Return three columns of a node or a beam, each as what computes it."""

    def column(k: int, dimension: str) -> Column:
        return Column(read(name)[:, k], dimension)

    return {f"{name}_{end}": partial(column, k, dimension) for k, (end, dimension) in enumerate(endings.items())}


def output_columns(
    outputs: Outputs,
    motion: Read,  # from a node to its x, y [m] and rotation [rad] at the points of the curve, (n, 3)
    # from a node to the force x, y [N] and the moment [N m] that hold it, of support and of a drive by a motion, for
    # one copy, (n, 3)
    reaction: Read,
) -> LazyColumns:
    """Return the columns of the nodes that are named, each as what computes it."""
    columns: LazyColumns = {}
    for name in outputs.nodes:
        columns |= columns_of(name, motion, MOTION_DIMENSIONS)
    for name in outputs.reactions:
        columns |= columns_of(name, reaction, REACTION_DIMENSIONS)
    return columns
