"""Positive-stiffness structures as closed forms: diamond, folded, U-shaped and straight beams, bought springs; preload.

All are given for the whole structure: two chains of the diamond or of U-shaped beams, four of folded beams, one
straight beam with a leaf to either side. A chain is two leaves in series, each taking half of the compression.

Departures from [D]: its eq. 15 counts one chain of the diamond and half of the shear term, L^3 cos^2 and not (L cos)^3
belongs into the bending term, and the force F_1 inside its bracket is a misprint.

[D] takes the force to rise by K_p dr (eq. 3), and the shuttle to move back by K_p dr/(K_p + K_b1) (eq. 6). The first is
exact where K_p = K_n and both are constant; the second is not: pulled back, the leaves are in tension and stiffen.

[D] B. Ding, X. Li, Y. Li, Robotica (2022), eq. 1-6, eq. 7-15 and Table II.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.families.findings import mm
from cfmkit.families.vcfm.leaves.kinds import LeafSpring, ProposedStructure, SpringChain, SpringKind
from cfmkit.families.vcfm.leaves.s_form import bent_leaf, s_force

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Section, Support
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    from cfmkit.families.vcfm.leaves.kinds import Edge, Edges
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings


BLOCK_HEIGHT_RATIO = 0.75  # half height of rigid blocks beyond the middle of a leaf, in its thicknesses
FILLET_MARGIN = 1.02  # height of rigid blocks beyond a leaf's edge, in what a fillet there takes


def leaf_compliance(strip: LeafStrip) -> Any:
    """Return the compliance of a leaf whose far end is guided and free to move across [m/N].

    Examples
    --------
    >>> from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    >>> leaf = LeafStrip(25e-3, np.radians(7), 1.5e-3, 10e-3, 1477e6, 0.3)
    >>> float((1e-3 / leaf_compliance(leaf)).round(6))
    3.202276
    """
    s2, c2 = np.sin(strip.angle) ** 2, np.cos(strip.angle) ** 2
    bent = strip.length**3 * c2 / (12.0 * strip.bending)
    return bent + strip.length * c2 / strip.shear + strip.length * s2 / strip.axial


def leaf_chain(strip: LeafStrip, section: Section, support: Support, travel: float, count: float) -> SpringChain:
    """Return one leaf, clamped at one end, as what is traced of a spring."""
    from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Network, Node

    nodes = {"wall": Node(0, 0, CLAMPED_SUPPORT), "end": Node(strip.reach, strip.rise, support)}
    return SpringChain(Network(nodes, {"leaf": Beam("wall", "end", section)}), "end", travel, count)


@dataclass(frozen=True)
class Diamond(LeafSpring):
    """Two chains of two leaves: K_p = 1/c for the whole diamond, c of one leaf. Straight to 1 % up to 0.2 L.

    `share` is the loaded part of the structure: 1, or 0.5 for one of the two chains.
    """

    share: Any = 1.0
    pairs: float = 1.0

    deflection_limits: ClassVar[tuple[float, float] | None] = (0.3, 0.12)
    """Beyond them its stiffness is off by more than 3 and 4 percent."""

    @property
    def stiffness(self) -> Any:
        """Stiffness of the unloaded spring, K_p [N/m]."""
        return self.pairs * self.share / leaf_compliance(self.strip)

    def stress(self, compression: Any) -> Any:
        """Return the largest bending stress [Pa]: at the ends of the leaves, each of which takes half."""
        e, t, length = self.strip.youngs_modulus, self.strip.thickness, self.strip.length
        return 3.0 * e * t * np.abs(0.5 * compression) * np.cos(self.strip.angle) / length**2

    def room(self, corner: float) -> float:
        """Return by how much it can be compressed until the blocks meet [m]."""
        return float(
            2.0 * self.strip.length * sin(self.strip.angle) + corner - 2.0 * BLOCK_HEIGHT_RATIO * self.strip.thickness
        )

    def chain(self, section: Section) -> SpringChain:
        """Return one leaf, whose corner moves across as it likes."""
        from cfmkit.elastica import Support

        return leaf_chain(self.strip, section, Support(rotation=True), 0.5, 2.0 * self.pairs * self.share)

    def rim(self, fillet: float) -> float:
        """Return how far its rigid corners reach beyond the middles of their leaves [m]: as a fillet needs it.

        Where the spring closes, the inner edges of the corners meet, not these.
        """
        thickness, angle = self.strip.thickness, self.strip.angle
        beside = float(np.tan(0.25 * np.pi + 0.5 * angle)) * fillet
        return float(max(BLOCK_HEIGHT_RATIO * thickness, 0.5 * thickness / np.cos(angle) + FILLET_MARGIN * beside))

    def edges(self, block: float, corner: float, fillet: float, top: float) -> Edges:
        """Return outer and inner edge of the right chain from its top down, and the lowest y [m]."""
        strip = self.strip
        half, x = 0.5 * block, 0.5 * block + float(strip.reach)
        rise, v, rim = float(strip.rise), 0.5 * strip.thickness / float(np.cos(strip.angle)), self.rim(fillet)
        high = top - block
        up, down = high - rise, high - rise - corner
        base, out = down - rise, x + block
        outer = [(half, high + v), (x, up + v), (x, up + rim), (out, up + rim)]
        outer += [(out, down - rim), (x, down - rim), (x, down - v), (half, base - v)]
        return outer, [(half, high - v), (x, up - v), (x, down + v), (half, base + v)], base - block

    def solved_piece(self, edges: Edges, _half: float) -> tuple[Edge, float, Edge, bool]:
        """Return the upper half of a chain, which is held by the middle of its corner."""
        outer, inner, low = edges
        middle, (leaf, corner) = 0.5 * low, inner[:2]
        line = [(outer[1][0], middle), (outer[3][0], middle)]
        return [*outer[:4], *line[::-1], corner, leaf, (0.0, leaf[1])], leaf[1], line, True

    def bent_lines(self, compression: float, corner: float) -> tuple[list[FloatArray], float]:
        """Return the lower and the upper leaf of the right chain, and its height [m]."""
        lower = bent_leaf(self.strip, 0.5 * compression, free=True)
        height = 2.0 * float(lower[-1, 1]) + corner
        return [lower, lower * np.array([1.0, -1.0]) + np.array([0.0, height])], height


@dataclass(frozen=True)
class Folded(Diamond):
    """Eight folded beams: four chains of two straight leaves, whose joints move along the leaves."""

    pairs: float = 2.0

    def room(self, _corner: float) -> float:
        """Return infinity: no blocks meet."""
        return np.inf


@dataclass(frozen=True)
class TrussDiamond(Diamond):
    """The diamond by bending alone [D, eq. 19]: E b t^3/(2 (L cos)^3) for each chain."""

    @property
    def stiffness(self) -> Any:
        """Stiffness, K_p [N/m]."""
        return 2.0 * self.share * 6.0 * self.strip.bending / self.strip.reach**3


@dataclass(frozen=True)
class UShape(LeafSpring):
    """Two chains of two straight leaves that a flexible semicircle of `radius` [m] joins.

    By symmetry half a chain, with the guided end's moment released about its centroid: K = EI/(I2 - xb^2 S) of both
    chains, S its developed length, xb and I2 its centroid and second moment across the motion.
    """

    radius: Any
    share: Any = 1.0

    @property
    def moments(self) -> tuple[Any, Any, Any]:
        """S [m], xb [m] and I2 [m3] of half a chain."""
        length, radius = self.strip.length, self.radius
        developed = length + 0.5 * np.pi * radius
        centroid = (0.5 * length**2 + 0.5 * np.pi * length * radius + radius**2) / developed
        second = length**3 / 3.0 + length**2 * np.pi * radius / 2.0 + 2.0 * length * radius**2 + np.pi * radius**3 / 4.0
        return developed, centroid, second

    @property
    def stiffness(self) -> Any:
        """Stiffness of the unloaded spring, K_p [N/m]."""
        developed, centroid, second = self.moments
        return self.share * self.strip.bending / (second - centroid**2 * developed)

    def stress(self, compression: Any) -> Any:
        """Return the largest bending stress [Pa]: at the clamped end or at the arc's apex."""
        _, centroid, _ = self.moments
        arm = np.maximum(centroid, self.strip.length + self.radius - centroid)
        one_chain = 0.5 * self.stiffness / self.share * np.abs(compression)
        moment = one_chain * arm
        return 0.5 * moment * self.strip.thickness * self.strip.youngs_modulus / self.strip.bending

    def room(self, _corner: float) -> float:
        """Return by how much it can be compressed until the blocks meet [m]."""
        return float(2.0 * self.radius - 2.0 * BLOCK_HEIGHT_RATIO * self.strip.thickness)

    def opening(self, _corner: float, needed: float) -> tuple[str, float]:
        """Return the key of the radius, and its value for so much more room [m]."""
        return "positive.radius", float(self.radius) + 0.5 * needed

    def chain(self, section: Section) -> SpringChain:
        """Return one chain: two legs and the bend."""
        from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Network, Node, arc, slider_support

        nodes = {
            "wall": Node(0, 0, CLAMPED_SUPPORT),
            "low": Node(self.strip.length, 0),
            "high": Node(self.strip.length, 2.0 * self.radius),
            "end": Node(0, 2.0 * self.radius, slider_support(0.5 * np.pi)),
        }
        beams = {
            "lower": Beam("wall", "low", section),
            "bend": Beam("low", "high", section, arc(np.pi)),
            "upper": Beam("high", "end", section),
        }
        return SpringChain(Network(nodes, beams), "end", 1.0, 2.0 * self.share)

    def edges(self, block: float, _corner: float, _fillet: float, top: float) -> Edges:
        """Return outer and inner edge of the right chain from its top down, and the lowest y [m]."""
        from cfmkit.export.contours import Arc

        half, v, radius = 0.5 * block, 0.5 * self.strip.thickness, float(self.radius)
        if radius <= v:
            raise GeometryError(
                f"a bend of radius {mm(radius)} cannot be cut in a leaf of {mm(self.strip.thickness)}: its inside "
                f"would cross itself; use a radius above {mm(v)} ('mechanism.positive.radius')"
            )
        high, x = top - block, 0.5 * block + self.strip.length
        center, base = (x, high - radius), high - 2.0 * radius
        bends = [Arc(center, radius + side * v, 0.5 * np.pi, -0.5 * np.pi) for side in (1.0, -1.0)]
        outer = [(half, high + v), bends[0], (half, base - v)]
        inner = [(half, high - v), bends[1], (half, base + v)]
        return outer, inner, base - block

    def solved_piece(self, edges: Edges, half: float) -> tuple[Edge, float, Edge, bool]:
        """Return one chain, which is held by its lower block."""
        outer, inner, low = edges
        (_, high), arc, (_, foot) = inner
        around = [*outer, (half, low), (0.0, low), (0.0, foot), inner[2], arc.reverse(), inner[0], (0.0, high)]
        return around, high, [(0.0, foot), (half, foot), (half, low), (0.0, low)], False

    def bent_lines(self, compression: float, _corner: float) -> tuple[list[FloatArray], float]:
        """Return the centre line of one chain from the clamped end (0, 0) up to the guided one, and its height [m].

        The moment is linear across the motion, about the chain's centroid [Castigliano].
        """
        length, radius = float(self.strip.length), float(self.radius)
        half = np.pi * radius
        legs = np.linspace(0, length, 40)
        s = np.concatenate([legs, length + np.linspace(0, half, 61)[1:], length + half + legs[1:]])
        arc = np.clip((s - length) / radius, 0.0, np.pi)
        middle = 0.5 * (s[1:] + s[:-1])
        turn_as_made = np.interp(middle, s, arc)
        x = np.concatenate([[0.0], np.cumsum(np.cos(turn_as_made) * np.diff(s))])
        developed, centroid, second = self.moments
        over_ei = 0.5 * compression / (second - centroid**2 * developed)  # force of one chain over EI
        curvature = -over_ei * (0.5 * (x[1:] + x[:-1]) - centroid)
        turn = np.concatenate([[0.0], np.cumsum(curvature * np.diff(s))])
        angles = turn_as_made - 0.5 * (turn[1:] + turn[:-1])
        steps = np.column_stack([np.cos(angles), np.sin(angles)]) * np.diff(s)[:, None]
        line = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
        end = np.array([0.0, 2.0 * radius - compression])
        line = line + (s / s[-1])[:, None] * (end - line[-1])
        return [line], float(line[-1, 1])


@dataclass(frozen=True)
class StraightSpring(LeafSpring):
    """A straight beam clamped at both ends and pushed in the middle: two leaves at no angle, stretched as they bend.

    The usual sum of a bending and a cubic stretching term is 11 % high at 2 mm and 31 % at 5 mm of [D], Fig. 4's size;
    the S form in tension is within 1 %.
    """

    share: Any = 1.0

    @property
    def stiffness(self) -> Any:
        """Stiffness of the unloaded spring, K_p [N/m]; it grows with the square of the compression."""
        return self.share * 2.0 * 12.0 * self.strip.bending / self.strip.length**3

    def force(self, compression: Any) -> FloatArray:
        """Return the force [N] at a compression [m]."""
        unit, form = self._leaf_state(compression)
        return np.asarray(-2.0 * self.share * unit * form.along)

    def stress(self, compression: Any) -> FloatArray:
        """Return the largest stress, bending and axial [Pa]."""
        unit, form = self._leaf_state(compression)
        bent = 0.5 * self.strip.youngs_modulus * self.strip.thickness * form.curvature / self.strip.length
        return np.asarray(bent + np.abs(4.0 * form.z * unit) / self.strip.area)

    def _leaf_state(self, compression: Any) -> tuple[Any, Any]:
        strip = self.strip
        # a leaf that leaves the flat pose: the S form's travel runs away from it
        travel = -np.asarray(compression, dtype=float) / strip.length
        return strip.bending / strip.length**2, s_force(0.0, strip.thickness / strip.length, travel)

    def chain(self, section: Section) -> SpringChain:
        """Return one leaf, whose end is guided."""
        from cfmkit.elastica import slider_support

        return leaf_chain(self.strip, section, slider_support(0.5 * np.pi), 1.0, 2.0 * self.share)

    def edges(self, block: float, _corner: float, _fillet: float, top: float) -> Edges:
        """Return the outer edge of the right half with its end block, no inner edge, and the lowest y [m]."""
        half, v = 0.5 * block, 0.5 * self.strip.thickness
        x, middle = half + self.strip.length, top - block
        out, bottom = x + block, top - block - half
        outer = [(half, middle + v), (x, middle + v), (x, middle + half), (out, middle + half)]
        outer += [(out, middle - half), (x, middle - half), (x, middle - v), (half, middle - v)]
        return outer, [], bottom

    def solved_piece(self, edges: Edges, half: float) -> tuple[Edge, float, Edge, bool]:
        """Return the right half, which is held by its end block."""
        outer, _, low = edges
        return [*outer, (half, low), (0.0, low)], low, outer[2:6], False

    def blocks(
        self, block: float, _corner: float, _fillet: float, top: float, compression: float
    ) -> tuple[float, list[PosedBody]]:
        """Return the height of its driven middle [m], and that block and the right one of the two that stand."""
        from cfmkit.export.posed_part import PosedBody, rectangle

        half, middle = 0.5 * block, top - block
        x, end = half + self.strip.length, middle + compression
        return middle, [
            PosedBody.polygon("block", "driven", rectangle(-half, middle - half, half, top)),
            PosedBody.polygon("base", "held", rectangle(x, end - half, x + block, end + half)),
        ]

    def bent_lines(self, compression: float, _corner: float) -> tuple[list[FloatArray], float]:
        """Return the centre line of the right leaf, from the driven middle at (0, 0) to its end, and its height [m]."""
        return [bent_leaf(self.strip, -compression)], compression


@dataclass(frozen=True)
class Coils:
    """Bought helical springs, all of them together: straight in their deflection, and slack without any."""

    stiffness: float  # of all [N/m]
    tension: float = 0.0  # force at which they begin to open [N]

    @classmethod
    def from_springs(cls, springs: BoughtSprings) -> Coils:
        """Return the law of the springs of a specification."""
        return cls(springs.count * springs.rate, springs.count * springs.initial_tension)

    def force(self, compression: Any) -> FloatArray:
        """Return the force [N] at a deflection [m]; none where it is not positive."""
        deflection = np.asarray(compression, dtype=float)
        return np.where(deflection > 0, self.tension + self.stiffness * deflection, 0.0 * deflection)

    def stress(self, compression: Any) -> FloatArray:
        """Return zero: the wire is not of the mechanism's material (`wire_stress_max` is its stress)."""
        return 0.0 * np.asarray(compression, dtype=float)


DIAMOND_SPRING = SpringKind(
    "diamond",
    "two chains of inclined leaves",
    lambda strip, _keys, share: Diamond(strip, share),
    truss=TrussDiamond,
    can_be_designed=True,
)
FOLDED_SPRING = SpringKind(
    "folded",
    "eight folded ones",
    lambda strip, _keys, share: Folded(strip, share),
    is_inclined=False,
    proposal=ProposedStructure(
        "folded spring", "2 Vs, folded spring", 1, lambda _leaf_state: {"structure": "folded", "angle": 0.0}
    ),
    drawing_note="one half of the eight folded beams is drawn: make it twice",
)
STRAIGHT_SPRING = SpringKind(
    "straight",
    "one straight beam",
    lambda strip, _keys, share: StraightSpring(strip, share),
    is_inclined=False,
    is_linear=False,
    stands_on_ends=True,
)
U_SHAPE = SpringKind(
    "u-shape",
    "two U-shapes",
    lambda strip, keys, share: UShape(strip, keys.radius, share),
    is_inclined=False,
    needs={"radius": "of its flexible semicircle"},
)


def force_change(positive_stiffness: Any, preload: Any) -> Any:
    """Return K_p dr, the change of the constant force [N].

    Examples
    --------
    >>> force_change(1400.0, 2.5e-3)
    3.5
    """
    return positive_stiffness * preload


def rest_shift(positive_stiffness: Any, first_stiffness: Any, preload: Any) -> Any:
    """Return how far the preload moves the shuttle back, by constant stiffnesses [m] [D, eq. 6]."""
    return positive_stiffness * preload / (positive_stiffness + first_stiffness)


def measured_stiffness_for(force: float, balance: float) -> float:
    """Return the K_p that a force at the balance point needs without preload [N/m]: the leaves carry nothing there."""
    return force / balance
