"""Leaves and spring of a specification: their laws, stiffnesses and linear range, and the room that the spring has."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils

if TYPE_CHECKING:
    from cfmkit.families.vcfm.leaves.kinds import LeafLaw, LeafSpring
    from cfmkit.families.vcfm.leaves_spec import Bistable, Positive
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings
    from cfmkit.stock.material_and_part_spec import MaterialSpec


@dataclass(frozen=True)
class LeafLaws:
    """A mechanism's leaves, their laws and how many there are; of several mechanisms, columns (`leaves.kinds`)."""

    leaf: LeafLaw  # law of one half-beam of the snap-through structure
    spring: LeafSpring | Coils  # law of the spring, as much of it as is loaded
    half_beams: Any  # leaves that carry the shuttle

    @property
    def strip(self) -> LeafStrip:
        """One leaf of the snap-through structure."""
        return self.leaf.strip

    @property
    def positive_stiffness(self) -> Any:
        """K_p, unloaded [N/m]."""
        return self.spring.stiffness

    @property
    def negative_stiffness(self) -> Any:
        """K_n, the size of the negative stiffness of all leaves [N/m]; zero where there is none."""
        return np.maximum(self.half_beams * self.leaf.negative_stiffness, 0.0)

    @property
    def first_stiffness(self) -> Any:
        """K_b1, the stiffness of all unloaded leaves [N/m]."""
        return self.half_beams * self.leaf.first_stiffness

    @property
    def linear_range(self) -> tuple[Any, Any]:
        """Range of constant negative stiffness, from and to [m]; NaN where it nowhere is."""
        return self.leaf.linear_range

    @property
    def balance(self) -> Any:
        """Travel at which the leaves carry nothing, and the spring alone decides the force [m]."""
        return self.leaf.balance


def strip_of(leaf: Positive | Bistable, made_of: MaterialSpec) -> LeafStrip:
    """Return a leaf of a specification."""
    angle = leaf.angle if leaf.kind.is_inclined else 0.0
    return LeafStrip(leaf.length, angle, leaf.thickness, leaf.width, made_of.modulus, made_of.poisson)


def share_of(positive: Positive) -> float:
    """Return the loaded part of the spring."""
    return 0.5 if positive.loaded == "half" else 1.0


def spring_room(spec: VcfmSpec) -> float:
    """Return how far the spring can be compressed until its blocks or its turns meet [m]; infinite where none do."""
    about, bought = spec.mechanism.positive, spec.mechanism.springs
    if about is None:
        return inf if bought is None else room_of_coils(bought)
    return leaf_spring(about, spec.mechanism.material).room(spec.mechanism.frame.corner)


def room_of_coils(springs: BoughtSprings) -> float:
    """Return how far bought springs can be compressed until their turns meet [m]; infinite where they are pulled."""
    return max(springs.spring_type.deflection_until_closed(springs.free_length, closed_length(springs)), 0.0)


def closed_length(springs: BoughtSprings) -> float:
    """Return the length of a spring with its turns on each other [m]; 0 if neither it nor its wire is stated."""
    return springs.body_length or (0.0 if springs.coil is None else springs.coil.body_length)


def parts(spec: VcfmSpec) -> LeafLaws:
    """Return the leaves of a specification with the laws that its fidelity asks for; those of `exact` are analytic."""
    mechanism = spec.mechanism
    bistable, leaf = mechanism.bistable, leaf_law(mechanism.bistable, mechanism.material)
    if mechanism.springs is not None:
        return LeafLaws(leaf, Coils.from_springs(mechanism.springs), bistable.half_beams)
    positive = mechanism.flexures
    spring, truss = leaf_spring(positive, mechanism.material), (bistable.kind.truss, positive.kind.truss)
    if spec.analysis.fidelity == "truss" and truss[0] is not None and truss[1] is not None:
        return LeafLaws(truss[0](leaf.strip), truss[1](spring.strip, share_of(positive)), bistable.half_beams)
    return LeafLaws(leaf, spring, bistable.half_beams)


def leaf_law(bistable: Bistable, made_of: MaterialSpec) -> LeafLaw:
    """Return the closed form of one snap-through leaf, with its shape."""
    return bistable.kind.law(strip_of(bistable, made_of), bistable)


def leaf_spring(positive: Positive, made_of: MaterialSpec) -> LeafSpring:
    """Return the closed form of a spring of leaves, as much of it as is loaded, with its shape."""
    return positive.kind.law(strip_of(positive, made_of), positive, share_of(positive))
