"""A plate with the anchors' holes and the slider's slot, and the lines of the springs with the slider in the middle."""

from cfmkit.export.contours import OUTLINE_TOLERANCE, Contour, Drawing, Line, circle, polygon
from cfmkit_oblique.model import Solution
from cfmkit_oblique.spec import ObliqueSpec

MARGIN, PIN = 0.25, 0.04
"""Of the plate around the anchors, and radius of holes and half width of the slot, in half spans."""


def drawing(spec: ObliqueSpec, tolerance: float = OUTLINE_TOLERANCE) -> Drawing:
    """Return the plate and the springs; every edge is exact."""
    solution, part = Solution(spec), spec.mechanism
    span, top, low = part.half_span, solution.height, solution.height - solution.travel
    base, pin, rim = solution.height - part.vertical.free_length, PIN * span, MARGIN * span
    side, floor = span + rim, min(low, base, 0.0) - rim
    plate = polygon([(-side, floor), (side, floor), (side, top + rim), (-side, top + rim)], "cut")
    slot = polygon([(-pin, low - pin), (pin, low - pin), (pin, top + pin), (-pin, top + pin)], "cut", hole=True)
    anchors = [circle((x, 0.0), pin, "cut", hole=True) for x in (-span, span)]
    springs = [Contour((Line(end, (0.0, 0.0)),), "path") for end in ((-span, 0.0), (span, 0.0), (0.0, base))]
    notes = (f"the vertical spring stands {-base * 1e3:.4g} mm below the line of the anchors",)
    return Drawing("oblique", (plate, slot, *anchors, *springs), notes=notes)
