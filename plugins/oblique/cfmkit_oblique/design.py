"""Springs for a force that stays constant over a range, with zero stiffness in its middle.

Zero stiffness makes the force's departure at d from the middle, over the force F there, a matter of shapes alone:

    (F(d) - F) / F = g e (1 - 1 / sqrt(1 + e^2)) / ((1 - g) sqrt(1 - g^2)),    e = d / a, g = a / L0.

It grows with g: the largest g within the tolerance has the shortest springs. g then gives h0, and h0 the stiffnesses.
"""

from math import hypot, sqrt

from cfmkit.families.findings import Infeasible, format_at_least, format_at_most, mm, refusals_answered
from cfmkit.families.run_control import Run
from cfmkit.numerics.roots import bracketed_root
from cfmkit.results import Design, Status
from cfmkit_oblique.model import finding
from cfmkit_oblique.spec import Mechanism, ObliqueDesign, ObliqueSpec

LEAST, MOST = 0.01, 0.99
"""Of a over L0: springs of a hundred half spans, and springs compressed by a hundredth, which play would use up."""


@refusals_answered
def design(spec: ObliqueSpec, run: Run) -> Design:
    """Return the shortest springs that keep the force within the tolerance over the range; the half span stays."""
    request, part = spec.design, spec.mechanism
    if request is None:
        return Design(spec, Status.COMPLETE)
    free = part.half_span / _ratio(request, part.half_span)
    height = sqrt((free - part.half_span) * (free + part.half_span))
    end = height + 0.5 * request.range
    _coils_stay_apart(part, end)
    vertical = request.force / height
    changes: dict[str, object] = {
        "mechanism.oblique.stiffness": 0.5 * vertical * part.half_span / (free - part.half_span),
        "mechanism.oblique.free_length": free,
        "mechanism.vertical.stiffness": vertical,
        "analysis.window": (height - 0.5 * request.range, end),
    }
    if spec.analysis.travel is not None:
        changes["analysis.travel"] = max(spec.analysis.travel, end)
    return Design(spec.replace(changes), Status.COMPLETE)


def _ratio(request: ObliqueDesign, half_span: float) -> float:
    """Return the largest a over L0 that keeps the force within the tolerance."""
    reach = 0.5 * request.range / half_span
    if departure(LEAST, reach) > request.tolerance:
        reported = f"a range of {mm(request.range)} needs springs of more than {mm(half_span / LEAST)}"
        raise Infeasible(finding("no_room", reported), {"design.range": _range(LEAST, request, half_span)})
    ratio = MOST
    if departure(MOST, reach) > request.tolerance:
        ratio = bracketed_root(lambda g: departure(g, reach) - request.tolerance, LEAST, MOST)
    height = half_span * sqrt(1.0 / ratio**2 - 1.0)
    if request.height_max is not None and height > request.height_max:
        reported = f"the slider has to start {mm(height)} above the anchors; allowed are {mm(request.height_max)}"
        flattest = half_span / hypot(half_span, request.height_max)
        nearer = {"design.range": _range(flattest, request, half_span)} if flattest <= MOST else {}
        raise Infeasible(finding("no_room", reported), {"design.height_max": format_at_least(height)} | nearer)
    return ratio


def _range(ratio: float, request: ObliqueDesign, half_span: float) -> str:
    """Return the largest range that springs of some a over L0 have within the tolerance."""
    # the departure at e is above e - 1 times this, which bounds the root
    factor = ratio / ((1.0 - ratio) * sqrt(1.0 - ratio**2))
    fits = bracketed_root(lambda e: departure(ratio, e) - request.tolerance, 0.0, 2.0 + request.tolerance / factor)
    return format_at_most(2.0 * half_span * fits)


def _coils_stay_apart(part: Mechanism, end: float) -> None:
    """Refuse springs that are solid before the range ends."""
    if part.oblique.solid_length > part.half_span:
        reported = f"the oblique springs are solid at {mm(part.oblique.solid_length)}, before they lie flat"
        raise Infeasible(
            finding("coils_touch", reported), {"mechanism.oblique.solid_length": format_at_most(part.half_span)}
        )
    if (room := part.vertical.free_length - part.vertical.solid_length) < end:
        reported = f"the vertical spring can be compressed by {mm(room)}; the range ends at {mm(end)}"
        longer = format_at_least(part.vertical.solid_length + end)
        raise Infeasible(finding("coils_touch", reported), {"mechanism.vertical.free_length": longer})


def departure(ratio: float, reach: float) -> float:
    """Return how far the force is off at the end of a reach [half spans], as a fraction of that in the middle."""
    # 1 - 1 / sqrt(1 + e^2), without the loss of digits near e = 0
    root = hypot(1.0, reach)
    return ratio * reach * (reach / root * (reach / (1.0 + root))) / ((1.0 - ratio) * sqrt(1.0 - ratio**2))
