"""What a model gives at some travels, whichever model it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cfmkit.families.vcfm.vbeam import VBeam

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.parts import Parts


@dataclass(frozen=True)
class Samples:
    """All leaves at some travels: force [N], largest stress [Pa], whether stable, whether buckled; (n,) each."""

    force: FloatArray
    stress: FloatArray
    stable: Any
    buckled: Any


@dataclass(frozen=True)
class Character:
    """Stiffness of spring and leaves [N/m], and where the negative one is constant [m] (NaN: nowhere).

    `negative_stiffness` is a size: positive, or zero where there is none.
    """

    positive_stiffness: float
    negative_stiffness: float
    first_stiffness: float
    linear: tuple[float, float]


class Sampler(Protocol):
    """A model of leaves and spring."""

    @property
    def problem(self) -> str:
        """Why a part could not be followed to the end; empty if all could."""

    @property
    def character(self) -> Character:
        """Stiffnesses and linear range."""

    def leaves(self, travel: FloatArray) -> Samples:
        """Return what all leaves do at some travels [m]."""

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""


class LawSampler:
    """Samples of closed forms."""

    problem = ""

    def __init__(self, parts: Parts) -> None:
        """Keep the laws."""
        self.parts = parts

    def leaves(self, travel: FloatArray) -> Samples:
        """Return what all leaves do at some travels [m]."""
        leaf = self.parts.leaf
        force, stress = leaf.state(travel) if isinstance(leaf, VBeam) else (leaf.force(travel), leaf.stress(travel))
        force = self.parts.half_beams * np.asarray(force, dtype=float)
        buckled = np.asarray(leaf.buckled(travel))
        return Samples(force, np.asarray(stress, dtype=float), np.ones(travel.shape, dtype=bool), buckled)

    def leaf_force(self, travel: FloatArray) -> FloatArray:
        """Return the force of all leaves alone [N]."""
        return np.asarray(self.parts.half_beams * np.asarray(self.parts.leaf.force(travel), dtype=float))

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""
        spring = self.parts.spring
        return np.asarray(spring.force(compression)), np.asarray(spring.stress(compression))

    @property
    def character(self) -> Character:
        """Stiffnesses and linear range by the laws."""
        parts = self.parts
        return Character(parts.positive_stiffness, parts.negative_stiffness, parts.first_stiffness, parts.linear)
