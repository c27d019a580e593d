"""What a YAML specification of a slider-crank mechanism may say."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from cfmkit.families.slider_crank.flexures.spec import Printed, PrintedAnalysis, PrintedDesign
from cfmkit.specs.spec import Model, Spec, refuse
from cfmkit.specs.units import Angle, Force, Length, Ratio, RotationalStiffness, Stiffness, Torque

PositiveLength = Annotated[Length, Field(gt=0)]
PositiveAngle = Annotated[Angle, Field(gt=0)]
TorsionRate = Annotated[RotationalStiffness, Field(ge=0)]
ExtensionRate = Annotated[Stiffness, Field(ge=0)]


class Springs(Model):
    """Rates of the springs of one leg; all are relaxed in the unloaded position."""

    pivot: TorsionRate = Field(0.0, description="torsion between ground and crank, K_RA; say per rad or per deg")
    crank_pin: TorsionRate = Field(0.0, description="torsion between crank and coupler, K_RB")
    slider_pin: TorsionRate = Field(0.0, description="torsion between coupler and slider, K_RC")
    slider: ExtensionRate = Field(0.0, description="extension between slider and ground, K_PC")


class Limits(Model):
    """How far each spring may be moved from the unloaded position, either way."""

    pivot: PositiveAngle | None = Field(None, description="rotation at the pivot")
    crank_pin: PositiveAngle | None = Field(None, description="rotation at the crank pin")
    slider_pin: PositiveAngle | None = Field(None, description="rotation at the slider pin")
    slider: PositiveLength | None = Field(None, description="travel of the slider")


class Mechanism(Printed):
    """A crank about a fixed pivot, a coupler, a slider on a straight way; a spring at each joint."""

    crank_length: PositiveLength = Field(description="r1, pivot to crank pin")
    coupler_length: PositiveLength | None = Field(
        None, description="r2, crank pin to slider pin; default: from 'stretched_position'"
    )
    stretched_position: PositiveLength | None = Field(
        None, description="distance of pivot and slider pin along the way when stretched; instead of 'coupler_length'"
    )
    offset: Length = Field(0.0, description="e, height of the slider pin's way above the pivot")
    branch: Literal["right", "left"] = Field("right", description="side of the crank pin on which the slider is")
    unloaded_angle: Angle | None = Field(None, description="crank angle from the slider's way with all springs relaxed")
    unloaded_offset: Angle | None = Field(
        None, description="the same from the stretched position, where 0 is exact; instead of 'unloaded_angle'"
    )
    springs: Springs = Field(default_factory=Springs, description="rates of one leg, each 0 unless given")
    legs: int = Field(1, ge=1, le=1000, description="equal legs in parallel on one crank, or on one slider")
    limits: Limits | None = Field(None, description="largest rotations and travel of the springs")

    @model_validator(mode="after")
    def _coupler_is_known(self) -> Self:
        if (self.coupler_length is None) == (self.stretched_position is None):
            raise ValueError("give either 'coupler_length' or 'stretched_position', from which it follows")
        return self

    @model_validator(mode="after")
    def _unloaded_position_is_known(self) -> Self:
        if (self.unloaded_angle is None) == (self.unloaded_offset is None):
            raise ValueError("give either 'unloaded_angle' or 'unloaded_offset', the angle from the stretched position")
        return self


JointName = Literal["pivot", "crank_pin", "slider_pin", "slider"]
PositiveForce = Annotated[Force, Field(gt=0)]


class MaxRates(Model):
    """Largest rates that a design may give the springs of one leg."""

    pivot: TorsionRate | None = Field(None, description="torsion at the pivot")
    crank_pin: TorsionRate | None = Field(None, description="torsion at the crank pin")
    slider_pin: TorsionRate | None = Field(None, description="torsion at the slider pin")
    slider: ExtensionRate | None = Field(None, description="extension at the slider")


class CrankDesign(PrintedDesign):
    """What `cfmkit design` is to reach: rates of the springs, and lengths where a range is given."""

    torque: Torque | None = Field(
        None, description="wanted at the crank, all legs together; negative: towards smaller angles"
    )
    force: PositiveForce | None = Field(None, description="wanted at the slider, all legs together")
    angle: tuple[Angle, Angle] | None = Field(None, description="crank angles at which the torque is wanted")
    travel: tuple[Length, Length] | None = Field(
        None, description="slider travel over which the force is wanted; without window: the widest at `tolerance`"
    )
    angle_within: tuple[Angle, Angle] | None = Field(
        None, description="crank angles among which the widest window is looked for; default: all that can be reached"
    )
    travel_within: tuple[Length, Length] | None = Field(
        None, description="slider travel in which the widest window is looked for; default: all that can be reached"
    )
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] | None = Field(
        None, description="largest deviation allowed, as a fraction of what is wanted"
    )
    objective: Literal["minimax", "least-squares"] = Field(
        "minimax", description="smallest largest deviation, or smallest root mean square"
    )
    stiffness: RotationalStiffness | None = Field(
        None, description="slope wanted of the torque: it is then to follow a line through the stretched position"
    )
    hold_stiffness: bool = Field(
        False, description="the slope in the stretched position exactly; the torque itself as constant as that allows"
    )
    springs: tuple[JointName, ...] = Field(
        ("pivot", "crank_pin", "slider_pin", "slider"), min_length=1, description="those that may be used"
    )
    max_rates: MaxRates | None = Field(None, description="largest rates; no limit unless given")
    crank_length: tuple[PositiveLength, PositiveLength] | None = Field(
        None, description="range in which it may be chosen; as the mechanism has it unless given"
    )
    offset: tuple[Length, Length] | None = Field(None, description="range of the slider's offset")
    unloaded_offset: tuple[Angle, Angle] | None = Field(
        None, description="range of the unloaded position, as an angle from the stretched one; one sign"
    )
    spacing: Literal["even", "crank"] = Field(
        "even", description="points of the window: even in the motion, or in the crank's angle"
    )
    points: int = Field(100, ge=10, le=10_000, description="points of the window, its start left out")
    slack: Annotated[Ratio, Field(ge=0, lt=1)] = Field(
        0.0, description="how much more deviation than the best is as good: among those designs `prefer` decides"
    )
    prefer: Literal["small-rotation", "even-rates", "soft-springs"] = Field(
        "small-rotation", description="which of several designs that are as good"
    )

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if (self.torque is None) == (self.force is None):
            raise ValueError("give either 'torque' or 'force': what is wanted constant")
        if self.torque == 0.0:
            raise ValueError("'torque' must not be 0: springs that are absent do that")
        if self.torque is None and (self.angle or self.stiffness is not None or self.hold_stiffness):
            raise ValueError("'angle', 'stiffness' and 'hold_stiffness' belong to 'torque'; with 'force' give 'travel'")
        if self.force is None and self.travel:
            raise ValueError("'travel' belongs to 'force'; with 'torque' give 'angle'")
        if (self.angle_within and self.torque is None) or (self.travel_within and self.force is None):
            raise ValueError("'angle_within' belongs to 'torque', 'travel_within' to 'force'")
        return self

    @model_validator(mode="after")
    def _window_or_tolerance(self) -> Self:
        if self.window is None and self.tolerance is None:
            raise ValueError("give a window ('angle' or 'travel'), or a 'tolerance' for the widest one, or both")
        if self.window is None and self.objective == "least-squares":
            raise ValueError("the widest window is a matter of the largest deviation: remove 'objective'")
        if self.hold_stiffness and self.stiffness is None:
            raise ValueError("'hold_stiffness' needs the 'stiffness' to hold")
        return self

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        for name in ("angle", "travel", "angle_within", "travel_within", "crank_length", "offset", "unloaded_offset"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(f"'{name}' must be increasing")
        if self.unloaded_offset and self.unloaded_offset[0] < 0 < self.unloaded_offset[1]:
            raise ValueError("'unloaded_offset' must have one sign: before or beyond the stretched position")
        return self

    @property
    def window(self) -> tuple[float, float] | None:
        """Where the target is wanted [rad or m]; None: as wide as possible."""
        return self.angle if self.torque is not None else self.travel

    @property
    def within(self) -> tuple[float, float] | None:
        """Where the widest window is looked for [rad or m]; None: everywhere."""
        return self.angle_within if self.torque is not None else self.travel_within

    @property
    def target(self) -> float:
        """What is wanted [N m or N]."""
        return self.torque or self.force or 0.0


class CrankAnalysis(PrintedAnalysis):
    """How a slider-crank is run."""

    drive: Literal["torque", "force"] = Field(
        "torque", description="torque at the crank over its angle, or force at the slider over its travel"
    )
    angle: tuple[Angle, Angle] | None = Field(
        None, description="crank angles to run through; default: one turn, or the arc that the linkage reaches"
    )
    travel: tuple[Length, Length] | None = Field(
        None,
        description="slider travel from the unloaded position, positive against the branch: inwards from where it is "
        "stretched; default: all of it",
    )
    side: Literal["before", "beyond"] | None = Field(
        None, description="where the crank is when a force drives: before or beyond the stretched position"
    )
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.005, description="half width of the constant band, as a fraction of the value at the reference"
    )
    reference_angle: Angle | None = Field(None, description="where the constant band is taken; default: stretched")
    reference_travel: Length | None = Field(
        None, description="where the constant band is taken when a force drives; default: half way"
    )
    fidelity: Literal["prb", "lumped", "beam"] | None = Field(
        None, description="rigid links with springs, flexures, or a strip; default: the last that the mechanism has"
    )

    @model_validator(mode="after")
    def _ranges_increase(self) -> Self:
        for name in ("angle", "travel"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(f"'{name}' must be increasing")
        return self


class SliderCrankSpec(Spec):
    """A slider-crank with springs at its joints."""

    family: Literal["slider-crank"]
    mechanism: Mechanism
    design: CrankDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: CrankAnalysis = Field(default_factory=CrankAnalysis, description="how it is run")

    @property
    def motion(self) -> Literal["length", "angle"]:
        """What the curve runs over: the slider's travel, or the angle of the crank; printed parts are pressed."""
        return "length" if self.analysis.drive == "force" or self.fidelity != "prb" else "angle"

    @property
    def fidelity(self) -> Literal["prb", "lumped", "beam"]:
        """The model that the analysis uses."""
        return self.analysis.fidelity or self.mechanism.finest

    @model_validator(mode="after")
    def _flexures_fit_their_links(self) -> Self:
        part = self.mechanism
        if part.flexures is None:
            return self
        coupler = part.coupler_length
        if coupler is None:
            coupler = math.hypot(part.stretched_position or 0.0, part.offset) - part.crank_length
        own, names = part.flexures.all, ("pivot", "crank_pin", "slider_pin")
        faults: dict[tuple[str | int, ...], str] = {}
        for k, (link, room) in enumerate((("crank", part.crank_length), ("coupler", coupler))):
            shares = (1.0 - own[k].before) * own[k].length, own[k + 1].before * own[k + 1].length
            if 0.0 < room * (1.0 + 1e-12) < sum(shares):
                longer = names[k] if shares[0] >= shares[1] else names[k + 1]
                faults["mechanism", "flexures", longer, "length"] = (
                    f"the flexures at its ends take {1e3 * sum(shares):.4g} mm of the {link}, which has "
                    f"{1e3 * room:.4g} mm: make them shorter"
                )
        refuse("Spec", faults)
        return self

    @model_validator(mode="after")
    def _fidelity_has_its_part(self) -> Self:
        part, asked = self.mechanism, self.analysis.fidelity
        if (asked == "lumped" and part.flexures is None) or (asked == "beam" and part.beam is None):
            block = "flexures" if asked == "lumped" else "beam"
            raise ValueError(f"fidelity {asked!r} needs 'mechanism.{block}'")
        if asked == "prb" and part.finest != "prb" and not any(self.mechanism.springs.model_dump().values()):
            raise ValueError("fidelity 'prb' needs the rates of 'mechanism.springs'")
        if self.fidelity != "prb" and self.analysis.drive != "force":
            raise ValueError("flexures and strips are pressed at the slider: set 'analysis.drive: force'")
        return self
