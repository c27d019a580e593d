"""Kinds of leaves that snap through and of springs of leaves: what the law of one gives, and the record of a kind.

A kind is a subclass of `LeafLaw` or `LeafSpring` and a record `LeafKind` or `SpringKind`, both in one file of this
folder; the record is listed in `leaves_spec`. Specification, findings, figures, drawings, models and
proposals read the record and the law: none of them compares names. Laws of several leaves stand as one law, one leaf a
row: numbers become columns (r, 1), and travels are (r, n).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from cfmkit.families.vcfm.leaves.s_form import bent_leaf

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Section
    from cfmkit.export.posed_part import PosedBody
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip

    Edge = list[Any]  # corners (x, y) [m], and arcs of `cfmkit.export.contours`
    Edges = tuple[Edge, Edge, float]


@dataclass(frozen=True)
class LeafLaw(ABC):
    """Force and stress of one leaf over the travel of the shuttle, and its shape.

    Travels count from the unloaded position, positive towards the flat pose [m]. What a subclass leaves out is that of
    a straight leaf of constant thickness, or follows from its force.
    """

    strip: LeafStrip

    one_by_one: ClassVar[bool] = True
    """Whether it is a law of plain numbers only; if not, fields may be columns, and travels rows (`stack_laws`)."""

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
        """Stiffness, unloaded [N/m], from the force at a thousandth of the rise."""
        small = 1e-3 * self.strip.rise
        return self.force(np.array([small]))[0] / small

    @property
    def negative_stiffness(self) -> Any:
        """Size of the negative stiffness [N/m]: that of the steepest fall of the force; zero if it only rises."""
        places = np.linspace(0.0, 2.0, 801) * self.strip.rise
        force = self.force(places)
        rows = zip(np.atleast_2d(force), np.broadcast_to(places, np.atleast_2d(force).shape), strict=True)
        falls = np.array([[max(0.0, -float(np.gradient(*row).min()))] for row in rows])
        return falls if np.ndim(force) == 2 else falls.item()

    @property
    def linear_range(self) -> tuple[Any, Any]:
        """Range of constant negative stiffness, because the leaf is buckled, from and to [m]; NaN: nowhere."""
        return np.nan, np.nan

    def is_buckled(self, travel: Any) -> Any:
        """Return whether the leaf is buckled."""
        first, last = self.linear_range
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
        """x, y [m] and slope, unloaded, from the shuttle at (0, 0) to the wall; of a straight leaf its two ends."""
        reach, rise = float(self.strip.reach), float(self.strip.rise)
        x = np.linspace(0.0, reach, 2)
        return x, -rise * x / reach, np.full(2, -rise / reach)

    def beam_shapes(self) -> tuple[Any, Any]:
        """Return the shapes of `cfmkit.elastica` of a leaf from wall to shuttle, and of its mirror image."""
        from cfmkit.elastica import STRAIGHT_SHAPE

        return STRAIGHT_SHAPE, STRAIGHT_SHAPE

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]: bent into an S."""
        return bent_leaf(self.strip, travel)


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
        """Stiffness of the unloaded spring, K_p of Ding [N/m]."""

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
    def edges(self, block: float, corner: float, fillet: float, top: float) -> Edges:
        """Return outer and inner edge of the right half between its blocks, from the top down, and the lowest y.

        The inner edge is empty where the two blocks are one.

        Parameters
        ----------
        block, corner, fillet : float
            Width of blocks, height of rigid corners, radius of inside corners [m].
        top : float
            Height of its upper end [m].
        """

    @abstractmethod
    def solved_piece(self, edges: Edges, half: float) -> tuple[Edge, float, Edge, bool]:
        """Return what symmetry leaves for the model of solids, from the edges of a spring with its upper end at zero.

        Its edge from the upper block down and around to x = 0, the lower end of the block that is driven, the corners
        of what is held, and whether that moves across as it likes. `half` is half of the width of a block [m].
        """

    @abstractmethod
    def bent_lines(self, compression: float, corner: float) -> tuple[list[FloatArray], float]:
        """Return the centre lines of the right chain from below, between rigid corners, and its height [m]."""

    def rim(self, _fillet: float) -> float:
        """Return how far its rigid corners reach beyond the middles of their leaves [m]; zero if it has none."""
        return 0.0

    def blocks(
        self, block: float, corner: float, fillet: float, top: float, compression: float
    ) -> tuple[float, list[PosedBody]]:
        """Return the height at which its `bent_lines` begin [m], and its rigid blocks at a compression [m].

        Of those beside x = 0 the right ones; `edges` describes the other parameters.
        """
        from cfmkit.export.posed_part import PosedBody, rectangle

        lines, height = self.bent_lines(compression, corner)
        half, rim, foot = 0.5 * block, self.rim(fillet), top - block - height
        over = 0.5 * self.strip.thickness / float(np.cos(self.strip.angle))
        bodies = [
            PosedBody.polygon("block", "driven", rectangle(-half, top - block - over, half, top)),
            PosedBody.polygon("base", "held", rectangle(-half, foot - block, half, foot + over)),
        ]
        for x, y in ((half + line[-1, 0], foot + line[-1, 1]) for line in lines[:-1]):
            bodies.append(PosedBody.polygon("corner", "free", rectangle(x, y - rim, x + block, y + corner + rim)))
        return foot, bodies

    def room(self, _corner: float) -> float:
        """Return by how much it can be compressed until its blocks meet [m]; infinite if they do not."""
        return np.inf

    def opening(self, corner: float, needed: float) -> tuple[str, float]:
        """Return which key of `mechanism` gives it more room, and its value for so much more [m]."""
        return "frame.corner", corner + needed


@dataclass(frozen=True)
class ProposedStructure:
    """Another structure in place of the designed leaves, or of the designed diamond, as `suggest` proposes it."""

    name: str
    variant: str  # what two Vs and a diamond are called with it
    turn: int  # the order in which variants are tried, see `proposals.VARIANT_ORDER`
    changes: Callable[[Any], dict[str, Any]]  # from the block as designed: keys of it -> values


@dataclass(frozen=True)
class StructureKind:
    """Base of kinds of leaves and kinds of springs."""

    name: str  # in `structure` of its block
    description: str  # as the documentation of that key lists it
    law: Callable[..., Any]
    needs: Mapping[str, str] = field(default_factory=dict)  # keys that must be given -> what they are of
    truss: Callable[..., Any] | None = None  # law of the fidelity `truss`; None if it has none
    is_inclined: bool = True  # whether its leaves have an angle
    lengths: tuple[str, ...] = ()  # keys of its own that grow with its leaves
    can_be_designed: bool = False  # whether `cfmkit design` has sizing rules for it
    proposal: ProposedStructure | None = None  # None: not proposed


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


@dataclass(frozen=True)
class SpringKind(StructureKind):
    """A kind of spring of leaves: everything that distinguishes it from the others."""

    law: Callable[[LeafStrip, Any, float], LeafSpring]  # from a leaf, keys of `mechanism.positive`, the loaded share
    truss: Callable[[LeafStrip, float], LeafSpring] | None = None
    is_linear: bool = True  # whether its stiffness is constant
    stands_on_ends: bool = False  # whether its two ends stand, and its middle is driven
    drawing_note: str = ""  # on the drawing of the whole spring


LawT = TypeVar("LawT")


def stack_laws(laws: Sequence[LawT]) -> LawT:
    """Return laws of one kind as one law with a row for each; one alone is returned as it is, with plain numbers.

    Examples
    --------
    >>> from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
    >>> stack_laws([Coils(100.0), Coils(200.0)]).force(0.1).tolist()
    [[10.0], [20.0]]
    """
    first: Any = laws[0]
    if len(laws) == 1:
        return laws[0]
    if getattr(first, "one_by_one", False):  # its tables and searches are not arrays over leaves
        column = np.empty((len(laws), 1), dtype=object)
        column[:, 0] = laws
        return LawsOneByOne(column)  # type: ignore[return-value]
    if not is_dataclass(first):
        return np.array(laws, dtype=float)[:, None]  # type: ignore[return-value]
    columns = {item.name: stack_laws([getattr(law, item.name) for law in laws]) for item in fields(first)}
    return type(laws[0])(**columns)


@dataclass(frozen=True)
class LawsOneByOne:
    """Laws that are asked one after the other, each for its row of travels (r, n)."""

    column: NDArray[np.object_]  # (r, 1)
    one_by_one: ClassVar[bool] = True

    @property
    def laws(self) -> list[Any]:
        """The law of each row."""
        return list(self.column[:, 0])

    @cached_property
    def strip(self) -> Any:
        """The leaves' dimensions, a row each."""
        return stack_laws([law.strip for law in self.laws])

    def force(self, travel: FloatArray) -> FloatArray:
        """Return the force of each leaf along the motion [N]."""
        return np.asarray(self._evaluate_each("force", travel))

    def stress(self, travel: FloatArray) -> FloatArray:
        """Return the largest stress of each leaf [Pa]."""
        return np.asarray(self._evaluate_each("stress", travel))

    def state(self, travel: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return `force` and `stress`."""
        return self.force(travel), self.stress(travel)

    def is_buckled(self, travel: FloatArray) -> Any:
        """Return whether each leaf is buckled."""
        return self._evaluate_each("is_buckled", travel)

    def _evaluate_each(self, name: str, travel: FloatArray) -> Any:
        travel_rows = np.broadcast_to(travel, (len(self.laws), travel.shape[1]))
        return np.stack([np.asarray(getattr(law, name)(row)) for law, row in zip(self.laws, travel_rows, strict=True)])

    def __getattr__(self, name: str) -> Any:
        """Return what the laws know of themselves: a column, or a column for each of several numbers."""
        if name.startswith("__"):
            raise AttributeError(name)
        values = np.array([np.ravel(getattr(law, name)) for law in self.laws], dtype=float)
        return values if values.shape[1] == 1 else tuple(column[:, None] for column in values.T)
