"""Sizes and paths of the parts of a cam mechanism, how deep they lie beside each other, and their clearances.

Rollers run in the plane of the plate; braces, springs and slider move beside it, where only the heads of its screws
stand out. Clearances are those over the travel, to the plate, its screws and each other. Lengths in metres.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import FloatArray
from cfmkit.export.contours import Arc, Line
from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.outline import CutPlate
from cfmkit.families.findings import mm
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.offers import slimmest_spring

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.springs_spec import Springs
    from cfmkit.results import Finding


PLATE_THICKNESS = 0.008  # thickness of the plate where no `contact.width` says it [m]: that of the contact's example


BRACE_WIDTH = 0.010
"""Thickness of a brace where the plate is thicker [m]: it is pulled along, the plate is pressed on its edge."""


def depth_of(thick: float, outer: float, number: int) -> float:
    """Return the depth of a plate, of a brace on both sides of it, and of so many springs beyond these [m].

    Half of the springs, of an outer diameter [m], are on either side, above each other.
    """
    return thick + 2.0 * min(thick, BRACE_WIDTH) + min(number, 2) * outer


def wire_and_coil(
    springs: Springs, stretch: float, half_width: float, safety: float = 1.0
) -> tuple[float, float] | None:
    """Return the wire's diameter and the mean one of the coil of each spring [m], of known wire or else of steel.

    Steel wire bears a stretch with a safety against yield, and fits between axes at rest two half widths apart [m];
    None if none does.
    """
    if springs.wound is not None:
        return springs.wound.wire, springs.wound.coil
    made = slimmest_spring(ExtensionSpring, springs.total / springs.number, stretch, 2.0 * half_width, safety)
    return None if made is None else (made.wire, made.coil)


def stack_height(outer: float, count: int) -> float:
    """Return how high springs of an outer diameter stand above each other, half of them on either side [m].

    >>> stack_height(0.01, 4), stack_height(0.01, 5)
    (0.02, 0.03)
    """
    return outer * ((count + 1) // 2)


BESIDE_FLANKS_PAIR, OVERLAP_TOL = "roller and plate beside the flanks", 1e-9
"""A pair whose distance ends at zero where the roller comes to the flank's end, which is no fault: only overlap is."""

Place = tuple[FloatArray | float, FloatArray | float]


def clearances(solution: Solution) -> Iterator[tuple[str, FloatArray]]:
    """Yield (pair of parts, gap at every point of the solution [m]); negative where they overlap.

    Only what `mechanism.envelope` gives a size is looked at. The cam's flank, on which the roller runs, is left out.
    """
    mechanism, states = solution.mechanism, solution.states
    sizes, radius = mechanism.envelope, mechanism.roller_radius
    if sizes is None:
        return
    x, y, pin = states.x, states.y, solution.pin_path[:, 1]
    profile = solution.assembly.profile
    contours = CutPlate((profile, profile), mechanism.plate).contours
    yield "roller and roller", 2.0 * (x - radius)
    # The ends of the edges beside the flanks lie on the flanks, which the rollers touch: rounding is no overlap.
    yield BESIDE_FLANKS_PAIR, _to_edges((x, y), contours[0].edges) - radius
    half = 0.5 * sizes.brace_width
    screws = [edge.center for contour in contours[1:] for edge in contour.edges if isinstance(edge, Arc)]
    for place in screws if sizes.screw_head else ():
        head = 0.5 * sizes.screw_head
        if half:
            yield "brace and screw", _to_segment(place, (x, y), (0.0 * pin, pin)) - half - head
        if sizes.spring_diameter:
            across = np.maximum(np.abs(place[0]) - x, 0.0)
            yield "spring and screw", np.hypot(across, place[1] - y) - 0.5 * sizes.spring_diameter - head
        if sizes.slider:
            yield "slider and screw", _to_box(place, pin, sizes.slider) - head
    if sizes.slider:
        yield "slider and roller", _to_box((x, y), pin, sizes.slider) - radius
        if sizes.spring_diameter:
            yield "slider and spring", pin - 0.5 * sizes.slider[1] - y - 0.5 * sizes.spring_diameter


def nearest_pairs(solution: Solution) -> dict[str, FloatArray]:
    """Return the gap of each pair of parts, of several alike the smallest, at every point of the solution, (n,) [m]."""
    gaps: dict[str, FloatArray] = {}
    for pair, gap in clearances(solution):
        gaps[pair] = np.minimum(gaps[pair], gap) if pair in gaps else gap
    return gaps


def smallest_gap(solution: Solution) -> float:
    """Return the smallest distance of all pairs [m]."""
    gaps = [(pair, float(gap.min())) for pair, gap in clearances(solution)]
    return min(gap for pair, gap in gaps if pair != BESIDE_FLANKS_PAIR or gap < -OVERLAP_TOL)


def touching(solution: Solution) -> Iterator[Finding]:
    """Yield which parts come nearer than wanted, the worst first."""
    envelope, reported = solution.mechanism.envelope, set()
    for pair, gap in sorted(clearances(solution), key=lambda item: float(item[1].min())):
        least = int(np.argmin(gap))
        if (
            envelope is None
            or pair in reported
            or gap[least] >= (0.0 if pair == BESIDE_FLANKS_PAIR else envelope.gap) - OVERLAP_TOL
        ):
            continue
        reported.add(pair)
        by = f"overlap by {mm(-float(gap[least]))}" if gap[least] < 0 else f"come within {mm(float(gap[least]))}"
        yield finding(
            "parts_touch",
            f"{pair} {by} at {mm(float(solution.travel[least]))} of travel ('mechanism.envelope', 'mechanism.plate')",
        )


def _to_segment(place: Place, start: Place, end: Place) -> FloatArray:
    """Return the distance of points from straight pieces [m]."""
    (px, py), (ax, ay), (bx, by) = place, start, end
    dx, dy = bx - ax, by - ay
    share = np.clip(((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    return np.asarray(np.hypot(px - ax - share * dx, py - ay - share * dy))


def _to_edges(place: Place, edges: tuple[object, ...]) -> FloatArray:
    """Return the distance from the straight edges and fillets of an outline [m]."""
    gaps = [_to_segment(place, edge.start, edge.end) for edge in edges if isinstance(edge, Line)]
    gaps += [_to_arc(place, edge) for edge in edges if isinstance(edge, Arc)]
    return np.asarray(np.min(gaps, axis=0))


def _to_arc(place: Place, arc: Arc) -> FloatArray:
    """Return the distance of points that face an arc [m]; infinite of others, to which an end is nearer."""
    across, along = place[0] - arc.center[0], place[1] - arc.center[1]
    turned = np.arctan2(along, across) - min(arc.start, arc.end)
    faced = np.mod(turned, 2.0 * np.pi) <= abs(arc.end - arc.start)
    return np.where(faced, np.abs(np.hypot(across, along) - arc.radius), np.inf)


def _to_box(place: Place, height: FloatArray, size: tuple[float, float]) -> FloatArray:
    """Return the distance of points from a box on the axis at some heights [m]; negative inside."""
    across, along = np.abs(place[0]) - 0.5 * size[0], np.abs(place[1] - height) - 0.5 * size[1]
    outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(across, along), 0.0))
