"""YAML specification of a cam mechanism: its keys with types, bounds and descriptions, and cross-checks."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, radians
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from cfmkit.families.cam.geometry.spec import DesignFriction, Profile
from cfmkit.families.cam.springs_spec import Springs
from cfmkit.families.request_spec import ProposedSpec
from cfmkit.specs.spec import Analysis, DesignBlock, Model, NonNegativeLength, PositiveLength, is_made, refuse
from cfmkit.specs.target_curve import Target
from cfmkit.specs.units import Angle, Force, Inertia, Length, Mass, Time, format_short
from cfmkit.stock.material_and_part_spec import (
    Friction,
    Guide,
    MaterialField,
    MaterialSpec,
    Pins,
    ProcessField,
    SafetyFactor,
)
from cfmkit.stock.springs.spec import Catalogue, Life, SpringSafety
from cfmkit.stock.stock_series import StockSize, System, stock_faults

NonNegativeInertia = Annotated[Inertia, Field(ge=0)]
SmallAngle = Annotated[Angle, Field(ge=-radians(45), le=radians(45))]


class Masses(Model):
    """Moving masses, for gravity and for dynamics."""

    slider: Annotated[Mass, Field(ge=0)] = Field(0.0, description="slider or pulling link, m2")
    brace: Annotated[Mass, Field(ge=0)] = Field(0.0, description="one brace, centre of mass at mid-length, m3")
    roller: Annotated[Mass, Field(ge=0)] = Field(0.0, description="one roller with its share of shaft and springs, m4")
    brace_inertia: NonNegativeInertia | None = Field(
        None, description="of one brace about its centre of mass, I3; default: m3 l^2/12, a slender rod"
    )
    roller_inertia: NonNegativeInertia | None = Field(
        None, description="of one roller about its axis, I4; default: m4 r^2/2, a solid cylinder"
    )


class LeftMasses(Model):
    """Masses of the left side that differ from those of the right."""

    brace: Annotated[Mass, Field(ge=0)] | None = Field(None, description="left brace")
    roller: Annotated[Mass, Field(ge=0)] | None = Field(None, description="left roller with its share")
    brace_inertia: NonNegativeInertia | None = Field(None, description="of the left brace")
    roller_inertia: NonNegativeInertia | None = Field(None, description="of the left roller")


class Plate(Model):
    """The plate that the cam is cut from: what closes the contour beside the flanks."""

    top_margin: NonNegativeLength = Field(0.010, description="plate above the end of the flanks")
    base_height: NonNegativeLength = Field(
        0.040, description="height of the tab below the cam that carries it; 0 for none"
    )
    base_width: PositiveLength | None = Field(None, description="width of the tab; default: gap between the rollers")
    hole_diameter: NonNegativeLength = Field(0.0066, description="diameter of the fixing holes; 0 for none")
    tool_radius: NonNegativeLength = Field(
        0.0, description="radius of the tool that cuts it: rounds the inside corners beside the tab; 0: sharp"
    )
    thickness: PositiveLength | None = Field(
        None, description="of the sheet, for bodies (STL, 3MF, STEP); default: width of the contact, if stated"
    )
    process: ProcessField | None = Field(
        None, description="manufacturing process: laser, wire-edm, fdm, sls or mill, or your own values; default: laser"
    )
    stock: System | None = Field(
        None,
        description="metric or inch: sheet, pins, bearings and wire that are stated must be of sizes that are sold "
        "(`show stock`)",
    )


class Stops(Model):
    """Stops of the slider, as travel from the start of the roller path."""

    lower: NonNegativeLength = Field(0.0, description="lowest position: the curve begins there")
    upper: PositiveLength | None = Field(None, description="highest position; default: only the end of the flank")

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.upper is not None and self.upper <= self.lower:
            raise ValueError("'upper' must be above 'lower'")
        return self


class MovingPartSizes(Model):
    """Sizes of the parts that move, for their distances from the plate, its screws and each other."""

    brace_width: NonNegativeLength = Field(0.0, description="of a brace, across its length")
    slider: tuple[PositiveLength, PositiveLength] | None = Field(
        None, description="of the slider across and along its guide, with its pin in the middle"
    )
    screw_head: NonNegativeLength = Field(0.0, description="diameter of the screws' heads in the plate's holes")
    spring_diameter: NonNegativeLength = Field(0.0, description="outer diameter of the springs")
    gap: NonNegativeLength = Field(0.0, description="required clearance")


class Contact(Model):
    """Contact of roller and cam, for its pressure."""

    width: PositiveLength = Field(description="width of the line contact, usually the plate's thickness")
    material: MaterialField = Field(
        default_factory=lambda: MaterialSpec(name="steel-s235"),
        description="a name from `show materials`, or {youngs_modulus, ...}; for both roller and cam",
    )


class Bearings(Model):
    """Bearings of a roller: its friction, and how long it lasts."""

    bore: PositiveLength = Field(description="diameter of its shaft, at which the friction acts")
    friction: Friction = Field(
        0.0, description="friction couple over load and half the bore; 0.001 to 0.002 if rolling"
    )
    dynamic_rating: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="C of one bearing, from its data sheet, for the life by ISO 281"
    )
    static_rating: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="C0 of one bearing, from its data sheet"
    )
    kind: Literal["ball", "roller", "plain"] = Field(
        "ball", description="exponent of the life: 3, or 10/3; plain: the roller itself turns on its shaft"
    )
    per_roller: int = Field(1, ge=1, le=16, description="bearings side by side in one roller; they share its load")
    name: str | None = Field(None, min_length=1, description="designation, for the parts list")

    @model_validator(mode="after")
    def _plain_bearings_have_no_rating(self) -> Self:
        if self.kind == "plain" and (self.dynamic_rating or self.static_rating):
            raise ValueError(
                "'dynamic_rating' and 'static_rating' are of rolling bearings: leave them out of plain ones"
            )
        return self


MOUNTING_ANGLES = {"up": 0.5 * pi, "horizontal": 0.0, "down": -0.5 * pi}


class Mounting(Model):
    """Attitude of the mechanism in the field of gravity."""

    elevation: Annotated[Angle, Field(ge=-0.5 * pi, le=0.5 * pi)] = Field(
        0.5 * pi,
        description="direction of the slider's outward travel above the horizontal: 90 deg is up, 0 horizontal, "
        "-90 deg down",
    )
    roll: Annotated[Angle, Field(ge=-pi, le=pi)] = Field(
        0.0,
        description="rotation of the cam's plane about that direction: 0 upright, the transverse weight acts to the "
        "right; 90 deg flat, the guide carries it",
    )


def _mounting(value: Any) -> Any:
    """Return a word or an angle as the block that it is short for."""
    if isinstance(value, str):
        word = str(value).strip()
        if word.isalpha() and word not in MOUNTING_ANGLES:
            raise ValueError(f"{word!r} is not one of {', '.join(MOUNTING_ANGLES)}, nor an angle such as '30 deg'")
        return {"elevation": MOUNTING_ANGLES.get(word, value)}
    return value


class Left(Model):
    """Parts of the left side that differ from those of the right; what is left out is as on the right."""

    brace_length: PositiveLength | None = Field(None, description="left brace")
    roller_radius: PositiveLength | None = Field(None, description="left roller")
    profile: Profile | None = Field(None, description="complete left flank; omitted values follow the left side")
    masses: LeftMasses | None = Field(None, description="of the left brace and roller")

    @property
    def moves_differently(self) -> bool:
        """Whether its geometry differs, and with it the force at any speed; masses count in a motion only."""
        return bool(self.brace_length or self.roller_radius or self.profile)


class Errors(Model):
    """Angular errors of the flanks, which are turned about the origin that `analysis.dynamics.origin` names."""

    slider_deviation: SmallAngle = Field(
        0.0, description="between the guide and the cam's axis: both flanks turned in the same direction"
    )
    flank_angle: SmallAngle = Field(
        0.0, description="manufacturing error, both flanks turned against each other; positive: wider at the top"
    )


class Mechanism(Model):
    """A cam between two rollers, springs between the rollers, braces to a slider; symmetric but for `left`."""

    brace_length: PositiveLength = Field(description="l, between slider pin and roller axis")
    rest_half_width: PositiveLength = Field(
        description="half the distance of the roller axes at the start; the springs are at rest there, or stretched by "
        "their `preload`"
    )
    roller_radius: PositiveLength = Field(description="of the rollers, r")
    springs: Springs = Field(description="{stiffness, count}, or a list of measured stiffnesses")
    rolling_friction: Friction = Field(0.0, description="mu = d/r, rolling resistance over roller radius")
    masses: Masses | None = Field(None, description="needed for gravity and for dynamics")
    profile: Profile = Field(description="the cam as cut")
    left: Left | None = Field(None, description="values that differ on the left side; for the dynamic model")
    errors: Errors | None = Field(None, description="angular errors of the flanks; for the dynamic model")
    plate: Plate = Field(default_factory=Plate, description="plate that closes the contour of the part")
    contact: Contact | None = Field(None, description="for the contact pressure")
    pins: Pins | None = Field(None, description="slider pin and spring hooks: their friction")
    bearings: Bearings | None = Field(None, description="of the rollers: their friction and life")
    guide: Guide | None = Field(None, description="of the slider: its friction")
    stops: Stops | None = Field(None, description="end stops of the slider")
    envelope: MovingPartSizes | None = Field(None, description="sizes of the moving parts, for their clearances")
    mounting: Annotated[Mounting, BeforeValidator(_mounting, json_schema_input_type=str | Mounting)] | None = Field(
        None,
        description="up | horizontal | down, the slider's elevation (30 deg), or {elevation, roll}; if stated, "
        "weight acts; if only gravity is requested, the slider moves up",
    )
    safety_factor: SafetyFactor = 1.0

    @model_validator(mode="after")
    def _only_hanging_weights_help(self) -> Self:
        hangs = self.mounting is not None and self.mounting.elevation < 0
        if self.profile.slope_factor < 1 and not hangs:
            reported = "must be >= 1: only weights that hang down ('mounting') help the springs"
            refuse("Mechanism", {("profile", "slope_factor"): reported})
        return self

    @model_validator(mode="after")
    def _tab_passes_between_the_rollers(self) -> Self:
        if self.plate.base_width is None:
            return self
        sides = [(self.profile.rest_half_width, self.profile.roller_radius, self.roller_radius)]
        if left := self.left:
            profile = left.profile or self.profile
            sides.append((profile.rest_half_width, profile.roller_radius, left.roller_radius or self.roller_radius))
        room = 2.0 * min((x0 or self.rest_half_width) - max(cut or 0.0, built) for x0, cut, built in sides)
        if self.plate.base_width > room > 0:
            reported = (
                f"a tab of {format_short(self.plate.base_width, 'length')} cuts into the rollers: they leave "
                f"{format_short(room, 'length')} between them at the start"
            )
            refuse("Mechanism", {("plate", "base_width"): reported})
        return self

    @model_validator(mode="after")
    def _rest_length_leaves_no_slack(self) -> Self:
        longest = 2.0 * self.rest_half_width
        if (length := self.springs.rest_length) is not None and length > longest * (1 + 1e-12):
            reported = (
                f"{format_short(length, 'length')} is longer than the {format_short(longest, 'length')} at the start"
            )
            refuse("Mechanism", {("springs", "rest_length"): f"{reported}: the springs would be slack there"})
        if (preload := self.springs.preload) is not None and preload >= longest:
            reported = f"must be below {format_short(longest, 'length')}, the distance of the roller axes at the start"
            refuse("Mechanism", {("springs", "preload"): reported})
        return self

    @property
    def preload(self) -> float:
        """Elongation of the springs at the start [m]."""
        if self.springs.rest_length is not None:
            stretched: float = np.maximum(2.0 * self.rest_half_width - self.springs.rest_length, 0.0)
            return stretched
        return 0.0 if self.springs.preload is None else self.springs.preload

    @property
    def effective_preload(self) -> float:
        """Elongation at the start of springs without initial tension that pull as hard as these [m]."""
        return self.preload + self.springs.tension_stretch

    @property
    def springs_rest(self) -> float:
        """Half the distance of the roller axes at which the springs, extended as they are, would pull no more [m]."""
        return self.rest_half_width - 0.5 * self.effective_preload

    @property
    def springs_rest_as_cut(self) -> float:
        """The same distance that the profile is cut for [m]."""
        preload = self.effective_preload if self.profile.preload is None else self.profile.preload
        return (self.profile.rest_half_width or self.rest_half_width) - 0.5 * preload

    @field_validator("springs", mode="before")
    @classmethod
    def _list_is_short_for_stiffness(cls, value: Any) -> Any:
        return {"stiffness": value} if isinstance(value, tuple | list) else value


class CamDesign(DesignBlock):
    """Targets and choices of `cfmkit design`."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="target force, weight included if gravity is on"
    )
    target: Target | None = Field(
        None, description="a curve of force over travel, from 0 to the stroke, instead of a constant force"
    )
    stroke: PositiveLength = Field(description="target travel of the slider")
    choose: Literal["force-constant", "stiffness", "catalogue", "preload"] = Field(
        "force-constant",
        description="what follows from F = 4KA: A from the springs, the stiffness from A, both from a catalogue; or A "
        "from the springs with the smallest preload that avoids undercut",
    )
    force_constant: PositiveLength | None = Field(
        None, description="A to keep when choosing the stiffness; default: the mechanism's"
    )
    catalogue: Catalogue = Field(
        (), description="springs to pick from: a list, a CSV file beside the specification, or `generic`"
    )
    spring_life: Life | None = Field(
        None, description="cycles that a spring of the catalogue must last; one of unknown life is not chosen"
    )
    spring_safety: SpringSafety | None = None
    friction: DesignFriction = Field(
        0.0,
        description="rolling friction that the profile is cut for; positive: exact on the way up, negative: on "
        "the way down",
    )
    avoid_undercut: bool = Field(False, description="take the smallest A whose path the roller can follow")
    gravity: bool = Field(False, description="shape the profile so that the weight of the moving parts is carried too")

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        both = self.force is not None and self.target is not None
        if (self.force is None and self.target is None) or (
            both and self.target and (self.target.stiffness is None or self.target.start is not None)
        ):
            raise ValueError(
                "give either 'force' or 'target'; with 'target: {stiffness}' the force is that at the start"
            )
        if self.target is not None and self.choose == "preload":
            raise ValueError("'choose: preload' is for a constant force: give a preload in 'mechanism.springs'")
        return self

    @model_validator(mode="after")
    def _catalogue_where_needed(self) -> Self:
        if (self.choose == "catalogue") != bool(self.catalogue):
            raise ValueError("'catalogue' and 'choose: catalogue' belong together: give both or neither")
        for name in ("spring_life", "spring_safety"):
            if getattr(self, name) is not None and not self.catalogue:
                raise ValueError(f"{name!r} applies only to springs picked from a catalogue: give 'catalogue', too")
        return self


class Dynamics(Model):
    """A motion that the slider is given, and how its forces are computed."""

    motion: Literal["cycloidal"] = Field(
        "cycloidal", description="from rest to rest without a jump of acceleration: s + h (t/T - sin(2 pi t/T)/(2 pi))"
    )
    slider_position: Length = Field(description="where the slider starts: its height above `origin`, not a travel")
    stroke: Length = Field(description="travel of the motion; negative: downwards")
    time: Annotated[Time, Field(gt=0)] = Field(description="duration T")
    points: int = Field(201, ge=5, le=1_000_000, description="points of the time history")
    origin: Literal["path-start", "cam-start"] = Field(
        "path-start", description="where heights are zero: at the first point of the roller path, or of the cam"
    )
    method: Literal["inverse", "multibody"] = Field(
        "inverse", description="inverse dynamics with closed kinematics, or nine coordinates with Lagrange multipliers"
    )

    @property
    def closed(self) -> bool:
        """Whether the kinematics are closed: `method` is 'inverse'."""
        return self.method == "inverse"

    @field_validator("stroke")
    @classmethod
    def _moves(cls, stroke: float) -> float:
        if stroke == 0:
            raise ValueError("must not be 0: the slider has to move")
        return stroke


class Manufacturing(Model):
    """Standard deviations of the errors with which flanks are cut, each flank drawn by itself."""

    waviness: Annotated[Length, Field(ge=0)] = Field(0.0, description="of the flank's distance from the design")
    wavelength: Annotated[Length, Field(gt=0)] = Field(0.010, description="of the shortest waves")
    offset: Annotated[Length, Field(ge=0)] = Field(0.0, description="of the material left on a whole flank")
    angle: Annotated[Angle, Field(ge=0)] = Field(0.0, description="of the angle at which a flank is cut")
    samples: int = Field(200, ge=10, le=100_000, description="random cams to evaluate")


class CamAnalysis(Analysis):
    """Analysis of a cam mechanism."""

    travel: PositiveLength | None = Field(None, description="slider travel; default: the profile's stroke")
    gravity: bool | None = Field(
        None, description="whether weight acts; default: true with design.gravity or a mounting"
    )
    fidelity: Literal["quasi-static", "dynamic"] | None = Field(
        None, description="model; default: dynamic if `dynamics` is stated, otherwise quasi-static"
    )
    manufacturing: Manufacturing | None = Field(
        None, description="errors of manufacture: adds the band of forces that they cause"
    )
    dynamics: Dynamics | None = Field(None, description="motion for the dynamic model")
    path_method: Literal["quadrature", "ode"] = Field("quadrature", description="how the path is integrated")
    origin: Literal["path-start", "slider", "slider-from-cam"] = Field(
        "path-start",
        description=(
            "zero of the displacement: travel from the start of the roller path, "
            "the slider's height above that start, or above the first point of the cam"
        ),
    )


class CamSpec(ProposedSpec):
    """A cam mechanism: rollers, cam and springs."""

    family: Literal["cam"]
    mechanism: Mechanism
    design: CamDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: CamAnalysis = Field(default_factory=CamAnalysis, description="how it is run")

    @model_validator(mode="after")
    def _stock_is_sold(self, info: ValidationInfo) -> Self:
        mechanism, plate, wound = self.mechanism, self.mechanism.plate, self.mechanism.springs.wound
        sizes: list[StockSize] = [
            (("pins", "diameter"), "pin", mechanism.pins.diameter if mechanism.pins else None),
            (("bearings", "bore"), "bearing", mechanism.bearings.bore if mechanism.bearings else None),
            (("springs", "wound", "wire"), "wire", wound.wire if wound else None),
        ]
        if plate.process is None or not plate.process.prints:
            sizes += [(("plate", "thickness"), "sheet", plate.thickness)]
        material = mechanism.contact.material.name if mechanism.contact else None
        refuse("Spec", {} if is_made(info) else stock_faults(plate.stock, sizes, material))
        return self

    @model_validator(mode="after")
    def _gravity_needs_masses(self) -> Self:
        wanted = self.gravity or (self.design is not None and self.design.gravity)
        if wanted and self.mechanism.masses is None:
            raise ValueError("gravity needs the masses of the moving parts: add 'mechanism.masses'")
        return self

    @model_validator(mode="after")
    def _dynamics_need_motion_and_masses(self) -> Self:
        if self.fidelity == "dynamic" and self.analysis.dynamics is None:
            raise ValueError("the dynamic model needs a motion: add 'analysis.dynamics'")
        if self.fidelity == "dynamic" and self.mechanism.profile.file is not None:
            raise ValueError("the dynamic model runs on the design: remove 'profile.file', or choose 'quasi-static'")
        left = self.mechanism.left and self.mechanism.left.profile
        if self.fidelity == "dynamic" and (self.mechanism.profile.curve or (left and left.curve)):
            raise ValueError("the dynamic model is for constant forces: remove 'profile.curve', or say 'quasi-static'")
        if self.fidelity == "dynamic" and self.mechanism.masses is None:
            raise ValueError("the dynamic model needs the masses of the moving parts: add 'mechanism.masses'")
        return self

    @model_validator(mode="after")
    def _target_counts_from_the_path(self) -> Self:
        if self.target_curve is not None and self.analysis.origin != "path-start":
            raise ValueError("a target curve counts from the start of the path: remove 'analysis.origin'")
        return self

    @property
    def fidelity(self) -> Literal["quasi-static", "dynamic"]:
        """The model that the analysis uses."""
        return self.analysis.fidelity or ("dynamic" if self.analysis.dynamics else "quasi-static")

    def end_stop_changes(self, end: float) -> Mapping[str, Any]:
        """Return what stops the slider at a travel [m], where its curve ends."""
        lower = 0.0 if self.mechanism.stops is None else self.mechanism.stops.lower
        return {"mechanism.stops": {"lower": lower, "upper": end}}

    @property
    def gravity(self) -> bool:
        """Whether weight acts in the analysis."""
        if self.analysis.gravity is not None:
            return self.analysis.gravity
        return self.mechanism.mounting is not None or (self.design is not None and self.design.gravity)
