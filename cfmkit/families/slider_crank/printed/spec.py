"""Specification of flexures, the strip, their material and how they are made and designed."""

from __future__ import annotations

import itertools
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from cfmkit.families.end_stops import EndStops
from cfmkit.families.end_stops_spec import EndStop
from cfmkit.specs.spec import Analysis, Model, PositiveLength
from cfmkit.specs.units import Length, Ratio
from cfmkit.stock.material_and_part_spec import MaterialField, PaddedPart, RoundedCorners, SafetyFactor
from cfmkit.stock.processes import PROCESSES_BY_NAME

Share = Annotated[Ratio, Field(gt=0, lt=1)]

Point = tuple[Length, Length]

LengthRange = tuple[PositiveLength, PositiveLength]

ShareRange = tuple[Share, Share]

MOST_TAPER = 100
"""Largest thickness of a strip over its smallest: a million in stiffness. What is softer turns within its own length,
and following its shape takes minutes for a curve that three flexures give at once."""


class FlexureSpec(Model):
    """A flexure with a rectangular section across a joint."""

    length: PositiveLength = Field(description="along the link, L")
    thickness: PositiveLength = Field(description="in the plane of bending, h")
    width: PositiveLength = Field(description="out of the plane, b")
    before: Annotated[Ratio, Field(ge=0, le=1)] = Field(0.5, description="share of the length before the joint")


class Flexures(Model):
    """The three flexures of one leg; rigid links between them."""

    pivot: FlexureSpec = Field(description="between ground and crank")
    crank_pin: FlexureSpec = Field(description="between crank and coupler; straight, along the chord across the kink")
    slider_pin: FlexureSpec = Field(description="between coupler and slider")

    @property
    def all(self) -> tuple[FlexureSpec, FlexureSpec, FlexureSpec]:
        """From the ground to the slider."""
        return self.pivot, self.crank_pin, self.slider_pin


class StripSpec(Model):
    """One strip from the ground to the slider in the place of links and flexures."""

    width: PositiveLength = Field(description="out of the plane, B")
    thickness: PositiveLength | Annotated[tuple[PositiveLength, ...], Field(min_length=2)] = Field(
        description="one value, or a list: linear in between, evenly spaced unless 'shares' states the positions"
    )
    shares: tuple[tuple[Share, ...], ...] | None = Field(
        None,
        description="positions of the thicknesses between the first and the last: for each straight piece, shares of "
        "its length",
    )
    flexure_length: PositiveLength | None = Field(
        None, description="of the flexures whose ends the centre line passes; default: 'flexures', or a fifth of r1"
    )
    centreline: Annotated[tuple[Point, ...], Field(min_length=2)] | None = Field(
        None,
        description="corners [x, y] of the line from ground to slider, the pivot at [0, 0]; default: through the "
        "flexures",
    )
    offset: Length = Field(
        0.0, description="by how much the printed part is thicker than drawn, everywhere; negative: thinner"
    )

    @property
    def values(self) -> tuple[float, ...]:
        """The thicknesses as drawn [m], at least two."""
        thickness = self.thickness
        return thickness if isinstance(thickness, tuple) else (thickness, thickness)

    @model_validator(mode="after")
    def _as_many_places_as_thicknesses(self) -> Self:
        if self.shares is not None:
            inner = [share for piece in self.shares for share in piece]
            if len(inner) + 2 != len(self.values):
                raise ValueError(
                    f"'shares' gives the positions of {len(inner)} thicknesses between the ends, but "
                    f"{len(self.values) - 2} are given"
                )
            if any(a >= b for piece in self.shares for a, b in itertools.pairwise(piece)):
                raise ValueError("'shares' must increase within each piece")
        if any(a == b for a, b in itertools.pairwise(self.centreline or ())):
            raise ValueError("'centreline' has the same corner twice in a row")
        if min(self.values) + self.offset <= 0:
            raise ValueError("'offset' reduces the smallest thickness to zero or less")
        if max(self.values) + self.offset > MOST_TAPER * (min(self.values) + self.offset):
            raise ValueError(
                f"the largest thickness is over {MOST_TAPER} times the smallest: a place that is a million times as "
                "soft is a hinge; make it thicker, or use 'flexures'"
            )
        return self


class Printed(RoundedCorners, Model):
    """Slider-crank in one piece: lumped flexures or a strip, and their material."""

    removed_keys: ClassVar[dict[str, str]] = {
        "process": "write 'part: {process: {position: ..., least_feature: ...}}' for its 'layer' and 'thinnest'"
    }
    material: MaterialField | None = Field(
        None, description="of 'flexures', 'beam' or links: a name from `show materials`, or {youngs_modulus, ...}"
    )
    safety_factor: SafetyFactor = 1.0
    flexures: Flexures | None = Field(
        None, description="small flexures at the joints, with rigid links between them: fidelity 'lumped'"
    )
    beam: StripSpec | None = Field(None, description="one strip of varying thickness: fidelity 'beam'")
    wide_beams: bool = Field(
        False,
        description="whether a wide strip or flexure is stiffer because its anticlastic bending is suppressed; the "
        "effect of clamped ends is left out",
    )
    part: PaddedPart | None = Field(None, description="how it is cut: inside corners, sheet, pads, holes")
    stops: dict[str, EndStop] = Field(
        {}, description="stops of the slider of flexures or a strip, by name: {end: {gap: 6 mm, stiffness: 80 N/mm}}"
    )

    @property
    def end_stops(self) -> EndStops:
        """Stops of the slider."""
        return EndStops(tuple(self.stops.items()))

    @property
    def thinnest(self) -> float:
        """Smallest thickness of the strip, or of the flexures [m]; 0 if there are neither."""
        drawn = (
            self.beam.values
            if self.beam
            else [flexure.thickness for flexure in self.flexures.all]
            if self.flexures
            else ()
        )
        return min(drawn, default=0.0)

    @property
    def resolved(self) -> tuple[float | None, float | None]:
        """Resolution of the process in the plane, and its thinnest wall [m]; None if not stated."""
        position = thinnest = None
        if self.part is not None and self.part.process is not None:
            stated = self.part.process
            accuracy = stated.accuracy(PROCESSES_BY_NAME[stated.name]) if stated.name else stated
            position, thinnest = accuracy.position, accuracy.least_feature
        return position, thinnest

    @property
    def finest(self) -> Literal["prb", "lumped", "beam"]:
        """The finest model that there is data for."""
        if self.beam is not None:
            return "beam"
        return "prb" if self.flexures is None else "lumped"

    @model_validator(mode="after")
    def _parts_need_a_material(self) -> Self:
        if (self.flexures or self.beam) and self.material is None:
            raise ValueError("'flexures' and 'beam' need 'material'")
        return self


class FlexureDesign(Model):
    """Sections of the flexures from the springs' rates and the stress: closed forms, then the exact force."""

    length: PositiveLength | None = Field(None, description="of all three; default: as stated, or a fifth of r1")
    exact: bool = Field(
        True, description="correct the sizes from the closed forms until the beam model gives the force and the stress"
    )


class StripDesign(Model):
    """Thickness along a strip for the longest stroke, or for the flattest force."""

    shape: Literal["uniform", "even", "shares"] = Field(
        "even", description="one thickness; nodes evenly spaced; or stations as 'beam.shares', which may move"
    )
    goal: Literal["stroke", "ripple", "rms"] = Field(
        "stroke", description="longest stroke within `tolerance`, or smallest deviation over `travel`"
    )
    nodes: int = Field(17, ge=2, le=65, description="thicknesses of the shape 'even'")
    thickness: LengthRange | None = Field(None, description="smallest and largest thickness")
    thicknesses: tuple[LengthRange, ...] | None = Field(
        None, description="smallest and largest value of each of the thicknesses"
    )
    shares: tuple[ShareRange, ...] | None = Field(None, description="ranges of 'beam.shares'; default: fixed")
    width: PositiveLength | LengthRange | None = Field(
        None, description="one value, or a range to choose from; default: that of the beam"
    )
    start: PositiveLength = Field(1e-3, description="where the band of the force begins: the run-in is before it")
    longest: PositiveLength | None = Field(
        None, description="upper limit of the stroke; default: half the slider's travel"
    )
    seeds: int = Field(1, ge=1, le=64, description="starts: the uniform strip, then strips with random thickness")
    stressed: bool = Field(True, description="whether the allowable stress limits the design")

    @model_validator(mode="after")
    def _ranges_increase(self) -> Self:
        ranges = [self.thickness, *(self.thicknesses or ()), *(self.shares or ())]
        ranges += [self.width] if isinstance(self.width, tuple) else []
        if any(ends is not None and not ends[0] <= ends[1] for ends in ranges):
            raise ValueError("a range goes from the smallest to the largest value")
        return self


class PrintedDesign(Model):
    """Design of flexures or a strip from springs."""

    flexures: FlexureDesign | None = Field(None, description="size the flexures for the springs' rates")
    beam: StripDesign | None = Field(None, description="shape a strip for the force")

    @model_validator(mode="after")
    def _one_part(self) -> Self:
        if self.flexures and self.beam:
            raise ValueError("give either 'flexures' or 'beam'")
        return self


class PrintedAnalysis(Analysis):
    """Analysis of flexures and strips."""

    removed_keys: ClassVar[dict[str, str]] = {
        "recheck": "for a second opinion on force and stress write 'fidelity: solid', the part as a planar solid",
        "accuracy": "forces are always solved to 1e-7: delete the line",
    }
