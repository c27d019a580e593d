"""Many mechanisms at once around one cut cam: other braces, rollers and springs than those it is cut for.

The cam is put together once. Where a roller of another radius or a brace of another length runs on it is
solved for all mechanisms and samples together; the formulas are those of `cam_track.Track` and `statics`, for a
profile cut for no friction, with the whole travel reached and nothing that holds a roller. Every other
mechanism is left to the model of one cam.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.block_forces import Forces, Slab, tangents
from cfmkit.families.cam.geometry.path import ideal_position
from cfmkit.families.cam.geometry.track import Pivot, pivot_angle
from cfmkit.numerics.roots import invert_increasing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.cam.geometry.cut import CamProfile

_LOOKED_AT = 65
"""Places on the corner and on the flank at which the slider must rise and friction must not hold the roller."""


@dataclass(frozen=True)
class Cut:
    """One cam with many rollers and braces, (d,) each [m].

    Attributes
    ----------
    profile : CamProfile
        The cam.
    radius, brace : (d,) array
        Of the parts that are built in.
    """

    profile: CamProfile
    radius: FloatArray
    brace: FloatArray

    def on_flank(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return slider position, its derivative by u, x and slope at path coordinates u, (d, n) each [m]."""
        law, brace = self.profile.path.law, self.brace[:, None]
        shift = (self.radius - self.profile.roller_radius)[:, None]
        slope = law.slope(u)
        length = (1.0 + slope * slope) ** 0.5
        x, y = u + shift * slope / length, self.profile.path.height(u) - shift / length
        rate = (slope - tangents(x, brace)) * (1.0 + shift / law.curvature_radius(u))
        return y + ((brace - x) * (brace + x)) ** 0.5, rate, x, slope

    @cached_property
    def pivot(self) -> Pivot:
        """How the rollers pivot on the corner; of a cam without one, a corner that is left at once."""
        corner, law = self.profile.corner, self.profile.path.law
        xc, yc = corner.point if corner else self.profile.flank(self.profile.start)
        high = np.arctan(law.slope(self.profile.start))
        low = np.arctan2(law.rest_half_width - xc, yc) if corner else high
        return Pivot(float(xc), float(yc), self.radius[:, None], self.brace[:, None], float(low), float(high))

    def on_corner(self, turn: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return slider position, x and slope where the contact normal is turned by an angle, (d, n) each [m]."""
        pivot = self.pivot
        x = pivot.x + pivot.radius * np.sin(turn)
        y = pivot.y - pivot.radius * np.cos(turn)
        return y + ((pivot.brace - x) * (pivot.brace + x)) ** 0.5, x, np.tan(turn) + 0.0 * x

    @cached_property
    def start(self) -> FloatArray:
        """Position of the slider at the start, (d, 1) [m]."""
        return self.on_corner(self.pivot.low)[0]

    @cached_property
    def corner_end(self) -> FloatArray:
        """Position at which the roller leaves the corner, (d, 1) [m]."""
        return self.on_flank(np.full((len(self.radius), 1), self.profile.start))[0]

    @cached_property
    def end(self) -> FloatArray:
        """Position at the end of the flank, (d, 1) [m]."""
        return self.on_flank(np.full((len(self.radius), 1), self.profile.end))[0]

    def possible(self, friction: FloatArray) -> NDArray[np.bool_]:
        """Return for which mechanisms the slider rises all along, and friction holds no roller, (d,)."""
        share = np.linspace(0.0, 1.0, _LOOKED_AT)
        count, mu = len(self.radius), friction[:, None]
        u = self.profile.start + (self.profile.end - self.profile.start) * share**2
        _, rate, x, slope = self.on_flank(np.broadcast_to(u, (count, _LOOKED_AT)))
        pivot = self.pivot
        _, x_corner, slope_corner = self.on_corner(pivot.low + (pivot.high - pivot.low) * share)
        levers = []
        for across, steep in ((x, slope), (x_corner, slope_corner)):
            tangent = tangents(across, self.brace[:, None])
            levers.append((steep - mu - tangent * (1.0 + mu * steep) > 1e-9).all(axis=1))
            levers.append((steep - tangent > 1e-9).all(axis=1))
        room = (x_corner[:, 0] >= self.radius) & (self.profile.flank(self.profile.start)[0] > 0)
        return np.asarray((rate > 0).all(axis=1) & np.logical_and.reduce(levers) & room)


class BuiltSlab(Slab):
    """Some mechanisms around one cam at all their samples; `designs.x0` is where their springs are at rest."""

    cut: Cut
    reach: float

    def with_cam(self, profile: CamProfile, reach: float) -> BuiltSlab:
        """Return the slab itself, with its cam and the travel that is requested [m]."""
        self.cut, self.reach = Cut(profile, self.designs.radius, self.designs.brace), reach
        return self

    @cached_property
    def travel(self) -> FloatArray:
        """Travel of the slider [m]."""
        return np.broadcast_to(np.linspace(0.0, self.reach, self.points), (len(self.designs), self.points))

    @cached_property
    def _states(self) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return x and slope of the rollers, and where they run on the flank."""
        return self._states_at(self.travel)

    def _states_at(self, travel: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return x and slope of the rollers at travels, (d, m) each [m], and where they run on the flank."""
        cut, slider = self.cut, self.cut.start + travel
        flank = (slider >= cut.corner_end) | (cut.profile.corner is None)
        law, low, high = cut.profile.path.law, cut.profile.start, cut.profile.end
        guess = np.minimum(np.maximum(ideal_position(law, np.maximum(travel, 0.0)), low), high)
        targets = np.where(flank, slider, cut.corner_end).ravel()

        def evaluate(u: FloatArray) -> tuple[FloatArray, FloatArray]:
            value, rate, _, _ = cut.on_flank(u.reshape(slider.shape))
            return value.ravel(), rate.ravel()

        u = invert_increasing(evaluate, targets, (low, high), guess.ravel()).reshape(slider.shape)
        _, _, x, slope = cut.on_flank(u)
        turn = pivot_angle(slider, cut.pivot)
        turn = np.where(slider <= cut.start, cut.pivot.low, turn)
        _, x_corner, slope_corner = cut.on_corner(turn)
        return np.where(flank, x, x_corner), np.where(flank, slope, slope_corner), flank

    def exact(self, branch: str, travel: FloatArray) -> FloatArray:
        """Return the force of a branch at travels of each mechanism, (d, m) [N]; NaN where friction holds a roller."""
        x, slope, _ = self._states_at(travel)
        mu, tangent = self.designs.friction[:, None], tangents(x, self.designs.brace[:, None])
        mu = mu if branch == "load" else -mu
        turn = 1.0 + mu * slope
        lever = slope - mu - tangent * turn
        spring = 2.0 * self.designs.stiffness[:, None] * np.maximum(x - self.designs.x0[:, None], 0.0)
        return np.asarray(np.where(lever > 0, 2.0 * (spring * turn) / np.where(lever > 0, lever, 1.0), np.nan))

    @cached_property
    def half_width(self) -> FloatArray:
        """x of the right roller's centre [m]."""
        return self._states[0]

    @cached_property
    def slope(self) -> FloatArray:
        """Slope of the track."""
        return self._states[1]

    @cached_property
    def flank(self) -> NDArray[np.bool_]:
        """Where the roller runs on the flank."""
        return self._states[2]

    @cached_property
    def stretch(self) -> FloatArray:
        """x less the half width at which the springs are at rest [m]."""
        return self.half_width - self.designs.x0[:, None]

    @cached_property
    def corner_travel(self) -> FloatArray:
        """Travel at which the roller leaves the corner [m]."""
        found = np.maximum((self.cut.corner_end - self.cut.start)[:, 0], 0.0)
        return found if self.cut.profile.corner else np.zeros_like(found)

    def warned(self, max_elongation: float | None) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield the findings that `checks.findings_of` has of such mechanisms, in its order."""
        found = list(super().warned(max_elongation))
        at = [name for name, _ in found].index("up_jam") + 1
        slack: NDArray[np.bool_] = np.asarray((2.0 * self.stretch < -1e-12).any(axis=1))
        yield from (*found[:at], ("spring_slack", slack), *found[at:])

    @property
    def jammed(self) -> NDArray[np.bool_]:
        """Nowhere: see `Cut.possible`."""
        return np.zeros(len(self.designs), dtype=bool)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Whether the slider rises all along up to the requested travel, and a force was found at every sample."""
        reached = ((self.cut.end - self.cut.start)[:, 0] >= self.reach) & (self.stretch[:, -1] > 0)
        return self.up.moves & self.down.moves & reached & self.cut.possible(self.designs.friction)

    def _forces(self, friction: FloatArray) -> Forces:
        mu, tangent = friction[:, None], self.tangent
        turn = 1.0 + mu * self.slope
        lever = self.slope - mu - tangent * turn
        spring = 2.0 * self.designs.stiffness[:, None] * np.maximum(self.stretch, 0.0)
        moves = lever > 0
        divisor = np.where(moves, lever, 1.0)
        contact = np.sqrt(1.0 + self.slope * self.slope) * spring / divisor if self.contacts else None
        return Forces(2.0 * (spring * turn) / divisor, contact, np.asarray(moves.all(axis=1)))
