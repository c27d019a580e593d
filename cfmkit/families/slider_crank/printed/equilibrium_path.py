"""Equilibria of a chain (crank and coupler as beams) whose slider is pressed: from rest, or bent to the other side.

A nearly straight chain buckles like a column: within the first micrometres the force rises to a buckling load and
stays there. Ordinary steps from rest jump over that corner, onto a higher mode with ten times the force, so the first
step is a hundred-thousandth of the travel and every point must be stable. Two cases cannot be reached from rest: the
chain that is straight, or so nearly that rounding decides, and the branch to which a kinked chain does not go by
itself. Their equilibria are solved from those of a chain that is bowed, or kinked, to the requested side.

Beams are lines to the equations, which know nothing of contact: a slider that runs on the line of its anchor passes it.
So it is looked at afterwards where the chain crosses itself, or is pressed through its own anchor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import ShortRepr, read_only
from cfmkit.elastica import Control, Displacement, Path, PathStatus, trace
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.results.between_points import interpolate_path
from cfmkit.elastica.results.equilibria_near_known_path import solve_near_known_path
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import SLIDER_NODE, kink, mirror_points

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.numerics.continuation.problem import PathEquilibrium


ANALYSIS_TOLERANCE = 1e-7  # error of forces and positions, relative to the largest of the path
FIRST_STEP = 1e-5  # of the travel
STRAIGHT_OFFSET, DECISIVE_OFFSET = 1e-9, 2e-4
"""Offset of the crank pin, in lengths of the chain: below the first there is no kink, above the second it decides."""
KINK_OFFSET = 2e-3  # offset that a chain is given to send it to one side, in lengths of the chain
MIN_CURVE_POINTS = 2  # a curve has at least so many points
NEAR_LIMIT = 1e-12
"""Last step back towards the limit point of a branch, as a share of the travel at which the branch is known: the force
there goes with the root of the distance, and is right to 1e-6."""
SLOPE_STEP = 1e-4  # where the slope of the branch is taken, as a share of the travel at its first known point
MAX_PREDICTION_ERROR = 0.3
"""How far unknowns may be from their prediction in such a step, as a share of their change; else another branch."""
FRAME_OFFSET = 0.1  # offset beyond which it is a frame rather than a chain, and goes where its shape sends it


class PressingEnd(Enum):
    """End of pressing a chain."""

    COMPLETE = "every requested point is a stable equilibrium on the requested branch"
    LIMIT_POINT = "there is no equilibrium for a further displacement of the slider: a limit point of the travel"
    UNSTABLE = "stability is lost: the chain would jump"
    NOT_CONVERGED = "no step converged, or the tolerance was not reached"
    WRONG_BRANCH = "the chain bends to the side opposite to the requested one"
    CROSSES = "the chain crosses to the side opposite to the requested one"
    BLOCKED = "the chain meets its own anchor, or itself"
    STARTS_LATE = "this branch exists only beyond some travel"


@dataclass(frozen=True, repr=False)
class PressedChain(ShortRepr):
    """The equilibria of a pressed chain."""

    path: Path  # converged points only
    ending: PressingEnd  # why it ended, or that it is complete
    message: str  # one sentence with the place
    side: int = 0  # 1: the crank pin is to the left of the line from pivot to slider pin; -1: to its right

    @property
    def travel(self) -> FloatArray:
        """Slider travel at the requested points that were reached [m]."""
        travel: FloatArray = self.path.drive[self.path.at_requested]
        return travel

    @property
    def force(self) -> FloatArray:
        """Force against the travel there [N]."""
        force: FloatArray = self.path.effort[self.path.at_requested]
        return force


@dataclass(frozen=True, repr=False)
class Chain(ShortRepr):
    """A chain ready to be pressed."""

    points: FloatArray  # (k, 2) what the network is built on, from the clamped end to the slider [m]
    pins: FloatArray  # (3, 2) pivot, crank pin and slider pin [m]
    build: Callable[[FloatArray], Network]  # from such points to the network
    direction: float  # of the travel [rad]: pi where the slider moves towards smaller x
    knee: Callable[[Path, int], FloatArray]  # from a path and a point of it to where the crank pin is [m]

    @property
    def kink(self) -> float:
        """Distance of the crank pin from the line from pivot to slider pin [m]; positive: to its left."""
        return kink(self.pins)

    @property
    def side(self) -> int:
        """To which side the chain is kinked, +1 or -1; 0 where it is straight."""
        return int(np.sign(self.kink)) if abs(self.kink) > STRAIGHT_OFFSET * self.length else 0

    @property
    def length(self) -> float:
        """Distance of pivot and slider pin [m]."""
        return float(np.hypot(*(self.pins[2] - self.pins[0])))

    @property
    def reach(self) -> float:
        """Distance of the slider pin from the pivot with the chain pulled straight [m]."""
        return max(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in (self.pins, self.points))

    def _reach(self, travel: FloatArray) -> FloatArray:
        """Return the distance of slider pin and pivot after some travel [m]."""
        along = np.array([np.cos(self.direction), np.sin(self.direction)])
        distance: FloatArray = np.hypot(*(self.pins[2] - self.pins[0] + np.outer(travel, along)).T)
        return distance

    def press(
        self,
        travel: FloatArray,  # (n,): from the unloaded position, increasing [m]; may start with 0
        side: int = 0,  # 1, -1, or 0 for the side of the kink (left where there is none)
        tolerance: float = ANALYSIS_TOLERANCE,  # as in `cfmkit.elastica.Control`
    ) -> PressedChain:
        """Return the equilibria at travels on one side, that of the kink unless asked otherwise."""
        taut = np.flatnonzero(self._reach(travel) > (1.0 + 1e-9) * self.reach)
        if len(taut):
            until_taut = self.press(travel[: taut[0]] if taut[0] else np.zeros(1), side, tolerance)
            text = (
                f"the chain is pulled taut before a travel of {travel[taut[0]] * 1e3:.4g} mm is reached; it cannot "
                "follow beyond"
            )
            return (
                replace(until_taut, ending=PressingEnd.LIMIT_POINT, message=text)
                if until_taut.ending is PressingEnd.COMPLETE
                else until_taut
            )
        drive = Displacement(SLIDER_NODE, self.direction, travel)
        wanted = side or self.side or 1
        clear = abs(self.kink) > DECISIVE_OFFSET * self.length
        if wanted == self.side and clear:
            path = _trace(self.build(self.points), drive, tolerance)
            if path.status is PathStatus.COMPLETE:
                return self._classify_ending(path, wanted)
        is_other_side = clear and wanted != self.side
        helper = mirror_points(self.points, self.pins) if is_other_side else self._bend_to_side(wanted)
        return self._trace_from_helper(helper, drive, wanted, tolerance, is_other_side)

    def _bend_to_side(self, side: int) -> FloatArray:
        """Return the points with the crank pin moved a little to one side: a chain that cannot go the wrong way."""
        axis = (self.pins[2] - self.pins[0]) / self.length
        along = (self.points - self.pins[0]) @ axis
        knee = float((self.pins[1] - self.pins[0]) @ axis)
        hat = np.interp(along, [0.0, knee, self.length], [0.0, 1.0, 0.0])
        moved: FloatArray = self.points + np.outer(
            side * KINK_OFFSET * self.length * hat, np.array([-axis[1], axis[0]])
        )
        return moved

    def _trace_from_helper(
        self, helper: FloatArray, drive: Displacement, wanted: int, tolerance: float, is_other_side: bool
    ) -> PressedChain:
        """Return the equilibria nearest to those of a chain that is kinked to the side wanted.

        The branch to which the kink does not lead begins with a limit point: nothing before it, nor rest, is on it.
        """
        helper_path = _trace(self.build(helper), drive, tolerance)
        if helper_path.status is not PathStatus.COMPLETE:
            return self._classify_ending(helper_path, wanted, helped=True)
        path = solve_near_known_path(helper_path, self.build(self.points), drive)
        first = _first_complete_point(path, drive) if is_other_side else 0
        if is_other_side and 0 < first < len(drive.points):
            path = _start_at_limit_point(part_of(path, path.requested >= first), drive.points[:first])
            text = f"with its kink the other way the chain has an equilibrium only from {path.drive[0] * 1e3:.4g} mm on"
            return PressedChain(path, PressingEnd.STARTS_LATE, text, wanted)
        return self._classify_ending(path, wanted)

    def _classify_ending(self, path: Path, wanted: int, helped: bool = False) -> PressedChain:
        """Return the outcome with its ending: a curve that is not the one requested is never passed on as such."""
        ending, message = _ENDING_BY_STATUS.get(path.status, PressingEnd.NOT_CONVERGED), path.message
        if helped or not len(path.at_requested):
            ending = PressingEnd.NOT_CONVERGED if ending is PressingEnd.COMPLETE else ending
            return PressedChain(path, ending, message)
        sides = self._sides(path, wanted)
        side = int(sides[-1])
        stable = path.stable[path.at_requested]
        if ending is PressingEnd.COMPLETE and not stable.all():
            first = path.drive[path.at_requested][~stable][0]
            ending, message = PressingEnd.UNSTABLE, f"unstable from {first * 1e3:.4g} mm on"
        chain_like = abs(self.kink) <= FRAME_OFFSET * self.length
        if ending is PressingEnd.COMPLETE and side != wanted and (chain_like or wanted != self.side):
            return self._cut_before_crossing(path, sides, wanted)
        return PressedChain(path, ending, message, side)

    def _sides(self, path: Path, wanted: int) -> FloatArray:
        """Return to which side the chain is bent at the requested points: the side wanted, or the other one.

        It is bent to the other side where the crank pin has moved there, and is beyond the line from pivot to slider
        pin, too: far on its way a chain turns with that line, and the pin comes back past where the line had been.
        """
        along = np.array([np.cos(self.direction), np.sin(self.direction)])
        last = path.at_requested.tolist()
        pins = np.array([self.knee(path, at) for at in last])
        moved = np.array([kink(np.array([self.pins[0], pin, self.pins[2]])) for pin in pins]) - self.kink
        ends = self.pins[2] + np.outer(path.drive[path.at_requested], along)
        off = np.array([kink(np.array([self.pins[0], *pose])) for pose in zip(pins, ends, strict=True)])
        sides: FloatArray = np.where((np.sign(moved) == wanted) | (np.sign(off) == wanted), wanted, np.sign(moved))
        begins = np.flatnonzero(path.drive[path.at_requested] > 0.0)
        if len(begins) and sides[-1] != wanted and np.sign(moved[begins[0]]) != wanted:
            sides[:] = -wanted  # it went there at once, whatever its kink says
        return sides

    def _cut_before_crossing(self, path: Path, sides: FloatArray, wanted: int) -> PressedChain:
        """Return what there is before the chain bends to the other side: nothing where it does so at once."""
        first = int(np.flatnonzero(sides == wanted)[-1]) + 1 if (sides == wanted).any() else 0
        if first < MIN_CURVE_POINTS:
            return PressedChain(path, PressingEnd.WRONG_BRANCH, PressingEnd.WRONG_BRANCH.value, -wanted)
        places = path.drive[path.at_requested][first - 1 : first + 1] * 1e3
        text = f"between {places[0]:.4g} and {places[1]:.4g} mm {PressingEnd.CROSSES.value}"
        kept = part_of(path, np.isin(path.requested, path.requested[path.at_requested][:first]))
        return PressedChain(kept, PressingEnd.CROSSES, text, wanted)


_ENDING_BY_STATUS = {
    PathStatus.COMPLETE: PressingEnd.COMPLETE,
    PathStatus.LIMIT_POINT: PressingEnd.LIMIT_POINT,
    PathStatus.JUMPS: PressingEnd.UNSTABLE,
}


def _first_complete_point(path: Path, drive: Displacement) -> int:
    """Return the number of the first point from which on nothing is missing, rest not counted."""
    is_there = np.zeros(len(drive.points), dtype=bool)
    is_there[path.requested] = True
    is_there &= drive.points != 0.0
    return int(np.flatnonzero(~is_there)[-1]) + 1 if not is_there.all() else 0


def _start_at_limit_point(
    path: Path,  # without the first of the points that were requested
    # (m,): the travels that were requested before it begins [m]; those behind the limit point are found on the way
    missing: FloatArray,
) -> Path:
    """Return a path that is followed back to the limit point that it begins with, which becomes its first point."""
    spots = _follow_back(path)
    if not spots:
        return path
    free, drive = np.array([spot.x for spot in spots[::-1]]), np.array([spot.drive for spot in spots[::-1]])
    back = path.with_states(np.zeros(len(spots), np.int64), free, drive)
    longer = back.append(path)
    between, places = interpolate_path(longer), missing[missing > longer.drive[0]]
    if between is None:
        return path
    number, more = len(missing) - len(places), between.solve_at(places)
    requested = np.full(len(back), -1)
    requested[0] = number - 1
    back = replace(back, requested=read_only(requested, np.int64))
    more = replace(more, requested=read_only(np.arange(number, len(missing)), np.int64)).take(more.accurate)
    before = back.append(more)
    return before.take(np.argsort(before.at.drive, kind="stable")).append(path)


def _follow_back(path: Path) -> list[PathEquilibrium]:
    """Return equilibria from the first point of a path back to a limit point of its travel, in this order."""
    rest_equations, y, drive = equations(path.mesh), path.free[0], float(path.at.drive[0])
    beside = rest_equations.solve(y, drive * (1.0 + SLOPE_STEP))  # tells the slope
    if beside is None:
        return []
    before, last, step = beside.x, beside.drive, SLOPE_STEP * drive
    unstable, spots, moves = int(path.unstable[0]), [], np.isinf(rest_equations.unit)
    while step > NEAR_LIMIT * path.at.drive[0]:
        guess = y + (y - before) * (step / (last - drive))
        spot = rest_equations.solve(guess, drive - step)
        off = np.inf if spot is None else np.abs(spot.x - guess)[moves].max()
        if spot is None or spot.unstable > unstable or off > MAX_PREDICTION_ERROR * np.abs(guess - y)[moves].max():
            step *= 0.5
            continue
        y, before, drive, last = spot.x, y, spot.drive, drive
        spots.append(spot)
        step = min(2.0 * step, 0.5 * drive)
    return spots


def part_of(path: Path, keep: NDArray[np.bool_]) -> Path:
    """Return some of the points of a path."""
    return replace(path.take(keep), status=PathStatus.COMPLETE)


def _trace(network: Network, drive: Displacement, tolerance: float) -> Path:
    """Follow the path from rest; where steps of the travel do not get through, by its arc length."""
    path = trace(network, drive, Control(first_step=FIRST_STEP, tolerance=tolerance))
    if path.status is PathStatus.COMPLETE:
        return path
    arc = trace(network, drive, Control(tolerance=tolerance, through_folds=True))
    good = arc.status is PathStatus.COMPLETE and bool(arc.stable[arc.at_requested].all())
    return arc if good and len(arc.at_requested) == len(drive.points) else path


N_LINE_PIECES = 60  # straight pieces of the line that are looked at for crossings


def cut_at_contact(
    pressed: PressedChain,  # any outcome
    thickness: float,  # at the ends of the chain [m]: nearer than this the slider's end touches the anchor
) -> PressedChain:
    """Return the outcome up to where the chain meets its anchor, or itself."""
    places = pressed.path.at_requested.tolist()
    if not places:
        return pressed
    lines = [_line(pressed.path, at) for at in places]
    for number, line in enumerate(lines):
        what = _find_contact(line, lines[0][-1], thickness)
        if what:
            at = pressed.path.drive[places[number]] * 1e3
            text = f"at {at:.4g} mm the chain {what}: no such part exists from there on; end 'analysis.travel' before"
            kept = part_of(pressed.path, np.isin(np.arange(len(pressed.path.drive)), places[:number]))
            return replace(pressed, path=kept, ending=PressingEnd.BLOCKED, message=text)
    return pressed


def _line(path: Path, index: int) -> FloatArray:
    """Return the line of a chain from its anchor to its slider, (n, 2) [m]."""
    shapes = [path.shape(name, index) for name in path.network.beams]
    line: FloatArray = np.concatenate(shapes)
    return line


def _find_contact(line: FloatArray, start: FloatArray, thickness: float) -> str:
    """Return what a chain meets; nothing while it is clear."""
    anchor, end = line[0], line[-1]
    side = end - start
    share = float(np.clip((anchor - start) @ side / max(float(side @ side), 1e-300), 0.0, 1.0))
    if np.hypot(*(start + share * side - anchor)) < thickness:
        return "is pressed through its own anchor"
    rows = np.unique(np.linspace(0, len(line) - 1, N_LINE_PIECES + 1).astype(int))
    return "crosses itself" if _crosses(line[rows]) else ""


def _crosses(line: FloatArray) -> bool:
    """Return whether two pieces of a line cross that are not neighbours."""
    first, last = line[:-1], line[1:]
    step = last - first
    # what is straight but for rounding crosses nothing
    slack = 1e-9 * float(np.ptp(line, axis=0).max()) * np.hypot(*step.T)[:, None]

    def sides(points: FloatArray) -> FloatArray:
        """Return on which side of each piece (rows) points lie (columns): 1, -1, or 0 for on it."""
        away = points[None] - first[:, None]
        left = step[:, None, 0] * away[..., 1] - step[:, None, 1] * away[..., 0]
        return np.where(np.abs(left) > slack, np.sign(left), 0.0)

    parted: NDArray[np.bool_] = sides(first) * sides(last) < 0.0
    apart = np.abs(np.subtract.outer(np.arange(len(first)), np.arange(len(first)))) > 1
    return bool((parted & parted.T & apart).any())
