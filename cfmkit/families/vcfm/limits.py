"""What a design may be: the limits of sizes, why a target cannot be met, and the nearest that can."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sin, sqrt
from typing import TYPE_CHECKING

from cfmkit.families.findings import at_least, at_most, mm
from cfmkit.families.refusals import Infeasible
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.vbeam import STEEP, buckled_stress

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec
    from cfmkit.families.vcfm.strip import Strip

MARGIN = 1.01
"""On that where a leaf length is proposed: the exact model changes widths by less than a percent."""

SNAPPING = 3.2
"""Rise over thickness below which leaves that buckle may do so with a jump."""

ROOM = 1.02
"""On the room that is proposed: the exact stress may lengthen the spring, and so widen it."""


@dataclass(frozen=True)
class Sizes:
    """The leaves of a design, and the end of the linear region [m]."""

    leaf: Strip
    side: Strip
    linear: tuple[float, float]


def thickness_for(target: VcfmDesign) -> float:
    """Return the thickness of leaves whose linear region is as long as the stroke [m].

    Raises
    ------
    Infeasible
        If the rise is too small for the stroke, or the leaf thinner than can be made.
    """
    rise, stroke, least = target.height, target.stroke, target.min_thickness or 0.0
    free = 1.0 - (0.75 * stroke / rise) ** 2
    if free <= 0:
        # at 98 % of its limit a leaf is a fifth of the rise over pi: thin, but a leaf
        longest = 0.98 * 4.0 * rise / 3.0
        raise Infeasible(
            finding(
                "stroke_unreachable",
                f"a stroke of {mm(stroke)} ('design.stroke') needs leaves with a rise above {mm(0.75 * stroke)}; "
                f"{_given(target)} {mm(rise)}: with that no stroke reaches {mm(4.0 * rise / 3.0)}",
            ),
            {"design.stroke": at_most(longest)} if not least else {"design.stroke": at_most(_stroke_for(rise, least))},
        )
    thickness = rise * sqrt(free) / pi
    if thickness < least:
        raise Infeasible(
            finding(
                "too_thin",
                f"a stroke of {mm(stroke)} from a rise of {mm(rise)} needs leaves of {mm(thickness)}, thinner than "
                f"{mm(least)} ('design.min_thickness')",
            ),
            {"design.stroke": at_most(_stroke_for(rise, least))},
        )
    return thickness


def _given(target: VcfmDesign) -> str:
    """Return what states the rise of the leaves, up to the number."""
    if target.rise is not None:
        return "'design.rise' is"
    return "'design.force', 'design.adjustment' and 'design.preload' give"


def _stroke_for(rise: float, thickness: float) -> float:
    """Return the linear region of leaves of this thickness [m]; an eighth of the rise's limit where they have none."""
    free = 1.0 - (pi * thickness / rise) ** 2
    if free <= 0:
        raise Infeasible(
            finding(
                "too_thin",
                f"leaves of {mm(thickness)} ('design.min_thickness') with a rise of {mm(rise)} do not buckle at all: "
                f"request a rise above {mm(pi * thickness)}, by 'design.rise' or a longer 'design.preload'",
            )
        )
    return 4.0 * rise / 3.0 * sqrt(free)


def followable_stroke(rise: float, leaf: Strip) -> dict[str, str]:
    """Return the stroke from which on exact leaves buckle without a jump; nothing where that is not what is wrong."""
    if rise >= SNAPPING * leaf.thickness:
        return {}
    return {"design.stroke": at_least(_stroke_for(rise, rise / SNAPPING))}


def shortest_leaf(spec: VcfmSpec, target: VcfmDesign, thickness: float) -> float:
    """Return the shortest leaf within the allowable stress and 15 deg [m]."""
    made, rise = spec.mechanism.material, target.height
    root = pi * thickness / rise
    u = min(1.0, 2.0 / 3.0 * (1.0 + sqrt(1.0 - root * root)))
    stressed = buckled_stress(rise, thickness, u)
    return max(sqrt(made.modulus / (spec.mechanism.allowable_stress or 1.0) * stressed), rise / sin(STEEP))


def check_room(target: VcfmDesign, sizes: Sizes) -> None:
    """Raise if the design needs more room than there is."""
    spans = {"leaves": 2.0 * float(sizes.leaf.reach), "spring": 2.0 * float(sizes.side.reach)}
    widths = {"leaves": sizes.leaf.width, "spring": sizes.side.width}
    for path, limit, found in (("max_span", target.max_span, spans), ("max_width", target.max_width, widths)):
        name = max(found, key=lambda key: found[key])
        if limit is not None and found[name] > limit * (1 + 1e-9):
            words = "across the motion" if path == "max_span" else "out of the plane"
            verb = "need" if name == "leaves" else "needs"
            raise Infeasible(
                finding("envelope", f"the {name} {verb} {mm(found[name])} {words}, 'design.{path}' gives {mm(limit)}"),
                {f"design.{path}": at_least(ROOM * found[name])},
            )
