"""The V-beam: an inclined leaf that first bends into an S and then buckles, and in between is a linear negative spring.

Where the axial force reaches the load of the form 1 - cos(2 pi s/L) it stays there. Both end slopes are then equal over
one full wave, so the end moments are equal, and the force acts exactly along the chord: F = P_cr sin(beta), zero where
the leaf is flat. For small angles that is a straight line with the slope -P_cr/X.

For comparison there is the paper's own law as intended, a bar that only compresses [D, eq. 18]; it is for one V, here
the leaves count that are there. It ignores buckling and clamping and is nowhere straight: for the leaf of Table I its
peak is 36 % too high and at twice the travel, and its steepest slope is 2.8 times that of the real leaf. Its
K_n = 33 E I/L^3 [D, eq. 17] is 17 % low: the factor is 4 pi^2/cos(theta).

[D] B. Ding, X. Li, Y. Li, Robotica (2022), variable constant-force compliant mechanism.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import radians, sqrt
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cfmkit.families.vcfm.leaves.kinds import LeafKind, LeafLaw, SlendernessLimits
from cfmkit.families.vcfm.leaves.s_form import N_LINE_POINTS, bent_leaf, pose, s_force

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip


@dataclass(frozen=True)
class TrussLeaf(LeafLaw):
    """One leaf as a bar on two pins [D, eq. 18]: half of E S u (u - s)(u - 2 s), u = d/L, s = sin(theta)."""

    one_by_one: ClassVar[bool] = False

    def force(self, travel: Any) -> Any:
        """Return the force of one leaf along the motion [N].

        Examples
        --------
        >>> from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
        >>> leaf = TrussLeaf(LeafStrip(35e-3, np.radians(7), 1e-3, 6e-3, 1477e6, 0.3))
        >>> float(leaf.force(1e-3).round(6))
        2.541452
        """
        u, s = np.asarray(travel) / self.strip.length, np.sin(self.strip.angle)
        return 0.5 * self.strip.axial * u * (u - s) * (u - 2.0 * s)

    def stress(self, travel: Any) -> Any:
        """Return the axial stress [Pa]: the law has no bending."""
        u, s = np.asarray(travel) / self.strip.length, np.sin(self.strip.angle)
        return self.strip.youngs_modulus * np.abs(s * u - 0.5 * u * u)

    @property
    def first_stiffness(self) -> Any:
        """Stiffness, unloaded [N/m]."""
        return self.strip.axial * np.sin(self.strip.angle) ** 2 / self.strip.length

    @property
    def negative_stiffness(self) -> Any:
        """Size of the largest negative stiffness [N/m]: where the bar is flat."""
        return 0.5 * self.first_stiffness

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]: straight."""
        share = np.linspace(0.0, 1.0, N_LINE_POINTS)[:, None]
        line: FloatArray = share * np.array([self.strip.reach, self.strip.rise - travel])
        return line


NEGATIVE_ABOVE = 1.4246  # rise over thickness above which a V-beam has a negative stiffness anywhere
LINEAR_ABOVE = np.pi  # rise over thickness above which it buckles, and so has a linear negative stiffness
FLAT_BUCKLED_ABOVE = 2.0 * np.pi / 3.0**0.5
"""Rise over thickness above which it is still buckled when flat, so that its force is zero there."""
THICK_LEAF_RATIO, STOCKY_LEAF_RATIO = 0.1, 0.25
"""Thickness over length of a leaf from which on the closed forms are off by 5 to 10 % of the peak, cosine leaves first
(a quarter as thick: half of it); and from which on a leaf is a beam no more, so that no model here holds."""
MAX_LEAF_ANGLE = radians(15)
"""Angle of the leaves beyond which the closed forms are off by more than a few percent: none steeper is designed."""
MAX_TRAVEL_RATIO = 1.6
"""Travel over rise beyond which the S form is no longer to be trusted (0.07 N of 2.3 at 1.9 of [D], Table I)."""


def critical_force(strip: LeafStrip) -> Any:
    """Return P_cr of the form 1 - cos(2 pi s/L) with stretching and shear [N].

    P_e (1 + P_e/EA - P_e/(5/6 GA)), P_e = 4 pi^2 EI/L^2: within 0.2 % of the exact slope for t/L up to 1/29.
    """
    euler = 4.0 * np.pi**2 * strip.bending / strip.length**2
    return euler * (1.0 + euler / strip.axial - euler / strip.shear)


def onset_and_exit(strip: LeafStrip) -> tuple[Any, Any]:
    """Return where the leaf buckles and where it straightens again, d1 and d2 [m]; NaN where it does not buckle.

    u - 3 u^2/4 = pi^2/(3 Q^2), u = d/h: good to a percent; the curve joins its branches where the two laws cross.
    """
    rise, root = strip.rise, np.pi / strip.slenderness
    with np.errstate(invalid="ignore"):
        half = np.sqrt(1.0 - root * root)
    return 2.0 / 3.0 * rise * (1.0 - half), 2.0 / 3.0 * rise * (1.0 + half)


def negative_stiffness(strip: LeafStrip) -> Any:
    """Return P_cr/X, the size of the negative stiffness of one leaf [N/m].

    Examples
    --------
    >>> from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    >>> leaf = LeafStrip(35e-3, np.radians(7), 1e-3, 6e-3, 1477e6, 0.3)
    >>> float(negative_stiffness(leaf).round(3))
    681.202
    """
    return critical_force(strip) / strip.reach


def first_stiffness(strip: LeafStrip) -> Any:
    """Return the stiffness of one unloaded leaf, K_b1 [N/m]: EA sin^2/L + 12 EI cos^2/L^3."""
    s, c = np.sin(strip.angle), np.cos(strip.angle)
    return strip.axial * s * s / strip.length + 12.0 * strip.bending * c * c / strip.length**3


def buckled_stress(rise: float, thickness: float, share: float) -> float:
    """Return the largest stress of a buckled leaf at a share of the travel to its flat pose, times L^2/E [m2].

    It is highest in the flat pose.
    """
    root = np.pi * thickness / rise
    bend = sqrt(4.0 * share - 2.0 * share * share - 4.0 / 3.0 * root * root)
    return float(np.pi * rise * thickness * bend + np.pi**2 * thickness**2 / 3.0)


def stress_overestimate(angle: float) -> float:
    """Return by what share the closed form overestimates the largest stress of a buckled leaf at an angle [rad].

    At most: 0.12 percent at 3 deg, 0.73 at 7 deg, 2.85 at 14 deg where the leaf just buckles, less the thinner it is.
    """
    return 0.5 * angle * angle


@dataclass(frozen=True)
class VBeam(LeafLaw):
    """The law of one straight inclined leaf, which carries nothing when flat, if it is buckled there."""

    one_by_one: ClassVar[bool] = False

    @property
    def first_stiffness(self) -> Any:
        """Stiffness, unloaded [N/m]."""
        return first_stiffness(self.strip)

    @property
    def negative_stiffness(self) -> Any:
        """Size of the negative stiffness [N/m]: of the buckled form, else of the steepest fall; zero if none.

        The S form has its steepest fall near 2/3 of the rise.
        """
        line, strip = negative_stiffness(self.strip), self.strip
        bent = np.ravel(strip.slenderness) <= LINEAR_ABOVE
        if not bent.any():
            return line
        places = np.atleast_2d(np.linspace(0.3, 1.1, 161) * strip.rise)
        falls = [-np.gradient(*row).min() for row in zip(np.atleast_2d(self.s_force(places)), places, strict=True)]
        steepest = np.maximum(falls, 0.0).reshape(np.shape(line))
        return np.where(strip.slenderness > LINEAR_ABOVE, line, steepest)

    def s_force(self, travel: Any) -> FloatArray:
        """Return the force of the S form, stable or not [N]."""
        strip = self.strip
        unit = strip.bending / strip.length**2
        return np.asarray(
            unit * s_force(strip.angle, strip.thickness / strip.length, travel / strip.length).along, dtype=float
        )

    def buckled_force(self, travel: Any) -> FloatArray:
        """Return the force of the buckled form [N]: P_cr sin(beta)."""
        drop = self.strip.rise - travel
        return np.asarray(critical_force(self.strip) * drop / np.hypot(self.strip.reach, drop), dtype=float)

    @cached_property
    def linear_range(self) -> tuple[Any, Any]:
        """Range in which the leaf is buckled, from and to [m]: where the two laws cross; NaN where it never is."""
        first, last = onset_and_exit(self.strip)
        span = last - first
        start, end = self._crossing(np.stack([first, last]), np.stack([-0.1 * span, 0.1 * span]))
        return start, end

    def _crossing(self, guess: Any, outward: Any) -> Any:
        """Return where both laws give one force, by secants; where there is no such place near, the closed form."""
        before, place = guess + outward, np.asarray(guess, dtype=float)
        gap = self.s_force(before) - self.buckled_force(before)
        for _ in range(12):
            gap_here = self.s_force(place) - self.buckled_force(place)
            with np.errstate(all="ignore"):
                step = gap_here * (place - before) / (gap_here - gap)
            step = np.where(np.isfinite(step), step, 0.0)
            before, gap, place = place, gap_here, place - step
            if not (np.abs(step) > 1e-15 * np.abs(place)).any():
                break  # the last bit
        is_near = np.abs(place - guess) <= 2.0 * np.abs(outward)
        return np.where(is_near, place, guess)

    @property
    def overrating(self) -> Any:
        """By what share the law overestimates the largest stress at most (`stress_overestimate`)."""
        return stress_overestimate(self.strip.angle)

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]."""
        buckled = bool(self.is_buckled(np.array([travel]))[0])
        return bent_leaf(self.strip, travel, float(critical_force(self.strip)) if buckled else None)

    def force(
        self,
        travel: Any,  # of the shuttle from the unloaded position, positive towards the flat pose [m]
    ) -> FloatArray:
        """Return the force of one leaf along the motion [N], on the stable branch."""
        strip, bent = self.strip, ~np.asarray(self.is_buckled(travel))
        drop = strip.rise - np.asarray(travel, dtype=float)
        force = np.array(np.broadcast_to(critical_force(strip) * (drop / np.hypot(strip.reach, drop)), bent.shape))
        if bent.any():
            unit = strip.bending / strip.length**2
            sizes = unit, strip.angle, strip.thickness / strip.length, travel / strip.length
            unit, *pose = (item if np.ndim(item) == 0 else np.broadcast_to(item, bent.shape)[bent] for item in sizes)
            force[bent] = unit * s_force(*pose).along
        return force

    def stress(self, travel: Any) -> FloatArray:
        """Return the largest stress of the leaf, bending and axial [Pa]."""
        return self.state(travel)[1]

    def state(self, travel: Any) -> tuple[FloatArray, FloatArray]:
        """Return `force` and `stress` at once: both come of one root."""
        buckled = np.asarray(self.is_buckled(travel))
        strip, is_single = self.strip, all(np.ndim(item) == 0 for item in vars(self.strip).values())
        wide = [] if is_single else [np.broadcast_to(np.asarray(item), buckled.shape) for item in vars(strip).values()]
        place = np.broadcast_to(np.asarray(travel, dtype=float), buckled.shape)
        force, stress = np.empty((2, *buckled.shape))
        for chosen, law in ((buckled, _buckled_form), (~buckled, _bent_form)):
            if chosen.any():
                about = strip if is_single else type(strip)(*(item[chosen] for item in wide))
                force[chosen], stress[chosen] = law(about, place[chosen])
        return force, stress


def _buckled_form(strip: LeafStrip, travel: FloatArray) -> tuple[Any, Any]:
    """Return force [N] and largest stress [Pa] of the buckled form."""
    force, at = critical_force(strip), pose(strip.angle, travel / strip.length)
    # (2 pi/L) sqrt(alpha^2 + 4 r) with r = shortening - P/EA - alpha^2/4: the tilt drops out
    curvature = 4.0 * np.pi / strip.length * np.sqrt(np.maximum(at.shortening - force / strip.axial, 0.0))
    stress = 0.5 * strip.youngs_modulus * strip.thickness * curvature + force / strip.area
    drop = strip.rise - travel
    return force * (drop / np.hypot(strip.reach, drop)), stress


def _bent_form(strip: LeafStrip, travel: FloatArray) -> tuple[Any, Any]:
    """Return force [N] and largest stress [Pa] of the S form."""
    unit = strip.bending / strip.length**2
    form = s_force(strip.angle, strip.thickness / strip.length, travel / strip.length)
    axial = np.abs(4.0 * form.z * unit) / strip.area
    bending = 0.5 * strip.youngs_modulus * strip.thickness * form.curvature / strip.length
    return unit * form.along, bending + axial


V_BEAM = LeafKind(
    "v-beam",
    "straight inclined leaves",
    lambda strip, _keys: VBeam(strip),
    truss=TrussLeaf,
    can_be_designed=True,
    limits=SlendernessLimits(NEGATIVE_ABOVE, LINEAR_ABOVE, "pi"),
)
