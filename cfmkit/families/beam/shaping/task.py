"""Task of a shape design: the network, what may vary, the window, and what must hold."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from cfmkit.families.beam.contacts import named_force, numbers_of, sense_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.elastica.sensitivity import Gradient
    from cfmkit.specs.evaluable_target_curve import TargetCurve

Objective = Literal["ripple", "range", "paper"]

BENDING_ONLY = "inextensible"  # the model of beams that bend only, as ``analysis.fidelity`` names it
STRESS_MARGIN = 2e-3
"""The search asks for so much less stress and slimmer beams: the stress peaks between its poses and places, too."""
MAX_START_ORDER = 3
"""Orders above that are for what was widened: a start in them takes longer and ends in the same families of shapes."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a node that may vary, 0 for x and 1 for y, between two places [m]."""

    node: str
    axis: int
    low: float
    high: float

    @property
    def name(self) -> str:
        """As reports call it: ``n3.x``."""
        return f"{self.node}.{'xy'[self.axis]}"


@dataclass(frozen=True)
class TaskLimits:
    """Limits that must hold; None: not asked."""

    stress: float | None = (
        None  # largest stress at every pose [Pa]: by the margin `STRESS_MARGIN` below the allowable one
    )
    envelope: tuple[float, float, float, float] | None = None  # where the centre lines must lie before loading [m]
    deformed_envelope: tuple[float, float, float, float] | None = None  # the same at every pose
    length_ratio: float | None = 1.5  # largest length over distance of the ends [1]
    slenderness: float | None = 10.0  # least length over thickness [1]
    clearance: float | None = None  # least gap between the surfaces of beams, before and under load [m]
    # near a joint the gap between centre lines grows at least so fast with the way around the joint [1]
    opening: float = 0.35
    radius: float | None = None  # least radius of curvature of a centre line before loading [m]
    # force_min, force_target, force_tolerance: least mean force over the window, and a mean force to meet within a
    # share [N, N, 1]
    force_min: float | None = None
    force_target: float | None = None
    force_tolerance: float = 0.01


@dataclass(frozen=True)
class Task:
    """A network to be shaped."""

    network: Network  # as it stands: fixed nodes, sections, supports; the start where its shapes are wanted
    # driven, direction: the node that is moved, and where to [rad]
    driven: str
    direction: float
    copies: float  # forces of the mechanism are so many times those of the network
    window: tuple[float, float]  # displacements between which the force is to be constant [m]
    coordinates: tuple[Coordinate, ...]  # what may vary of the nodes
    shaped: tuple[str, ...]  # the beams whose shape may vary
    orders: tuple[int, ...] = (0, 1, 2)  # orders of the shape polynomials, from coarse to fine
    coefficient_limit: float = 0.5 * np.pi  # largest coefficient [rad]
    limits: TaskLimits = field(default_factory=TaskLimits)  # what must hold
    # "ripple": flattest over the window; "range": the widest window with `half_band`; "paper": F(a)/F(b) - 1
    objective: Objective = "range"
    half_band: float = 0.025  # (max - min)/(max + min) that is to hold over the widest window [1]
    compared: tuple[float, float] | None = None  # a and b of the objective of the paper [m]
    points: int = 17  # poses in the window
    fidelity: str = BENDING_ONLY  # the model of the network, as ``analysis.fidelity`` names it
    total_stress: bool = False  # whether the axial part counts as stress, too: as in the analysis of the design
    safety_factor: float = 1.0  # yield strength over allowable stress [1]
    # how many of the network stand in series in the mechanism: its displacements are so many times as large
    layers: int = 1
    contact: str | None = None  # stop or obstacle whose force on one copy is to be constant; None: the drive's
    # force over the mechanism's displacements that is wanted, as a share of its mean in the window; None: constant
    shape: TargetCurve | None = None
    # the network with beams that bend only, which a start begins with; None if those of the network do no more
    bending_only: Network | None = None

    @property
    def first(self) -> Task:
        """The same with beams that bend only: the model in which a start begins."""
        if self.bending_only is None:
            return self
        return replace(self, network=self.bending_only, fidelity=BENDING_ONLY, total_stress=False, bending_only=None)

    @property
    def started(self) -> Task:
        """The same in the orders that starts are searched in: where windows are widened, the fine ones come after."""
        coarse = tuple(order for order in self.orders if order <= MAX_START_ORDER)
        return replace(self, orders=coarse) if coarse and self.objective == "range" else self

    @property
    def allowable_stress(self) -> float | None:
        """The stress that the analysis allows [Pa]; None if it is not limited."""
        return None if self.limits.stress is None else self.limits.stress / (1 - STRESS_MARGIN)

    def force(self, path: Path) -> FloatArray:
        """Return the force that is to be constant, of the drive or of a contact, at all points of a path, (n,) [N]."""
        return path.effort * self.copies if self.contact is None else named_force(path, self.contact)

    def force_slopes(self, slopes: Gradient) -> FloatArray:
        """Return the derivatives of that force, (p, k)."""
        if self.contact is None:
            return slopes.effort * self.copies
        numbers = numbers_of(self.network.contacts, self.contact)
        return np.asarray(sum(sense_of(self.network.contacts[k]) * slopes.contact_force(k) for k in numbers))

    @cached_property
    def size(self) -> float:
        """The unit of length: the largest distance along an axis of coordinates that do not vary, and of ranges [m].

        It does not depend on where the free nodes are: a design that is designed again comes out the same.
        """
        free = {
            (coordinate.node, coordinate.axis): (coordinate.low, coordinate.high) for coordinate in self.coordinates
        }
        spans = []
        for axis in (0, 1):
            places = [free.get((name, axis), ((node.x, node.y)[axis],)) for name, node in self.network.nodes.items()]
            spans.append(np.ptp([value for some in places for value in some]))
        return float(max(spans))
