"""From a cam specification to the machine of the dynamic models: sides, masses, inertias, springs, motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.cam.dynamics.axis_springs import AxisSprings
from cfmkit.families.cam.dynamics.roller_curves_and_motion import Cycloid, Machine, Side, SideParts
from cfmkit.families.cam.dynamics.solution import Build
from cfmkit.families.cam.findings import finding
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import NoTrack
from cfmkit.families.cam.mechanism_from_spec import assemble_sides, cam_start_height, directions
from cfmkit.families.cam.statics import STANDARD_GRAVITY

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import CamSpec, Dynamics, Errors, LeftMasses, Masses, Mechanism
    from cfmkit.families.cam.statics import Assembly


def build(spec: CamSpec) -> Build:
    """Return the mechanism put together.

    Raises CannotBuild if it cannot exist; the finding says why.
    """
    motion = stated_motion(spec)
    right, left = assemble_sides(spec)
    lift = cam_start_height(right.profile) if motion.origin == "cam-start" else 0.0
    machine = _make_machine(spec, (right, left), lift)
    for name, side in (("right", machine.right), ("left", machine.left)):
        _check_leverage(name, side)
    return Build(right, left, machine, Cycloid(motion.slider_position, motion.stroke, motion.time), lift)


def stated_motion(spec: CamSpec) -> Dynamics:
    """Return the motion that the specification states.

    Raises ValueError if it states none; `CamSpec.fidelity` is dynamic only where it does.
    """
    if spec.analysis.dynamics is None:
        raise ValueError("the specification states no motion")
    return spec.analysis.dynamics


def _make_machine(spec: CamSpec, sides: tuple[Assembly, Assembly], lift: float) -> Machine:
    mechanism, masses = spec.mechanism, spec.mechanism.masses
    right, left = sides
    errors = _angles(mechanism.errors)
    along, right_share, _ = directions(mechanism.mounting)
    return Machine(
        right=Side(parts_of(right.spec.mechanism, masses), right.track, errors[0], lift),
        left=Side(
            parts_of(left.spec.mechanism, masses, mechanism.left.masses if mechanism.left else None),
            left.track,
            errors[1],
            lift,
        ),
        slider_mass=masses.slider if masses else 0.0,
        springs=AxisSprings.from_mechanism(mechanism),
        gravity=STANDARD_GRAVITY * along if spec.gravity else 0.0,
        friction=mechanism.rolling_friction if stated_motion(spec).closed else 0.0,
        sideways=STANDARD_GRAVITY * right_share if spec.gravity and stated_motion(spec).closed else 0.0,
    )


def _angles(errors: Errors | None) -> tuple[float, float]:
    """Return by how much the right and the left flank are turned, each counter-clockwise as seen on the right [rad]."""
    if errors is None:
        return 0.0, 0.0
    return errors.slider_deviation - errors.flank_angle, -errors.slider_deviation - errors.flank_angle


def parts_of(mechanism: Mechanism, masses: Masses | None, left_masses: LeftMasses | None = None) -> SideParts:
    """Return brace and roller of a side; `left_masses` come first. Defaults: a slender rod, a solid cylinder."""
    length, radius = mechanism.brace_length, mechanism.roller_radius

    def get_stated(name: str) -> float | None:
        value: float | None = getattr(left_masses, name, None)
        return getattr(masses, name, None) if value is None else value

    brace, roller = get_stated("brace") or 0.0, get_stated("roller") or 0.0
    rod, cylinder = get_stated("brace_inertia"), get_stated("roller_inertia")
    return SideParts(
        brace_length=length,
        brace_mass=brace,
        brace_inertia=slender_rod(brace, length) if rod is None else rod,
        roller_radius=radius,
        roller_mass=roller,
        roller_inertia=solid_cylinder(roller, radius) if cylinder is None else cylinder,
    )


def slender_rod(mass: float, length: float) -> float:
    """Return the moment of inertia of a slender rod about its middle [kg m^2]."""
    return mass * length**2 / 12.0


def solid_cylinder(mass: float, radius: float) -> float:
    """Return the moment of inertia of a solid cylinder about its axis [kg m^2]."""
    return mass * radius**2 / 2.0


def _check_leverage(name: str, side: Side) -> None:
    try:
        _ = side.span
    except NoTrack:
        raise finding.cannot_build(
            "dead_point",
            f"on the {name} side the slider does not rise as the roller moves out: the flank is turned too far "
            "('mechanism.errors'), or the brace is too short for the profile ('mechanism.brace_length')",
        ) from None
