"""Metrics of many parts: what a design with tolerances knows, and no analysis of a single part."""

from __future__ import annotations

OF_MANY_PARTS = {
    "yield": "share of parts drawn from `design.tolerances` that meet every other requirement",
    "yield_low": "lower end of the 95 % interval of the yield [Clopper, Pearson 1934]",
    "yield_high": "upper end of that interval",
    "yield_before": "yield of the specification that the design began with",
    "yield_with_common_frozen": "yield without the errors that scale the force of a whole part, such as that of the "
    "modulus: those that a test coupon and a trim remove",
    "yield_after_trim": "yield where the mean force of each part is adjusted to that of the design, by a trim or by "
    "its width; stresses do not change",
}
"""Name -> definition; all are shares of parts."""
