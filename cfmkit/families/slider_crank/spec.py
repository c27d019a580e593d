"""YAML specification of a slider-crank mechanism: its keys with types, bounds and descriptions, and cross-checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from cfmkit.families.end_stops_spec import stop_faults, travel_up_to_stop
from cfmkit.families.request_spec import ProposedSpec
from cfmkit.families.slider_crank.printed.spec import Printed, PrintedAnalysis, PrintedDesign
from cfmkit.families.slider_crank.springs.spec import Limits, Links, SpringDesign, Springs
from cfmkit.metrics.fatigue_and_relaxation import Durability
from cfmkit.specs.spec import PositiveLength, SolidAnalysis, is_made, refuse
from cfmkit.specs.units import Angle, Length, Ratio, format_short
from cfmkit.stock.material_and_part_spec import Guide, Pins, sheet_faults, stated_sheet
from cfmkit.stock.stock_series import StockSize, stock_faults


class Mechanism(Printed):
    """A crank about a fixed pivot, a coupler, a slider on a straight guide; a spring at each joint."""

    crank_length: PositiveLength = Field(description="r1, pivot to crank pin")
    coupler_length: PositiveLength | None = Field(
        None, description="r2, crank pin to slider pin; default: from 'stretched_position'"
    )
    stretched_position: PositiveLength | None = Field(
        None,
        description="distance of pivot and slider pin along the guide in the stretched position; instead "
        "of 'coupler_length'",
    )
    offset: Length = Field(0.0, description="e, height of the slider pin's path above the pivot")
    branch: Literal["right", "left"] = Field("right", description="side of the crank pin on which the slider is")
    unloaded_angle: Angle | None = Field(
        None, description="crank angle from the guide's direction with all springs relaxed"
    )
    unloaded_offset: Angle | None = Field(
        None,
        description="the same, measured from the stretched position (0: exactly there); instead of 'unloaded_angle'",
    )
    springs: Springs = Field(default_factory=Springs, description="rates of one leg; default: 0 each")
    legs: int = Field(1, ge=1, le=1000, description="equal legs in parallel on one crank, or on one slider")
    copies: Literal["single", "mirrored"] = Field(
        "single", description="mirrored: a second set of legs, mirrored at the guide, which then carries no load"
    )
    pins: Pins | None = Field(None, description="at pivot, crank pin and slider pin: their friction")
    links: Links | None = Field(
        None,
        description="width of crank and coupler between springs at joints; with 'material' and 'part.sheet' their "
        "strength is known; default: 0.16 of the shorter one's length",
    )
    guide: Guide | None = Field(None, description="of the slider: its friction")
    limits: Limits | None = Field(None, description="largest rotations and travel of the springs")

    @property
    def sets(self) -> int:
        """Legs that act together: those stated, twice for a mirrored pair."""
        return self.legs * (2 if self.copies == "mirrored" else 1)

    @model_validator(mode="after")
    def _coupler_is_known(self) -> Self:
        if (self.coupler_length is None) == (self.stretched_position is None):
            raise ValueError("give either 'coupler_length' or 'stretched_position', from which it follows")
        return self

    @model_validator(mode="after")
    def _links_are_wider_than_their_pins(self) -> Self:
        if self.links is not None and self.pins is not None and self.links.width <= self.pins.diameter:
            reported = f"links must be wider than the pins in them, {format_short(self.pins.diameter, 'length')}"
            refuse("Mechanism", {("links", "width"): reported})
        return self

    @model_validator(mode="after")
    def _unloaded_position_is_known(self) -> Self:
        if (self.unloaded_angle is None) == (self.unloaded_offset is None):
            raise ValueError("give either 'unloaded_angle' or 'unloaded_offset', the angle from the stretched position")
        return self


class CrankDesign(SpringDesign, PrintedDesign):
    """Targets of `cfmkit design`: rates of the springs, and lengths where a range is given."""


class CrankAnalysis(PrintedAnalysis):
    """Analysis of a slider-crank."""

    drive: Literal["torque", "force"] = Field(
        "torque", description="torque at the crank over its angle, or force at the slider over its travel"
    )
    angle: tuple[Angle, Angle] | None = Field(
        None, description="crank angles to run through; default: one turn, or the arc that the linkage reaches"
    )
    travel: tuple[Length, Length] | None = Field(
        None,
        description="slider travel from the unloaded position; positive to the left for branch `right`, to the right "
        "for `left`: from the stretched position towards the pivot; default: all of it",
    )
    side: Literal["before", "beyond"] | None = Field(
        None, description="where the crank is when a force drives: before or beyond the stretched position"
    )
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.005, description="half width of the constant band, as a fraction of the value at the reference"
    )
    reference_angle: Angle | None = Field(None, description="where the constant band is taken; default: stretched")
    reference_travel: Length | None = Field(
        None,
        description="travel around which the constant band is evaluated for a force drive; default: half the travel",
    )
    fidelity: Literal["prb", "lumped", "beam", "solid"] | None = Field(
        None,
        description="rigid links with springs, flexures, or a strip; default: the last of these that the mechanism "
        "has; solid: flexures or strip as drawn, as a planar solid",
    )
    solid: SolidAnalysis = Field(SolidAnalysis(), description="settings of fidelity 'solid'")

    @property
    def side_sign(self) -> int:
        """The side that is stated as a sign: 1 beyond, -1 before the stretched position; 0 if none is."""
        return {"beyond": 1, "before": -1, None: 0}[self.side]

    @model_validator(mode="after")
    def _ranges_increase(self) -> Self:
        for name in ("angle", "travel"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(f"'{name}' must be increasing")
        return self


class SliderCrankSpec(ProposedSpec):
    """A slider-crank with springs at its joints."""

    family: Literal["slider-crank"]
    mechanism: Mechanism
    design: CrankDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: CrankAnalysis = Field(default_factory=CrankAnalysis, description="how it is run")

    @property
    def durability(self) -> Durability | None:
        """Of flexures or strip."""
        return self.mechanism.material.durability if self.mechanism.material else None

    @property
    def motion(self) -> Literal["length", "angle"]:
        """Abscissa of the curve: the slider's travel, or the angle of the crank; printed parts are pressed."""
        return "length" if self.analysis.drive == "force" or self.fidelity != "prb" else "angle"

    @property
    def fidelity(self) -> Literal["prb", "lumped", "beam", "solid"]:
        """The model that the analysis uses."""
        return self.analysis.fidelity or self.mechanism.finest

    @property
    def built_as(self) -> Literal["springs", "printed"]:
        """Which folder of the family models it: rigid links with springs, or a part that bends."""
        return "springs" if self.fidelity == "prb" else "printed"

    @property
    def piece(self) -> Literal["prb", "lumped", "beam"]:
        """Kind: links and springs, flexures or a strip; of a solid the finest that there is data for."""
        return self.mechanism.finest if self.fidelity == "solid" else self.fidelity

    @model_validator(mode="after")
    def _stock_is_sold(self, info: ValidationInfo) -> Self:
        mechanism = self.mechanism
        if mechanism.part is None or is_made(info):
            return self
        sizes: list[StockSize] = [*stated_sheet(mechanism.part)]
        sizes += [(("pins", "diameter"), "pin", mechanism.pins.diameter if mechanism.pins else None)]
        for number, spring in enumerate(mechanism.springs.bought):
            wire = spring.wound.wire if spring.wound else None
            sizes += [(("springs", "bought", number, "wound", "wire"), "wire", wire)]
        material = mechanism.material.name if mechanism.material else None
        refuse("Spec", stock_faults(mechanism.part.stock, sizes, material))
        return self

    @model_validator(mode="after")
    def _is_cut_from_one_sheet(self) -> Self:
        refuse("Spec", sheet_faults(self.mechanism.part, self.out_of_plane_widths))
        return self

    @property
    def out_of_plane_widths(self) -> Mapping[str, float | None]:
        """Of flexures and strip, where there are any."""
        flexures, strip = self.mechanism.flexures, self.mechanism.beam
        names = ("pivot", "crank_pin", "slider_pin")
        widths = {f"flexures.{name}.width": getattr(flexures, name).width for name in names} if flexures else {}
        return widths | ({"beam.width": strip.width} if strip else {})

    @model_validator(mode="after")
    def _stops_are_of_a_part_that_is_pressed(self) -> Self:
        faults = dict(stop_faults(self.mechanism.stops, self.requirements))
        end = self.analysis.travel[1] if self.analysis.travel else math.inf
        solid = self.fidelity == "solid" and end < self.mechanism.end_stops.free_end
        if self.mechanism.stops and self.fidelity in ("prb", "solid") and not solid:
            faults["mechanism", "stops"] = (
                "stops are known of flexures and strips: 'analysis.fidelity' of lumped or beam, or of solid with an "
                f"'analysis.travel' that ends before them, not {self.fidelity}"
            )
        refuse("Spec", faults)
        return self

    def end_stop_changes(self, end: float) -> Mapping[str, Any]:
        """Return what puts a rigid stop at a motion of the slider [m], just behind the end; none with springs."""
        if self.built_as == "springs":
            return {}
        return {"mechanism.stops": {"end": {"gap": end}}, "analysis.travel": (0.0, travel_up_to_stop(end))}

    @model_validator(mode="after")
    def _a_mirrored_pair_is_on_one_slider(self) -> Self:
        if self.mechanism.copies == "mirrored" and self.analysis.drive != "force":
            raise ValueError("'copies: mirrored' is a pair on one slider: set 'analysis.drive: force'")
        return self

    @model_validator(mode="after")
    def _flexures_fit_their_links(self) -> Self:
        part = self.mechanism
        if part.flexures is None:
            return self
        coupler = part.coupler_length
        if coupler is None:
            coupler = math.hypot(part.stretched_position or 0.0, part.offset) - part.crank_length
        flexures, names = part.flexures.all, ("pivot", "crank_pin", "slider_pin")
        faults: dict[tuple[str | int, ...], str] = {}
        for k, (link, room) in enumerate((("crank", part.crank_length), ("coupler", coupler))):
            shares = (1.0 - flexures[k].before) * flexures[k].length, flexures[k + 1].before * flexures[k + 1].length
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
        if asked == "prb" and part.finest != "prb" and not any(self.mechanism.springs.rates):
            raise ValueError("fidelity 'prb' needs the rates of 'mechanism.springs'")
        if asked == "solid" and part.finest == "prb":
            raise ValueError("fidelity 'solid' needs a part: 'mechanism.flexures' or 'mechanism.beam'")
        if asked == "solid" and self.analysis.side is not None:
            raise ValueError("fidelity 'solid' follows the side of its kink: remove 'analysis.side'")
        if asked == "solid" and self.analysis.travel is not None and self.analysis.travel[0] < 0:
            raise ValueError("fidelity 'solid' is pressed, not pulled: 'analysis.travel' must not begin below 0")
        if self.fidelity != "prb" and self.analysis.drive != "force":
            raise ValueError("flexures and strips are pressed at the slider: set 'analysis.drive: force'")
        return self
