"""YAML specification of a vcfm (V-beams and a spring): its keys with types, bounds and descriptions, cross-checks."""

from __future__ import annotations

from collections.abc import Mapping
from math import sin
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from cfmkit.families.end_stops import EndStops
from cfmkit.families.end_stops_spec import EndStop, stop_faults, travel_up_to_stop
from cfmkit.families.request_spec import ProposedSpec
from cfmkit.families.vcfm.leaves_spec import LEAF_KINDS, SPRING_KINDS, Bistable, Positive
from cfmkit.families.vcfm.surroundings_spec import BoughtSprings, CutLeaves, StandingFrame, VcfmPart
from cfmkit.metrics.fatigue_and_relaxation import Durability
from cfmkit.specs.block import keys_of
from cfmkit.specs.spec import (
    Analysis,
    DesignBlock,
    Model,
    NonNegativeLength,
    PositiveLength,
    SolidAnalysis,
    is_made,
    refuse,
)
from cfmkit.specs.target_curve import Target
from cfmkit.specs.units import Force, Length, Ratio, Stiffness, format_short
from cfmkit.stock.material_and_part_spec import MaterialField, SafetyFactor, sheet_faults, stated_sheet
from cfmkit.stock.springs.spec import Catalogue, Life, SpringSafety
from cfmkit.stock.stock_series import Path, StockSize, stock_faults

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.specs.evaluable_target_curve import TargetCurve


MOST_PRELOAD = 100.0  # lengths of a leaf that a preload may be: every spring closes, or tears, long before


class Frame(Model):
    """The rigid parts, for the drawings only: they do not bend."""

    shuttle_width: PositiveLength = Field(0.008, description="of the shuttle between the leaves")
    spacing: PositiveLength = Field(0.020, description="between the two Vs on the shuttle")
    block: PositiveLength = Field(0.006, description="width of walls, corners and blocks")
    corner: PositiveLength = Field(
        0.012,
        description="height of the diamond's rigid corners: compressed by this plus twice its leaves' rise, it closes",
    )
    clearance: NonNegativeLength = Field(0.008, description="between the last V and the diamond")


class Mechanism(CutLeaves, Model):
    """A shuttle between snap-through leaves and a spring whose other end the preload moves."""

    material: MaterialField = Field(
        description="of leaves and spring: a name from `show materials`, or {youngs_modulus, ...}"
    )
    safety_factor: SafetyFactor = 1.0
    positive: Positive | None = Field(None, description="the spring as a structure of leaves; or 'springs'")
    springs: BoughtSprings | None = Field(None, description="bought springs instead of 'positive'")
    bistable: Bistable
    wide_beams: bool = Field(
        False,
        description="whether wide leaves are stiffer because their anticlastic bending is suppressed; exact model "
        "only, the effect of clamped ends is left out",
    )
    stops: dict[str, EndStop] = Field(
        {}, description="stops of the shuttle, by name: {end: {gap: 6 mm, stiffness: 80 N/mm}}"
    )
    frame: Frame = Field(default_factory=lambda: Frame(), description="rigid parts, for drawings")
    part: VcfmPart | None = Field(None, description="how both parts are cut: inside corners, sheet, holes, frame")

    @model_validator(mode="after")
    def _one_kind_of_spring(self) -> Self:
        if self.positive is None and self.springs is None:
            raise ValueError("needs 'positive', a spring of leaves, or 'springs' that are bought")
        if self.positive is not None and self.springs is not None:
            raise ValueError("give either 'positive', a spring of leaves, or 'springs' that are bought")
        return self

    @property
    def end_stops(self) -> EndStops:
        """Stops of the shuttle."""
        return EndStops(tuple(self.stops.items()))

    @property
    def flexures(self) -> Positive:
        """The spring that balances the leaves and is cut with them.

        Raises TypeError if it is bought: ask `springs` first.
        """
        if self.positive is None:
            raise TypeError("the springs of this mechanism are bought")
        return self.positive

    @property
    def kinds(self) -> tuple[str, str]:
        """Structure of the spring, "springs" where it is bought, and of the leaves."""
        return "springs" if self.positive is None else self.positive.structure, self.bistable.structure

    @property
    def allowable_stress(self) -> float | None:
        """Yield strength over safety factor [Pa]; None if no strength is known."""
        return self.material.allowable(self.safety_factor)


class VcfmDesign(DesignBlock):
    """Targets of `cfmkit design`. Angle and thickness of the spring, and the number of leaves, stay."""

    force: Annotated[Force, Field(gt=0)] | None = Field(None, description="constant force without preload")
    target: Target | None = Field(
        None, description="a curve over the displacement instead of a constant force, preferably a line ('stiffness')"
    )
    adjustment: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="increase of the force by the preload; default: no preload, then state 'rise'"
    )
    stroke: Annotated[Length, Field(ge=0)] = Field(
        0.0, description="travel over which it is constant; required, except where `free` alone is stated"
    )
    preload: PositiveLength | None = Field(None, description="preload that increases the force by that much")
    rise: PositiveLength | None = Field(
        None,
        description="of the leaves, h; instead of 'preload'; with bought springs, whose rate determines it, its upper "
        "limit",
    )
    catalogue: Catalogue = Field(
        (),
        description="springs to pick instead of a diamond: a list, a CSV file beside the specification, or `generic`",
    )
    spring_room: PositiveLength | None = Field(
        None, description="space for a spring of the catalogue: one that is longer when relaxed is not chosen"
    )
    spring_life: Life | None = Field(
        None, description="cycles that a spring of the catalogue must last; one of unknown life is not chosen"
    )
    spring_safety: SpringSafety | None = None
    leaf_length: PositiveLength | None = Field(None, description="L2; default: the shortest that the stress allows")
    min_thickness: PositiveLength | None = Field(None, description="thinnest leaf that can be made")
    max_span: PositiveLength | None = Field(
        None, description="space across the motion between the walls, 2 L cos(theta)"
    )
    max_width: PositiveLength | None = Field(None, description="space out of the plane")
    refine: bool = Field(True, description="correct both widths by one pass of the exact model")

    @model_validator(mode="after")
    def _one_length_and_target(self) -> Self:
        if self.preload is not None and self.rise is not None:
            raise ValueError(
                "give either 'preload' or 'rise': one follows from the other, rise = force/adjustment preload"
            )
        if self.adjustment is None and self.preload is not None:
            raise ValueError("'preload' needs the 'adjustment' that it gives; without one give the leaves' 'rise'")
        if self.by_requirements:
            return self
        if self.stroke == 0.0:
            raise ValueError("give the 'stroke' over which the force is constant, above 0 mm; or 'free' alone")
        if self.target is None:
            if self.force is None:
                raise ValueError("give either 'force' or 'target', a curve of forces")
            return self
        if self.force is not None and (self.target.stiffness is None or self.target.start is not None):
            raise ValueError("give either 'force' or 'target'; with 'target: {stiffness}' the force is that at zero")
        if self.rise is None or self.adjustment is not None or self.catalogue or not self.refine:
            raise ValueError("a 'target' needs the leaves' 'rise' and the exact model: no adjustment, no catalogue")
        return self

    @property
    def curve(self) -> TargetCurve | None:
        """The curve that is wanted; None of a constant force."""
        return None if self.target is None else self.target.curve(self.force)

    @property
    def required_force(self) -> float:
        """The force, of a curve that in the middle of the leaves' linear region, two thirds of their rise [N]."""
        if self.curve is not None:
            return float(self.curve.evaluate(2.0 / 3.0 * (self.rise or 0.0)))
        return self.force or 0.0

    @property
    def height(self) -> float:
        """Rise of the leaves [m]."""
        if self.rise is not None or self.adjustment is None:
            return self.rise or 0.0
        return (self.preload or 0.0) * self.required_force / self.adjustment

    @property
    def preload_stroke(self) -> float:
        """Preload for the whole adjustment [m]; 0 where none is wanted."""
        if not self.adjustment:
            return self.preload or 0.0
        return self.preload or (self.rise or 0.0) * self.adjustment / self.required_force


class Measured(Model):
    """Reported values of a built mechanism, to be checked for consistency."""

    force: Annotated[Force, Field(gt=0)] = Field(description="constant force without preload")
    positive_stiffness: Annotated[Stiffness, Field(gt=0)] = Field(description="K_p of the spring")


class VcfmSolid(SolidAnalysis):
    """Settings of planar solids."""

    poses: int = Field(
        41, ge=3, le=2000, description="poses that are solved, rest included; cubics interpolate between them"
    )


OTHER_DEFAULTS = "; ".join(
    f"for {kind.name} leaves the default is {kind.fidelity}"
    for kind in LEAF_KINDS.values()
    if kind.fidelity is not None
)
"""Of `analysis.fidelity`."""


class VcfmAnalysis(Analysis):
    """Analysis of the mechanism. Displacements are the shuttle's from the unloaded position."""

    preloads: tuple[Length, ...] = Field(
        (0.0,),
        min_length=1,
        max_length=50,
        description="displacements of the spring's far end, the nominal one first; negative: pulled",
    )
    travel: PositiveLength | None = Field(None, description="travel of the shuttle; default: 1.4 times the rise")
    fidelity: Literal["truss", "analytic", "exact", "solid"] = Field(
        "analytic",
        description="the paper's eq. 18 and 19, the corrected closed forms, beams in large deflection, or leaves and "
        f"spring as drawn, as planar solids; {OTHER_DEFAULTS}",
    )
    solid: VcfmSolid = Field(VcfmSolid(), description="settings of fidelity 'solid'")
    branch: Literal["stable", "primary"] = Field(
        "stable",
        description="where a leaf buckles: switch to the stable branch, or stay on the S shape; exact model only",
    )
    flatness: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.05, description="largest (max - min)/max of the force in the constant-force window"
    )
    measured: Measured | None = Field(None, description="reported values to compare with")

    @field_validator("preloads")
    @classmethod
    def _lengths(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if len(set(values)) < len(values):
            raise ValueError("lists a preload twice")
        return values


class VcfmSpec(ProposedSpec):
    """A constant-force mechanism of snap-through leaves and a preloaded spring."""

    family: Literal["vcfm"]
    mechanism: Mechanism
    design: VcfmDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: VcfmAnalysis = Field(default_factory=lambda: VcfmAnalysis(), description="how it is run")

    @model_validator(mode="before")
    @classmethod
    def _default_model_is_that_of_the_leaves(cls, data: Any) -> Any:
        """Choose the model that the kind of leaf needs, unless another is named."""
        blocks = keys_of(data)
        structure = keys_of(keys_of(blocks.get("mechanism")).get("bistable")).get("structure")
        analysis = blocks.get("analysis")
        fidelity = next((kind.fidelity for kind in LEAF_KINDS.values() if kind.name == structure), None)
        if fidelity is None or not (analysis is None or isinstance(analysis, Mapping | Model)):
            return data
        return dict(blocks) | {"analysis": {"fidelity": fidelity} | dict(keys_of(analysis))}

    @model_validator(mode="after")
    def _stock_is_sold(self, info: ValidationInfo) -> Self:
        part, springs = self.mechanism.part, self.mechanism.springs
        if part is not None and not is_made(info):
            wire = springs.wound.wire if springs and springs.wound else None
            sizes: list[StockSize] = [*stated_sheet(part), (("springs", "wound", "wire"), "wire", wire)]
            refuse("Spec", stock_faults(part.stock, sizes, self.mechanism.material.name))
        return self

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        widths = sheet_faults(self.mechanism.part, self.out_of_plane_widths)
        refuse("Spec", widths | dict(stop_faults(self.mechanism.stops, self.requirements)) | dict(self._list_faults()))
        return self

    def _list_faults(self) -> Iterator[tuple[Path, str]]:
        """Yield what of mechanism, analysis and design does not go together, by path."""
        mechanism, analysis, design = self.mechanism, self.analysis, self.design
        part = mechanism.part or VcfmPart()
        frame = part.frame or StandingFrame()
        if part.sheet is not None and design is not None and design.leaf_length is not None:
            yield (
                ("design", "leaf_length"),
                "the length of leaves from a sheet follows from the force: drop it, or 'mechanism.part.sheet'",
            )
        if frame.stop is not None and frame.stop < self.travel * (1 - 1e-9):
            stop, travel = (format_short(length, "length") for length in (frame.stop, self.travel))
            yield (
                ("mechanism", "part", "frame", "stop"),
                f"the stop holds the shuttle at {stop}, but the travel is {travel}: make the stop or 'analysis' agree",
            )
        if frame.seat is not None and mechanism.springs is not None:
            yield (
                ("mechanism", "part", "frame", "seat"),
                "a seat is drawn for a spring of leaves; these springs are bought: leave it out",
            )
        most = MOST_PRELOAD * mechanism.bistable.length
        for index, preload in enumerate(analysis.preloads):
            if abs(preload) > most:
                yield (
                    ("analysis", "preloads", index),
                    f"is more than {MOST_PRELOAD:g} times the length of a leaf ('mechanism.bistable.length'): at most "
                    f"{format_short(most, 'length')}",
                )
        if mechanism.wide_beams and analysis.fidelity in ("truss", "analytic"):
            yield ("mechanism", "wide_beams"), "no closed form includes it: add 'analysis.fidelity: exact'"
        if analysis.fidelity == "solid" or (design is not None and design.verify == "solid"):
            if mechanism.bistable.waviness:
                yield (
                    ("mechanism", "bistable", "waviness"),
                    "the model 'solid' does not support it: leaves are as drawn",
                )
            if analysis.branch == "primary":
                yield ("analysis", "branch"), "the model 'solid' follows the stable branch only"

    @property
    def out_of_plane_widths(self) -> Mapping[str, float | None]:
        """Of leaves, and of a spring that is cut."""
        spring = self.mechanism.positive
        spring_width = {} if spring is None else {"positive.width": spring.width}
        return {"bistable.width": self.mechanism.bistable.width} | spring_width

    @model_validator(mode="after")
    def _truss_has_two_laws(self) -> Self:
        both = self.mechanism.positive, self.mechanism.bistable
        if self.analysis.fidelity == "truss" and any(strip is None or strip.kind.truss is None for strip in both):
            names = [
                f"'{kind.name}'" for kind in (*SPRING_KINDS.values(), *LEAF_KINDS.values()) if kind.truss is not None
            ]
            raise ValueError(f"the truss laws are for {' and '.join(names)}; choose another 'analysis.fidelity'")
        return self

    @model_validator(mode="after")
    def _design_has_laws(self) -> Self:
        if self.design is None or self.design.by_requirements:
            return self
        spring, leaves = self.mechanism.positive, self.mechanism.bistable
        fixed = spring is not None and not self.design.catalogue
        if not leaves.kind.can_be_designed or (spring is not None and fixed and not spring.kind.can_be_designed):
            names, springs = (
                " or ".join(f"'{kind.name}'" for kind in kinds.values() if kind.can_be_designed)
                for kinds in (LEAF_KINDS, SPRING_KINDS)
            )
            raise ValueError(f"only {names} with a {springs} or with 'springs' can be designed; remove 'design'")
        free = not fixed
        if not free and self.design.preload is None and self.design.rise is None:
            raise ValueError(
                "'design' needs either 'preload' or 'rise': one follows from the other, rise = force/adjustment preload"
            )
        for name in ("spring_life", "spring_safety", "spring_room"):
            if free and not self.design.catalogue and getattr(self.design, name):
                raise ValueError(f"{name!r} applies only to springs picked from a catalogue: give 'catalogue', too")
        return self

    @property
    def durability(self) -> Durability | None:
        """Of leaves and spring; bought springs do not relax with the leaves, so that no law holds for their sum."""
        durability = self.mechanism.material.durability
        if durability is None or self.mechanism.springs is None:
            return durability
        if durability.fatigue is None:
            return None
        return Durability(durability.fatigue, assumed=durability.assumed if durability.relaxation is None else ())

    def end_stop_changes(self, end: float) -> Mapping[str, Any]:
        """Return what puts a rigid stop at a motion of the shuttle [m] and ends the analysis just before it."""
        return {"mechanism.stops": {"end": {"gap": end}}, "analysis.travel": travel_up_to_stop(end)}

    @property
    def travel(self) -> float:
        """Travel of the shuttle [m]."""
        leaf = self.mechanism.bistable
        return self.analysis.travel or 1.4 * leaf.length * sin(leaf.angle)
