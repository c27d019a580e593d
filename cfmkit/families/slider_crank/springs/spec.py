"""Specification of springs at the joints, their limits, and their design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from cfmkit.specs.spec import DesignBlock, Model, PositiveForce, PositiveLength, is_made, refuse
from cfmkit.specs.target_curve import Target
from cfmkit.specs.units import Angle, Length, Ratio, RotationalStiffness, Stiffness, Torque
from cfmkit.stock.springs.extension_springs import ExtensionSpring
from cfmkit.stock.springs.kinds import AXIAL_KINDS
from cfmkit.stock.springs.spec import RATE_RTOL, Catalogue, Life, SpringSafety, SpringWire
from cfmkit.stock.springs.support_spec import BuiltInSpring
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

if TYPE_CHECKING:
    from cfmkit.specs.evaluable_target_curve import TargetCurve
    from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring

    AxialKind = str
else:
    AxialKind = Literal[tuple(AXIAL_KINDS)]

PositiveAngle = Annotated[Angle, Field(gt=0)]
TorsionRate = Annotated[RotationalStiffness, Field(ge=0)]
ExtensionRate = Annotated[Stiffness, Field(ge=0)]


JointName = Literal["pivot", "crank_pin", "slider_pin", "slider"]


class Bought(BuiltInSpring):
    """A spring of one leg that is bought."""

    at: JointName = Field(description="the joint that it acts at")
    name: str = Field(min_length=1, description="part number")
    count: int = Field(1, ge=1, le=1000, description="how many in parallel in one leg")
    loaded: AxialKind | None = Field(None, description="how a spring at the slider is loaded; default: extension")
    free_length: PositiveLength | None = Field(None, description="relaxed, of one that is compressed: it may buckle")
    wound: SpringWire | None = Field(
        None,
        description="wire, coil and turns of one spring, for the stress in its wire, and for the rate if "
        "none is stated",
    )
    life: Life | None = None

    @model_validator(mode="after")
    def _is_held(self) -> Self:
        if self.loaded is not None and self.at != "slider":
            raise ValueError("'loaded' is for the spring at the slider; those at pins are torsion springs")
        self.check_guide(self.spring_type, self.coil, None)
        return self

    @property
    def spring_type(self) -> type[HelicalSpring]:
        """Its kind."""
        return AXIAL_KINDS[self.loaded or ExtensionSpring.kind] if self.at == "slider" else HelicalTorsionSpring

    @property
    def rate(self) -> float | None:
        """Of all of them, from their wire [N m/rad or N/m]; None if that is not known."""
        return None if self.coil is None else self.count * self.coil.rate


class Springs(Model):
    """Rates of the springs of one leg; all are relaxed in the unloaded position."""

    pivot: TorsionRate = Field(0.0, description="torsion between ground and crank, K_RA; state it per rad or per deg")
    crank_pin: TorsionRate = Field(0.0, description="torsion between crank and coupler, K_RB")
    slider_pin: TorsionRate = Field(0.0, description="torsion between coupler and slider, K_RC")
    slider: ExtensionRate = Field(0.0, description="extension between slider and ground, K_PC")
    anchor: Length | None = Field(
        None,
        description="a trim: how far the anchor of the slider's spring is moved from where that spring is relaxed in "
        "the unloaded position; positive adds force against the travel; needs 'slider'",
    )

    bought: tuple[Bought, ...] = Field((), description="the bought springs, for the parts list")

    @model_validator(mode="after")
    def _rates_are_those_of_the_wires(self, info: ValidationInfo) -> Self:
        """Take rates from the wires where none are stated, and refuse stated ones that contradict them."""
        for joint in dict.fromkeys(spring.at for spring in self.bought):
            parts = [spring.rate for spring in self.bought if spring.at == joint]
            if None in parts:
                if joint not in self.model_fields_set:
                    refuse("Springs", {(joint,): "missing: give it, or 'wound' of every spring bought for this joint"})
                continue
            total = sum(rate for rate in parts if rate is not None)
            if joint not in self.model_fields_set:
                # past the frozen model, and not counted as set: another wire then has another rate
                object.__setattr__(self, joint, total)
            elif (
                not is_made(info)
                and abs(total / getattr(self, joint) - 1.0 if getattr(self, joint) else 1.0) > RATE_RTOL
            ):
                refuse(
                    "Springs",
                    {
                        (joint,): f"wires of 'bought' give {total / max(getattr(self, joint), 1e-300):.3g} "
                        "times the stated rate: leave one of them out, or give the wire's modulus"
                    },
                )
        return self

    def stated_over_wires(self, joint: JointName) -> float:
        """Return the rate at a joint over that of its springs' wires; 1 where one of these is not known."""
        rates = [spring.rate for spring in self.bought if spring.at == joint]
        stated = [rate for rate in rates if rate is not None]
        return float(getattr(self, joint) / sum(stated)) if len(stated) == len(rates) else 1.0

    def coils_at(self, joint: str) -> list[HelicalSpring]:
        """Return the springs at a joint whose wire is known."""
        return [spring.coil for spring in self.bought if spring.at == joint and spring.coil is not None]

    def pulled_outwards(self, high: float, low: float) -> bool:
        """Return whether the slider's spring has a known wire and is stretched by a slider that leaves the pivot.

        `high` and `low`: how far the slider goes outwards and inwards from the unloaded position [m].
        """
        return bool(self.coils_at("slider")) and high > abs(low)

    @property
    def rates(self) -> tuple[float, float, float, float]:
        """Rates at pivot, crank pin, slider pin and slider [N m/rad, the last N/m]."""
        return self.pivot, self.crank_pin, self.slider_pin, self.slider


class Links(Model):
    """Crank and coupler as bars with round ends, cut from the sheet of `part`."""

    width: PositiveLength = Field(description="across their length, at the eyes, too")


class Limits(Model):
    """Largest deflection of each spring from the unloaded position, either way."""

    pivot: PositiveAngle | None = Field(None, description="rotation at the pivot")
    crank_pin: PositiveAngle | None = Field(None, description="rotation at the crank pin")
    slider_pin: PositiveAngle | None = Field(None, description="rotation at the slider pin")
    slider: PositiveLength | None = Field(None, description="travel of the slider")


class MaxRates(Model):
    """Largest rates that a design may give the springs of one leg."""

    pivot: TorsionRate | None = Field(None, description="torsion at the pivot")
    crank_pin: TorsionRate | None = Field(None, description="torsion at the crank pin")
    slider_pin: TorsionRate | None = Field(None, description="torsion at the slider pin")
    slider: ExtensionRate | None = Field(None, description="extension at the slider")


class SpringDesign(DesignBlock):
    """Targets and choices of a design of springs."""

    torque: Torque | None = Field(
        None, description="target at the crank, all legs together; negative: towards smaller angles"
    )
    force: PositiveForce | None = Field(None, description="target at the slider, all legs together")
    target: Target | None = Field(
        None, description="a curve instead of a constant torque or force: torque over crank angle, or force over travel"
    )
    angle: tuple[Angle, Angle] | None = Field(None, description="crank angles over which the torque is to be constant")
    travel: tuple[Length, Length] | None = Field(
        None,
        description="slider travel over which the force is to be constant; without window: the widest one at "
        "`tolerance`",
    )
    angle_within: tuple[Angle, Angle] | None = Field(
        None, description="crank angles within which the widest window is sought; default: all that can be reached"
    )
    travel_within: tuple[Length, Length] | None = Field(
        None, description="slider travel within which the widest window is sought; default: all that can be reached"
    )
    tolerance: Annotated[Ratio, Field(ge=1e-8, lt=1)] | None = Field(
        None, description="largest deviation allowed, as a fraction of the target; at least 1e-6 % (rounding)"
    )
    objective: Literal["minimax", "least-squares"] = Field(
        "minimax", description="minimise the largest deviation, or the root mean square"
    )
    stiffness: RotationalStiffness | None = Field(
        None, description="target slope of the torque, which then follows a line through the stretched position"
    )
    hold_stiffness: bool = Field(
        False,
        description="meet the slope in the stretched position exactly, and keep the torque as constant as that allows",
    )
    springs: tuple[JointName, ...] = Field(
        ("pivot", "crank_pin", "slider_pin", "slider"), min_length=1, description="springs that may be used"
    )
    catalogue: Catalogue | None = Field(
        None,
        description="springs to pick from, at most one kind per joint: a list, a CSV file beside the specification, "
        "or `generic`; default: any rate",
    )
    spring_life: Life | None = Field(
        None, description="cycles that springs of the catalogue must last; one of unknown life is not chosen"
    )
    spring_safety: SpringSafety | None = None
    spring_room: PositiveLength | None = Field(
        None,
        description="space for the slider's spring of the catalogue: one that is longer when relaxed is not chosen",
    )
    max_rates: MaxRates | None = Field(None, description="largest rates; default: no limit")
    crank_length: tuple[PositiveLength, PositiveLength] | None = Field(
        None, description="range in which it may be chosen; default: the value of the mechanism"
    )
    offset: tuple[Length, Length] | None = Field(None, description="range of the slider's offset")
    unloaded_offset: tuple[Angle, Angle] | None = Field(
        None, description="range of the unloaded position, as an angle from the stretched one; one sign"
    )
    spacing: Literal["even", "crank"] = Field(
        "even", description="points of the window: even in the motion, or in the crank's angle"
    )
    points: int = Field(100, ge=10, le=10_000, description="points of the window, its start excluded")
    slack: Annotated[Ratio, Field(ge=0, lt=1)] = Field(
        0.0,
        description="deviation beyond the best that is treated as equally good: among these designs `prefer` decides",
    )
    prefer: Literal["small-rotation", "even-rates", "soft-springs"] = Field(
        "small-rotation", description="which of several equally good designs to take"
    )

    branch: Literal["load", "unload", "mean"] | None = Field(
        None,
        description="branch on which the target holds if pins or guide have friction; default: without friction, "
        "between both branches",
    )
    adjustment: PositiveForce | None = Field(
        None,
        description="increase of the force by the trim: by the anchor of the slider's spring, or by the unloaded angle",
    )
    anchor_travel: PositiveLength | None = Field(
        None, description="range over which the anchor of the slider's spring can be adjusted"
    )
    angle_travel: PositiveAngle | None = Field(
        None,
        description="range of the unloaded angle in each direction: rotation of the anchors of the torsion springs",
    )

    @model_validator(mode="after")
    def _adjustment_has_its_travel(self) -> Self:
        ways = [self.anchor_travel, self.angle_travel]
        if self.adjustment is None and ways != [None, None]:
            raise ValueError("'anchor_travel' and 'angle_travel' apply only to an 'adjustment': give that, too")
        if self.adjustment is not None and ways.count(None) != 1:
            raise ValueError("'adjustment' needs either 'anchor_travel' or 'angle_travel', by which it is made")
        if self.adjustment is not None and self.torque is not None:
            raise ValueError("'adjustment' applies to a force only: give 'force' instead of 'torque'")
        if self.anchor_travel is not None and "slider" not in self.springs:
            raise ValueError("'anchor_travel' moves the anchor of the slider's spring: add 'slider' to 'springs'")
        if self.angle_travel is not None and self.objective == "least-squares":
            raise ValueError("'angle_travel' needs 'objective: minimax': least squares cannot impose this limit")
        return self

    @model_validator(mode="after")
    def _springs_are_picked(self) -> Self:
        if not self.catalogue:
            for name in ("spring_life", "spring_safety", "spring_room"):
                if getattr(self, name) is not None:
                    raise ValueError(f"{name!r} applies only to springs picked from a catalogue: give 'catalogue', too")
            return self
        if self.window is None:
            raise ValueError("springs of a 'catalogue' are picked for a window: give 'travel' (or 'angle'), too")
        if self.objective == "least-squares":
            raise ValueError(
                "springs of a 'catalogue' are chosen for the smallest maximum deviation: remove 'objective'"
            )
        if self.hold_stiffness or self.slack:
            name = "hold_stiffness" if self.hold_stiffness else "slack"
            raise ValueError(
                f"{name!r} needs freely chosen rates, which a 'catalogue' does not offer: remove one of the two"
            )
        return self

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if self.by_requirements:
            return self
        if self.target is not None:
            self._check_curve(self.target)
            return self
        if (self.torque is None) == (self.force is None):
            raise ValueError("state 'torque' or 'force', which is kept constant, or 'target', a curve of one of them")
        if self.torque == 0.0:
            raise ValueError("'torque' must not be 0: no springs at all give that")
        if self.torque is None and (self.angle or self.stiffness is not None or self.hold_stiffness):
            raise ValueError("'angle', 'stiffness' and 'hold_stiffness' belong to 'torque'; with 'force' give 'travel'")
        if self.force is None and self.travel:
            raise ValueError("'travel' belongs to 'force'; with 'torque' give 'angle'")
        if (self.angle_within and self.torque is None) or (self.travel_within and self.force is None):
            raise ValueError("'angle_within' belongs to 'torque', 'travel_within' to 'force'")
        return self

    @model_validator(mode="after")
    def _window_or_tolerance(self) -> Self:
        if self.by_requirements:
            return self
        if self.window is None and self.tolerance is None:
            raise ValueError("give a window ('angle' or 'travel'), or a 'tolerance' for the widest one, or both")
        if self.window is None and self.objective == "least-squares":
            raise ValueError("the widest window is defined by the largest deviation: remove 'objective'")
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

    def _check_curve(self, target: Target) -> None:
        """Refuse what has no meaning beside a curve, and a curve that does not cover its window."""
        if target.stiffness is None and (self.torque, self.force) != (None, None):
            raise ValueError("give either 'torque' or 'force', or 'target', a curve of one")
        stated = [name for name in ("stiffness", "adjustment") if getattr(self, name) is not None]
        if stated or self.hold_stiffness:
            raise ValueError(f"{(stated or ['hold_stiffness'])[0]!r} is for a constant effort, not for a 'target'")
        name = "angle" if self.drive == "torque" else "travel"
        if self.window is None or (self.travel if name == "angle" else self.angle) is not None:
            raise ValueError(f"a 'target' of {self.drive} needs its window: give {name!r}")
        if not (curve := target.curve(self.torque or self.force)).covers(*self.window):
            raise ValueError(f"the window {name!r} is beyond the points of 'target'")
        if not curve.largest(*self.window):
            raise ValueError("'target' is zero all over its window: no springs at all give that")

    @property
    def drive(self) -> Literal["torque", "force"]:
        """Drive: a torque at the crank or a force at the slider."""
        curved = self.target is not None and self.target.kind == "torque"
        return "torque" if self.torque is not None or curved else "force"

    @property
    def window(self) -> tuple[float, float] | None:
        """Window of the target [rad or m]; None: as wide as possible."""
        return self.angle if self.drive == "torque" else self.travel

    @property
    def within(self) -> tuple[float, float] | None:
        """Range in which the widest window is searched [rad or m]; None: everywhere."""
        return self.angle_within if self.drive == "torque" else self.travel_within

    @property
    def curve(self) -> TargetCurve | None:
        """The curve that is wanted; None of a constant torque or force."""
        return None if self.target is None else self.target.curve(self.torque or self.force)

    @property
    def size(self) -> float:
        """Target, of a curve its largest magnitude in the window [N m or N]."""
        if self.curve is not None and self.window is not None:
            return self.curve.largest(*self.window)
        return self.torque or self.force or 0.0
