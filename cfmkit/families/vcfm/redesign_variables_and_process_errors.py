"""Values that may vary when a design is changed to raise its yield of good parts, and values with process errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from cfmkit.designing.rounded_and_reported_values import range_about
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmSpec


def free(
    spec: VcfmSpec,  # with the `design` block
    designed: VcfmSpec,  # what came out
) -> dict[str, tuple[float, float]]:
    """Return both widths, and length, angle and thickness of the leaves, within the limits of the design.

    From a sheet the widths stay, and length and thickness of the spring may move.
    """
    wanted = spec.design
    if wanted is None:
        return {}
    leaf, spring = designed.mechanism.bistable, designed.mechanism.positive
    longest = None if wanted.max_span is None else wanted.max_span / (2.0 * math.cos(leaf.angle))
    ranges = {
        "mechanism.bistable.width": range_about(leaf.width, high=wanted.max_width),
        "mechanism.bistable.thickness": range_about(leaf.thickness, low=wanted.min_thickness),
        "mechanism.bistable.angle": range_about(leaf.angle),
    }
    if spring is not None:
        ranges["mechanism.positive.width"] = range_about(spring.width, high=wanted.max_width)
    if wanted.leaf_length is None:
        ranges["mechanism.bistable.length"] = range_about(leaf.length, high=longest)
    if sheet_of(designed.mechanism.part) is not None:  # widths are those of the sheet
        ranges = {path: ends for path, ends in ranges.items() if not path.endswith(".width")}
        if spring is not None:
            ranges["mechanism.positive.length"] = range_about(spring.length)
            ranges["mechanism.positive.thickness"] = range_about(spring.thickness, low=wanted.min_thickness)
    return {path: ends for path, ends in ranges.items() if ends[0] < ends[1]}


def errors(spec: VcfmSpec) -> dict[str, str]:
    """Return which values err: the thicknesses of both kinds of leaves, or of leaves and the rate of bought springs."""
    if spec.mechanism.springs is None:
        return {f"mechanism.{strip}.thickness": "thickness" for strip in ("positive", "bistable")}
    return {"mechanism.bistable.thickness": "thickness", "mechanism.springs.stiffness": "rate"}
