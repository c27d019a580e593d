"""The law of a spring of leaves, and the record of a kind of such springs.

A kind of spring is a subclass of `LeafSpring`, and a record `SpringKind` that is listed in `leaves_spec.SPRING_KINDS`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from cfmkit.families.vcfm.leaves.structure_kind import StructureKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Section, Support
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip

    Edge = list[Any]  # corners (x, y) [m], and arcs of `cfmkit.export.contours`

RIM = 0.75
"""Half height of rigid blocks beyond the middle of a leaf, in its thicknesses."""


class SpringLaw(Protocol):
    """Force and stress of a whole spring over its compression."""

    @property
    def stiffness(self) -> Any:
        """K_p as made [N/m]."""

    def force(self, compression: Any) -> Any:
        """Return the force [N] at a compression [m]."""

    def stress(self, compression: Any) -> Any:
        """Return the largest stress [Pa]."""


@dataclass(frozen=True)
class SpringChain:
    """A part of the spring that is traced: its network, the node that moves, and how it counts."""

    network: Network
    node: str
    travel: float  # share of the compression that the node moves
    count: float  # number of such parts in parallel


@dataclass(frozen=True)
class LeafSpring(ABC):
    """A spring of leaves, with its shape: x = 0 is its middle, and it is compressed along y."""

    strip: LeafStrip

    deflection_limits: ClassVar[tuple[float, float] | None] = None
    """Deflection of a leaf over its length up to which the law holds, pressed and stretched; None: it always does."""

    @property
    @abstractmethod
    def stiffness(self) -> Any:
        """K_p as made [N/m]."""

    def force(self, compression: Any) -> Any:
        """Return the force [N] at a compression [m]."""
        return self.stiffness * compression

    @abstractmethod
    def stress(self, compression: Any) -> Any:
        """Return the largest stress [Pa]."""

    @abstractmethod
    def chain(self, section: Section) -> SpringChain:
        """Return what is traced of it by the exact model."""

    @abstractmethod
    def edges(self, block: float, corner: float, fillet: float, top: float) -> tuple[Edge, Edge, float]:
        """Return outer and inner edge of the right half between its blocks, from the top down, and its lowest point.

        The inner edge is empty where the two blocks are one.

        Parameters
        ----------
        block, corner, fillet : float
            Width of blocks, height of rigid corners, radius of inside corners [m].
        top : float
            Height of its upper end [m].
        """

    @abstractmethod
    def solved_half(self, edges: tuple[Edge, Edge, float], half: float) -> tuple[Edge, float, Edge, bool]:
        """Return what symmetry leaves for the model of solids, from the edges of a spring with its upper end at zero.

        Its edge from the upper block down and around to x = 0, the lower end of the block that is driven, the corners
        of what is held, and whether that moves across as it likes. `half` is half of the width of a block [m].
        """

    @abstractmethod
    def bent_lines(self, compression: float, corner: float) -> tuple[list[FloatArray], float]:
        """Return the centre lines of the right chain from below, between rigid corners, and its height [m]."""

    def room(self, _corner: float) -> float:
        """Return by how much it can be compressed until its blocks meet [m]; infinite if they do not."""
        return np.inf

    def opening(self, corner: float, needed: float) -> tuple[str, float]:
        """Return which key of `mechanism` gives it more room, and its value for so much more [m]."""
        return "frame.corner", corner + needed


def leaf_stress(strip: LeafStrip, deflection: Any) -> Any:
    """Return the bending stress at the ends of a leaf that is deflected by so much [m], in Pa."""
    e, t, length = strip.youngs_modulus, strip.thickness, strip.length
    return 3.0 * e * t * np.abs(deflection) * np.cos(strip.angle) / length**2


def leaf_chain(strip: LeafStrip, section: Section, support: Support, travel: float, count: float) -> SpringChain:
    """Return one leaf, clamped at one end, as what is traced of a spring."""
    from cfmkit.elastica import CLAMPED, Beam, Network, Node

    nodes = {"wall": Node(0, 0, CLAMPED), "end": Node(strip.reach, strip.rise, support)}
    return SpringChain(Network(nodes, {"leaf": Beam("wall", "end", section)}), "end", travel, count)


@dataclass(frozen=True)
class SpringKind(StructureKind):
    """A kind of spring of leaves: everything that distinguishes it from the others."""

    law: Callable[
        [LeafStrip, Any, float], LeafSpring
    ]  # from a leaf, the keys of `mechanism.positive`, the loaded share
    truss: Callable[[LeafStrip, float], SpringLaw] | None = None
    is_linear: bool = True  # whether its stiffness is constant
    stands_on_ends: bool = False  # whether its two ends stand, and its middle is driven
    drawing_note: str = ""  # on the drawing of the whole spring
