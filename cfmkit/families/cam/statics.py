"""Quasi-static forces in a cam mechanism per slider position and direction, with all friction, and where it jams.

Each roller is in equilibrium under the contact force, turned by atan(mu) against the motion, the springs, the brace and
its weight. With p = tan(atan f -+ atan mu), the slope f of the track so turned (minus on the way up), t = tan(alpha) of
the brace, S the spring force on one roller and w the weight that hangs on it,

    F = 2 (S + w p) / (p - t) + W

[SS, eq. 1, with weight added; W is the weight on the slider]. Without weight this is
F = 4 K D / (p - t): friction is a rotation of the contact normal. The code multiplies
by 1 +- mu f, which on the way down passes through zero where the normal turns past
horizontal: beyond, the springs no longer bring the rollers back and F is negative.

Friction beside rolling turns the same formula, not its kind. A roller's bearing takes kappa r N sqrt(1 + m^2), with
kappa = mu_b d_b / 2r, so that the normal is turned by m = mu + kappa sqrt(1 + m^2) instead of mu. The couples of
bearing, slider pin and spring hooks bend the brace out of its line by a transverse force V, which acts like a change
V / cos a of the spring force. The guide drags on the slider alone. All friction is that of Coulomb: the equations are
linear in the loads, and solved as such.

Assumes: the brace's centre of mass at mid-length, so that half of it hangs at each end; pins feel the axial force of
their brace (V is some thousandth of it).

[SS] S. Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import ShortRepr
from cfmkit.families.cam.geometry.slope_law import brace_tangent
from cfmkit.families.guide_friction import FRICTIONLESS_GUIDE, GuideFriction
from cfmkit.families.rows import rows_of
from cfmkit.numerics.roots import last_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.geometry.roller_track_on_cut_cam import Track, TrackStates, TrackStretch
    from cfmkit.families.cam.geometry.slope_law import Real
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.results import Finding

    Interval = tuple[float, float]


STANDARD_GRAVITY = 9.80665  # standard acceleration of gravity, exact by definition (3rd CGPM, 1901) [m/s^2]
JAM_SHARES = np.sort(np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 40), 1.0 - np.geomspace(1e-6, 0.1, 20)]))
"""Where to look for a jam along a part of the track: mostly it is at the ends."""


@dataclass(frozen=True)
class Losses:
    """Friction beside that of rolling; couples are per newton of load, so lengths."""

    rolling: float = 0.0  # rolling friction mu, resistance over roller radius
    roller_radius: float = 1.0  # [m]
    # bearing, pin: friction couple per load of a roller's bearing, and of a pin (slider pin, spring hook): mu d/2 [m]
    bearing: float = 0.0
    pin: float = 0.0
    guide: GuideFriction = FRICTIONLESS_GUIDE  # of the slider


@dataclass(frozen=True)
class Loads:
    """Loads on the rollers and the slider; of many mechanisms those that differ are columns (m, 1)."""

    stiffness: float  # K, the sum of all parallel springs [N/m]
    rest_half_width: float  # half the distance of the roller axes at which the springs are at rest [m]
    brace_length: float  # [m]
    # roller_weight, slider_weight: weight that hangs on one roller, and on the slider, against the slider's way out [N]
    roller_weight: float = 0.0
    slider_weight: float = 0.0
    # weight on one roller and on the slider across that way in the plane of the cam, to the right [N]
    sideways: tuple[float, float] = (0.0, 0.0)
    off_plane: float = 0.0  # weight of slider, braces and rollers out of that plane, which the guide carries [N]
    losses: Losses | None = None  # friction of bearings, pins and guide; None: the rollers roll, nothing else rubs

    @property
    def plain(self) -> bool:
        """Whether both sides are loaded alike, and nothing rubs but the rollers."""
        return self.losses is None and not any(map(np.any, self.sideways))


@dataclass(frozen=True, eq=False, repr=False)
class Forces(ShortRepr):
    """Forces on one branch, each (n,) or (m, n): on the slider, at a contact, in a brace [N].

    Those inside (`inside` returns contact and brace) are computed when they are first read. NaN where no finite force
    holds the mechanism (a jam, or a dead point under load). Where the sides are loaded differently `contact` and
    `brace` are the larger of both and `least_contact` is the smaller; `lost` is what each kind of friction takes from
    the force on the slider: rolling, bearings, pins, guide.
    """

    slider: FloatArray
    inside: Callable[[], tuple[FloatArray, FloatArray]]
    least_contact: FloatArray | None = None
    lost: dict[str, FloatArray] | None = None

    @cached_property
    def _inside(self) -> tuple[FloatArray, FloatArray]:
        return self.inside()

    @property
    def contact(self) -> FloatArray:
        """Force at a contact [N]."""
        return self._inside[0]

    @property
    def brace(self) -> FloatArray:
        """Force in a brace [N]."""
        return self._inside[1]


def load_on_slider(turn: Real, slope: Real, friction: Any, spring: Real, weight: Any = None) -> Real:
    """Return what one roller pulls the slider with, times its lever: S (1 + mu f) + w (f - mu) [SS, eq. 1; N].

    `turn` is 1 + mu f of `levers`; `spring` and `weight` pull at the roller [N].
    """
    load: Real = spring * turn
    return load if weight is None else load + weight * (slope - friction)


def load_on_contact(slope: Real, tangent: Real, spring: Real, weight: Any = None) -> Real:
    """Return what presses one roller on the cam, times the slider's lever: sqrt(1 + f^2) (S + w t) [N]."""
    along: Real = np.sqrt(1.0 + slope * slope)
    return along * (spring if weight is None else spring + weight * tangent)


def levers(slope: Real, tangent: Real, friction: Any) -> tuple[Real, Real]:
    """Return 1 + mu f, by which friction turns the load, and the slider's lever f - mu - t (1 + mu f) [SS, eq. 1]."""
    turn: Real = 1.0 + friction * slope
    lever: Real = slope - friction - tangent * turn
    return turn, lever


def spring_force(states: TrackStates, loads: Loads) -> FloatArray:
    """Return the spring force on one roller [N]; springs do not push."""
    stretch: FloatArray = 2.0 * loads.stiffness * np.maximum(states.x - loads.rest_half_width, 0.0)
    return stretch


def forces(states: TrackStates, loads: Loads, friction: Any, direction: float = 1.0) -> Forces:
    """Return the forces for one direction of travel [SS, eq. 1].

    Parameters
    ----------
    states : TrackStates
        Where the rollers are.
    loads : Loads
        Springs and weights.
    friction : float or (m, 1) array
        Rolling friction mu, of one sign: positive on the way up, negative on the way down.
    direction : float
        1 on the way up, -1 on the way down: the sign of all other friction, and of mu where that is zero.

    Returns
    -------
    Forces
        On the slider, at each contact and in each brace.
    """
    if not loads.plain:
        sign = float(np.sign(np.ravel(friction)[0]))
        return _forces_with_losses(states, loads, np.abs(friction), sign or direction)
    slope, weight = states.slope, loads.roller_weight if np.any(loads.roller_weight) else None
    tangent = states.tangent
    turn, lever = levers(slope, tangent, friction)
    spring = spring_force(states, loads)
    pull, limit = safe_divide(2.0 * load_on_slider(turn, slope, friction, spring, weight), lever), None
    if weight is None and (idle := _is_dead_point(states, loads, lever)).any():
        with np.errstate(divide="ignore", invalid="ignore"):
            pull, limit = np.where(idle, _dead_point_limit(states, loads, friction), pull), (idle, turn)
    return Forces(
        pull + loads.slider_weight, partial(_inner_forces, (slope, tangent, spring, weight), lever, 0.5 * pull, limit)
    )


def _inner_forces(
    loaded: tuple[Any, ...], lever: FloatArray, half_pull: FloatArray, limit: tuple[Any, Any] | None
) -> tuple[FloatArray, FloatArray]:
    """Return the forces at a contact and in a brace [N].

    `loaded`: the arguments of `load_on_contact`; `half_pull`: half of what the slider is pulled with [N]; `limit`:
    where forces are those of the dead point, and 1 + mu f.
    """
    slope, tangent, *_ = loaded
    contact = safe_divide(load_on_contact(*loaded), lever)
    if limit is not None:
        idle, turn = limit
        with np.errstate(divide="ignore", invalid="ignore"):
            contact = np.where(idle, load_on_contact(slope, tangent, half_pull) / turn, contact)
    return contact, half_pull * np.sqrt(1.0 + tangent * tangent)


def safe_divide(load: FloatArray, lever: FloatArray) -> FloatArray:
    """Return load / lever; 0 for nothing over anything, NaN where there is no leverage to move the load."""
    moves = lever > 0
    if moves.all():
        return np.asarray(load / lever)
    force = load / np.where(moves, lever, 1.0)
    return np.where(moves | (load == 0), force, np.nan)


def _is_dead_point(states: TrackStates, loads: Loads, lever: FloatArray) -> NDArray[np.bool_]:
    """Return where the slider has no leverage on a roller whose springs carry nothing."""
    idle = np.abs(lever) < 1e-13
    if idle.any():
        idle &= np.abs(states.x - loads.rest_half_width) <= 1e-15 * loads.rest_half_width
    return idle


def _dead_point_limit(states: TrackStates, loads: Loads, friction: Any) -> FloatArray:
    """Return the limit of 0/0 at the first point of an ideal profile, the ratio of the derivatives [N].

    The springs carry nothing there and the slider has no leverage on the roller: the limit is the constant force.
    """
    x, brace = loads.rest_half_width, loads.brace_length
    across = (brace - x) * (brace + x)
    turn = 1.0 + friction * states.slope
    lever_rate = states.bend * (1.0 - friction * brace_tangent(x, brace)) - brace**2 / across**1.5 * turn
    limit: FloatArray = 4.0 * loads.stiffness * turn / lever_rate
    return limit


class _Side(NamedTuple):
    """One roller and its brace, each (n,): pull on the slider along and across its way, contact, axial force [N]."""

    along: FloatArray
    across: FloatArray
    contact: FloatArray
    axial: FloatArray


def normal_turn(losses: Losses, rolling: Any) -> Any:
    """Return m, the traction on a roller over its contact force: m = mu + kappa sqrt(1 + m^2), solved for m."""
    kappa = losses.bearing / losses.roller_radius
    return (rolling + kappa * np.sqrt(1.0 + rolling**2 - kappa**2)) / (1.0 - kappa**2)


def leverage(x: FloatArray, slope: FloatArray, brace_length: Any, losses: Losses, friction: Any) -> FloatArray:
    """Return the slider's lever on a roller with all friction: no force moves it where this is not positive.

    At places of its track, x [m] and dy/dx, (n,); `friction` is that of rolling, negative on the way down.
    """
    direction = -1.0 if np.any(friction < 0) else 1.0
    turn = direction * normal_turn(losses, np.abs(friction))
    tangent = brace_tangent(x, brace_length)
    cos, sin = 1.0 / np.sqrt(1.0 + tangent**2), tangent / np.sqrt(1.0 + tangent**2)
    along = np.sqrt(1.0 + slope * slope)
    load_factor, lever = levers(slope, tangent, turn)
    rubbed = losses.pin * (load_factor / cos + sin * lever) - losses.bearing * np.sqrt(1.0 + turn**2) * along
    free_lever: FloatArray = lever - direction * rubbed / (cos * brace_length)
    return free_lever


def _side(states: TrackStates, loads: Loads, losses: Losses, direction: float, outward: Any) -> _Side:
    """Return the forces of one side whose roller's weight pulls `outward` [N]; NaN where nothing moves it.

    With n and t along the contact normal and the track, u along the brace and V across it, the roller's axis is in
    balance under N n - m N t - S - w + T u + V u', and the brace about the slider's pin if
    V l = pin (T + S) - bearing N sqrt(1 + m^2) on the way up. Eliminating T, N and V leaves one division.
    """
    slope, length, weight = states.slope, loads.brace_length, loads.roller_weight
    tangent = states.tangent
    cos, sin = 1.0 / np.sqrt(1.0 + tangent**2), tangent / np.sqrt(1.0 + tangent**2)
    turn = direction * normal_turn(losses, losses.rolling)
    (load_factor, lever), along = levers(slope, tangent, turn), np.sqrt(1.0 + slope * slope)
    spring = spring_force(states, loads)
    pulled, hooks = spring - outward, losses.pin * spring
    bearing = losses.bearing * np.sqrt(1.0 + turn**2)
    load = pulled * load_factor + weight * (slope - turn)

    def balance(pin: Any) -> tuple[FloatArray, FloatArray]:
        """Return T cos a and V of a brace whose pins rub with this sign; NaN where no force moves the slider."""
        scale = cos * length * lever - direction * (pin * (load_factor / cos + sin * lever) - bearing * along)
        scale = np.where(scale > 0, scale, np.nan)
        moved = load * (cos * length - direction * pin * sin) + direction * load_factor * hooks
        rubbed = pin * load / cos + hooks * lever - bearing * along * (pulled + weight * tangent)
        return (moved + direction * bearing * along * weight) / scale, direction * rubbed / scale

    # A pin rubs whichever way its brace is loaded: the sign is that of the axial force.
    pulling, pushing = balance(losses.pin), balance(-losses.pin)
    is_pushed = pulling[0] + pulling[1] * cos * sin < 0
    pull, bend = (np.where(is_pushed, pushed, drawn) for pushed, drawn in zip(pushing, pulling, strict=True))
    idle = (load == 0) & (hooks == 0) & (weight == 0)
    pull, bend = np.where(idle, 0.0, pull), np.where(idle, 0.0, bend)
    if not any(map(np.any, (turn, losses.pin, weight, outward))):
        pull = np.where(_is_dead_point(states, loads, lever), 0.5 * _dead_point_limit(states, loads, 0.0), pull)
    contact = ((slope - turn) * (pulled + bend + pull * tangent) + load_factor * (pull - weight)) / (
        (1.0 + turn**2) * along
    )
    return _Side(pull, pull * tangent + bend, contact, (pull + bend * cos * sin) / cos)


def _forces_with_losses(states: TrackStates, loads: Loads, rolling: Any, direction: float) -> Forces:
    losses = replace(loads.losses or Losses(), rolling=rolling)
    right = _side(states, loads, losses, direction, loads.sideways[0])
    left = _side(states, loads, losses, direction, -loads.sideways[0]) if np.any(loads.sideways[0]) else right
    free = right.along + left.along + loads.slider_weight
    guided = losses.guide.force(free, right.across - left.across + loads.sideways[1], loads.off_plane, direction)
    return Forces(
        guided,
        lambda: (np.maximum(right.contact, left.contact), np.maximum(np.abs(right.axial), np.abs(left.axial))),
        np.minimum(right.contact, left.contact),
        _find_friction_forces(states, loads, losses, (right, left)) | {"guide": np.abs(guided - free)},
    )


def _find_friction_forces(
    states: TrackStates, loads: Loads, losses: Losses, sides: tuple[_Side, _Side]
) -> dict[str, FloatArray]:
    """Return the power that each kind of friction takes, divided by the slider's speed [N]."""
    tangent = states.tangent
    axial, contact = (sum(np.abs(getattr(side, name)) for side in sides) for name in ("axial", "contact"))
    worn = losses.bearing * np.sqrt(1.0 + normal_turn(losses, losses.rolling) ** 2)
    with np.errstate(divide="ignore", invalid="ignore"):  # at a dead point the rollers move, the slider does not
        outward = 1.0 / (states.slope - tangent)  # of the roller, over the slider's speed
        swing = outward * np.sqrt(1.0 + tangent**2) / loads.brace_length
        spin = outward * np.sqrt(1.0 + states.slope**2) / losses.roller_radius
        return {
            "rolling": losses.rolling * losses.roller_radius * contact * spin,
            "bearings": worn * contact * (spin - swing),
            "pins": losses.pin * (axial + 2.0 * spring_force(states, loads)) * swing,
        }


def jams(
    track: Track,  # of one mechanism or of all, or tracks side by side
    friction: Any,  # float or (count, 1): rolling friction
    states: TrackStates | None = None,  # of each, (n,) or (count, n)
    losses: Losses | None = None,  # all friction
    count: int = 1,  # number of mechanisms
) -> list[tuple[Interval, ...]]:
    """Return the intervals of the slider's travel in which no force moves it up, of each of some mechanisms [m].

    There the lever of the slider on a roller, f - mu - tan(alpha) (1 + mu f), is not positive. It is looked at in the
    `states` that are given, if force is known to be missing in one of them; else where a stretch of the track begins or
    ends without it. With `losses` it is `leverage`. A jam up to the end of the track has no other end.
    """
    before, places_of_rows = np.zeros(count, dtype=bool), [list[float]() for _ in range(count)]
    for number, part in enumerate(track.stretches()):
        lever = partial(_lever, track, number, friction, losses)
        grid = _places(part, states)
        held = np.array(np.broadcast_to(lever(grid) < 0, (count, grid.shape[-1])))
        if states is None:
            held &= (held[:, 0] | held[:, -1] | before)[:, None]
        rows, at = np.nonzero(held != np.column_stack([before, held[:, :-1]]))
        if rows.size:
            grid = np.broadcast_to(grid, held.shape)
            place_here, earlier, begins = grid[rows, at], grid[rows, np.maximum(at - 1, 0)], held[rows, at]
            moves, rests = np.where(begins, (earlier, place_here), (place_here, earlier))[..., None]

            def shortage(parameter: FloatArray, ends: Any, lever: Any = lever, rows: Any = rows) -> FloatArray:
                return np.asarray(-lever(parameter, rows[ends]))

            place = last_places(shortage, moves, rests)
            row_track = track.select_rows(rows)
            travel = list(row_track.stretches())[number].at(place)[0] - row_track.start
            for row, first, edge in zip(rows.tolist(), (at == 0).tolist(), travel[:, 0].tolist(), strict=True):
                places_of_rows[row].append(0.0 if first and not places_of_rows[row] else edge)
        before = held[:, -1]
    for row in np.flatnonzero(before).tolist():
        places_of_rows[row].append(np.inf)
    return [tuple(zip(edges[::2], edges[1::2], strict=True)) for edges in places_of_rows]


def _lever(
    track: Track, number: int, friction: Any, losses: Losses | None, parameter: Any, rows: Any = None
) -> FloatArray:
    """Return the slider's lever on a roller on the way up at parameters of a stretch, rounding added.

    Rounding at a start without any lever is not a jam.
    """
    if rows is not None:
        track, losses = track.select_rows(rows), rows_of(losses, rows)
        friction = friction[rows] if np.ndim(friction) else friction
    _, x, slope = list(track.stretches())[number].at(parameter)
    if losses is not None:
        return leverage(x, slope, track.brace_length, losses, friction) + 1e-12
    return np.asarray(levers(slope, brace_tangent(x, track.brace_length), friction)[1] + 1e-12)


def _places(part: TrackStretch, states: TrackStates | None) -> FloatArray:
    """Return where to look for a jam on a stretch: its parameters in increasing order, of one track or of each."""
    grid: FloatArray = part.low + (part.high - part.low) * JAM_SHARES
    if states is not None:
        known_places = np.arctan(states.slope) if part.on_corner else states.parameter
        known_places = np.where(states.on_corner == part.on_corner, known_places, part.low)
        grid = np.sort(
            np.concatenate([known_places, np.broadcast_to(grid, (*known_places.shape[:-1], grid.shape[-1]))], axis=-1)
        )
    return np.minimum(np.maximum(grid, part.low), part.high)


TRAVEL_RTOL = 1e-6
"""A travel that is short by so little is not short: on a nearly vertical path rounding in x alone costs 1e-8."""


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together; several of one kind have columns (m, 1) for numbers that differ."""

    spec: CamSpec  # with every derived value written out
    profile: CamProfile  # the cam as cut
    track: Track  # where the roller runs
    loads: Loads  # springs and weights
    # travel that the cut profile offers with its own brace [m]; short of the specified stroke where the geometry ends
    # first
    stroke: float
    shortfall: Finding | None = None  # why `stroke` is short, if it is


def constant_force(assembly: Assembly) -> float:
    """Return the force that the profile is cut for, with the springs and weights built in [N]."""
    law, loads = assembly.profile.path.law, assembly.loads
    return 4.0 * loads.stiffness * law.force_constant + loads.slider_weight


def target_force(spec: CamSpec, assembly: Assembly) -> float | None:
    """Return the constant force that is wanted or that the profile is cut for [N]; None if it follows a curve."""
    if spec.target_curve is not None or assembly.spec.mechanism.profile.curve is not None:
        return None
    return spec.design.force if spec.design else constant_force(assembly)
