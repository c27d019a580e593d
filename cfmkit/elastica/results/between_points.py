"""A traced path at every place of its drive: equilibria between points and corners, extremes of effort and stress.

What is stated of a curve must not depend on how many points it has. An equilibrium between two points of the path is
solved from the polynomial through the nearest four, on the branch that these are on. A stress is solved at its
extremes and where it passes the allowable one; elsewhere the polynomial is taken, for each beam by itself. At a
bifurcation, where the path has a corner, everything is parted.

Under a load the place is the driven node's motion (`between_loads`).

At a bifurcation a path changes to another branch, and its curves have a kink: nothing may be interpolated across one.
On the branch that parts from a path the change of shape grows with the root of the drive from there on: in that root it
is smooth.

Assumes: a path on which the drive, or under a load the motion, does not turn back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import Several, ShortRepr, distinct, read_only
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.results.stress_extremes import insert_knots, largest_inside, solve_extremes, solve_passes
from cfmkit.numerics.interpolation import crossing, inner_extremes, values_at

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.equations import NumpyEquations, SolvedStates
    from cfmkit.elastica.results.path import EquilibriumPath
    from cfmkit.elastica.results.stress_extremes import Knots


@dataclass(frozen=True, eq=False)
class Corner:
    """A bifurcation between two points of a path."""

    drive: float  # where, dimensionless
    y: FloatArray  # (unknowns,) the equilibrium there
    # below, above: whether a branch that parts from the other one is at smaller, and at larger values of the drive
    below: bool
    above: bool


@dataclass(frozen=True, eq=False)
class SmoothStretch:
    """A path between two corners, or up to an end of the path: None."""

    low: Corner | None
    high: Corner | None

    @property
    def _roots(self) -> tuple[float | None, float | None]:
        """The ends [dimensionless] from which the change of shape grows with a root."""
        opens = self.low.drive if self.low is not None and self.low.above else None
        return opens, self.high.drive if self.high is not None and self.high.below else None

    def smooth(self, drive: FloatArray) -> FloatArray:
        """Return the variable in which the path is smooth, increasing with the drive: the drive where no root is."""
        low, high = self._roots
        if low is not None and high is not None:
            return np.asarray(np.arccos(1.0 - 2.0 * np.clip((drive - low) / (high - low), 0.0, 1.0)))
        if low is not None:
            return np.sqrt(np.maximum(drive - low, 0.0))
        if high is not None:
            return np.asarray(-np.sqrt(np.maximum(high - drive, 0.0)))
        return drive

    def drive(self, smooth: FloatArray) -> FloatArray:
        """Return the drive where the smooth variable has some values."""
        low, high = self._roots
        if low is not None and high is not None:
            return np.asarray(low + 0.5 * (high - low) * (1.0 - np.cos(smooth)))
        if low is not None:
            return np.asarray(low + smooth**2)
        if high is not None:
            return np.asarray(high - smooth**2)
        return smooth

    def with_ends(
        self, drive: FloatArray, values: FloatArray, at_low: FloatArray | None, at_high: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return points on the stretch and values there, (n, k), with those at the corners, which may be points.

        Where the path ends at a corner there may be no point besides it: `drive` is then empty.
        """
        if self.low is not None and at_low is not None and self.low.drive not in drive[:1]:
            drive, values = np.append(self.low.drive, drive), np.vstack([at_low, values])
        if self.high is not None and at_high is not None and self.high.drive not in drive[-1:]:
            drive, values = np.append(drive, self.high.drive), np.vstack([values, at_high])
        return drive, values


MIN_PATH_POINTS = 4  # points of a path below which nothing is said of what lies between them: a cubic needs four
N_EXTREME_ROUNDS = 3
"""Extremes are solved for, and looked for again with what was found: the third moves them by less than rounding."""
MAX_RELATIVE_STRAY, MIN_STRAY_DISTANCE = 0.5, 1e-3
"""Largest distance of a pose from its first guess: as a share of the change between the two points around it, and at
least [rad or mean beam lengths]. Beyond that another branch was found."""
CORNER_OFFSET = 1e-6
"""Share of the drive's range by which the knots next to a corner are beside it: no cubic goes across it but there."""
CORNER_SHARES = (0.1, 0.01, 0.001)
"""Shares of the way from a corner to the next point: equilibria are solved for there, to extrapolate to the corner."""
AT_POINT = 1e-10  # share of the drive's range within which a bifurcation is at a point: it is not located better
NEXT_TO_POINT = 1e-7
"""The same for a point of the path that goes through. So near, Newton's method leaves more of the critical mode than
the path moves: no polynomial may run through both. On the branch that parts it moves with the root of the distance."""
SHARE_OF_STEP = 1e-3  # such a bifurcation is also nearer to the point than this share of the step to the one before
PLACE_RTOL = 1e-12  # share of the drive's range within which a place is that of a point


def interpolate_path(
    path: EquilibriumPath,  # under a displacement or a rotation
    unit: float = 1.0,  # what the effort is multiplied by: parts side by side
    axial: bool = True,  # whether the stress has its axial part
    allowed: float | None = None,  # stress [Pa]; where it is passed is solved for
) -> BetweenPoints | None:
    """Return a path at every place of its drive; None of one that turns back, is too short, or misses its tolerance."""
    if isinstance(path.load_case, Loading) or len(path) < MIN_PATH_POINTS or not np.all(path.accurate):
        return None
    steps = np.diff(path.at.drive)
    if not ((steps > 0).all() or (steps < 0).all()):
        return None
    return BetweenPoints(path, unit, axial, allowed)


@dataclass(frozen=True, eq=False, repr=False)
class BetweenPoints(ShortRepr):
    """The effort and the stress of a path at every place (a `cfmkit.results.ClosedForm`)."""

    path: EquilibriumPath  # whose drive never turns back
    unit: float  # what its effort is multiplied by
    axial: bool  # whether the stress has its axial part
    allowed: float | None  # stress that is solved for where it is passed [Pa]

    @cached_property
    def _order(self) -> Any:
        """The points of the path in the order of an increasing drive."""
        return slice(None) if self._motion[-1] > self._motion[0] else slice(None, None, -1)

    @property
    def _motion(self) -> FloatArray:
        """The place of every point of the path [m or rad]."""
        return self.path.drive

    @property
    def _scale(self) -> float:
        """The unit of dimensionless places [m or rad]."""
        return self.path.mesh.scales.drive

    @property
    def places(self) -> FloatArray:
        """The points of the path, and extremes between them, increasing [m or rad]."""
        return self.knots[0]

    @cached_property
    def own_points(self) -> FloatArray:
        """Places of the points of the path, increasing [m or rad]."""
        return read_only(self._motion[self._order])

    @cached_property
    def point_efforts(self) -> FloatArray:
        """The effort at every point, by increasing places [N or N m]."""
        return read_only(self.unit * self._effort_on(self.path)[self._order])

    def _effort_on(self, path: EquilibriumPath) -> FloatArray:
        """Return the effort at every point of a path [N or N m]."""
        return path.effort

    @cached_property
    def peaks(self) -> FloatArray:
        """Places of extremes of the effort between two points, and of corners, (m,) [m or rad]."""
        beside = {*self.beside_corners[:, [0, 2]].ravel().tolist()}
        return read_only(sorted({*self.knots[0].tolist()} - {*self.own_points.tolist()} - beside))

    @cached_property
    def corners(self) -> FloatArray:
        """Places at which the path changes to another branch, so that the effort has a kink, (m,) [m or rad]."""
        return read_only(self._scale * np.array([corner.drive for corner in self._corners.values()]))

    @cached_property
    def beside_corners(self) -> FloatArray:
        """Of each corner a place just before it, the corner, and one behind, or itself at an end, (m, 3) [m or rad]."""
        places, points = np.empty((len(self.corners), 3)), self.own_points
        for number, corner in enumerate(self.corners):
            before, behind = points[points < corner][-1:], points[points > corner][:1]
            room = 0.5 * float(np.abs(np.concatenate([before, behind]) - corner).min())
            aside = min(CORNER_OFFSET * (points[-1] - points[0]), room)
            places[number] = corner - aside * len(before), corner, corner + aside * len(behind)
        return places

    @cached_property
    def knots(self) -> Several[FloatArray]:
        """The points of the path, its corners, and extremes between: places, increasing, and efforts, (n,) each."""
        x, effort = self.own_points, self.point_efforts
        if len(self.corners):
            beside = np.setdiff1d(self.beside_corners, x)
            x, effort = insert_knots(x, effort, beside, self.effort("", beside))
        for _ in range(N_EXTREME_ROUNDS):
            more = inner_extremes(x, effort)
            for low, _, high in self.beside_corners.tolist():
                more = more[(more < low) | (more > high)]
            if not len(more):
                break
            x, effort = insert_knots(x, effort, more, self.effort("", more))
        return Several((read_only(x), read_only(effort)))

    @cached_property
    def _stresses(self) -> tuple[tuple[SmoothStretch, tuple[Knots, ...]], ...]:
        """Of each stretch between corners, and there of each beam, smooth variables and stresses.

        They are those of `_extremes`, and where the allowable stress is passed.
        """
        if self.allowed is None:
            return self._extremes
        numbers, stretches = self._stretch_numbers, []
        for number, (stretch, knots) in enumerate(self._extremes):
            points = stretch.smooth(self.own_drive[numbers == number])
            solve = partial(self._solved_stress, stretch)
            stretches.append((stretch, solve_passes(knots, points, solve, self.allowed)))
        return tuple(stretches)

    @cached_property
    def _stretch_numbers(self) -> Any:
        """Number of the stretch between corners that each point is on."""
        return np.searchsorted([corner.drive for corner in self._corners.values()], self.own_drive)

    @cached_property
    def _extremes(self) -> tuple[tuple[SmoothStretch, tuple[Knots, ...]], ...]:
        """Of each stretch, and there of each beam, stresses at the points and corners and at extremes between them."""
        corners, numbers = list(self._corners.values()), self._stretch_numbers
        at_points = self.path.beam_stresses(self.axial)[0][:, self._order]
        at_corners = np.empty((0, len(at_points)))
        if corners:
            corner_path = self.solve_at(self.corners)
            at_corners = corner_path.beam_stresses(self.axial)[0].T
        extremes = []
        for number in range(len(corners) + 1):
            low, high = (corners[k] if 0 <= k < len(corners) else None for k in (number - 1, number))
            stretch, of_stretch = SmoothStretch(low, high), numbers == number
            ends = None if low is None else at_corners[number - 1], None if high is None else at_corners[number]
            x, rows = stretch.with_ends(self.own_drive[of_stretch], at_points[:, of_stretch].T, *ends)
            solve = partial(self._solved_stress, stretch)
            extremes.append((stretch, solve_extremes(stretch.smooth(x), rows.T, solve)))
        return tuple(extremes)

    def _solved_stress(self, stretch: SmoothStretch, t: FloatArray) -> tuple[FloatArray, Any]:
        """Return the stress of each beam where the smooth variable has some values, and where it was solved."""
        solved = self.solve_at(self._scale * stretch.drive(t))
        return solved.beam_stresses(self.axial)[0], solved.accurate

    def effort(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the effort at places of any shape [N or N m]; next to a bifurcation between the points beside it."""
        flat = np.ravel(places)
        solved = self._solved.get(flat.tobytes())
        if solved is None:
            states = self.solve_at(flat)
            effort = self._effort_on(states)
            solved = np.where(states.accurate, self.unit * effort, np.interp(flat, self.own_points, self.point_efforts))
            self._solved[flat.tobytes()] = solved
        return np.array(solved.reshape(np.shape(places)))

    @cached_property
    def _solved(self) -> dict[bytes, FloatArray]:
        """Efforts at places that were requested: page, files and requirements each ask for those of the metrics."""
        return {}

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress of all beams at places of any shape [Pa]."""
        flat = np.ravel(places)
        wanted, largest = flat / self._scale, np.full(len(flat), np.nan)
        number = np.searchsorted([corner.drive for corner in self._corners.values()], wanted)
        for index, (stretch, beams) in enumerate(self._stresses):
            of_stretch = number == index
            t = stretch.smooth(wanted[of_stretch])
            largest[of_stretch] = np.max([values_at(x, stress, t) for x, stress in beams], axis=0)
        return np.asarray(largest.reshape(np.shape(places)))

    def stress_reaches(self, level: float, sense: float = 1.0) -> float | None:
        """Return the first place, in the sense of travel (1 or -1), at which a beam's stress is a level [m or rad]."""
        stretches = self._stresses if sense > 0 else self._stresses[::-1]
        for stretch, beams in stretches:
            crossings = [crossing(*(pair if sense > 0 else (-pair[0][::-1], pair[1][::-1])), level) for pair in beams]
            if reached := [sense * place for place in crossings if place is not None]:
                places = self._scale * stretch.drive(np.array(reached))
                return float(sense * (sense * places).min())
        return None

    def largest_stress(self, branch: str, low: float, high: float, /) -> float | None:
        """Return the largest stress in a window [Pa]; None of a path with corners."""
        if len(self.corners):
            return None
        ends = np.array([low, high])
        end_states = self.solve_at(ends)
        solved = end_states.beam_stresses(self.axial)[0].max(axis=0)
        if not end_states.accurate.all():
            solved = np.where(end_states.accurate, solved, self.stress(branch, ends))
        inner = largest_inside(self.own_drive, self._point_stresses, self.solve_stress, ends / self._scale)
        return float(max(inner, *solved))

    def _point_stresses(self, points: Any) -> FloatArray:
        """Return the stress of each beam at some of the points in their order, (b, n) [Pa]."""
        known_stresses = self.path.known_beam_stresses(self.axial)
        if known_stresses is None:
            return self.path.take(self._numbers[points]).beam_stresses(self.axial)[0]
        return known_stresses[:, self._order][:, points]

    def solve_stress(self, drive: FloatArray) -> tuple[FloatArray, Any]:
        """Return the stress of each beam at dimensionless places of a path without corners, and where it was solved."""
        return self._solved_stress(SmoothStretch(None, None), drive)

    def solve_at(self, places: FloatArray) -> EquilibriumPath:
        """Return the equilibria at places (n,) in the range of the path; `accurate` is False where none was found."""
        drive = self.own_drive
        wanted = np.clip(places / self._scale, drive[0], drive[-1])
        left = np.clip(np.searchsorted(drive, wanted, side="right") - 1, 0, len(drive) - 2)
        nearest = self._nearest(wanted, left)
        y = self._guesses(wanted, nearest)
        # what friction does between two points is what it does at the later one: it changes at the earlier one, if any
        later = left + (self._numbers[left + 1] > self._numbers[left])
        y[:, self._friction_slots] = self.own_unknowns[later][:, self._friction_slots]
        loads = self._loads[nearest]
        is_known = np.abs(wanted - drive[nearest]) <= PLACE_RTOL * (drive[-1] - drive[0])
        y[is_known] = self.own_unknowns[nearest[is_known]]
        for corner in self._corners.values():
            at_corner = np.abs(wanted - corner.drive) <= PLACE_RTOL * (drive[-1] - drive[0])
            y[at_corner], loads[at_corner], is_known = corner.y, corner.drive, is_known | at_corner
        is_solved, changes = is_known.copy(), self._poses(self.own_unknowns[left + 1] - self.own_unknowns[left])
        asked = np.flatnonzero(~is_known)
        if len(asked):
            spots, ways = self._solve_places(y[asked], wanted[asked], loads[asked])
            alike = (spots.unstable[:, None] == self._find_allowed_counts(nearest[asked], left[asked])).any(axis=1)
            moved = self._poses(spots.free - y[asked])
            good = (
                spots.converged & alike & (moved <= np.maximum(MIN_STRAY_DISTANCE, MAX_RELATIVE_STRAY * changes[asked]))
            )
            chosen = asked[good]
            y[chosen], loads[chosen], is_solved[chosen] = spots.free[good], ways[good], True
        return self.path.with_states(self._numbers[nearest], y, loads, is_solved)

    def _solve_places(self, y: FloatArray, wanted: FloatArray, _loads: FloatArray) -> tuple[SolvedStates, FloatArray]:
        """Return the equilibria at dimensionless places and their drives; `_loads`: the drive at the nearest points."""
        return self._equations.solve_each(y, wanted), wanted

    @cached_property
    def _friction_slots(self) -> Any:
        """Which free unknowns say what friction does."""
        contacts = [contact for contact in self.path.mesh.contacts if contact.rub >= 0]
        said = [unknown for contact in contacts for unknown in (contact.flag, contact.anchor)]
        return np.flatnonzero(np.isin(self.path.mesh.free, said)) if said else np.empty(0, np.int64)

    @cached_property
    def _equations(self) -> NumpyEquations:
        return equations(self.path.mesh)

    def _poses(self, changes: FloatArray) -> FloatArray:
        """Return the largest change of a motion in each of some changes of the unknowns, (n,)."""
        mesh = self.path.mesh
        return np.asarray(np.abs(changes[:, mesh.free < mesh.n_motions]).max(axis=1, initial=0.0))

    def _find_allowed_counts(self, nearest: Any, _left: Any) -> Any:
        """Return how many unstable directions equilibria may have, (n, k); `_left`: the points before them."""
        return self._unstable[nearest][:, None]

    @cached_property
    def _numbers(self) -> Any:
        return np.arange(len(self.path))[self._order]

    @cached_property
    def _loads(self) -> FloatArray:
        return np.asarray(self.path.at.drive[self._order])

    @cached_property
    def own_drive(self) -> FloatArray:
        """Dimensionless places of the points, increasing."""
        return self._loads

    @cached_property
    def own_unknowns(self) -> FloatArray:
        """Free unknowns at every point, by increasing places, (n, free)."""
        return np.asarray(self.path.free[self._order])

    @cached_property
    def _unstable(self) -> Any:
        counts = np.array(self.path.unstable[self._order])
        counts[self._contacts] = counts[self._contacts + 1]  # such a point begins a stretch
        return counts

    @cached_property
    def _stretch(self) -> Any:
        """The number of the smooth stretch that each point is on: they are parted by bifurcations, (n,)."""
        parted = np.zeros(len(self.own_drive), dtype=bool)
        branch = self.path.branch[self._order]
        parted[1:] = (branch[1:] != branch[:-1]) | (self._unstable[1:] != self._unstable[:-1])
        parted[self._contacts] = True
        return np.cumsum(parted)

    @cached_property
    def _contacts(self) -> Any:
        """Numbers of the points at which a contact begins or ends, but for both ends of the path."""
        changes = np.flatnonzero(self.path.changes_contact[self._order])
        return changes[(changes > 0) & (changes < len(self.path) - 1)]

    @cached_property
    def _events(self) -> FloatArray:
        """Bifurcations of the path and changes of contacts, dimensionless, increasing."""
        places = [event.drive / self._scale for event in self.path.events if event.kind == "bifurcation"]
        return np.sort([*places, *self.own_drive[self._contacts].tolist()])

    def _nearest(self, wanted: FloatArray, left: Any) -> Any:
        """Return the nearest point of the stretch that each value of the drive is on; `left`: the points before."""
        drive, events = self.own_drive, self._events
        nearest = left + (wanted - drive[left] > drive[left + 1] - wanted)
        for number in np.flatnonzero(self._stretch[left] != self._stretch[left + 1]).tolist():
            inner_events = events[(events >= drive[left[number]]) & (events <= drive[left[number] + 1])]
            if len(inner_events):
                nearest[number] = left[number] + bool(wanted[number] > inner_events[0])
        return nearest

    @cached_property
    def _corners(self) -> dict[int, Corner]:
        """The corners of the path by the number of the stretch behind each, increasing."""
        branch, stretches, drive = self.path.branch[self._order], self._stretch, self.own_drive
        names, corners = list(dict.fromkeys(self.path.branch.tolist())), {}
        width = float(drive[-1] - drive[0])
        slack = NEXT_TO_POINT * width
        for right in (np.flatnonzero(np.diff(stretches)) + 1).tolist():
            if right in self._contacts:
                corners[int(stretches[right])] = Corner(
                    float(drive[right]), np.asarray(self.own_unknowns[right]), False, False
                )
                continue
            before, behind = drive[right - 1], drive[right]
            inner_events = self._events[(self._events >= before - slack) & (self._events <= behind + slack)]
            if len(inner_events) != 1:
                continue
            ranks = [names.index(branch[right - 1]), names.index(branch[right])]
            below, above = ranks[0] > ranks[1], ranks[1] > ranks[0]  # a branch that parts is named after the other
            # a point beyond the bifurcation is still on its branch where the mode is less than rounding
            sides = (right - 1, inner_events[0] - before, below), (right, behind - inner_events[0], above)
            limits = [AT_POINT * width if parts else self._nearness(point, width) for point, _, parts in sides]
            at = next((side[0] for side, limit in zip(sides, limits, strict=True) if side[1] <= limit), None)
            place = float(inner_events[0] if at is None else drive[at])
            y = self._corner(place, right if below else right - 1) if at is None else np.asarray(self.own_unknowns[at])
            if y is not None:
                corners[int(stretches[right])] = Corner(place, y, below, above)
        return corners

    def _nearness(self, point: int, width: float) -> float:
        """Return the distance from a point of the path within which a bifurcation counts as at it, dimensionless."""
        neighbours = np.flatnonzero(self._stretch == self._stretch[point])
        steps = np.abs(self.own_drive[neighbours] - self.own_drive[point])
        step = float(steps[steps > 0].min(initial=np.inf)) if len(neighbours) > 1 else 0.0
        return max(AT_POINT * width, min(NEXT_TO_POINT * width, SHARE_OF_STEP * step))

    def _corner(self, place: float, point: int) -> FloatArray | None:
        """Return the equilibrium at a bifurcation from the stretch that a point next to it is on, which goes through.

        It is singular: ever nearer ones are solved for, and the polynomial taken on from there.
        """
        of_stretch, drive = np.flatnonzero(self._stretch == self._stretch[point]), self.own_drive
        x, y = drive[of_stretch], self.own_unknowns[of_stretch]
        for share in CORNER_SHARES:
            nearby = place + share * (drive[point] - place)
            spots, _ = self._solve_places(values_at(x, y, np.array([nearby])), np.array([nearby]), np.array([nearby]))
            beside = np.array([point])
            if not spots.converged[0] or spots.unstable[0] not in self._find_allowed_counts(beside, beside):
                if share == CORNER_SHARES[0]:
                    return None
                break  # of a bifurcation just behind the rest, the place is known less closely
            at = int(np.searchsorted(x, nearby))
            x, y = np.insert(x, at, nearby), np.insert(y, at, spots.free[0], axis=0)
        return np.asarray(values_at(x, y, np.array([place]))[0])

    def _guesses(self, wanted: FloatArray, nearest: Any) -> FloatArray:
        """Return the polynomials through up to four points of a stretch at values of the drive on it, (n, unknowns)."""
        guesses = np.empty((len(wanted), self.own_unknowns.shape[1]))
        for number in distinct(self._stretch[nearest]).tolist():
            of_stretch, requested = self._stretch == number, self._stretch[nearest] == number
            stretch = SmoothStretch(self._corners.get(number), self._corners.get(number + 1))
            ends = (None if corner is None else corner.y for corner in (stretch.low, stretch.high))
            x, y = stretch.with_ends(self.own_drive[of_stretch], self.own_unknowns[of_stretch], *ends)
            guesses[requested] = values_at(stretch.smooth(x), y, stretch.smooth(wanted[requested]))
        return guesses
