"""Leaves and spring as wide as the sheet is thick: their lengths, the angle, the thickness of the spring and the number
of leaves follow from the force instead of the widths.

A leaf's stiffness goes with n b t^3/L^3, its stress with t/L^2; t follows from the stroke. So its length follows from
the width; where that is shorter than the stress allows, there are more leaves. A spring's stiffness goes with b t^3/L^3
and its stress with t/L^2, too: both together give its thickness and length.
"""

from __future__ import annotations

from dataclasses import replace
from math import asin, ceil
from typing import TYPE_CHECKING

from cfmkit.families.findings import at_least, mm, mpa
from cfmkit.families.no_mechanism import Infeasible
from cfmkit.families.vcfm.findings import finding
from cfmkit.families.vcfm.leaf_sizing import SQUAT, sized_leaf

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    from cfmkit.families.vcfm.spec import VcfmDesign, VcfmSpec

ROUNDS = 40
"""Of iterations that end after five, since forces and stresses are powers of the sizes within a few per cent."""
CLOSE = 1e-6
"""Share of the width that is left when sizes are found."""
PASSES, NEAR = 12, 1e-5
"""Of the exact model for a sheet, and how far its force may then be off: five passes are usual."""
MOST_LEAVES = 1000
"""As `mechanism.bistable.half_beams` allows."""


def leaves_for(have: int, wanted: float, sheet: float) -> int:
    """Return the number of leaves that is no smaller than one that is wanted, whole Vs more than there are.

    Raises
    ------
    Infeasible
        If a mechanism cannot have as many.
    """
    count = have + 2 * max(0, ceil((wanted - have) / 2.0 - 1e-9))
    if count > MOST_LEAVES:
        told = f"from a sheet of {mm(sheet)} ('mechanism.part.sheet') {count} leaves would have to be cut"
        raise Infeasible(finding("envelope", f"{told}, {MOST_LEAVES} at most: use a thicker sheet"))
    return count


def leaf_of_sheet(
    spec: VcfmSpec, target: VcfmDesign, thickness: float, shortest: float, sheet: float
) -> tuple[int, LeafStrip]:
    """Return how many leaves the sheet needs, and one of them.

    Parameters
    ----------
    spec, target : VcfmSpec, VcfmDesign
    thickness : float
        In the plane [m].
    shortest : float
        Shortest leaf within the stress [m].
    sheet : float
        Their width [m].

    Raises
    ------
    Infeasible
        If the sheet is so thin that leaves would buckle out of the plane, or that there would be too many.
    """
    if sheet < SQUAT * thickness:
        least = at_least(SQUAT * thickness)
        paths = ("part.sheet", "bistable.width", *(["positive.width"] if spec.mechanism.positive else []))
        raise Infeasible(
            finding(
                "out_of_plane_buckling",
                f"leaves of {mm(thickness)} from a sheet of {mm(sheet)} ('mechanism.part.sheet') would buckle out of "
                f"the plane: below twice the thickness they do; a sheet of {least} is enough",
            ),
            {f"mechanism.{path}": least for path in paths},
        )
    leaf, have = sized_leaf(spec, target, thickness, shortest), spec.mechanism.bistable.half_beams
    count = leaves_for(have, have * leaf.width / sheet, sheet)
    for _ in range(ROUNDS):
        wide = leaf.width * have / count / sheet
        if abs(wide - 1.0) < CLOSE:
            break
        leaf = sized_leaf(spec, target, thickness, float(leaf.length) * wide ** (-1.0 / 3.0))
    return count, replace(leaf, width=sheet)


def side_of_sheet(sized: Callable[[float], LeafStrip], side: LeafStrip, least: float, sheet: float) -> LeafStrip:
    """Return a leaf of the spring as wide as the sheet is thick.

    Parameters
    ----------
    sized : callable
        The leaf of some thickness that the stress allows, with the width that its stiffness needs.
    side : LeafStrip
        One of them.
    least : float
        Thinnest leaf that can be made [m].
    sheet : float
        [m]
    """
    for _ in range(ROUNDS):
        side = sized(float(side.thickness) * (side.width / sheet) ** (2.0 / 3.0))
        if abs(side.width / sheet - 1.0) < CLOSE:
            break
    longer = max(1.0, least / float(side.thickness))
    return replace(side, thickness=longer * side.thickness, length=longer * side.length, width=sheet)


def next_leaf(have: int, leaf: LeafStrip, stiffer: float, over: float, rise: float) -> tuple[int, LeafStrip]:
    """Return how many leaves, and one, have a force `stiffer` times as large and keep the stress.

    Parameters
    ----------
    have : int
        Number so far.
    leaf : LeafStrip
        With its width, which stays.
    stiffer : float
        Factor of the force of all leaves.
    over : float
        Its stress over the allowable one.
    rise : float
        Of the leaf, which stays [m].
    """
    count, length = have, float(leaf.length) * stiffer ** (-1.0 / 3.0)
    stressed = over * (leaf.length / length) ** 2
    if stressed > 1.0 + 1e-4:
        # n leaves are longer by the cube root of n, and their stress is lower by its square
        count = leaves_for(have, have * stressed**1.5, float(leaf.width))
        length *= (count / have) ** (1.0 / 3.0)
    return count, replace(leaf, length=length, angle=asin(rise / length))


def next_side(side: LeafStrip, stiffer: float, over: float, least: float) -> LeafStrip:
    """Return a leaf of the spring `stiffer` times as stiff, with the allowable stress or the least thickness [m].

    `over` is its stress over the allowable one.
    """
    slope = stiffer ** (1.0 / 3.0) * float(side.thickness / side.length)
    length = max(float(side.length) * stiffer ** (1.0 / 3.0) * over, least / slope)
    return replace(side, thickness=slope * length, length=length)


def stress_unreachable(leaf: LeafStrip, stress: float, allowable: float) -> Infeasible:
    """Return what is raised where the sizes do not come within the stress [Pa]."""
    told = f"the exact stress of leaves of {mm(float(leaf.length))} from this sheet is {mpa(stress)}"
    return Infeasible(finding("stress_unreachable", f"{told}, {mpa(allowable)} is allowed ('mechanism.material')"))
