"""From a specification to its leaves and their laws."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils, Diamond, StraightSpring, UShape, folded
from cfmkit.families.vcfm.leaves.truss import TrussDiamond

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.vcfm.bought_springs_spec import BoughtSprings
    from cfmkit.families.vcfm.leaves.leaf_kind import LeafLaw
    from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Spring
    from cfmkit.families.vcfm.leaves_spec import Bistable, Positive
    from cfmkit.families.vcfm.spec import LeafMaterial, VcfmSpec


RIM = 0.75
"""Half height of rigid blocks beyond the middle of a leaf, in its thicknesses."""


@dataclass(frozen=True)
class Parts:
    """A mechanism's leaves, their laws and how many there are; of several mechanisms, columns (`laws_in_rows`)."""

    leaf: LeafLaw  # law of one half-beam of the snap-through structure
    spring: Spring | TrussDiamond  # law of the spring, as much of it as is loaded
    half_beams: Any  # leaves that carry the shuttle

    @property
    def strip(self) -> LeafStrip:
        """One leaf of the snap-through structure."""
        return self.leaf.strip

    @property
    def positive_stiffness(self) -> Any:
        """K_p as made [N/m]."""
        return self.spring.stiffness

    @property
    def negative_stiffness(self) -> Any:
        """K_n, the size of the negative stiffness of all leaves [N/m]; zero where there is none."""
        return np.maximum(self.half_beams * self.leaf.negative_stiffness, 0.0)

    @property
    def first_stiffness(self) -> Any:
        """K_b1, the stiffness of all leaves as made [N/m]."""
        return self.half_beams * self.leaf.first_stiffness

    @property
    def linear(self) -> tuple[Any, Any]:
        """Where the negative stiffness is constant, from and to [m]; NaN where it nowhere is."""
        return self.leaf.linear

    @property
    def balance(self) -> Any:
        """Travel at which the leaves carry nothing, and the spring alone decides the force [m]."""
        return self.leaf.balance


def strip_of(leaf: Positive | Bistable, made_of: LeafMaterial) -> LeafStrip:
    """Return a leaf of a specification; of the springs only the diamond's are inclined."""
    angle = 0.0 if leaf.structure in ("folded", "straight", "u-shape") else leaf.angle
    return LeafStrip(leaf.length, angle, leaf.thickness, leaf.width, made_of.modulus, made_of.poisson)


def share_of(positive: Positive) -> float:
    """Return the loaded part of the spring."""
    return 0.5 if positive.loaded == "half" else 1.0


def spring_room(spec: VcfmSpec) -> float:
    """Return how far the spring can be compressed until its blocks or its turns meet [m]; infinite where none do."""
    about, bought = spec.mechanism.positive, spec.mechanism.springs
    if about is None:
        return inf if bought is None else room_of_coils(bought)
    rims = 2.0 * RIM * about.thickness
    if about.structure == "diamond":
        return 2.0 * about.length * sin(about.angle) + spec.mechanism.frame.corner - rims
    return 2.0 * about.radius - rims if about.structure == "u-shape" and about.radius else inf


def room_of_coils(springs: BoughtSprings) -> float:
    """Return how far bought springs can be compressed until their turns meet [m]; infinite where they are pulled."""
    if springs.kind == "extension" or springs.free_length is None:
        return inf
    return max(springs.free_length - closed_length(springs), 0.0)


def closed_length(springs: BoughtSprings) -> float:
    """Return the length of a spring with its turns on each other [m]; 0 if neither it nor its wire is stated."""
    return springs.body_length or (0.0 if springs.coil is None else springs.coil.body_length)


def parts(spec: VcfmSpec) -> Parts:
    """Return the leaves of a specification with the laws that its fidelity asks for; those of `exact` are analytic."""
    mechanism = spec.mechanism
    bistable, leaf = mechanism.bistable, leaf_law(mechanism.bistable, mechanism.material)
    if mechanism.springs is not None:
        return Parts(leaf, coils(mechanism.springs), bistable.half_beams)
    positive = mechanism.flexures
    one, share = strip_of(positive, mechanism.material), share_of(positive)
    if spec.analysis.fidelity == "truss" and bistable.kind.truss is not None:
        return Parts(bistable.kind.truss(leaf.strip), TrussDiamond(one, share), bistable.half_beams)
    return Parts(leaf, _springs(one, positive, share), bistable.half_beams)


def leaf_law(bistable: Bistable, made_of: LeafMaterial) -> LeafLaw:
    """Return the closed form of one snap-through leaf, with its shape."""
    return bistable.kind.law(strip_of(bistable, made_of), bistable)


def coils(springs: BoughtSprings) -> Coils:
    """Return the law of bought springs, all of them together."""
    return Coils(springs.count * springs.rate, springs.count * springs.initial_tension)


def _springs(strip: LeafStrip, positive: Positive, share: float) -> Spring:
    kinds: dict[str, Callable[[], Spring]] = {
        "diamond": lambda: Diamond(strip, share),
        "folded": lambda: folded(strip, share),
        "straight": lambda: StraightSpring(strip, share),
        "u-shape": lambda: UShape(strip, positive.radius, share),
    }
    return kinds[positive.structure]()
