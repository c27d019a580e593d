"""The hybrid leaf: a flexure at either end of a stiff bar, as pseudo-rigid bodies.

Each flexure is a pivot in its middle with the stiffness EI/l_f, and the bar between the pivots can be compressed. Good
to about 10 % up to the peak as long as the rise is below six thicknesses of the flexure, and poor where the force turns
negative (up to 86 % off). Thinner flexures buckle under the axial force, which this model does not know: at 8.5
thicknesses the peak is 1.0 to 2 times too high, at 21 four to ten times. The stress is 5 to 50 % too low, because
bending by the axial force is left out. So `exact` is the default for these leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import asin, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import percent
from cfmkit.families.vcfm.leaves.kinds import LeafKind, LeafLaw, ProposedStructure
from cfmkit.families.vcfm.leaves.s_form import N_LINE_POINTS, line_between

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


MAX_RISE_RATIO, MAX_BUCKLING_RATIO = 6.0, 0.25
"""Rise over the thickness of a flexure, and axial force over its own buckling load, above which that force bends it."""
MIDDLE_THICKNESS_RATIO = 4.0  # thickness of the middle over that of the flexures, where none is stated
PROPOSED_FLEXURE = 0.2
"""Length of each flexure of a proposed leaf over that of the leaf: as in Ding, Li and Li 2022, a little longer."""
PROPOSED_RISE = 1.6
"""Rise of proposed leaves over that of straight ones for the same travel: their force falls over less of it."""
N_FLEXURE_POINTS = 15  # points of a flexure in pictures


@dataclass(frozen=True)
class HybridLeaf(LeafLaw):
    """The law of one hybrid leaf, of flexures as thick as its strip; some force is left where its chord is flat."""

    flexure: Any  # length of each flexure [m]
    stiffening: Any = MIDDLE_THICKNESS_RATIO  # thickness of the bar over that of the flexures

    @property
    def pivot(self) -> Any:
        """Stiffness of a flexure as a pivot [N m/rad]."""
        return self.strip.bending / self.flexure

    @property
    def bar(self) -> Any:
        """Distance of the pivots [m]."""
        return self.strip.length - self.flexure

    @property
    def bar_stiffness(self) -> Any:
        """Axial stiffness of flexures and bar in series [N/m]."""
        soft, stiff = 2.0 * self.flexure, (self.strip.length - 2.0 * self.flexure) / self.stiffening
        return self.strip.axial / (soft + stiff)

    @property
    def crushing(self) -> float:
        """Largest axial force, in the flat pose, over that at which a flexure buckles between clamps."""
        force = self.bar_stiffness * self.bar * (1.0 - np.cos(self.strip.angle))
        return float(force * self.flexure**2 / (4.0 * np.pi**2 * self.strip.bending))

    @property
    def flexures_buckle(self) -> bool:
        """Whether the flexures are too thin for this model."""
        return float(self.strip.slenderness) > MAX_RISE_RATIO or self.crushing > MAX_BUCKLING_RATIO

    def _pose(self, travel: Any) -> tuple[Any, Any, Any]:
        """Return distance of the pivots [m], angle of the bar, and how much it has turned [rad]."""
        reach, drop = self.bar * np.cos(self.strip.angle), self.bar * np.sin(self.strip.angle) - travel
        tilt = np.arctan2(drop, reach)
        return np.hypot(reach, drop), tilt, self.strip.angle - tilt

    def force(self, travel: Any) -> FloatArray:
        """Return the force of one leaf along the motion [N]."""
        length, tilt, turn = self._pose(np.asarray(travel, dtype=float))
        pressed = self.bar_stiffness * (self.bar - length) * np.sin(tilt)
        return np.asarray(pressed + 2.0 * self.pivot * turn * np.cos(tilt) / length)

    def stress(self, travel: Any) -> FloatArray:
        """Return the largest stress of the flexures, bending and axial [Pa]."""
        length, _, turn = self._pose(np.asarray(travel, dtype=float))
        bent = 0.5 * self.strip.youngs_modulus * self.strip.thickness * np.abs(turn) / self.flexure
        return np.asarray(bent + np.abs(self.bar_stiffness * (self.bar - length)) / self.strip.area)

    @property
    def first_stiffness(self) -> Any:
        """Stiffness, unloaded [N/m]."""
        s, c = np.sin(self.strip.angle), np.cos(self.strip.angle)
        return self.bar_stiffness * s * s + 2.0 * self.pivot * c * c / self.bar**2

    @cached_property
    def _steepest(self) -> tuple[Any, Any]:
        places = np.linspace(0.0, 1.6, 801) * self.strip.rise
        slope = np.gradient(self.force(places), places)
        falling = np.flatnonzero(slope < 0.5 * slope.min()) if slope.min() < 0 else np.empty(0, int)
        return -slope.min(), (places[falling[0]], places[falling[-1]]) if len(falling) else (np.nan, np.nan)

    @property
    def negative_stiffness(self) -> Any:
        """Largest size of the negative stiffness [N/m]: this leaf has no constant one."""
        return self._steepest[0]

    @property
    def linear_range(self) -> tuple[Any, Any]:
        """Range in which the negative stiffness is at least half of its largest, from and to [m]."""
        limits: tuple[Any, Any] = self._steepest[1]
        return limits

    def is_buckled(self, travel: Any) -> Any:
        """Return False everywhere: the model has no buckled form."""
        return np.zeros(np.shape(travel), dtype=bool)

    # --- shape ------------------------------------------------------------------------------------------------------

    @property
    def profile(self) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Shares of the length, and the thicknesses there [m]: with the steps from the flexures to the middle."""
        end, thin = self.flexure / self.strip.length, self.strip.thickness
        thick = self.stiffening * thin
        return (0.0, end, end, 1.0 - end, 1.0 - end, 1.0), (thin, thin, thick, thick, thin, thin)

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]."""
        strip, end, n = self.strip, float(self.flexure), N_FLEXURE_POINTS
        tilt = float(np.arctan2(self.bar * np.sin(strip.angle) - travel, self.bar * np.cos(strip.angle)))
        bend = np.linspace(float(strip.angle), tilt, n)
        angles = np.concatenate([bend, np.full(N_LINE_POINTS - 2 * n, tilt), bend[::-1]])
        middle = np.full(N_LINE_POINTS - 2 * n, (strip.length - 2 * end) / (N_LINE_POINTS - 2 * n))
        lengths = np.concatenate([np.full(n, end / n), middle, np.full(n, end / n)])
        return line_between(angles, lengths, (strip.reach, strip.rise - travel))


def _shortcoming(law: HybridLeaf) -> str:
    """Return how rough the force and the stress of this law are."""
    if not law.flexures_buckle:
        force = "the pseudo-rigid-body model gives the force of hybrid leaves to about 10 %, up to the peak only"
    else:
        force = (
            f"with a rise of {float(law.strip.slenderness):.3g} flexure thicknesses and an axial force of up to "
            f"{percent(law.crushing)} of the flexures' own buckling load these bend and buckle, which pseudo-rigid "
            "bodies cannot: the force is overestimated, by up to several times"
        )
    return f"{force}; their stress is underestimated, by up to a half"


def _as_proposed(leaf: Any) -> dict[str, Any]:
    """Return the keys of hybrid leaves in place of a designed straight one."""
    angle = asin(min(PROPOSED_RISE * sin(leaf.angle), 0.25))
    return {"structure": "hybrid", "flexure_length": PROPOSED_FLEXURE * leaf.length, "angle": angle}


HYBRID_LEAF = LeafKind(
    "hybrid",
    "flexures with a stiff middle",
    lambda strip, keys: HybridLeaf(strip, keys.flexure_length, keys.stiffening or MIDDLE_THICKNESS_RATIO),
    needs={"flexure_length": "of each of its two flexures"},
    lengths=("flexure_length",),
    fidelity="exact",
    buckles=False,
    shortcoming=_shortcoming,
    proposal=ProposedStructure("hybrid leaves", "2 hybrid Vs", 6, _as_proposed),
)
