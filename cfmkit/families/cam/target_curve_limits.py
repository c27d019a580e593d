"""Limits of cams with a force that varies on purpose: which target curves of force can be made, and why others cannot.

The targets of a design, or the slope law of a profile, go in; the curve as shares of its largest force, or the slope
law for it, comes out. A curve that no cam can follow raises an error with the reason.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.geometry.slope_law import SlopeLaw
from cfmkit.families.cam.geometry.slope_law_for_curve import CurveSlopeLaw
from cfmkit.families.findings import format_at_most, mm, newton
from cfmkit.families.rows import fails, refuse_columns

if TYPE_CHECKING:
    from cfmkit.families.cam.geometry.flank_from_roller_path import CamProfile
    from cfmkit.families.cam.spec import CamDesign
    from cfmkit.numerics.interpolation import ThroughPoints
    from cfmkit.specs.evaluable_target_curve import TargetCurve


def wanted_curve(design: CamDesign) -> TargetCurve | None:
    """Return the target curve of a design; None if its force is constant."""
    return None if design.target is None else design.target.curve(design.force)


def largest_force(design: CamDesign) -> float:
    """Return the constant force, or the largest of the target curve [N]."""
    curve = wanted_curve(design)
    return design.force or 0.0 if curve is None else curve.extremes(0.0, design.stroke)[1]


def check_target(design: CamDesign) -> None:
    """Raise if no springs that pull the rollers against the cam can give the target curve of a design."""
    curve = wanted_curve(design)
    assert curve is not None
    first, last = curve.extent
    if not curve.covers(0.0, design.stroke) or 0.0 > first > -float("inf"):
        covered = f"{mm(first)} to {mm(last)}"
        raise finding.infeasible(
            "target_curve",
            f"the target curve goes from {covered}, and the slider from 0 mm to {mm(design.stroke)}; let its points "
            "begin at 0 mm and reach the stroke ('design.target', 'design.stroke')",
            {"design.stroke": format_at_most(last)} if last > 0 >= first else None,
        )
    shape = curve.to_points(0.0, design.stroke)
    places = np.linspace(0.0, max(design.stroke, shape.places[-1]), 2001)
    force = np.asarray(curve.evaluate(places))
    lowest = int(np.argmin(force[1:])) + 1
    if force[lowest] <= 0 or force[0] < 0:
        at = places[0 if force[0] < min(force[lowest], 0.0) else lowest]
        raise finding.infeasible(
            "target_curve",
            f"the target curve is {newton(float(curve.evaluate(at)))} at {mm(float(at))}: a cam holds up a force, "
            "which must stay above 0 beyond the start, or the rollers would have to give back energy that the springs "
            "do not have ('design.target')",
        )
    if force[0] == 0.0 and not shape.slope(0.0) > 0:
        raise finding.infeasible(
            "target_curve",
            "the target curve begins at zero force and does not grow from there: the path would begin vertical; "
            "begin with some force, or with a slope ('design.target')",
        )


def target_shape(design: CamDesign, slider_weight: float) -> ThroughPoints | None:
    """Return the target force less the weight of the slider [N], as shares of its largest; None if it is constant."""
    curve = wanted_curve(design)
    if curve is None:
        return None
    wanted, most = curve.to_points(0.0, design.stroke), largest_force(design) - slider_weight
    return replace(wanted, values=tuple((value - slider_weight) / most for value in wanted.values))


def with_curve(law: SlopeLaw, shape: ThroughPoints, stroke: Any) -> CurveSlopeLaw:
    """Return the law for a force that follows a curve of shares over travel [m], up to a stroke [m].

    Raises CannotBuild if there is no such path: the finding says why.
    """
    if fails(stroke > shape.places[-1] * (1 + 1e-6)):
        raise finding.cannot_build(
            "target_curve",
            f"the curve of forces ends at {mm(shape.places[-1])}, before the stroke of {mm(stroke)}; give it more "
            "points, or a shorter stroke ('curve' and 'stroke' of 'mechanism.profile')",
        )
    refuse_columns(law.friction, law.slope_factor)  # such a path is integrated, or has a guide of its own
    curved = CurveSlopeLaw(**vars_of(law), shape=shape)
    least = min(shape.values) - curved.carried
    if shape.values[0] == 0.0 and fails(np.not_equal(law.preload, 0.0)):
        raise finding.cannot_build(
            "target_curve",
            "the force begins at zero, and the springs are stretched there: the path would begin vertical; leave "
            "out the preload ('mechanism.springs.preload'), or begin with some force",
        )
    if (shape.values[0] == 0.0 and (law.friction or law.slope_factor != 1.0)) or (curved.carried and least <= 0):
        raise finding.cannot_build(
            "target_curve",
            "the smallest force of the curve does not carry the weight and friction that the profile is cut for; "
            "use a curve with more force, or cut for none ('friction' and 'gravity' of 'design')",
        )
    return curved


def vars_of(law: SlopeLaw) -> dict[str, float]:
    """Return the numbers of a slope law by name."""
    return {item.name: getattr(law, item.name) for item in fields(SlopeLaw)}


def check_bends(law: CurveSlopeLaw, profile: CamProfile) -> None:
    """Raise where a force that falls quickly bends the path more tightly than the roller, beyond the start."""
    place, radius = law.tightest(profile.end, profile.start)
    if fails(np.logical_and(radius < profile.roller_radius * (1 - 1e-9), place > profile.start)):
        at = float(law.travel(place))
        raise finding.cannot_build(
            "undercut_total",
            f"at {mm(at)} of travel the force falls so quickly that the path has a radius of curvature of "
            f"{mm(radius)}, less than the roller's {mm(profile.roller_radius)}; use a smaller roller "
            "('mechanism.roller_radius'), softer springs, or let the force fall over more travel ('design.target')",
        )
