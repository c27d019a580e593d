"""The law of one snap-through leaf, and the record of a kind of leaf.

A kind of leaf is one file of this folder: a subclass of `LeafLaw`, and a record `LeafKind` that is listed in
`leaves_spec.LEAF_KINDS`. Specification, findings, figures, drawings, models and proposals read the record; none of them
compares names.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cfmkit.families.vcfm.leaves.bent_centre_line import bent_leaf
from cfmkit.families.vcfm.leaves.structure_kind import StructureKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip


@dataclass(frozen=True)
class LeafLaw(ABC):
    """Force and stress of one leaf over the travel of the shuttle, and its shape.

    Travels count from the as-made pose, positive towards the flat pose [m]. What a subclass leaves out is that of a
    straight leaf of constant thickness, or follows from its force.
    """

    strip: LeafStrip

    one_by_one: ClassVar[bool] = True
    """Whether it is a law of plain numbers only; if not, fields may be columns, and travels rows (`laws_in_rows`)."""

    @abstractmethod
    def force(self, travel: Any) -> Any:
        """Return the force of one leaf along the motion [N], on the stable branch."""

    @abstractmethod
    def stress(self, travel: Any) -> Any:
        """Return the largest stress of the leaf, bending and axial [Pa]."""

    def state(self, travel: Any) -> tuple[Any, Any]:
        """Return `force` and `stress`."""
        return self.force(travel), self.stress(travel)

    @property
    def balance(self) -> Any:
        """Travel at which the leaf carries nothing [m]: flat."""
        return self.strip.rise

    @property
    def first_stiffness(self) -> Any:
        """Stiffness as made [N/m], from the force at a thousandth of the rise."""
        small = 1e-3 * self.strip.rise
        return self.force(np.array([small]))[0] / small

    @property
    def negative_stiffness(self) -> Any:
        """Size of the negative stiffness [N/m]: that of the steepest fall of the force; zero if it only rises."""
        places = np.linspace(0.0, 2.0, 801) * self.strip.rise
        return max(0.0, -float(np.gradient(self.force(places), places).min()))

    @property
    def linear(self) -> tuple[Any, Any]:
        """Where the negative stiffness is constant, because the leaf is buckled, from and to [m]; NaN: nowhere."""
        return np.nan, np.nan

    def buckled(self, travel: Any) -> Any:
        """Return whether the leaf is buckled."""
        first, last = self.linear
        return (travel >= first) & (travel <= last)

    @property
    def overrating(self) -> Any:
        """By what share the law overestimates the largest stress at most, where that is known; else zero."""
        return 0.0

    # --- shape ------------------------------------------------------------------------------------------------------

    @property
    def profile(self) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Shares of the length, and the thicknesses there [m]; linear in between, a share given twice is a step."""
        return (0.0, 1.0), (self.strip.thickness, self.strip.thickness)

    @property
    def centre_line(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x, y [m] and slope as made, from the shuttle at (0, 0) to the wall; of a straight leaf its two ends."""
        reach, rise = float(self.strip.reach), float(self.strip.rise)
        x = np.linspace(0.0, reach, 2)
        return x, -rise * x / reach, np.full(2, -rise / reach)

    def beam_shapes(self) -> tuple[Any, Any]:
        """Return the shapes of `cfmkit.elastica` of a leaf from wall to shuttle, and of its mirror image."""
        from cfmkit.elastica import STRAIGHT

        return STRAIGHT, STRAIGHT

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]: bent into an S."""
        return bent_leaf(self.strip, travel)


@dataclass(frozen=True)
class SlendernessLimits:
    """Rise over thickness from which on leaves of a kind have a negative stiffness, and a constant one."""

    negative: float
    constant: float
    constant_text: str  # as messages write it


@dataclass(frozen=True)
class LeafKind(StructureKind):
    """A kind of snap-through leaf: everything that distinguishes it from the others."""

    law: Callable[[LeafStrip, Any], LeafLaw]  # from dimensions and material, and the keys of `mechanism.bistable`
    truss: Callable[[LeafStrip], LeafLaw] | None = None
    fidelity: str | None = None  # default of `analysis.fidelity`; None: that of the family
    buckles: bool = True  # whether a constant negative stiffness means that it is buckled, and carries nothing if flat
    limits: SlendernessLimits | None = None  # None: the curve shows whether its stiffness is negative, and constant
    shortcoming: Callable[[Any], str] | None = None  # from its law: why that is rough for all sizes; None if it is not
