"""Specification of the elements of a network: nodes, beams, springs, loads, drives, copies, and how it is cut."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from cfmkit.elastica.model import network as engine
from cfmkit.families.beam.shapes_spec import Point, ShapeSpec, Straight
from cfmkit.specs.spec import Model, PositiveLength
from cfmkit.specs.units import (
    Angle,
    Density,
    Force,
    Inertia,
    Length,
    LineLoad,
    Mass,
    Ratio,
    RotationalStiffness,
    Stiffness,
    Torque,
    format_short,
)
from cfmkit.stock.material_and_part_spec import MaterialSpec, PaddedPart, material_input
from cfmkit.stock.materials import material

Station = tuple[Annotated[Ratio, Field(ge=0, le=1)], PositiveLength]
Thickness = PositiveLength | Annotated[tuple[Station, ...], Field(min_length=2)]
LOAD_SUM_RTOL = 1e-12  # loads of which less is left, in parts of the largest, cancel

HELD_MOTIONS = {
    "free": (False, False, False),
    "clamped": (True, True, True),
    "pinned": (True, True, False),
    "guided": (False, True, True),
    "roller": (False, True, False),
    "parallel": (False, False, True),
}
"""Which motions a support holds: along its direction, across it, the rotation."""


class BeamMaterial(MaterialSpec):
    """A material of beams, which may also say what it weighs."""

    density: Annotated[Density, Field(gt=0)] | None = Field(
        None, description="for natural frequencies; default: that of the named material, or none"
    )

    @model_validator(mode="after")
    def _weighs_as_named(self) -> Self:
        if self.density is None and self.name is not None:
            object.__setattr__(self, "density", material(self.name).density)  # not counted as set, as in `MaterialSpec`
        return self


MaterialField = Annotated[BeamMaterial, material_input(BeamMaterial)]
"""The type of a key that says what beams are made of."""


class Moved(Model):
    """Initial displacements of a support."""

    along: Length = Field(0.0, description="along the support's direction")
    across: Length = Field(0.0, description="90 deg to the left of it")
    rotation: Angle = Field(0.0, description="counter-clockwise")


class NodeSpec(Model):
    """A node: its place before any load, and its support."""

    at: Point = Field(description="place [x, y], to the right and upwards")
    support: Literal["free", "clamped", "pinned", "guided", "roller", "parallel"] = Field(
        "free",
        description=(
            "guided: slides along its direction without turning; roller: slides and turns; parallel: moves without "
            "turning"
        ),
    )
    direction: Angle | None = Field(None, description="along which a guided node or a roller slides; from the x axis")
    moved: Moved | None = Field(None, description="prescribed displacements of what the support holds")
    mass: Annotated[Mass, Field(ge=0)] | None = Field(
        None, description="mass of a part fixed to the node, for natural frequencies; it has no weight"
    )
    inertia: Annotated[Inertia, Field(ge=0)] | None = Field(None, description="its moment of inertia about the node")

    @model_validator(mode="after")
    def _direction_where_it_slides(self) -> Self:
        slides = self.support in ("guided", "roller")
        if slides and self.direction is None:
            raise ValueError(f"a node that is {self.support!r} needs 'direction', along which it slides")
        if self.direction is not None and self.support in ("free", "parallel"):
            raise ValueError(f"'direction' has no meaning for a support that is {self.support!r}")
        return self

    @model_validator(mode="after")
    def _moves_only_what_is_held(self) -> Self:
        if self.moved is not None:
            for name, held in zip(("along", "across", "rotation"), HELD_MOTIONS[self.support], strict=True):
                if getattr(self.moved, name) != 0 and not held:
                    raise ValueError(
                        f"'moved.{name}' is given, but a support that is {self.support!r} leaves that free"
                    )
        return self


class MemberSpec(Model):
    """A beam between two nodes. What is left out is as for the whole mechanism."""

    start: str = Field(description="node at the first end")
    end: str = Field(description="node at the last end")
    shape: ShapeSpec = Field(default_factory=Straight, description="reference shape, by its `kind`; default: straight")
    thickness: Thickness | None = Field(
        None, description="in the plane; or [[fraction, thickness], ...], linear between"
    )
    width: PositiveLength | None = Field(None, description="out of the plane")
    material: MaterialField | None = Field(None, description="a name from `show materials`, or its values")
    start_joint: Literal["rigid", "pin"] = Field("rigid", description="whether the first end turns with its node")
    end_joint: Literal["rigid", "pin"] = Field("rigid", description="whether the last end turns with its node")
    start_offset: Point | None = Field(None, description="rigid arm from the node to the beam; turns with the node")
    end_offset: Point | None = Field(None, description="the same at the last end")

    @field_validator("thickness")
    @classmethod
    def _stations(cls, value: Thickness | None) -> Thickness | None:
        return value if value is None else checked_thickness(value)


def checked_thickness(value: Thickness) -> Thickness:
    """Return a thickness whose stations run from 0 to 1."""
    if isinstance(value, tuple):
        places = [place for place, _ in value]
        if places[0] != 0 or places[-1] != 1 or places != sorted(places):
            raise ValueError("the fractions of a thickness must run from 0 to 1 without decreasing")
        if any(places.count(place) > (1 if place in (0, 1) else 2) for place in places):
            raise ValueError("a fraction stated twice is a step; three times, or a step at an end, is not possible")
    return value


class LinkSpec(Model):
    """A rigid link: `node` moves and turns with `master` as one body."""

    master: str = Field(description="node that leads")
    node: str = Field(description="node that follows; without a support")


class SpringElement(Model):
    """Base of the kinds of springs: a new one is a class here and its name in `SpringSpec`."""

    @abstractmethod
    def build(self) -> engine.Spring:
        """Return the spring as the engine has it."""


class LineSpringSpec(SpringElement):
    """A spring along the line between two nodes, or a node and a fixed point."""

    kind: Literal["line"]
    start: str = Field(description="node")
    end: str | None = Field(None, description="node at the other end; or state `ground`")
    ground: Point | None = Field(None, description="fixed point at the other end")
    stiffness: Annotated[Stiffness, Field(gt=0)] = Field(description="force per elongation")
    free_length: Annotated[Length, Field(ge=0)] | None = Field(None, description="default: the length before any load")

    @model_validator(mode="after")
    def _one_other_end(self) -> Self:
        if (self.end is None) == (self.ground is None):
            raise ValueError("give either 'end' (a node) or 'ground' (a point)")
        return self

    def build(self) -> engine.Spring:
        """Return the spring as the engine has it."""
        return engine.LineSpring(self.start, self.end, self.stiffness, self.free_length, self.ground or (0.0, 0.0))


class TorsionSpringSpec(SpringElement):
    """A spring between the rotations of two nodes, or of a node and the ground."""

    kind: Literal["torsion"]
    end: str = Field(description="node")
    start: str | None = Field(None, description="node it turns against; default: the ground")
    stiffness: Annotated[RotationalStiffness, Field(gt=0)] = Field(description="moment per angle")
    free_angle: Angle = Field(0.0, description="rotation of end minus that of start at which it is relaxed")

    def build(self) -> engine.Spring:
        """Return the spring as the engine has it."""
        return engine.TorsionSpring(self.start, self.end, self.stiffness, self.free_angle)


class SlideSpringSpec(SpringElement):
    """A spring from the ground that resists the motion of a node along a fixed direction."""

    kind: Literal["slide"]
    node: str = Field(description="node")
    direction: Angle = Field(description="from the x axis")
    stiffness: Annotated[Stiffness, Field(gt=0)] = Field(description="force per displacement")
    free_displacement: Length = Field(0.0, description="displacement at which it is relaxed")

    def build(self) -> engine.Spring:
        """Return the spring as the engine has it."""
        return engine.SlideSpring(self.node, self.direction, self.stiffness, self.free_displacement)


SpringSpec = Annotated[LineSpringSpec | TorsionSpringSpec | SlideSpringSpec, Field(discriminator="kind")]


class Load(Model):
    """Base of the kinds of loads: a new one is a class here and its name in `LoadSpec`."""

    acts_on: ClassVar[Literal["node", "beam"]]  # key of the name of that
    sizes: ClassVar[tuple[str, ...]]  # keys of its components

    @abstractmethod
    def build(self, share: float = 1.0) -> engine.LoadOn:
        """Return a share of the load as the engine has it."""


class PointLoadSpec(Load):
    """A constant force and moment at a node."""

    acts_on, sizes = "node", ("fx", "fy", "moment")

    kind: Literal["point"]
    node: str = Field(description="node")
    fx: Force = Field(0.0, description="to the right")
    fy: Force = Field(0.0, description="upwards")
    moment: Torque = Field(0.0, description="counter-clockwise")
    follows: bool = Field(False, description="whether the force turns with the node")

    def build(self, share: float = 1.0) -> engine.LoadOn:
        """Return a share of the load as the engine has it."""
        return engine.PointLoad(self.node, share * self.fx, share * self.fy, share * self.moment, self.follows)


class LineLoadSpec(Load):
    """A constant uniform load on a beam, per length before any load."""

    acts_on, sizes = "beam", ("wx", "wy")

    kind: Literal["line"]
    beam: str = Field(description="beam")
    wx: LineLoad = Field(0.0, description="to the right")
    wy: LineLoad = Field(0.0, description="upwards")

    def build(self, share: float = 1.0) -> engine.LoadOn:
        """Return a share of the load as the engine has it."""
        return engine.LineLoad(self.beam, share * self.wx, share * self.wy)


LoadSpec = Annotated[PointLoadSpec | LineLoadSpec, Field(discriminator="kind")]


class Drive(Model):
    """Base of the kinds of drives, which differ in these values; nothing else compares the name of a kind.

    `cfmkit.families.beam.network_from_spec` has the load case of each kind.
    """

    by_motion: ClassVar[bool] = False  # the motion is given; else it follows from loads
    by_load: ClassVar[bool] = False  # one load on the node is given, shared by all copies
    turns: ClassVar[bool] = False  # the curve runs over the rotation of the node; else over its displacement
    extent: ClassVar[str]  # key of `analysis` that says how far it goes
    dimension: ClassVar[str]  # of that

    @property
    def is_displacement(self) -> bool:
        """Whether a displacement is given."""
        return self.by_motion and not self.turns

    @property
    def motion_dimension(self) -> Literal["length", "angle"]:
        """Dimension of the abscissa of the curve: the displacement or the angle of the driven node."""
        return "angle" if self.turns else "length"

    @property
    def effort_dimension(self) -> Literal["force", "torque"]:
        """Dimension of the ordinate of the curve."""
        return "torque" if self.turns else "force"

    def text(self, value: float, copies: int) -> str:
        """Return a value of the drive on one copy [SI] as a reader wants it, of all copies together."""
        return format_short((copies if self.by_load else 1) * value, self.dimension)


class DisplacementDrive(Drive):
    """A node is moved along a direction by `analysis.travel`; the force is the one along it."""

    by_motion, extent, dimension = True, "travel", "length"

    kind: Literal["displacement"]
    node: str = Field(description="node that is moved")
    direction: Angle = Field(description="from the x axis; the displacement and the force count along it")


class RotationDrive(Drive):
    """A node is turned by `analysis.travel`; the effort is the torque."""

    by_motion, turns, extent, dimension = True, True, "travel", "angle"

    kind: Literal["rotation"]
    node: str = Field(description="node that is turned")


class ForceDrive(Drive):
    """A force that grows to `analysis.force`; the displacement is the node's along the direction."""

    by_load, extent, dimension = True, "force", "force"

    kind: Literal["force"]
    node: str = Field(description="node that is pushed")
    direction: Angle = Field(description="from the x axis")
    follows: bool = Field(False, description="whether the force turns with the node")


class MomentDrive(Drive):
    """A moment that grows to `analysis.moment`; the angle is the node's rotation."""

    by_load, turns, extent, dimension = True, True, "moment", "torque"

    kind: Literal["moment"]
    node: str = Field(description="node that is twisted")


class LoadsDrive(Drive):
    """Several loads that grow together, in proportion, to `analysis.factor` times what is given here.

    The curve runs over the displacement of one node; its force is the reference times the factor.
    """

    extent, dimension = "factor", "ratio"

    kind: Literal["loads"]
    node: str = Field(description="node whose displacement along `direction` is the abscissa of the curve")
    direction: Angle = Field(description="from the x axis")
    loads: Annotated[tuple[LoadSpec, ...], Field(min_length=1, max_length=1000)] = Field(
        description="as in `mechanism.loads`, on each copy: the loads at a factor of one"
    )
    reference: Annotated[Force, Field(gt=0)] = Field(
        1.0, description="force that the curve shows where the factor is one"
    )

    @property
    def acts(self) -> bool:
        """Whether some load is left where those of one kind on one node or beam are added up."""
        sums: dict[Any, list[Any]] = {}
        for load in self.loads:
            key = load.kind, getattr(load, load.acts_on), getattr(load, "follows", False)
            sums.setdefault(key, []).append([getattr(load, name) for name in load.sizes])
        return any(
            abs(math.fsum(values)) > LOAD_SUM_RTOL * max(map(abs, values))
            for loads in sums.values()
            for values in zip(*loads, strict=True)
        )

    def text(self, value: float, copies: int) -> str:
        """Return a value of the drive on one copy as a reader wants it."""
        return f"{value:.5g} times the loads"


DriveSpec = Annotated[
    DisplacementDrive | RotationDrive | ForceDrive | MomentDrive | LoadsDrive, Field(discriminator="kind")
]


class Copies(Model):
    """Copies of the part that is described: side by side, mirrored, or stacked."""

    mirror: Point | None = Field(
        None, description="a point of the mirror axis, which runs along the drive: two halves, twice the force"
    )
    legs: int = Field(1, ge=1, le=1000, description="equal parts side by side (mirrored pairs count once)")
    layers: int = Field(
        1, ge=1, le=20, description="equal stages in series: each is mounted on the moving part of the previous one"
    )
    layer_pitch: PositiveLength | None = Field(
        None, description="distance of the stages along the drive; default: 1.15 times the height of one"
    )


class PartSpec(PaddedPart):
    """Cutting of the part, and limits of the cut."""

    min_gap: Annotated[Length, Field(ge=0)] = Field(0.0, description="smallest gap that can be cut")
    min_feature: Annotated[Length, Field(ge=0)] = Field(0.0, description="smallest thickness that can be made")
