"""Helical springs of round wire: what all kinds have in common, and the formulas of those loaded along their axis.

With d the wire, D the mean coil diameter, n the active turns and c = D/d:

    along the axis   k = G d^4 / (8 D^3 n),    tau = K_W 8 F D / (pi d^3),  K_W = (4c-1)/(4c-4) + 0.615/c

K_W is Wahl's factor of curvature and direct shear. A kind is a subclass in a file of its own and a line in `kinds.py`;
specification, catalogue, designs, findings and drawings read the class: none of them compares names.

Assumes: round wire, small pitch, no friction between turns.

Reference
---------
[W] A. M. Wahl, Mechanical Springs, 2nd ed., McGraw-Hill (1963).
[Sh] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill (2011), chapter 10.
[Norton] R. L. Norton, Machine Design, Prentice Hall, chapter on springs: clearance of a spring in a hole or on a rod.
"""

from __future__ import annotations

import math
from abc import ABC
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from cfmkit.stock.springs.wire_materials import MUSIC_WIRE, WIRES_BY_NAME, WireName, WireOutOfRange

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.stock.springs.wire_materials import YieldShares

SHEAR_MODULUS, YOUNGS_MODULUS = MUSIC_WIRE.shear_modulus, MUSIC_WIRE.youngs_modulus
"""Moduli of music wire [Pa], taken for a spring whose list states none."""

tensile_strength = MUSIC_WIRE.tensile_strength
"""Smallest tensile strength of music wire of a diameter [m] in [Pa]; refuses diameters that its table does not list."""

Seats = Literal["fixed-fixed", "fixed-pivoted", "pivoted-pivoted", "fixed-free"]

SEAT_FACTORS: Mapping[Seats, float] = MappingProxyType(
    {"fixed-fixed": 0.5, "fixed-pivoted": 0.707, "pivoted-pivoted": 1.0, "fixed-free": 2.0}
)
"""alpha, by which the free length counts in buckling [Sh, Table 10-2]; a fixed end stands flat on a plate."""
SMALL_HOLE, SMALL_HOLE_CLEARANCE, ROD_CLEARANCE = 0.013, 0.10, 0.05
"""Inner diameter below which a spring is small [m]; clearance of small and of larger springs on a rod, as shares of it
[Norton]."""
MAX_GUIDE_CLEARANCE = 0.20
"""Largest clearance of a guide, in diameters of the inside (rod) or outside (tube): twice that of [Norton], assumed. A
spring in a looser guide bows as far as the clearance lets it."""


@dataclass(frozen=True)
class HelicalSpring(ABC):
    """Helical spring of round wire; its subclasses are the kinds."""

    wire: float  # diameter [m]
    coil: float  # mean diameter [m]
    turns: float  # active turns, which bend or twist
    shear_modulus: float = SHEAR_MODULUS  # of the wire [Pa]
    youngs_modulus: float = YOUNGS_MODULUS  # of the wire [Pa]
    material: WireName | None = MUSIC_WIRE.name  # class of the wire, which its moduli may differ from; None: unknown

    # --- what a kind states -----------------------------------------------------------------------------------------

    kind: ClassVar[str]
    """How a specification calls it."""
    dimension: ClassVar[Literal["length", "angle"]] = "length"
    """Of its deflection; its load is a force or a couple."""
    rate_key: ClassVar[str] = "stiffness"
    largest_keys: ClassVar[tuple[str, str]] = ("max_elongation", "max_load")
    """Keys of a list of springs: its rate, its largest deflection and load."""
    lengthening: ClassVar[float] = 0.0
    """By how much it is longer per deflection: 1 if it is pulled, -1 if it is pressed."""
    wire_stress: ClassVar[Literal["shear", "bending"]] = "shear"
    """Decides which shares of the strength of its wire it may have."""
    idle_turns: ClassVar[float] = 1.0
    """Turns of its body beyond the active ones: two halves, if nothing closes its ends."""
    has_initial_tension: ClassVar[bool] = False
    needs_guide: ClassVar[bool] = False
    """Whether it may buckle, so that seats and a guide are stated of it."""
    series_turns: ClassVar[tuple[int, ...]] = (6, 8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100, 125, 160)
    """Turns of the generic series: preferred numbers (ISO 3, R10)."""

    @classmethod
    def unguided_deflection(
        cls, _free_length: float | None, _wound: HelicalSpring | None, _outer_diameter: float | None, _seats: Seats
    ) -> float:
        """Return the deflection up to which it does not buckle [m]; infinite if never, or if that is not known."""
        return math.inf

    @classmethod
    def deflection_until_closed(cls, _free_length: float | None, _body_length: float | None) -> float:
        """Return the deflection at which its turns touch [m]; infinite if they never do, or if a length is unknown."""
        return math.inf

    def free_length_for(self, _largest: Any) -> Any:
        """Return the relaxed length with usual ends of one that is deflected so far at most [m]."""
        return self.body_length

    def room_for(self, deflection: Any) -> Any:
        """Return how long the place for one with usual ends must be that is deflected so far [m]."""
        return self.free_length_for(deflection)

    @property
    def usual_initial_tension(self) -> tuple[float, float]:
        """Range of initial tension that it is easily wound with [N]; zero where the kind has none."""
        return 0.0, 0.0

    # --- formulas ---------------------------------------------------------------------------------------------------

    @property
    def index(self) -> float:
        """Coil diameter over wire diameter, c."""
        return self.coil / self.wire

    @property
    def rate(self) -> float:
        """Force per deflection [N/m], or couple per angle [N m/rad]."""
        return self.shear_modulus * self.wire**4 / (8.0 * self.coil**3 * self.turns)

    def stress(self, load: float) -> float:
        """Return the largest stress in the turns [Pa] under a force [N] or a couple [N m]: shear, or bending."""
        c = self.index
        curved = (4.0 * c - 1.0) / (4.0 * c - 4.0) + 0.615 / c
        return curved * 8.0 * load * self.coil / (math.pi * self.wire**3)

    def loop_stress(self, _load: float) -> float | None:
        """Return the largest bending stress in the loops at its ends [Pa] under a force [N]; None if it has none."""
        return None

    @property
    def strength(self) -> tuple[float, YieldShares]:
        """Tensile strength of the wire [Pa], and the shares of it at which springs yield.

        Raises WireOutOfRange if no strength is published for this diameter, or the class of the wire is not known.
        """
        if self.material is None:
            raise WireOutOfRange("the class of the wire is not known, nor its strength: state 'material'")
        wire = WIRES_BY_NAME[self.material]
        return wire.tensile_strength(self.wire), wire.yields

    def yield_load(self) -> Any:
        """Return the force [N] or couple [N m] at which it yields; of an array of coils, of each.

        Raises WireOutOfRange as `strength` does.
        """
        strength, shares = self.strength
        return getattr(shares, self.wire_stress) * strength / self.stress(1.0)

    @property
    def body_length(self) -> float:
        """Length of the coil with its turns on each other [m]."""
        return (self.turns + self.idle_turns) * self.wire

    @property
    def outer_diameter(self) -> float:
        """Coil and wire [m]."""
        return self.coil + self.wire

    @property
    def inner_diameter(self) -> float:
        """Coil without wire [m]."""
        return self.coil - self.wire

    def inner_diameter_at(self, _deflection: float) -> float:
        """Return the inner diameter at a deflection [m]: with a small pitch that of the relaxed spring."""
        return self.inner_diameter

    def deflection_at(self, stress: float) -> float:
        """Return the deflection [m] or angle [rad] at a stress in the wire [Pa]."""
        return stress / (self.stress(1.0) * self.rate)

    @property
    def thickest_guide_rod(self) -> float:
        """Diameter of the thickest rod that guides the spring with clearance [m]."""
        inner = self.inner_diameter
        return inner * (1.0 - (SMALL_HOLE_CLEARANCE if inner < SMALL_HOLE else ROD_CLEARANCE))

    @property
    def thinnest_guide_rod(self) -> float:
        """Diameter of the thinnest rod that still guides a compression spring [m]."""
        return self.inner_diameter * (1.0 - MAX_GUIDE_CLEARANCE)

    @property
    def widest_guide_tube(self) -> float:
        """Inner diameter of the widest tube that still guides a compression spring [m]."""
        return self.outer_diameter * (1.0 + MAX_GUIDE_CLEARANCE)


def inner_curvature(index: float) -> float:
    """Return K_i, the factor on the stress at the inner side of a bent bar, (4c^2-c-1)/(4c(c-1)) [Sh, eq. 10-43]."""
    return (4.0 * index * index - index - 1.0) / (4.0 * index * (index - 1.0))
